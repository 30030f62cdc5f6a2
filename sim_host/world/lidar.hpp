// SPDX-License-Identifier: Apache-2.0
// A turning laser scanner in the walls of the course. Each beam is cast from where the scanner is at the beam's time,
// so a scan is smeared by the motion of the vehicle.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/faults.hpp"
#include "sim_host/world/measurement.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"
#include "sim_host/world/surroundings.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace tetap::sim {

class Lidar {
 public:
  struct Scan {
    base::Micros first;  ///< time of the first beam, after the start
    ScanHead head;
    std::vector<std::uint16_t> ranges;  ///< [5 mm]; 0: none
    [[nodiscard]] ScanBlock block(std::size_t number) const;
    [[nodiscard]] std::size_t blocks() const { return (ranges.size() + 3) / 4; }
  };
  /// `surroundings` outlives it.
  Lidar(const LidarNumbers& parameters, const Surroundings& surroundings, std::uint64_t seed);

  /// Casts the beams of (before, now], with the poses at the two: between them the motion is uniform. The scan whose
  /// last beam is among them.
  [[nodiscard]] std::optional<Scan> sense(const Truth& from, const Truth& to, base::Micros before, base::Micros now,
                                          const Faults& faults);
  /// Time of a beam after the first one of its scan.
  [[nodiscard]] double beam_us(int beam) const;

 private:
  [[nodiscard]] std::uint16_t range(const Truth& truth, base::Micros at, const Faults& faults);

  LidarNumbers parameters_;
  const Surroundings* surroundings_;
  Chance chance_;
  Scan scan_;
  int step_;  ///< angle between beams in steps of the bus, without sign
};

}  // namespace tetap::sim
