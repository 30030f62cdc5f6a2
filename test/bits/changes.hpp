// SPDX-License-Identifier: Apache-2.0
// A node whose parameters change on the bus while it runs: twenty sets of one row and twenty applies among the made-up
// input of the self-check. The same wherever the arithmetic is the same.
#pragma once

#include "tetap/firmware/boot_self_check.hpp"
#include "tetap/param/staged.hpp"
#include "tetap/param/table.hpp"

#include <array>
#include <cstdint>
#include <cstring>

namespace tetap::bits {

/// In front of a node: before every hundredth tick it changes one of five live rows by a tenth.
template <class Node>
class ChangedNode {
 public:
  static constexpr std::uint32_t kChanges = 20, kEvery = 100;

  ChangedNode(Node& node, std::uint32_t can_base) : node_(node), base_(can_base) {}
  void power_on(base::Micros time) { node_.power_on(time); }
  void on_frame(const base::CanFrame& frame) { node_.on_frame(frame); }
  template <class Send>
  void tick(base::Micros time, const bus::LoopHealth& loop, Send& send) {
    if (++ticks_ % kEvery == 0 && asked_ < kChanges) change();
    node_.tick(time, loop, [&](const base::CanFrame& frame) {
      note(frame);
      send(frame);
    });
  }
  /// Changes that the node has confirmed.
  [[nodiscard]] std::uint32_t done() const { return done_; }

 private:
  static constexpr std::array kRows{
      param::row_of("landmark.gate_scale")->index, param::row_of("landmark.sigma_range_m")->index,
      param::row_of("landmark.sigma_bearing_rad")->index, param::row_of("wheels.noise.speed")->index,
      param::row_of("wheels.noise.yaw_rate")->index};

  void change() {
    const param::StagedParameters& sets = node_.parameter_sets();
    const std::uint16_t row = kRows[asked_ % kRows.size()];
    std::uint32_t word = sets.value(param::Source::kActive, row, 0);
    float value = 0;
    std::memcpy(&value, &word, sizeof value);
    value *= 1.1F;
    std::memcpy(&word, &value, sizeof value);
    const auto counter = static_cast<std::uint8_t>(++asked_ & 0xF);
    send(bus::CmdParamSet{.ctr = counter, .set_row_id = row, .set_value = word});
    send(bus::CmdParamApply{.ctr = counter,
                            .apply_before_crc = sets.active_crc() & param::StagedParameters::kName,
                            .apply_after_crc = sets.staged_crc() & param::StagedParameters::kName});
  }
  template <class Message>
  void send(const Message& message) {
    node_.on_frame(bus::frame(base_, bus::protect(message)));
  }
  void note(const base::CanFrame& frame) {
    if (frame.id != base_ + bus::EstParamRow::kOffset) return;
    const auto told = bus::decode<bus::EstParamSet>(bus::payload(frame));
    done_ += told && told->set_page_id == bus::CmdParamApply::kPage && told->set_answer == bus::ParamAnswer::kDone;
  }

  Node& node_;
  std::uint32_t base_, ticks_ = 0, asked_ = 0, done_ = 0;
};

struct ChangedRun {
  std::uint32_t hash = 0;
  bool whole = false;  ///< each change was made
};
template <class Node>
[[nodiscard]] ChangedRun changed_run(Node& node, std::uint32_t can_base) {
  using Changed = ChangedNode<Node>;
  Changed changed(node, can_base);
  const std::uint32_t hash =
      firmware::BootSelfCheck(changed, can_base, 3).run((Changed::kChanges + 1) * Changed::kEvery);
  return {.hash = hash, .whole = changed.done() == Changed::kChanges};
}

}  // namespace tetap::bits
