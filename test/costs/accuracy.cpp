// SPDX-License-Identifier: Apache-2.0
// Accuracy of every row of list.hpp on the common scenario, as JSON: tetap-costs [--track]. With --track the errors of
// seed 1 over the steps instead, for pictures.
#include "costs/contestants.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>

namespace {

using namespace tetap::costs;

struct Sums {
  double squares = 0, nees = 0;
  long steps = 0;
  int dimension = 0;
};
bool track = false;
bool first = true;

/// Squared error of the position, and the squared error of all in units of the covariance.
void compare(Sums& sums, const Estimate& e, const PlanePose& truth) {
  const Eigen::Vector3d off(static_cast<double>(e.pose.x_m - truth.x_m), static_cast<double>(e.pose.y_m - truth.y_m),
                            std::remainder(static_cast<double>(e.pose.yaw_rad - truth.yaw_rad), 2 * M_PI));
  Eigen::Matrix3d p;
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c) p(static_cast<int>(r), static_cast<int>(c)) = static_cast<double>(e.p[r][c]);
  const int n = e.dimension;
  sums.squares += off.head<2>().squaredNorm();
  sums.nees += off.head(n).dot(p.topLeftCorner(n, n).inverse() * off.head(n));
  sums.dimension = n;
  ++sums.steps;
}

void print_head(const char* name, int size, const char* header, const char* takes, const char* grows) {
  std::printf("%s\n{\"filter\": \"%s\", \"size\": %d, \"header\": \"%s\", \"scenario\": \"%s\", \"grows\": \"%s\", ",
              first ? "[" : ",", name, size, header, takes, grows);
  first = false;
}

template <class Contestant>
void run_drive(const char* name, int size, const char* header, const char* takes, const char* grows) {
  Sums sums;
  constexpr bool kAtTheEnd = Contestant::kCounted == kSteps;  // of a job at the end alone its result is judged
  print_head(name, size, header, takes, grows);
  if (track) std::printf("\"error_m\": [");
  for (std::uint32_t seed = 1; seed <= (track ? 1U : static_cast<std::uint32_t>(Contestant::kSeeds)); ++seed) {
    Drive drive(seed, Contestant::kLandmarks);
    const auto filter = std::make_unique<Contestant>();
    filter->start(drive.start());
    for (int k = 0; k < kSteps; ++k) {
      filter->step(drive.next());
      if constexpr (kAtTheEnd)
        if (k != kSteps - 1) continue;
      const Estimate e = filter->estimate();
      if (track)
        std::printf("%s%.4f", k == 0 || kAtTheEnd ? "" : ", ",
                    std::hypot(static_cast<double>(e.pose.x_m - drive.truth().x_m),
                               static_cast<double>(e.pose.y_m - drive.truth().y_m)));
      else
        compare(sums, e, drive.truth());
    }
  }
  if (track)
    std::printf("]}");
  else
    std::printf("\"rmse_m\": %.6g, \"nees\": %.6g, \"nees_dof\": %d, \"seeds\": %d}",
                std::sqrt(sums.squares / static_cast<double>(sums.steps)), sums.nees / static_cast<double>(sums.steps),
                sums.dimension, Contestant::kSeeds);
}

template <class Contestant>
void run_sway(const char* name, int size, const char* header, const char* takes, const char* grows) {
  if (track) return;
  double squares = 0;
  long steps = 0;
  for (std::uint32_t seed = 1; seed <= Contestant::kSeeds; ++seed) {
    Sway sway(seed, 0);
    Contestant filter;
    filter.start();
    for (int k = 0; k < 6000; ++k) {
      filter.step(sway.next());
      if (k < 2000) continue;
      const Eigen::Vector3d up = filter.up_b().template cast<double>();
      const double roll = static_cast<double>(sway.roll_rad());
      const double off = std::atan2(up.cross(Eigen::Vector3d(0, std::sin(roll), std::cos(roll))).norm(),
                                    up.dot(Eigen::Vector3d(0, std::sin(roll), std::cos(roll))));
      squares += off * off;
      ++steps;
    }
  }
  print_head(name, size, header, takes, grows);
  std::printf("\"rmse_deg\": %.6g, \"seeds\": %d}", std::sqrt(squares / static_cast<double>(steps)) * 180 / M_PI,
              Contestant::kSeeds);
}

template <class Contestant>
void run(const char* name, int size, const char* header, const char* takes, const char* grows) {
  if constexpr (std::is_same_v<typename Contestant::Scenario, Drive>)
    run_drive<Contestant>(name, size, header, takes, grows);
  else
    run_sway<Contestant>(name, size, header, takes, grows);
}

}  // namespace

int main(int argc, char** argv) {
  track = argc == 2 && std::strcmp(argv[1], "--track") == 0;
  if (argc > 2 || (argc == 2 && !track)) {
    std::fprintf(stderr, "tetap-costs [--track]\n");
    return 2;
  }
  using namespace tetap;
#define TETAP_COST(name, size, header, takes, grows, ...) run<__VA_ARGS__>(#name, size, header, takes, grows);
#include "costs/list.hpp"
#undef TETAP_COST
  std::printf("\n]\n");
}
