// SPDX-License-Identifier: Apache-2.0
// Commands with a tag: 32 bits of SipHash-2-4 under a key that node and host share. The tag covers the command, a
// counter and a number that the node publishes (Diag_Nonce). SECURITY.md has what it promises.
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
class Authentication {
 public:
  explicit Authentication(const param::Parameters& parameters) : parameters_(parameters), link_(parameters.bus.key) {}

  static constexpr auto members(auto& self) {
    return base::members(base::reference(self.parameters_), base::own(self.link_), base::own(self.sum_), self.chain_,
                         self.inputs_hashed_, self.nonces_, self.tags_, self.attempts_, self.more_at_, self.turn_);
  }
  void power_on() {
    base::clear(*this);
    attempts_ = kAttempts;
    begin_link();
  }
  /// The key could be computed from a hash that is under way. Only right behind tick().
  void hide_secrets() { link_ = base::SipHash({}); }
  /// All but the parameters, from a state whose secrets may be hidden.
  void resume(const Authentication& other) {
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

  /// A tag waits for the frame of its id; a later one takes its place.
  void announce(const InGuardTag& tag) {
    if (tag.tag_id < tags_.size()) tags_[tag.tag_id] = {.counter = tag.tag_ctr, .tag = tag.tag_crc, .waits = true};
  }
  [[nodiscard]] bool waits_for(std::uint8_t offset) const { return tags_[slot_of(offset)].waits; }
  /// Whether the tag that waits for this frame is right and new; it is used up.
  [[nodiscard]] bool admits(std::uint8_t offset, const base::CanFrame& frame, Counters& counters);

  /// At the begin of a tick: a new nonce in a new turn, and patience with wrong tags.
  void tick(base::Micros now);
  [[nodiscard]] std::uint32_t nonce() const { return nonces_[0].number; }

 private:
  static constexpr int kTurnBits = 21;
  static constexpr std::uint32_t kLeastInputs = 256;  ///< frames without which there is no nonce
  static constexpr std::uint8_t kAttempts = 8;        ///< wrong tags at once; then ten in a turn

  struct Nonce {
    std::uint32_t number = 0;
    std::uint32_t turn = 0;
    std::uint32_t last = 0;  ///< the greatest counter that was accepted with it
  };
  struct Tag {
    std::uint32_t counter = 0;
    std::uint32_t tag = 0;
    bool waits = false;
  };

  /// Guard_TagId of a command.
  [[nodiscard]] static constexpr std::size_t slot_of(std::uint8_t offset) {
    return offset == CmdParamSet::kOffset ? 6 : offset;
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
  std::array<Tag, 7> tags_{};      ///< by id offset; the last is that of Cmd_Param
  std::uint8_t attempts_ = kAttempts;
  base::Micros more_at_;  ///< time from which another wrong tag is bearable
  std::uint32_t turn_ = 0;
};

[[gnu::cold]] inline bool Authentication::admits(std::uint8_t offset, const base::CanFrame& frame, Counters& counters) {
  Tag& tag = tags_[slot_of(offset)];
  if (!tag.waits || attempts_ == 0) return ++counters.auth_bad, false;
  for (Nonce& nonce : nonces_) {
    if (nonce.number == 0) continue;
    const TagContext context{
        .nonce = nonce.number, .turn = nonce.turn, .id = parameters_.can_base + offset, .counter = tag.counter};
    if (tag_of(parameters_.bus.key, context, payload(frame)) != tag.tag) continue;
    tag.waits = false;
    if (tag.counter <= nonce.last) return ++counters.replayed, false;
    nonce.last = tag.counter;
    return true;
  }
  --attempts_;
  return ++counters.auth_bad, false;
}

inline void Authentication::tick(base::Micros now) {
  base::SipHash inputs = link_;
  inputs.add_word(static_cast<std::uint32_t>(sum_));
  inputs.add_word(static_cast<std::uint32_t>(sum_ >> 32));
  chain_ = inputs.finish();
  begin_link();
  if (now >= more_at_ || more_at_.us - now.us > 1'000'000) {
    more_at_ = now + base::Micros{(1 << kTurnBits) / 10};
    if (attempts_ < kAttempts) ++attempts_;
  }
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

}  // namespace tetap::bus
