// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/antenna.hpp"

#include "sim_host/doctor/remedy.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace tetap::doctor {
namespace {

constexpr double kArmLeastWindows = 30;
constexpr double kArmMostTurn_radps = 1.5;  ///< in a second: more, and the mean of a velocity has lost its size
constexpr double kArmLeast_m = 0.5;         ///< nearer than that an antenna hardly matters beside its noise
constexpr double kArmShown_m = 0.05;        ///< half of the last digit that is shown: less is 0.0
constexpr double kArmSigmas = 8;            ///< slip in turns lasts

using Three = std::array<double, 3>;

/// Solution of a symmetric 3 x 3 system, and the diagonal of its inverse; false: singular. Gauss and Jordan.
bool solve(std::array<Three, 3> a, Three b, Three& x, Three& inverse) {
  std::array<Three, 3> e{Three{1, 0, 0}, Three{0, 1, 0}, Three{0, 0, 1}};
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(a[k][k] > 1e-9)) return false;
    const double scale = 1 / a[k][k];
    for (std::size_t c = 0; c < 3; ++c) a[k][c] *= scale, e[k][c] *= scale;
    b[k] *= scale;
    for (std::size_t r = 0; r < 3; ++r) {
      if (r == k) continue;
      const double share = a[r][k];
      for (std::size_t c = 0; c < 3; ++c) a[r][c] -= share * a[k][c], e[r][c] -= share * e[k][c];
      b[r] -= share * b[k];
    }
  }
  x = b;
  inverse = {e[0][0], e[1][1], e[2][2]};
  return true;
}

}  // namespace

void AntennaDetector::window(const Window& w) {
  if (!w.wheels || !w.velocity_n_mps || !w.turn_s_radps || w.up_s == Vector3{}) return;
  const double v = 0.5 * w.wheels->sum_mps, turn = dot(*w.turn_s_radps, w.up_s);
  if (std::abs(turn) > kArmMostTurn_radps) return;
  const double east = (*w.velocity_n_mps)[0], north = (*w.velocity_n_mps)[1];
  squares_.add({v * v, -2 * v * turn, turn * turn, east * east + north * north});
}

void AntennaDetector::finish(Findings& findings) {
  if (robot_.name.empty() || squares_.count() < kArmLeastWindows) return;
  std::array<Three, 3> a{};
  Three b{}, found{}, inverse{};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 3; ++c) a[r][c] = squares_.product(r, c);
    b[r] = squares_.product(r, 3);
  }
  if (!solve(a, b, found, inverse)) return;
  const double left = squares_.product(3, 3) - found[0] * b[0] - found[1] * b[1] - found[2] * b[2];
  const auto sigma = [&](std::size_t i) {
    return std::sqrt(std::max(0.0, left * inverse[i] / (squares_.count() - 3)));
  };
  const double x0 = static_cast<double>(robot_.parameters.gnss.antenna_x_b_m);
  const double y0 = static_cast<double>(robot_.parameters.gnss.antenna_y_b_m);
  const double length = std::sqrt(std::max(0.0, found[2])), stated = std::hypot(x0, y0);
  const auto differs = [](double size, double by, double its_sigma) {
    return std::abs(size) > kArmLeast_m && std::abs(by) > kArmSigmas * its_sigma;
  };
  const bool aside = differs(found[1] - y0, found[1] - y0, sigma(1));
  if (!aside && !differs(length - stated, found[2] - stated * stated, sigma(2))) return;
  const double ahead = std::sqrt(std::max(0.0, found[2] - found[1] * found[1]));
  const bool beside = ahead < kArmShown_m;
  const auto at = [&](double x_m) -> Remedy {
    return {{.path = "gnss.antenna_x_b_m", .values = {five_digits(x_m)}},
            {.path = "gnss.antenna_y_b_m", .values = {five_digits(found[1])}}};
  };
  findings.push_back(
      {.code = Code::kAntennaArm,
       .uses = kWheels | kGyroscope | kAccelerometer | kGnssVelocity,
       .evidence =
           text("By its speed in turns the antenna lies %.1f m to the left of the body's origin (sigma %.2f) and "
                "%.1f m ahead of it or behind; stated are %.1f m and %.1f m (%.0f s).",
                found[1], sigma(1), ahead, y0, x0, squares_.count()),
       .change = beside ? text("Measure the antenna's place. By the speeds gnss.antenna_y_b_m is %.1f and "
                               "gnss.antenna_x_b_m is 0.0.",
                               found[1])
                        : text("Measure the antenna's place. By the speeds gnss.antenna_y_b_m is %.1f and "
                               "gnss.antenna_x_b_m is %.1f or %.1f.",
                               found[1], ahead, -ahead),
       .remedies = beside ? std::vector<Remedy>{at(0)} : std::vector<Remedy>{at(ahead), at(-ahead)}});
}

}  // namespace tetap::doctor
