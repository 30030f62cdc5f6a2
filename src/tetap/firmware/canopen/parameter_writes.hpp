// SPDX-License-Identifier: Apache-2.0
// A write of an object as frames of Cmd_Param: a node takes it as from anybody on the bus, and the log of the bus has
// it. Est_Param has its end.
#pragma once

#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/firmware/canopen/sdo_server.hpp"
#include "tetap/param/staged.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace tetap::firmware::canopen {

class ParameterWrites {
 public:
  explicit ParameterWrites(std::uint32_t can_base) : can_base_(can_base) {}

  /// One word; of an element of two words, twice before the first is sent.
  void set(const param::StoredRow& row, std::size_t word, std::uint32_t value) {
    add(bus::CmdParamSet{.set_word = static_cast<std::uint8_t>(word), .set_row_id = row.index, .set_value = value});
    row_ = &row;
  }
  void apply(std::uint32_t before, std::uint32_t after) {
    add(bus::CmdParamApply{.apply_before_crc = before & kName, .apply_after_crc = after & kName});
  }
  void save(std::uint32_t before) { add(bus::CmdParamSave{.save_before_crc = before & kName}); }
  void restore(std::uint32_t before) { add(bus::CmdParamRestore{.restore_before_crc = before & kName}); }

  /// Sends the frames that are left, until send(frame) is false.
  template <class Send>
  void send(Send&& send) {
    while (sent_ < count_ && send(frames_[sent_])) ++sent_;
  }
  /// A frame of the node. A value: all answers are here, and this is the end.
  [[nodiscard]] [[gnu::cold]] std::optional<Abort> on_answer(const base::CanFrame& frame) {
    if (count_ == 0 || frame.id != can_base_ + bus::EstParamRow::kOffset) return std::nullopt;
    for (std::size_t i = 0; i < sent_; ++i) {
      const auto told = answer_to(frames_[i], frame);
      if (!told || (answered_ >> i & 1U) != 0) continue;
      answered_ |= 1U << i;
      if (end_ == Abort::kNone) end_ = *told;
      if (answered_ + 1U != 1U << count_) return std::nullopt;
      const Abort end = end_;
      forget();
      return end;
    }
    return std::nullopt;
  }
  void forget() {
    count_ = sent_ = 0;
    answered_ = 0;
    end_ = Abort::kNone;
    row_ = nullptr;
  }

 private:
  static constexpr std::uint32_t kName = param::StagedParameters::kName;

  template <class Message>
  void add(Message message) {
    if (count_ == frames_.size()) return;
    message.ctr = counter_++ & 0xF;
    frames_[count_++] = bus::frame(can_base_, bus::protect(message));
  }
  /// Answer of the node to a command; a word that is not as commanded is somebody else's by now.
  [[nodiscard]] std::optional<Abort> answer_to(const base::CanFrame& command, const base::CanFrame& frame) const {
    if (const auto set = bus::decode<bus::CmdParamSet>(bus::payload(command))) {
      const auto told = bus::decode<bus::EstParamRow>(bus::payload(frame));
      if (!told || told->row_ctr != set->ctr || told->row_id != set->set_row_id || told->row_word != set->set_word ||
          told->row_source != bus::ParamSource::kStaged)
        return std::nullopt;
      if (told->row_answer == bus::ParamAnswer::kOutOfLimits) return beyond(set->set_value);
      if (told->row_answer != bus::ParamAnswer::kDone) return abort_of(told->row_answer);
      return told->row_value == set->set_value ? Abort::kNone : Abort::kDeviceState;
    }
    const auto told = bus::decode<bus::EstParamSet>(bus::payload(frame));
    const std::uint8_t page = command.data[1] >> 4 & 7U, counter = command.data[1] & 0xFU;
    if (!told || told->set_ctr != counter || told->set_page_id != page) return std::nullopt;
    return abort_of(told->set_answer);
  }
  /// The limit that a word lies beyond; a word that is no number lies beyond none.
  [[nodiscard]] Abort beyond(std::uint32_t word) const {
    if (row_ == nullptr) return Abort::kOutOfRange;
    param::StoredRow open = *row_;
    open.most = word;
    const bool low = !open.within(word);
    open.most = row_->most, open.least = word;
    const bool high = !open.within(word);
    return low == high ? Abort::kOutOfRange : low ? Abort::kTooLow : Abort::kTooHigh;
  }
  [[nodiscard]] static Abort abort_of(bus::ParamAnswer answer) {
    switch (answer) {
      case bus::ParamAnswer::kDone:
        return Abort::kNone;
      case bus::ParamAnswer::kUnknown:
        return Abort::kNoObject;
      case bus::ParamAnswer::kOutOfLimits:
        return Abort::kOutOfRange;
      case bus::ParamAnswer::kRefused:
        return Abort::kLocalControl;
      case bus::ParamAnswer::kNotTogether:
        return Abort::kIncompatible;
      default:
        return Abort::kDeviceState;
    }
  }

  std::uint32_t can_base_;
  std::array<base::CanFrame, 2> frames_{};
  const param::StoredRow* row_ = nullptr;  ///< row of a set
  std::size_t count_ = 0, sent_ = 0;
  std::uint32_t answered_ = 0;  ///< bit of each frame
  Abort end_ = Abort::kNone;
  std::uint8_t counter_ = 0;
};

}  // namespace tetap::firmware::canopen
