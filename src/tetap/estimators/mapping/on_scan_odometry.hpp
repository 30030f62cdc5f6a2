// SPDX-License-Identifier: Apache-2.0
// What an estimator that stands on the odometry by scans leaves to it: samples, their records, and motion.
#pragma once

#include "tetap/estimators/mapping/scan_odometry.hpp"

namespace tetap::estimators {

template <int kBeams, int kFrames>
class OnScanOdometry {
 public:
  static constexpr bool kDelayed = true;
  static constexpr int kMostBeams = kBeams;

  [[nodiscard]] bool defers(const sensor::Sample& sample, const Context& ctx) const {
    return odometer_.defers(sample, ctx);
  }
  template <class Input>
  requires requires(ScanOdometry<kBeams, kFrames>& odometer, const Input& input, const Context& ctx) {
    odometer.fuse(input, base::Micros{}, ctx);
  }
  Innovation fuse(const Input& input, base::Micros stamp, const Context& ctx) {
    return odometer_.fuse(input, stamp, ctx);
  }
  template <class Sink>
  void late_records(Sink&& sink) {
    odometer_.late_records(sink);
  }
  static void close_batch(const Context&) {}
  [[nodiscard]] MotionVariance motion_variance(const Context& ctx) const { return odometer_.motion_variance(ctx); }
  [[nodiscard]] ScanMatchReport scan_match() const { return odometer_.scan_match(); }

 protected:
  ScanOdometry<kBeams, kFrames> odometer_;
};

}  // namespace tetap::estimators
