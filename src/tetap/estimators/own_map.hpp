// SPDX-License-Identifier: Apache-2.0
// Output of an estimator that makes a map of its own: landmarks one at a time, and how full the map is.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/model/landmark.hpp"
#include "tetap/model/planar_pose.hpp"
#include "tetap/sensor/vocabulary.hpp"

#include <concepts>
#include <cstddef>
#include <cstdint>

namespace tetap::estimators {

/// How an optimisation of a pose graph ended.
enum class GraphEnd : std::uint8_t { kNone = 0, kConverged = 1, kNotConverged = 2, kSingular = 3, kNoRoom = 4 };

/// A landmark of the own map; errors in axes of n.
struct MappedLandmark {
  std::uint8_t id = 0;
  model::Landmark place;
  float xx_m2 = 0;
  float xy_m2 = 0;
  float yy_m2 = 0;
  std::uint16_t hits = 0;  ///< accepted sightings
  base::Micros age;        ///< time since the last of them
  bool confirmed = false;  ///< false: the landmark gives way when there is no room
};

/// A keyframe that is new in this tick.
struct NewKeyframe {
  std::uint32_t id = 0;  ///< counted from 0
  base::Micros stamp;
  float step_x_m = 0;  ///< from the keyframe before it, in that one's frame; NaN: not known
  float step_y_m = 0;
};

/// A keyframe that the graph holds.
struct GraphKeyframe {
  std::uint32_t id = 0;
  model::PlanarPose pose;
};

/// The graph and its latest optimisation.
struct GraphReport {
  double chi2 = 0;  ///< over the edges that were not left out
  GraphEnd end = GraphEnd::kNone;
  std::uint32_t closures = 0;
  std::uint32_t jobs = 0;  ///< optimisations that ended
};

/// State of the own map and of a job that lasts longer than a tick. Counters grow since the start of the estimator.
struct MapReport {
  std::uint32_t size = 0;
  std::uint32_t refused = 0;    ///< new landmarks or edges without room
  std::uint32_t ambiguous = 0;  ///< sightings of which the landmark was not clear
  std::uint32_t work_left = 0;  ///< units of the job under way
  std::uint32_t jobs_aborted = 0;
};

/// An estimator that makes a map: `own_map()` reports on it.
template <class E>
concept MakesMap = requires(const E& e) {
  { e.own_map() } -> std::same_as<MapReport>;
};
/// `own_landmark(i)` is its landmark i below `size`.
template <class E>
concept MapsLandmarks = MakesMap<E> && requires(const E& e, std::size_t i) {
  { e.own_landmark(i) } -> std::same_as<MappedLandmark>;
};
/// `own_keyframe(i)` is its keyframe i below `size`; new ones are handed to a sink, each in one tick alone.
template <class E>
concept MapsKeyframes = MakesMap<E> && requires(const E& e, std::size_t i) {
  { e.own_keyframe(i) } -> std::same_as<GraphKeyframe>;
  { e.graph() } -> std::same_as<GraphReport>;
  e.new_keyframes([](const NewKeyframe&) {});
};

/// How a match of a scan ended, in the order of bus::ScanFate.
enum class ScanEnd : std::uint8_t { kMatched = 0, kFirst = 1, kFewPairs = 2, kSingular = 3, kNoGeometry = 4 };

/// The latest match of a scan.
struct ScanMatchReport {
  base::Micros ended{-1};  ///< tick in which it ended; -1: none yet
  std::uint8_t sequence = 0;
  std::uint8_t instance = 0;
  ScanEnd end = ScanEnd::kFirst;
  int iterations = 0;
  int pairs = 0;      ///< beams that had a partner
  float sigma_m = 0;  ///< 1 sigma of the place in its least certain direction
  float sigma_yaw_rad = 0;
};

/// An estimator that matches scans.
template <class E>
concept MatchesScans = requires(const E& e) {
  { e.scan_match() } -> std::same_as<ScanMatchReport>;
};

/// An estimator that localises on the map it is given (MapFrame::map).
template <class E>
concept UsesMap = requires {
  requires E::kUsesMap;
};

}  // namespace tetap::estimators
