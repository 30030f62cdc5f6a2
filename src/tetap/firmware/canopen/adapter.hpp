// SPDX-License-Identifier: Apache-2.0
// CANopen around a node, which knows nothing of it: SDO requests become reads of its parameters and frames of Cmd_Param
// that go onto the bus as well. A log of the bus therefore needs no SDO for its replay. Without a node id it is silent.
#pragma once

#include "tetap/firmware/canopen/emergency.hpp"
#include "tetap/firmware/canopen/ids.hpp"
#include "tetap/firmware/canopen/objects.hpp"
#include "tetap/firmware/canopen/parameter_writes.hpp"
#include "tetap/firmware/canopen/sdo_server.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::firmware::canopen {

class Adapter {
 public:
  /// `sets` outlives it. An id that is_node_id() refuses counts as none.
  Adapter(const Identity& identity, const param::StagedParameters& sets, base::Micros period)
      : writes_(identity.can_base),
        objects_(identity, sets, writes_),
        server_(kResponseIds + identity.node_id),
        period_(period),
        on_(is_node_id(identity.node_id, identity.can_base)) {}
  Adapter(const Adapter&) = delete;
  Adapter& operator=(const Adapter&) = delete;

  /// A request to this server, which is kept for poll(); more than are kept are lost, and their clients ask again.
  [[nodiscard]] bool take(const base::CanFrame& frame) {
    if (!on_ || frame.extended || frame.id != kRequestIds + objects_.identity().node_id) return false;
    if (size_ < queue_.size()) queue_[(first_ + size_++) % queue_.size()] = frame;
    return true;
  }
  /// Every frame that the node sends.
  void on_sent(const base::CanFrame& frame) {
    if (const auto end = writes_.on_answer(frame)) end_ = *end, ended_ = true;
  }
  void on_tick(const bus::LoopHealth& health, base::Micros now) { emergency_.note(health, now); }

  /// send(frame): onto the bus; command(frame): onto the bus and into the node. Both are false where the bus takes no
  /// more. `takes_commands`: the node may be commanded by its own board now.
  template <class Send, class Command>
  [[gnu::cold]] void poll(base::Micros now, bool takes_commands, Send&& send, Command&& command) {
    if (!on_) return;
    heartbeat_.poll(now, objects_.identity().node_id, base::Micros{std::int64_t{1000} * kHeartbeat_ms}, send);
    emergency_.poll(now, objects_.identity().node_id, send);
    objects_.note(emergency_.error_register(), takes_commands);
    if (now - period_began_ >= period_) period_began_ = now, left_ = kPerPeriod;
    if (ended_) server_.finish(end_, send);
    ended_ = false;
    while (size_ != 0 && left_ != 0 && !server_.is_writing()) {
      const base::CanFrame request = queue_[first_];
      first_ = (first_ + 1) % queue_.size();
      --size_;
      server_.on_request(request, now, objects_, send);
      left_ = Objects::is_long(SdoServer::object_of(request).index) ? 0 : left_ - 1;
    }
    writes_.send(command);
    const bool writes = server_.is_writing();
    server_.give_up(now, send);
    if (writes && !server_.is_writing()) writes_.forget();
  }

 private:
  static constexpr std::size_t kQueue = 8;
  static constexpr std::uint32_t kPerPeriod = 4;  ///< requests in a period of the tick; a long one is its last

  ParameterWrites writes_;
  Objects objects_;
  SdoServer server_;
  Heartbeat heartbeat_;
  Emergency emergency_;
  std::array<base::CanFrame, kQueue> queue_{};
  std::size_t first_ = 0, size_ = 0;
  base::Micros period_, period_began_;
  std::uint32_t left_ = kPerPeriod;
  Abort end_ = Abort::kNone;
  bool ended_ = false, on_;
};

}  // namespace tetap::firmware::canopen
