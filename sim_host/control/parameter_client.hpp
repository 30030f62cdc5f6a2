// SPDX-License-Identifier: Apache-2.0
// Parameters of a running node, read and changed over its bus by Cmd_Param and Est_Param. A lost frame is asked for
// again; what cannot be done whole is not done.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/param/parameters.hpp"
#include "tetap/param/row.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

namespace tetap::sim {

/// One line on what the node did not do.
struct ControlError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class ParameterClient {
 public:
  using Send = std::function<void(const base::CanFrame&)>;
  /// The next frame of the bus, or none after so long.
  using Receive = std::function<std::optional<base::CanFrame>(base::Micros)>;
  using Clock = std::function<base::Micros()>;

  /// `can_base`: first identifier of the node's block.
  ParameterClient(std::uint32_t can_base, Send send, Receive receive, Clock now)
      : can_base_(can_base), send_(std::move(send)), receive_(std::move(receive)), now_(std::move(now)) {}

  /// The node's parameters; of the key, zeros. Throws ControlError where it does not answer, or has no such row.
  [[nodiscard]] param::Parameters read(bus::ParamSource source);
  /// Makes `wanted` active where it differs from `before`, which read() gave: all of it at one tick, or none. Throws
  /// ControlError with the row that the node refuses, or with the rule.
  bus::EstParamSet change(const param::Parameters& before, const param::Parameters& wanted);
  /// Makes the staged set active as it is, whoever staged it.
  bus::EstParamSet apply(const param::Parameters& before);
  /// The node keeps its parameters without power. Throws ControlError where its board cannot.
  bus::EstParamSet save(const param::Parameters& before);
  /// The compiled parameters are active again, but for those of access and identity.
  bus::EstParamSet restore(const param::Parameters& before);

 private:
  struct Word {
    const param::Row* row;
    std::uint8_t word;
    std::uint32_t value = 0;
  };
  template <class Message>
  std::uint8_t send(Message message);
  /// The next frame of Est_Param until then.
  [[nodiscard]] std::optional<base::CanFrame> answer(base::Micros until);
  /// Asks for words with `make`, and again for those that are not answered.
  template <class Make>
  void exchange(std::vector<Word>& words, bus::ParamSource source, Make&& make);
  bus::EstParamSet apply(const param::Parameters& before, const param::Parameters& staged);
  /// `done`: whether an answer shows that an earlier attempt was obeyed.
  template <class Message, class Done>
  bus::EstParamSet act(const Message& message, base::Micros patience, Done&& done);

  std::uint32_t can_base_;
  Send send_;
  Receive receive_;
  Clock now_;
  std::uint8_t counter_ = 0;
};

}  // namespace tetap::sim
