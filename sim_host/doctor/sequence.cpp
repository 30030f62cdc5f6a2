// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/sequence.hpp"

#include "tetap/bus/signal.hpp"

namespace tetap::doctor {
namespace {

// A lost frame begins a new chain, and its old one may be met again once by chance. Two senders alternate all the time.
// Half of the frames alternate at equal rates, a fifth of them for a second sender of a tenth of the rate.
constexpr double kSwitches = 0.1;
constexpr double kNewChains = 0.2;  ///< more breaks than that is no counter at all
constexpr std::uint64_t kLeastSwitches = 20;

Devices devices_of(std::uint32_t offset) {
  if (offset >= bus::ImuGyro::kOffset && offset < bus::ImuGyro::kOffset + 4 * bus::ImuGyro::kStride)
    return kGyroscope | kAccelerometer | kMounting;
  if (offset >= bus::InWheelCounts::kOffset && offset <= bus::InBodySpeed::kOffset) return kWheels;
  if (offset >= bus::InGnssLat::kOffset && offset <= bus::InGnssAcc::kOffset) return kFixes;
  if (offset >= bus::InGnssVelEN::kOffset && offset <= bus::InGnssVelU::kOffset) return kGnssVelocity;
  return kNoDevice;
}

}  // namespace

void SequenceDetector::frame(const SeenFrame& seen) {
  const auto header = header_of(seen.offset, seen.frame);
  if (!header) return;
  Stream& s = streams_[header->stream];
  const std::uint64_t bits = bus::word(bus::payload(seen.frame));
  if (s.begun && bits == s.last_bits) return;
  s.last_bits = bits;
  s.begun = true;
  s.message = header->message;
  s.instance = header->instance;
  ++s.frames;
  const auto follows = [&](std::size_t chain) {
    return chain < s.chains && header->counter == (s.chain[chain] + 1) % header->modulus;
  };
  const std::size_t other = 1 - s.latest;
  if (follows(s.latest)) {
    s.chain[s.latest] = header->counter;
  } else if (follows(other)) {
    s.chain[other] = header->counter;
    s.latest = other;
    ++s.switches;
  } else {
    if (s.chains == 0) s.latest = 1;  // the first frame begins chain 0
    s.latest = 1 - s.latest;
    s.chain[s.latest] = header->counter;
    if (s.chains < 2) ++s.chains;
    ++s.new_chains;
  }
}

void SequenceDetector::finish(Findings& findings) {
  for (std::size_t i = 0; i < streams_.size(); ++i) {
    const Stream& s = streams_[i];
    const auto frames = static_cast<double>(s.frames);
    if (s.switches < kLeastSwitches || static_cast<double>(s.switches) < kSwitches * frames ||
        static_cast<double>(s.new_chains) > kNewChains * frames)
      continue;
    std::string name = s.message;
    if (const auto star = name.find('*'); star != std::string::npos) name[star] = static_cast<char>('0' + s.instance);
    findings.push_back(
        {.code = Code::kTwoSenders,
         .certainty = static_cast<double>(s.switches) / frames,
         .evidence = text("Seq of %s, instance %d, runs in two chains: %llu of its %llu frames go on with the chain "
                          "that is not the last frame's.",
                          name.c_str(), s.instance, static_cast<unsigned long long>(s.switches),
                          static_cast<unsigned long long>(s.frames)),
         .change = "Stop one of the two senders of " + name + ", or give the second device another Inst.",
         .spoils = devices_of(static_cast<std::uint32_t>(i / 4))});
  }
}

}  // namespace tetap::doctor
