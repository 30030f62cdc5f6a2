// SPDX-License-Identifier: Apache-2.0
// Commands with two tags: 32 bits each of SipHash-2-4 under a key that node and host share. They cover a counter and a
// number that the node publishes (Diag_Nonce), the second one the command, too. The first opens a counter, so wrong
// tags of others hold nobody up. SECURITY.md has what they promise.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/members.hpp"
#include "tetap/base/siphash.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/param/parameters.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::bus {

/// Content of a tag beside the frame's data.
struct TagContext {
  std::uint32_t nonce = 0;
  std::uint32_t turn = 0;  ///< turn of the nonce
  std::uint32_t id = 0;    ///< identifier of the command's frame
  std::uint32_t counter = 0;
};

[[nodiscard]] constexpr std::uint32_t tag_of(const base::SipKey& key, const TagContext& of,
                                             std::span<const std::uint8_t> data) {
  base::SipHash hash(key);
  for (const std::uint32_t value : {of.nonce, of.turn, of.id, of.counter}) hash.add_word(value);
  hash.add(data);
  return static_cast<std::uint32_t>(hash.finish());
}

/// A nonce is a keyed hash of every input frame since power-on, chained tick by tick: it differs from start to start as
/// the sensors' noise does, and nobody without the key can make it repeat. It holds for a turn of 2^21 us and the turn
/// after; within it counters only rise. Within a tick the frames are a multiset whose hash is the sum of theirs
/// (MSet-Add-Hash: Clarke et al., Incremental Multiset Hash Functions, ASIACRYPT 2003): a replay takes the
/// frames of a tick in another order where some are the node's own.
template <std::uint32_t kTagMask>
class AuthenticationBy {
 public:
  explicit AuthenticationBy(const param::Parameters& parameters) : parameters_(parameters), link_(parameters.bus.key) {}

  static constexpr auto members(auto& self) {
    return base::members(base::reference(self.parameters_), base::own(self.link_), base::own(self.sum_), self.chain_,
                         self.inputs_hashed_, self.nonces_, self.opening_, self.hashes_, self.turn_);
  }
  void power_on() {
    base::clear(*this);
    begin_link();
  }
  /// The key could be computed from a hash that is under way. Only right behind tick().
  void hide_secrets() { link_ = base::SipHash({}); }
  /// All but the parameters, from a state whose secrets may be hidden.
  void resume(const AuthenticationBy& other) {
    base::resume(*this, other);
    begin_link();
  }

  /// Every input frame of a tick, in any order.
  void input(const base::CanFrame& frame) {
    base::SipHash hash = link_;
    hash.add(frame.data);
    hash.add(static_cast<std::uint8_t>(frame.id - parameters_.can_base));
    sum_ += hash.finish();
    if (inputs_hashed_ < kLeastInputs) ++inputs_hashed_;
  }

  /// The first tag of a counter opens it; those behind it wait for the frame of their id.
  void announce(const InGuardTag& tag, Counters& counters);
  [[nodiscard]] bool waits_for(std::uint8_t offset) const {
    return opening_.left != 0 && opening_.tag_id == slot_of(offset);
  }
  /// Whether a tag that waits for this frame is right and new; the counter is used up then.
  [[nodiscard]] bool admits(std::uint8_t offset, const base::CanFrame& frame, Counters& counters);

  /// At the begin of a tick: a new nonce in a new turn, and the work for tags.
  void tick(base::Micros now);
  [[nodiscard]] std::uint32_t nonce() const { return nonces_[0].number; }

 private:
  static constexpr int kTurnBits = 21;
  static constexpr std::uint32_t kLeastInputs = 256;  ///< frames without which there is no nonce
  /// Part of a tick for each hash: a frame needs two, and 111 us of 1 Mbit/s.
  static constexpr std::int32_t kHash_us = 50;
  static constexpr std::uint8_t kWrong = 8;  ///< frames that fit no tag of an opening, until it is used up

  struct Nonce {
    std::uint32_t number = 0;
    std::uint32_t turn = 0;
    std::uint32_t last = 0;  ///< the greatest counter that was accepted with it
  };
  /// A counter that was opened by somebody with the key.
  struct Opening {
    std::uint32_t counter = 0;
    std::uint32_t turn = 0;               ///< turn of its nonce
    std::array<std::uint32_t, 4> tags{};  ///< the latest that came for it, in a ring
    std::uint8_t tag_id = 0, next = 0;
    std::uint8_t left = 0;  ///< frames that it bears; 0: none is open
  };

  /// Guard_TagId of a command.
  static constexpr std::uint8_t kParameterTag = 6;
  [[nodiscard]] static constexpr std::uint8_t slot_of(std::uint8_t offset) {
    return offset == CmdParamSet::kOffset ? kParameterTag : offset;
  }
  [[nodiscard]] [[gnu::noinline]] std::uint32_t right_tag(const Nonce& nonce, std::uint32_t counter,
                                                          std::uint8_t offset, std::span<const std::uint8_t> data) {
    --hashes_;
    const TagContext context{
        .nonce = nonce.number, .turn = nonce.turn, .id = parameters_.can_base + offset, .counter = counter};
    return tag_of(parameters_.bus.key, context, data) & kTagMask;
  }
  void begin_link() {
    link_ = base::SipHash(parameters_.bus.key);
    link_.add_word(static_cast<std::uint32_t>(chain_));
    link_.add_word(static_cast<std::uint32_t>(chain_ >> 32));
    sum_ = 0;
  }

  const param::Parameters& parameters_;
  base::SipHash link_;       ///< key and chain_, before what is hashed in this tick
  std::uint64_t sum_ = 0;    ///< sum of the hashes of this tick's frames
  std::uint64_t chain_ = 0;  ///< hash of all frames up to the last tick; without the key, nothing follows from it
  std::uint32_t inputs_hashed_ = 0;
  std::array<Nonce, 2> nonces_{};  ///< nonces of this turn and of the one before
  Opening opening_;
  std::uint16_t hashes_ = 0;  ///< hashes that are left in this tick
  std::uint32_t turn_ = 0;
};

template <std::uint32_t kTagMask>
[[gnu::cold]] void AuthenticationBy<kTagMask>::announce(const InGuardTag& tag, Counters& counters) {
  Opening& o = opening_;
  if (o.left != 0 && o.tag_id == tag.tag_id && o.counter == tag.tag_ctr) {
    o.tags[o.next++ % o.tags.size()] = tag.tag_crc & kTagMask;
    return;
  }
  const std::uint8_t offset = tag.tag_id == kParameterTag ? CmdParamSet::kOffset : tag.tag_id;
  for (const Nonce& nonce : nonces_) {
    if (nonce.number == 0 || hashes_ == 0) continue;
    if (right_tag(nonce, tag.tag_ctr, offset, {}) != (tag.tag_crc & kTagMask)) continue;
    if (tag.tag_ctr <= nonce.last) ++counters.replayed;
    // One that is repeated takes the place of none.
    if (tag.tag_ctr <= nonce.last || (o.left != 0 && o.turn == nonce.turn && tag.tag_ctr < o.counter)) return;
    o = {.counter = tag.tag_ctr, .turn = nonce.turn, .tag_id = tag.tag_id, .left = kWrong};
    o.tags.fill(tag.tag_crc & kTagMask);
    return;
  }
}

template <std::uint32_t kTagMask>
[[gnu::cold]] bool AuthenticationBy<kTagMask>::admits(std::uint8_t offset, const base::CanFrame& frame,
                                                      Counters& counters) {
  Opening& o = opening_;
  for (Nonce& nonce : nonces_) {
    if (!waits_for(offset) || nonce.number == 0 || nonce.turn != o.turn || hashes_ == 0) continue;
    const std::uint32_t right = right_tag(nonce, o.counter, offset, payload(frame));
    bool fits = false;
    for (const std::uint32_t one : o.tags) fits |= one == right;
    if (fits || --o.left == 0) o.left = 0, nonce.last = o.counter;
    if (!fits) break;
    return true;
  }
  return ++counters.auth_bad, false;
}

template <std::uint32_t kTagMask>
void AuthenticationBy<kTagMask>::tick(base::Micros now) {
  base::SipHash inputs = link_;
  inputs.add_word(static_cast<std::uint32_t>(sum_));
  inputs.add_word(static_cast<std::uint32_t>(sum_ >> 32));
  chain_ = inputs.finish();
  begin_link();
  hashes_ = static_cast<std::uint16_t>(parameters_.loop.period_us / kHash_us);
  const auto turn = static_cast<std::uint32_t>(static_cast<std::uint64_t>(now.us) >> kTurnBits);
  if (turn == turn_ || inputs_hashed_ < kLeastInputs) return;
  // A turn that was left out: the nonce before the last one is of no use any more.
  nonces_[1] = turn == nonces_[0].turn + 1 ? nonces_[0] : Nonce{};
  base::SipHash hash = link_;
  hash.add_word(turn);
  const auto number = static_cast<std::uint32_t>(hash.finish());
  nonces_[0] = {.number = number != 0 ? number : 1, .turn = turn};
  turn_ = turn;
}

using Authentication = AuthenticationBy<0xFFFF'FFFFU>;

}  // namespace tetap::bus
