// SPDX-License-Identifier: Apache-2.0
// A robot's node in this process, and the player's link to it: the same frames, codec and firmware as on a bus.
#pragma once

#include "sim_host/replay/link.hpp"
#include "sim_host/robot.hpp"

#include <functional>
#include <memory>

namespace tetap::sim {

using InProcessLink = MemoryLink<std::function<void()>>;

class MemoryNode {
 public:
  /// The parameters outlive it, `can_base` and the policy of lockstep included: `for_player` makes them.
  MemoryNode(const Robot& robot, const param::Parameters& parameters, const bus::Version& version)
      : firmware_(robot.make_firmware(board_, parameters, version)) {
    link_.on_resume([this](std::span<const std::byte> state) { return firmware_->resume(state); });
  }
  MemoryNode(const MemoryNode&) = delete;  // its parts look at each other
  MemoryNode& operator=(const MemoryNode&) = delete;

  [[nodiscard]] InProcessLink& link() { return link_; }

  /// A node in the player's own process is the player's: it takes Step frames that nobody vouches for.
  [[nodiscard]] static param::Parameters for_player(param::Parameters parameters, std::uint32_t can_base) {
    parameters.can_base = can_base;
    if (parameters.loop.lockstep == param::Lockstep::kAuthenticated) parameters.loop.lockstep = param::Lockstep::kPlain;
    return parameters;
  }

 private:
  static constexpr base::Micros kLongestPause{200'000};  ///< well below the time after which lockstep ends

  hal::MemoryBus bus_;
  hal::MemoryCan node_end_ = bus_.node_end();
  CanAdapter<hal::MemoryCan> can_{node_end_};
  HostBoard board_{can_, kLongestPause};
  std::unique_ptr<RobotFirmware> firmware_;
  InProcessLink link_{bus_, [this] { firmware_->poll(); }};
};

}  // namespace tetap::sim
