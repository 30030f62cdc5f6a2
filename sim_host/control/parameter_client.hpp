// SPDX-License-Identifier: Apache-2.0
// Parameters of a running node, read and changed over its bus by Cmd_Param and Est_Param. A lost frame is asked for
// again; what cannot be done whole is not done.
#pragma once

#include "sim_host/control/tags.hpp"
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

  /// The node's parameters; for the key, which is never read, one that only keeps the rules. Throws ControlError where
  /// it does not answer, or has no such row.
  [[nodiscard]] param::Parameters read(bus::ParamSource source);
  /// Makes `wanted` active where it differs from `before`, which read() gave: all of it at one tick, or none. Throws
  /// ControlError with the row that the node refuses, or with the rule.
  bus::EstParamSet change(const param::Parameters& before, const param::Parameters& wanted);
  /// Makes the staged set active as it is, whoever staged it.
  bus::EstParamSet apply(const param::Parameters& before);
  /// The same with the rows that need a restart: the node's estimators begin anew. Throws ControlError where it moves.
  bus::EstParamSet restart(const param::Parameters& before);
  /// The node keeps its parameters without power. Throws ControlError where its board cannot.
  bus::EstParamSet save(const param::Parameters& before);
  /// The compiled parameters are active again, but for those of access and identity.
  bus::EstParamSet restore(const param::Parameters& before);
  /// The key of use_key() is the node's first one; from then on it obeys commands with a tag alone. A command with a
  /// tag proves it.
  bus::EstParamSet claim(const param::Parameters& before);
  /// For the commands of a node that asks for tags.
  void use_key(const base::SipKey& key) { key_ = key, tags_.emplace(key, can_base_); }

 private:
  struct Word {
    const param::Row* row;
    std::uint8_t word;
    std::uint32_t value = 0;
  };
  template <class Message>
  std::uint8_t send(Message message, bool tagged = false, bool hurry = false);
  /// The next frame of the bus, which the tags see as well.
  [[nodiscard]] std::optional<base::CanFrame> receive(base::Micros patience);
  /// The next frame of Est_Param until then.
  [[nodiscard]] std::optional<base::CanFrame> answer(base::Micros until);
  /// Asks for words with `make`, and again for those that are not answered.
  template <class Make>
  void exchange(std::vector<Word>& words, bus::ParamSource source, Make&& make);
  bus::EstParamSet apply(const param::Parameters& before, const param::Parameters& staged);
  void stage(std::vector<Word>& words);
  /// The tags of the next commands need a number that the node publishes each second.
  void await_nonce();
  /// `done`: whether an answer shows that an earlier attempt was obeyed. `access`: of the node, bus.commands.
  template <class Message, class Done>
  bus::EstParamSet act(const Message& message, param::CommandAccess access, base::Micros patience, Done&& done);

  std::uint32_t can_base_;
  Send send_;
  Receive receive_;
  Clock now_;
  std::optional<base::SipKey> key_;
  std::optional<Tags> tags_;
  std::uint8_t counter_ = 0;
};

}  // namespace tetap::sim
