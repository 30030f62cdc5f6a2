// SPDX-License-Identifier: Apache-2.0
// The simulated world and a robot's node in one loop, tick by tick, with faults while it drives.
#pragma once

#include "sim_host/node_origin.hpp"
#include "sim_host/page/module/observer.hpp"
#include "sim_host/played_run.hpp"
#include "sim_host/replay/lockstep.hpp"
#include "sim_host/replay/memory_node.hpp"
#include "sim_host/world_source.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tetap::page {

class Play {
 public:
  /// The robot drives what `tetap-world --memory --robot NAME --seed N` drives. Writes kStage.
  Play(const sim::Robot& robot, std::uint64_t seed);
  Play(const Play&) = delete;  // its parts look at each other
  Play& operator=(const Play&) = delete;

  /// Plays so many ticks of 10 ms, or up to the end of the course; writes tables, kTruth, kFrames and kPlayed.
  sim::Result<> advance(std::uint32_t ticks);
  /// A fault of that number in sim::fault_table(), from now on and for so long; writes kInjected.
  sim::Result<> inject(std::uint32_t fault, base::Micros duration);
  /// A frame that somebody beside the world sends to the node, before the next tick. A script does not have it.
  void hand(const base::CanFrame& frame) { handed_.push_back(frame); }
  /// Writes kScript: the run up to now. It may go on.
  void script();

 private:
  /// Everything on the bus, as a log and as tables.
  class Bus {
   public:
    explicit Bus(std::uint32_t base) : run(base), origin(base), origin_id_(base + bus::EstOriginLat::kOffset) {}
    void restarted() { run.restarted(); }
    void sent(const base::CanFrame& frame) {
      line(frame);
      run.sent(frame);
    }
    void received(const base::CanFrame& frame) {
      line(frame);
      origin.received(frame);
      origin_stated = origin_stated || frame.id == origin_id_;
      run.received(frame);
    }
    void epoch(const sim::NodeEpoch& epoch, base::Micros time) { run.epoch(epoch, time); }

    Observer run;
    sim::NodeOrigin origin;
    bool origin_stated = false;  ///< flag of a frame with it, to be taken down
    std::string frames;
    base::Micros now;  ///< time of the world

   private:
    void line(const base::CanFrame& frame);
    std::uint32_t origin_id_;
    sim::Line line_;
  };
  void describe() const;
  void truth_row(base::Micros time);
  /// Origin of the node's map; empty while a map that begins at the first fix has none.
  [[nodiscard]] std::optional<sim::GeodeticOrigin> map_origin() const;

  sim::World::Options world_;
  param::Parameters parameters_;
  sim::PlayedRun played_;
  sim::MemoryNode node_;
  sim::WorldSource source_;
  Bus bus_;
  sim::LockstepOptions options_;
  sim::Lockstep<sim::InProcessLink, Bus> lockstep_;
  std::optional<sim::FrameChange> to_map_;
  std::vector<base::CanFrame> handed_, inputs_;
  sim::Line line_;
  std::string truth_;
};

}  // namespace tetap::page
