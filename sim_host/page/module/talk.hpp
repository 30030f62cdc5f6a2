// SPDX-License-Identifier: Apache-2.0
// Parameters of a node at a cable: what was read of its sets, what the user wants, and the frames of Cmd_Param and
// Est_Param. When a frame goes out, and again, is for web/talk.js.
#pragma once

#include "sim_host/replay/result.hpp"
#include "tetap/base/can_frame.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/param/row.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::page {

class Talk {
 public:
  /// `base`: first identifier of the node's block.
  explicit Talk(std::uint32_t base) : base_(base) {}

  /// Writes kTalk: identifiers of the node's answers, and the words that can be read.
  void describe() const;
  /// Writes a line of kFrames: the word of the table's row `number` is asked for. `source` is a bus::ParamSource.
  sim::Result<> get(std::uint32_t number, std::uint32_t word, std::uint32_t source, std::uint32_t counter) const;
  /// As get(): the wanted word is staged.
  sim::Result<> set(std::uint32_t number, std::uint32_t word, std::uint32_t counter) const;
  /// As get(): an Apply of the wanted set, a Save or a Restore, by the command's page.
  sim::Result<> act(std::uint32_t page, std::uint32_t counter) const;
  /// A frame of the bus. Keeps the word that it has, and writes kTalk where it is an answer or shows motion.
  void hear(const base::CanFrame& frame);

  /// The staged set is the wanted one, from now on.
  void want_staged() { wanted_ = set_of(bus::ParamSource::kStaged); }
  /// One element of the wanted set, against the limits of its row.
  sim::Result<> want(std::uint32_t number, std::uint32_t element, double value);
  /// The rules between rows of the wanted set. Writes kTalk: words that are to be staged.
  sim::Result<> check() const;
  /// Writes kTalk: active, compiled and wanted values of each row in its unit, and who may change them.
  void values() const;

 private:
  [[nodiscard]] param::Parameters& set_of(bus::ParamSource source) { return sets_[static_cast<std::size_t>(source)]; }
  [[nodiscard]] const param::Parameters& set_of(bus::ParamSource source) const {
    return sets_[static_cast<std::size_t>(source)];
  }
  template <class Message>
  void send(Message message, std::uint32_t counter) const;

  std::uint32_t base_;
  std::array<param::Parameters, 3> sets_{};  ///< by bus::ParamSource
  param::Parameters wanted_;
};

}  // namespace tetap::page
