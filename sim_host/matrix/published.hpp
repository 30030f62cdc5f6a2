// SPDX-License-Identifier: Apache-2.0
// Primary estimate that a node publishes, tick by tick, and its errors against the truth in units of three published
// sigma.
#pragma once

#include "sim_host/matrix/clean_log.hpp"
#include "sim_host/replay/protocol.hpp"
#include "sim_host/world/world.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tetap::sim {

enum class Quantity : std::uint8_t { kPosition, kVelocity, kHeading, kTilt };
inline constexpr std::size_t kQuantities = 4;
inline constexpr std::array<const char*, kQuantities> kQuantityNames{"position", "velocity", "heading", "tilt"};

/// The estimate at one tick; NaN: not published, or not available.
struct PublishedState {
  std::size_t tick = 0;
  Vector3 position_m{}, std_position_m{};
  Vector3 velocity_mps{}, std_velocity_mps{};
  double yaw_rad = 0, std_yaw_rad = 0;
  std::array<double, 4> q_nb{};          ///< w x y z
  std::array<double, 2> std_tilt_rad{};  ///< about east and north
  std::array<bool, kQuantities> valid{};
};

/// Collects states and words of a node. A sigma that is not in an epoch is that of the last epoch that had it.
class PublishedStates {
 public:
  explicit PublishedStates(std::uint32_t base) : base_(base) {}

  void epoch(const NodeEpoch& epoch, std::size_t tick);
  [[nodiscard]] const std::vector<PublishedState>& states() const { return states_; }
  /// Words of the status and of the sources, with the ticks at which they were first and last published.
  struct Published {
    std::size_t first = 0, last = 0;
  };
  [[nodiscard]] const std::map<std::string, Published>& words() const { return words_; }
  void forget_states() { states_.clear(); }
  void forget_words() { words_.clear(); }

 private:
  void frame(const base::CanFrame& frame, bool& whole);
  void more(std::uint32_t offset, std::span<const std::uint8_t> payload);
  void status(std::span<const std::uint8_t> payload);
  void word(const std::string& text) { words_.try_emplace(text, Published{tick_, tick_}).first->second.last = tick_; }

  std::uint32_t base_;
  std::size_t tick_ = 0;
  PublishedState now_;
  std::optional<std::uint8_t> resets_;
  std::vector<PublishedState> states_;
  std::map<std::string, Published> words_;
};

/// Errors of one state. Ratio: the largest of the components' error over three of its sigma.
struct Judged {
  std::size_t tick = 0;
  std::array<double, kQuantities> error{};  ///< m, m/s, rad, rad
  std::array<double, kQuantities> ratio{};  ///< NaN: not published
  std::array<bool, kQuantities> valid{};
};

/// `origin`: of the node's map.
[[nodiscard]] std::vector<Judged> judged(std::span<const PublishedState> states, const CleanLog& log,
                                         const GeodeticOrigin& origin);

/// A cell's figures of one quantity.
struct Figures {
  double worst_ratio = 0;
  double worst_error = 0;
  double clean_ratio = 0;
  double clean_error = 0;
  double beyond_s = 0;           ///< ratio above 1.5 and error above twice the largest of the clean run so far
  double valid_while_out_s = 0;  ///< valid with a ratio above 10, likewise
  std::optional<double> inside_after_s = 0;  ///< after the end of the fault; none: not before the end of the cell
};

/// Both runs hold the same ticks. `end_tick`: of the fault.
[[nodiscard]] std::array<Figures, kQuantities> compare(std::span<const Judged> run, std::span<const Judged> clean,
                                                       std::size_t end_tick);

}  // namespace tetap::sim
