// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/tags.hpp"

#include "tetap/bus/authentication.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <algorithm>
#include <charconv>

namespace tetap::sim {
namespace {

constexpr int kTurnBits = 21;                      ///< bits of a microsecond: a turn of the nonce
constexpr std::uint8_t kParameterTag = 6;          ///< Guard_TagId of Cmd_Param
constexpr std::uint32_t kMostCounter = 0xFF'FFFF;  ///< Guard_TagCtr has 24 bits

}  // namespace

std::optional<base::SipKey> key_of_digits(const std::string& digits) {
  base::SipKey key{};
  if (digits.size() != 32) return std::nullopt;
  for (std::size_t byte = 0; byte < 16; ++byte) {
    unsigned value = 0;
    const char* const first = digits.data() + 2 * byte;
    const auto [end, error] = std::from_chars(first, first + 2, value, 16);
    if (error != std::errc{} || end != first + 2) return std::nullopt;
    key[byte / 4] |= std::uint32_t{value} << (8 * (byte % 4));
  }
  if (key == base::SipKey{}) return std::nullopt;
  return key;
}

void Tags::on_frame(const base::CanFrame& frame) {
  if (frame.extended) return;
  if (frame.id == can_base_ + bus::EstEpoch::kOffset) {
    if (const auto epoch = bus::decode<bus::EstEpoch>(bus::payload(frame))) epoch_us_ = epoch->time_us;
  } else if (frame.id == can_base_ + bus::EstDiagGuard::kOffset) {
    const auto guard = bus::decode<bus::EstDiagGuard>(bus::payload(frame));
    if (!guard) return;
    nonce_ = guard->nonce;
    turn_ = static_cast<std::uint32_t>(epoch_us_ >> kTurnBits);
  }
}

std::array<base::CanFrame, 2> Tags::before(const base::CanFrame& command, base::Micros now, bool hurry) {
  const auto by_clock = static_cast<std::uint32_t>(static_cast<std::uint64_t>(now.us) / 1'000 % (kMostCounter / 2));
  counter_ = std::max(counter_, by_clock) + 1;
  if (hurry) counter_ += (kMostCounter - std::min(counter_, kMostCounter)) / 2;
  counter_ = std::min(counter_, kMostCounter);
  const bus::TagContext context{.nonce = nonce_.value_or(0), .turn = turn_, .id = command.id, .counter = counter_};
  const auto tag = [&](std::span<const std::uint8_t> covered) {
    const bus::InGuardTag guard{
        .tag_id = kParameterTag, .tag_ctr = counter_, .tag_crc = bus::tag_of(key_, context, covered)};
    return bus::frame(can_base_, guard);
  };
  return {tag({}), tag(bus::payload(command))};
}

}  // namespace tetap::sim
