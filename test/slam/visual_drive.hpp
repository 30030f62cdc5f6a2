// SPDX-License-Identifier: Apache-2.0
// A camera's drive as the window filter meets it, recorded or simulated, and the judgement of its path in double.
#pragma once

#include "tetap/slam/speed_core.hpp"
#include "tetap/slam/visual_window.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tetap::test {

struct DriveImage {
  double time_s = 0;
  Eigen::Vector3d speed_b_mps = Eigen::Vector3d::Zero(), rate_b_radps = Eigen::Vector3d::Zero();
  Eigen::Matrix3d r_nb = Eigen::Matrix3d::Identity();  ///< truth
  Eigen::Vector3d p_n_m = Eigen::Vector3d::Zero();
  std::vector<slam::ImageFeature> features;
  bool lost = false;  ///< the image did not come
};

struct Drive {
  model::PinholeCamera camera;
  model::CameraMounting mounting;
  std::vector<DriveImage> images;
  bool means = false;  ///< speed and rate are means of the interval before the image, else samples at its time
};

[[nodiscard]] inline Eigen::Vector3d in_double(const nav::Vector3& v) { return v.cast<double>(); }
[[nodiscard]] inline Eigen::Matrix3d in_double(const nav::Quaternion& q) {
  return Eigen::Quaternionf(q.w, q.x, q.y, q.z).cast<double>().normalized().toRotationMatrix();
}
[[nodiscard]] inline nav::Quaternion in_float(const Eigen::Matrix3d& r) {
  const Eigen::Quaterniond q(r);
  return {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()), static_cast<float>(q.z())};
}
[[nodiscard]] inline Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& r) {
  const Eigen::AngleAxisd turn(r);
  return turn.angle() * turn.axis();
}
[[nodiscard]] inline Eigen::Matrix3d rotation(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, v / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

/// Rows of numbers of a table of tools/dataset/import_kitti_klt, without its header.
[[nodiscard]] inline std::vector<std::vector<double>> read_rows(const std::string& path, std::size_t columns) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream words(line);
    std::vector<double> row;
    for (double value = 0; words >> value;) row.push_back(value);
    if (row.size() != columns) throw std::runtime_error(path + ": row " + std::to_string(rows.size() + 2));
    rows.push_back(row);
  }
  if (rows.empty()) throw std::runtime_error(path + ": no row in it");
  return rows;
}
[[nodiscard]] inline Drive read_drive(const std::string& stem) {
  Drive drive;
  const auto camera = read_rows(stem + ".camera.csv", 11).front();
  const auto f = [&](std::size_t i) { return static_cast<float>(camera[i]); };
  drive.camera = {.fu_px = f(0), .fv_px = f(1), .cu_px = f(2), .cv_px = f(3)};
  drive.mounting = {.q_cb = {f(4), f(5), f(6), f(7)}, .lever_b_m = {f(8), f(9), f(10)}};
  const auto motion = read_rows(stem + ".motion.csv", 7), truth = read_rows(stem + ".truth.csv", 9);
  for (std::size_t k = 0; k < motion.size(); ++k) {
    const auto& m = motion[k];
    const auto& t = truth.at(k);
    DriveImage image;
    image.time_s = m[0];
    image.speed_b_mps = {m[1], m[2], m[3]};
    image.rate_b_radps = {m[4], m[5], m[6]};
    image.p_n_m = {t[1], t[2], t[4]};
    image.r_nb = Eigen::Quaterniond(t[5], t[6], t[7], t[8]).normalized().toRotationMatrix();
    drive.images.push_back(image);
  }
  for (const auto& row : read_rows(stem + ".features.csv", 4))
    drive.images.at(static_cast<std::size_t>(row[0]))
        .features.push_back({static_cast<std::uint16_t>(row[1]), static_cast<std::uint16_t>(row[2]),
                             static_cast<std::uint16_t>(row[3])});
  return drive;
}

/// One image without pacing: the whole job at once.
template <class Window>
void take_image(Window& window, std::vector<slam::ImageFeature> features) {
  if (!window.begin_image(features)) throw std::runtime_error("an image was refused");
  while (window.busy()) window.work(1'000'000);
  if (!window.end_image(features)) throw std::runtime_error("an image did not end");
}

struct PathJudgement {
  double position_m = 0;    ///< mean over time of the root mean square per axis, as the published figures
  double rotation_rad = 0;  ///< likewise
  double nees = 0;          ///< mean over time, six degrees of freedom
  double end_m = 0, path_m = 0;
  double beyond_s = 0;  ///< longest time that one of six errors stayed beyond 3 sigma
  int images = 0;
};

template <class Window>
class PathJudge {
 public:
  void add(const Window& window, const DriveImage& truth, double dt_s) {
    const Eigen::Vector3d origin =
        Eigen::Vector3d(static_cast<double>(window.origin_um()[0]), static_cast<double>(window.origin_um()[1]),
                        static_cast<double>(window.origin_um()[2])) *
        1e-6;
    const Eigen::Vector3d p = in_double(window.pose().p_n_m), true_p = truth.p_n_m - origin;
    const Eigen::Matrix3d r = in_double(window.pose().q_nb);
    const Eigen::Vector3d theta = rotation_vector(truth.r_nb * r.transpose()), miss = true_p - p;
    Eigen::Matrix<double, 6, 1> error, plain;
    error << theta, true_p - rotation(theta) * p;
    plain << theta, miss;
    Eigen::Matrix<double, 6, 6> covariance;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        covariance(i, j) = static_cast<double>(window.covariance()(Window::kCore + i, Window::kCore + j));
    covariance.diagonal().array() += 1e-9;  // the truth's last digits
    nees_ += error.dot(covariance.ldlt().solve(error));
    position_ += miss.norm() / std::sqrt(3.0);
    rotation_ += theta.norm() / std::sqrt(3.0);
    end_ = miss.norm();
    const auto sigma = window.pose_covariance();
    for (int i = 0; i < 6; ++i) {
      auto& run = run_[static_cast<std::size_t>(i)];
      const double bound = 3 * std::sqrt(static_cast<double>(sigma(i, i)) + 1e-9);
      run = std::abs(plain(i)) > bound ? run + dt_s : 0.0;
      beyond_ = std::max(beyond_, run);
    }
    if (count_ > 0) path_ += (truth.p_n_m - before_).norm();
    before_ = truth.p_n_m;
    ++count_;
  }
  [[nodiscard]] PathJudgement result() const {
    return {position_ / count_, rotation_ / count_, nees_ / count_, end_, path_, beyond_, count_};
  }

 private:
  double nees_ = 0, position_ = 0, rotation_ = 0, end_ = 0, path_ = 0, beyond_ = 0;
  std::array<double, 6> run_{};
  Eigen::Vector3d before_ = Eigen::Vector3d::Zero();
  int count_ = 0;
};

/// The window from image `from` to image `to`; it starts at the truth. `eyes` false: dead reckoning alone.
template <class Window>
PathJudgement run_drive(Window& window, const Drive& drive, std::size_t from, std::size_t to, bool eyes = true) {
  const DriveImage& first = drive.images.at(from);
  std::array<std::int64_t, 3> origin_um;
  for (int i = 0; i < 3; ++i) origin_um[static_cast<std::size_t>(i)] = std::llround(first.p_n_m(i) * 1e6);
  window.start(in_float(first.r_nb), 1e-3F, origin_um, 1e-3F);
  PathJudge<Window> judge;
  for (std::size_t k = from; k <= to; ++k) {
    const DriveImage& image = drive.images.at(k);
    double dt_s = 0;
    if (k > from) {
      const DriveImage& before = drive.images[k - 1];
      dt_s = image.time_s - before.time_s;
      const Eigen::Vector3d speed = drive.means ? image.speed_b_mps : (image.speed_b_mps + before.speed_b_mps) / 2;
      const Eigen::Vector3d rate = drive.means ? image.rate_b_radps : (image.rate_b_radps + before.rate_b_radps) / 2;
      if (!window.predict({.speed_b_mps = speed.cast<float>(),
                           .rate_b_radps = rate.cast<float>(),
                           .dt_s = static_cast<float>(dt_s)}))
        throw std::runtime_error("a motion was refused");
    }
    if (eyes && !image.lost) take_image(window, image.features);
    judge.add(window, image, dt_s);
  }
  return judge.result();
}

}  // namespace tetap::test
