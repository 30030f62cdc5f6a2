// SPDX-License-Identifier: Apache-2.0
// Runs an attitude filter over a recorded IMU log, for tools/report/compare_attitude: attitude_log FILTER IN OUT
// [option=value...]. IN: rows of ten little-endian floats: interval since the row before (s), gyroscope (rad/s),
// accelerometer (m/s^2), magnetometer. OUT: one row each of q_nb (w x y z), gyroscope bias (rad/s) and flags. Flags:
// 1 rest, 2 accelerometer, 4 magnetometer disturbed. The option names are those of AttitudeOptions,
// gyroscope_range_radps and accelerometer_range_mps2. Madgwick's filter (2010) is here as it was published, to show
// that the errors are measured as the published ones were.
#include "tetap/filter/attitude.hpp"
#include "tetap/filter/mahony.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace {

using namespace tetap;
using filter::AttitudeOptions;
using filter::Quaternion;
using filter::SensorRange;
using filter::Vector3;

struct Row {
  float dt_s;
  std::array<float, 3> gyro, force, field;
};
struct Answer {
  Quaternion q_nb{};
  std::array<float, 3> bias{};
  float flags = 0.0F;
};
static_assert(sizeof(Row) == 40 && sizeof(Answer) == 32);

Vector3 vector(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }
std::array<float, 3> array(const Vector3& v) { return {v(0), v(1), v(2)}; }

/// An attitude from one sample of each, where a filter has no start of its own.
Quaternion first_attitude(const Row& row) {
  AttitudeOptions options;
  filter::Attitude start(options);
  static_cast<void>(start.step(Vector3::Zero(), vector(row.force), row.dt_s));
  start.magnetometer(vector(row.field), row.dt_s);
  return start.q_nb();
}

/// Gradient descent (Madgwick 2010, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays",
/// eq. 25 to 34 and 45). North is the first axis as there, because the radial part of the gradient depends on it.
class Madgwick {
 public:
  double beta = 0.12;
  std::array<double, 4> q{1, 0, 0, 0};  ///< body to (north, west, up)

  void step(const Row& row, bool nine) {
    const auto dt = static_cast<double>(row.dt_s);
    const std::array<double, 4> omega{0, static_cast<double>(row.gyro[0]), static_cast<double>(row.gyro[1]),
                                      static_cast<double>(row.gyro[2])};
    std::array<double, 4> rate = product(q, omega);
    for (double& r : rate) r *= 0.5;
    std::array<double, 4> gradient{};
    add_gradient(gradient, {0, 0, 1}, unit(row.force));
    if (nine) {
      const std::array<double, 3> m = unit(row.field);
      const auto r = matrix(q);
      std::array<double, 3> h{};
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) h[i] += r[i][j] * m[j];
      add_gradient(gradient, {std::sqrt(h[0] * h[0] + h[1] * h[1]), 0, h[2]}, m);
    }
    double norm = 0;
    for (double g : gradient) norm += g * g;
    norm = std::sqrt(norm);
    double length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      q[i] += (rate[i] - (norm > 0 ? beta * gradient[i] / norm : 0)) * dt;
      length += q[i] * q[i];
    }
    for (double& c : q) c /= std::sqrt(length);
  }

 private:
  using Matrix = std::array<std::array<double, 3>, 3>;

  static std::array<double, 4> product(const std::array<double, 4>& a, const std::array<double, 4>& b) {
    return {
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
  }
  static std::array<double, 3> unit(const std::array<float, 3>& v) {
    const auto x = static_cast<double>(v[0]), y = static_cast<double>(v[1]), z = static_cast<double>(v[2]);
    const double n = std::sqrt(x * x + y * y + z * z);
    return {x / n, y / n, z / n};
  }
  static Matrix matrix(const std::array<double, 4>& p) {
    const auto [w, x, y, z] = p;
    // Both diagonal squares written as the paper has them, so that the derivative by q is the paper's.
    return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
  }
  /// gradient += J^T (R^T d - s)
  void add_gradient(std::array<double, 4>& gradient, const std::array<double, 3>& d,
                    const std::array<double, 3>& s) const {
    const Matrix r = matrix(q);
    std::array<double, 3> f{};
    for (std::size_t j = 0; j < 3; ++j) f[j] = r[0][j] * d[0] + r[1][j] * d[1] + r[2][j] * d[2] - s[j];
    const auto [w, x, y, z] = q;
    const std::array<Matrix, 4> dr{{{{{0, -2 * z, 2 * y}, {2 * z, 0, -2 * x}, {-2 * y, 2 * x, 0}}},
                                    {{{0, 2 * y, 2 * z}, {2 * y, -4 * x, -2 * w}, {2 * z, 2 * w, -4 * x}}},
                                    {{{-4 * y, 2 * x, 2 * w}, {2 * x, 0, 2 * z}, {-2 * w, 2 * z, -4 * y}}},
                                    {{{-4 * z, -2 * w, 2 * x}, {2 * w, -4 * z, 2 * y}, {2 * x, 2 * y, 0}}}}};
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) gradient[c] += dr[c][i][j] * d[i] * f[j];
  }
};

bool set(AttitudeOptions& o, SensorRange& range, std::string_view argument) {
  const std::size_t equals = argument.find('=');
  if (equals == std::string_view::npos) return false;
  const std::string_view name = argument.substr(0, equals);
  char* end = nullptr;
  const float value = std::strtof(argument.data() + equals + 1, &end);
  if (*end != '\0' || end == argument.data() + equals + 1) return false;
  struct Option {
    std::string_view name;
    float AttitudeOptions::*member;
  };
#define OPTION(member) \
  { #member, &AttitudeOptions::member }
  constexpr Option kOptions[] = {OPTION(tau_inclination_s),
                                 OPTION(inclination_limit_radps),
                                 OPTION(inclination_reject_rad),
                                 OPTION(inclination_hold_s),
                                 OPTION(bias_start_sigma_radps),
                                 OPTION(bias_walk_radps),
                                 OPTION(bias_walk_s),
                                 OPTION(bias_limit_radps),
                                 OPTION(bias_motion_sigma_radps),
                                 OPTION(bias_rest_sigma_radps),
                                 OPTION(bias_vertical_weight),
                                 OPTION(rest_after_s),
                                 OPTION(tau_rest_s),
                                 OPTION(rest_rate_radps),
                                 OPTION(rest_acceleration_mps2),
                                 OPTION(tau_heading_s),
                                 OPTION(declination_rad),
                                 OPTION(inclination_sigma_rad),
                                 OPTION(field_deviation_share),
                                 OPTION(field_turn_rad)};
#undef OPTION
  if (name == "gyroscope_range_radps") return range.gyroscope_radps = value, true;
  if (name == "accelerometer_range_mps2") return range.accelerometer_mps2 = value, true;
  for (const Option& option : kOptions)
    if (option.name == name) return o.*option.member = value, true;
  return false;
}

int fail(const std::string& what) {
  std::fprintf(stderr, "attitude_log: %s\n", what.c_str());
  return 2;
}

std::vector<Answer> run(std::string_view which, const std::vector<Row>& rows, const AttitudeOptions& options,
                        const SensorRange& range) {
  std::vector<Answer> answers;
  answers.reserve(rows.size());
  const bool nine = which.ends_with('9');
  if (which.starts_with("tetap")) {
    filter::Attitude attitude(options, range);
    for (const Row& row : rows) {
      static_cast<void>(attitude.step(vector(row.gyro), vector(row.force), row.dt_s));
      if (nine) attitude.magnetometer(vector(row.field), row.dt_s);
      answers.push_back({attitude.q_nb(), array(attitude.bias_b_radps()),
                         (attitude.at_rest() ? 1.0F : 0.0F) + (attitude.accelerometer_disturbed() ? 2.0F : 0.0F) +
                             (attitude.magnetometer_disturbed() ? 4.0F : 0.0F)});
    }
  } else if (which.starts_with("mahony")) {
    filter::Mahony mahony;
    mahony.start(first_attitude(rows.front()));
    for (const Row& row : rows) {
      if (nine)
        mahony.step(vector(row.gyro), vector(row.force), vector(row.field), row.dt_s);
      else
        mahony.step(vector(row.gyro), vector(row.force), row.dt_s);
      answers.push_back({mahony.q_nb(), array(mahony.bias_b_radps()), 0.0F});
    }
  } else {
    Madgwick madgwick;
    constexpr float kHalf = 0.70710678F;
    const Quaternion north_from_east{kHalf, 0.0F, 0.0F, -kHalf};
    const Quaternion q = north_from_east * first_attitude(rows.front());
    madgwick.q = {static_cast<double>(q.w), static_cast<double>(q.x), static_cast<double>(q.y),
                  static_cast<double>(q.z)};
    for (const Row& row : rows) {
      madgwick.step(row, nine);
      const Quaternion q_wb{static_cast<float>(madgwick.q[0]), static_cast<float>(madgwick.q[1]),
                            static_cast<float>(madgwick.q[2]), static_cast<float>(madgwick.q[3])};
      answers.push_back({north_from_east.conjugate() * q_wb, {}, 0.0F});
    }
  }
  return answers;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return fail("FILTER IN OUT [option=value...], FILTER tetap, mahony or madgwick with 6 or 9 after it");
  const std::string which = argv[1];
  if (which != "tetap6" && which != "tetap9" && which != "mahony6" && which != "mahony9" && which != "madgwick6" &&
      which != "madgwick9")
    return fail(which + ": no such filter");
  AttitudeOptions options;
  SensorRange range;
  for (int i = 4; i < argc; ++i)
    if (!set(options, range, argv[i])) return fail(std::string(argv[i]) + ": no such option, or no number");
  std::vector<Row> rows;
  if (std::FILE* in = std::fopen(argv[2], "rb")) {
    Row row;
    std::size_t got = 0;
    while ((got = std::fread(&row, 1, sizeof row, in)) == sizeof row) rows.push_back(row);
    std::fclose(in);
    if (got != 0) return fail(std::string(argv[2]) + ": ends inside a row");
  } else {
    return fail(std::string(argv[2]) + ": " + std::strerror(errno));
  }
  if (rows.empty()) return fail(std::string(argv[2]) + ": has no rows");
  const std::vector<Answer> answers = run(which, rows, options, range);
  std::FILE* out = std::fopen(argv[3], "wb");
  if (out == nullptr) return fail(std::string(argv[3]) + ": " + std::strerror(errno));
  const bool written = std::fwrite(answers.data(), sizeof(Answer), answers.size(), out) == answers.size();
  if (std::fclose(out) != 0 || !written) return fail(std::string(argv[3]) + ": could not be written");
  return 0;
}
