// SPDX-License-Identifier: Apache-2.0
// A camera and an inertial sensor on a path, recorded or simulated, as the visual-inertial window meets them.
#pragma once

#include "slam/visual_drive.hpp"
#include "tetap/slam/visual_inertial.hpp"

#include <functional>

namespace tetap::test {

struct ImuReading {
  std::int64_t time_us = 0;
  Eigen::Vector3d rate_b_radps, force_b_mps2;
};

struct InertialDrive {
  Drive camera;  ///< images with the moments that they show
  std::vector<ImuReading> imu;
  std::vector<Eigen::Vector3d> v_n_mps;                     ///< truth at each image
  std::vector<std::vector<slam::ImageFeature>> recognised;  ///< with lasting identities
  double offset_s = 0;                                      ///< moment of an image minus its stamp
};

struct InertialJudgement {
  PathJudgement whole, late;                   ///< from the start, from 60 s on
  double rmse_m = 0, first_m = 0, last_m = 0;  ///< three axes: whole, first 60 s, last 60 s
  double scale = 0, tilt_rad = 0, offset_s = 0;
  int stood = 0;
};

/// Splits what the sensor showed at the moments of images: means of neighbours are constant between them.
class ImuFeed {
 public:
  explicit ImuFeed(const std::vector<ImuReading>& imu) : imu_(imu), now_us_(imu.front().time_us) {}
  template <class Sink>
  void to(std::int64_t until_us, Sink&& sink) {
    while (now_us_ < until_us && k_ + 1 < imu_.size()) {
      const ImuReading &a = imu_[k_], &b = imu_[k_ + 1];
      const std::int64_t end_us = std::min(b.time_us, until_us);
      if (end_us > now_us_)
        sink(nav::ImuIncrement::constant(((a.rate_b_radps + b.rate_b_radps) / 2).cast<float>(),
                                         ((a.force_b_mps2 + b.force_b_mps2) / 2).cast<float>(),
                                         base::Micros{end_us - now_us_}));
      now_us_ = end_us;
      if (now_us_ == b.time_us) ++k_;
    }
  }

 private:
  const std::vector<ImuReading>& imu_;
  std::int64_t now_us_;
  std::size_t k_ = 0;
};

/// Rests for `rest_s`, then rides to the end. The heading and the place of the start are the truth's.
template <class Window>
InertialJudgement ride(Window& window, const InertialDrive& drive, double rest_s, int units = 1'000'000,
                       const std::function<void(const Window&, std::size_t)>& look = {}) {
  const auto& images = drive.camera.images;
  ImuFeed feed(drive.imu);
  std::size_t k = 0;
  while (images.at(k).time_s < rest_s) ++k;
  slam::RestMeans rest;
  feed.to(std::llround(images[k].time_s * 1e6), [&](const auto& imu) { rest.add(imu); });
  const Eigen::Matrix3d turn = images[k].r_nb * in_double(rest.attitude(0)).transpose();
  std::array<std::int64_t, 3> origin_um;
  for (int i = 0; i < 3; ++i) origin_um[static_cast<std::size_t>(i)] = std::llround(images[k].p_n_m(i) * 1e6);
  if (!window.start_at_rest(rest, static_cast<float>(std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1))),
                            1e-3F, origin_um, 1e-3F))
    throw std::runtime_error("no rest");
  PathJudge<Window> whole, late;
  InertialJudgement out;
  double sum = 0, first = 0, last = 0, vv = 0, vw = 0;
  int n = 0, n_first = 0, n_last = 0;
  const double start_s = images[k].time_s, end_s = images.back().time_s;
  for (; k < images.size(); ++k) {
    const double stamp_s = images[k].time_s - drive.offset_s;
    feed.to(std::llround((stamp_s + static_cast<double>(window.time_offset_s())) * 1e6), [&](const auto& imu) {
      if (!window.predict(imu)) throw std::runtime_error("an increment was refused");
    });
    auto features = images[k].features;
    if (!window.begin_image(features)) throw std::runtime_error("an image was refused");
    while (window.busy()) window.work(units);
    if (!window.end_image(features)) throw std::runtime_error("an image did not end");
    if constexpr (Window::kPoints > 0) {
      auto points = drive.recognised.at(k);
      if (!window.begin_recognised(points)) throw std::runtime_error("what was recognised was refused");
      while (window.busy()) window.work(units);
      if (!window.end_recognised(points)) throw std::runtime_error("what was recognised did not end");
    }
    if (look) look(window, k);
    out.stood += window.stands() ? 1 : 0;
    whole.add(window, images[k], 0.1);
    if (images[k].time_s > 60) late.add(window, images[k], 0.1);
    Eigen::Vector3d p = in_double(window.pose().p_n_m);
    for (int i = 0; i < 3; ++i) p(i) += static_cast<double>(window.origin_um()[static_cast<std::size_t>(i)]) * 1e-6;
    const double square = (p - images[k].p_n_m).squaredNorm();
    sum += square, ++n;
    if (images[k].time_s < start_s + 60) first += square, ++n_first;
    if (images[k].time_s > end_s - 60) last += square, ++n_last;
    const Eigen::Vector3d v = in_double(window.core().velocity_n_mps());
    vv += drive.v_n_mps[k].squaredNorm(), vw += v.dot(drive.v_n_mps[k]);
    out.tilt_rad = (in_double(window.pose().q_nb).row(2) - images[k].r_nb.row(2)).norm();
  }
  out.whole = whole.result();
  if (end_s > 60) out.late = late.result();
  out.rmse_m = std::sqrt(sum / n), out.first_m = std::sqrt(first / n_first), out.last_m = std::sqrt(last / n_last);
  out.scale = vw / vv;
  out.offset_s = static_cast<double>(window.time_offset_s());
  return out;
}

}  // namespace tetap::test
