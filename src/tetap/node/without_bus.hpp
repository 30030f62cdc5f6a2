// SPDX-License-Identifier: Apache-2.0
// The node where there is no bus: samples come as they are, with whole stamps, and estimates and records go out as they
// are. A robot names it, `node::Node<node::WithoutBus<Estimators>>`; tetap/localizer.hpp does.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/input_crc.hpp"
#include "tetap/bus/publisher.hpp"
#include "tetap/bus/version.hpp"
#include "tetap/estimators/estimate.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::node {

template <class Estimators, std::size_t kMostRecords>
struct WithoutBus : Estimators {
  static constexpr bool kBus = false, kBusParameters = false;
  static constexpr std::size_t kRecords = kMostRecords;
};

template <class Estimators>
inline constexpr bool kHasBus = true;
template <class Estimators, std::size_t kMostRecords>
inline constexpr bool kHasBus<WithoutBus<Estimators, kMostRecords>> = false;

/// Fate of one measurement in one estimator.
struct Record {
  base::Micros stamp;
  sensor::Sensor sensor = sensor::Sensor::kNotAvailable;
  std::uint8_t instance = 0;   ///< number among sensors of this kind
  std::uint8_t estimator = 0;  ///< place in the robot's list of estimators
  estimators::Innovation innovation;

  /// Statistic of the test that decided over its limit: above 1 it refuses. NaN: nothing was compared.
  [[nodiscard]] float size() const { return bus::ratio_of(innovation); }
};

/// In place of bus::StampWraps.
struct WholeStamps {
  static void power_on() {}
  [[nodiscard]] static base::Micros place(const sensor::Sample& sample, base::Micros) { return sample.stamp; }
  [[nodiscard]] static base::Micros place_beside(const sensor::Sample& sample, base::Micros) { return sample.stamp; }
  [[nodiscard]] static bool two_senders(const sensor::Sample&) { return false; }
};

/// In place of bus::Decoder: no frame means anything.
struct NoDecoder {
  static void power_on() {}
  template <class Out>
  static void on_frame(std::uint8_t, const base::CanFrame&, std::uint32_t, base::Micros, bus::Counters& counters,
                       Out&&) {
    ++counters.malformed;
  }
  static void expire(base::Micros, base::Micros, bus::Counters&) {}
  static void discard(bus::Counters&) {}
};

/// In place of bus::Publisher: what it would encode goes to `out` in every epoch, and records are kept until the next.
template <std::size_t kMostRecords>
class DirectOutput {
 public:
  DirectOutput(const param::Parameters& parameters, const bus::Version&) : side_every_(parameters.publish.side_every) {}
  void power_on() { epoch_ = 0, begin_records(); }
  static constexpr auto members(auto& self) {
    return base::members(base::unhashed(self.records_), base::count(self.size_), base::count(self.lost_), self.epoch_,
                         self.side_every_, self.ended_);
  }

  /// Measurements that were refused between ticks belong to the tick that follows.
  void tick_begins() {
    if (ended_) begin_records();
  }
  void event(const estimators::Innovation& innovation, const sensor::Sample& sample, std::size_t instance, base::Micros,
             bus::Counters&) {
    if (innovation.verdict == sensor::Verdict::kNotUsed) return;
    if (ended_) begin_records();
    if (size_ == kMostRecords) return void(++lost_);
    records_[size_++] = {.stamp = sample.stamp,
                         .sensor = sample.sensor,
                         .instance = sample.instance,
                         .estimator = static_cast<std::uint8_t>(instance),
                         .innovation = innovation};
  }
  [[nodiscard]] std::span<const Record> records() const { return {records_.data(), size_}; }
  [[nodiscard]] std::size_t lost() const { return lost_; }

  [[nodiscard]] std::uint32_t epoch() const { return epoch_; }
  template <class Out>
  void begin(base::Micros, const bus::InputCrc&, Out&) {
    ++epoch_;
  }
  [[nodiscard]] static bool publishes_sigma(std::size_t, bool) { return true; }
  [[nodiscard]] bool publishes(std::size_t instance) const {
    return bus::side_published(epoch_, side_every_, instance);
  }
  [[nodiscard]] bool compares_attitudes() const { return bus::attitudes_compared(epoch_, side_every_); }
  template <class Out>
  static void estimate(std::size_t instance, sensor::EstimatorKind, bool, const estimators::Estimate& e,
                       const estimators::MotionVariance& motion, Out& out) {
    out.estimate(instance, e, motion);
  }
  template <class Inertial, class Sources, class Out>
  static void inertial(std::size_t instance, Inertial&& inertial, Sources&&, Out& out) {
    out.inertial(instance, inertial());
  }
  template <class Attitude, class Out>
  static void attitude(std::size_t instance, Attitude&& attitude, const estimators::Disagreement&, Out& out) {
    out.attitude(instance, attitude());
  }
  template <class GiveSummary, class Out>
  static void status(GiveSummary&& summary, const bus::LoopHealth&, Out& out) {
    out.status(summary());
  }
  template <class Out>
  void end(std::uint32_t, const bus::InputCrc&, Out&) {
    ended_ = true;
  }
  /// Frames that nobody waits for.
  static void own_map(const auto&, auto&) {}
  static void scan_match(const auto&, base::Micros, auto&) {}
  static void visual(std::size_t, const auto&, const auto&, auto&) {}
  static void statistics(const auto&, base::Micros, auto&) {}
  static void diagnostics(const bus::Counters&, const bus::LoopHealth&, std::uint16_t, auto&) {}
  static void refusals(const bus::Counters&, const bus::LoopHealth&, auto&&, auto&) {}
  static void identity(const estimators::MapFrame&, auto&&, auto&) {}
  static void events(auto&) {}
  static void send_version(auto&) {}
  static void show_wired() {}

 private:
  void begin_records() { size_ = lost_ = 0, ended_ = false; }

  std::array<Record, kMostRecords> records_{};
  std::size_t size_ = 0, lost_ = 0;
  std::uint32_t epoch_ = 0;
  std::int32_t side_every_;
  bool ended_ = false;  ///< the records are those of a tick that is over
};

/// The parts of a node that speak to the bus, or what stands in their places.
template <class Estimators>
struct Parts {
  using Decoder = bus::Decoder;
  using Wraps = bus::StampWraps;
  using Publisher = bus::Publisher<Estimators::kCount>;
};
template <class Estimators, std::size_t kMostRecords>
struct Parts<WithoutBus<Estimators, kMostRecords>> {
  using Decoder = NoDecoder;
  using Wraps = WholeStamps;
  using Publisher = DirectOutput<kMostRecords>;
};

}  // namespace tetap::node
