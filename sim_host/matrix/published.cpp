// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/published.hpp"

#include "sim_host/replay/names.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace tetap::sim {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kTick_s = 0.01;
constexpr double kBeyond = 1.5, kInside = 1, kFarOut = 10;  ///< times three sigma
constexpr double kCleanTimes = 2;

double wide(float x) { return static_cast<double>(x); }
double metres(std::int32_t raw) { return raw == bus::EstPos::kXNotAvailable ? kNone : raw * bus::EstPos::kXScale; }

/// Rotation vector, in n, of the turn from the true attitude to the estimated one.
Vector3 attitude_error(const std::array<double, 4>& q, const Vector3& true_rpy) {
  const auto [w, x, y, z] = q;
  const Matrix3 estimate{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
                          1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
                          1 - 2 * (x * x + y * y)}};
  const Matrix3 d = estimate * rotation(true_rpy).transposed();
  const Vector3 axis{d.m[7] - d.m[5], d.m[2] - d.m[6], d.m[3] - d.m[1]};
  const double sine = 0.5 * std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
  const double angle = std::atan2(sine, 0.5 * (d.m[0] + d.m[4] + d.m[8] - 1));
  return (sine > 1e-9 ? 0.5 * angle / sine : 0.5) * axis;
}

/// Norm of the error, and its largest component over three sigma; components without a sigma do not count.
template <std::size_t N>
std::pair<double, double> error_of(const std::array<double, N>& error, const std::array<double, N>& sigma) {
  double squares = 0, ratio = kNone;
  for (std::size_t i = 0; i < N; ++i) {
    const double one = std::fabs(error[i]) / (3 * sigma[i]);
    if (!std::isfinite(one)) continue;
    squares += error[i] * error[i];
    ratio = std::isnan(ratio) ? one : std::max(ratio, one);
  }
  return {std::isnan(ratio) ? kNone : std::sqrt(squares), ratio};
}

}  // namespace

void PublishedStates::epoch(const NodeEpoch& epoch, std::size_t tick) {
  tick_ = tick;
  now_.tick = tick;
  bool whole = false;
  for (const base::CanFrame& f : epoch.frames) frame(f, whole);
  if (whole) states_.push_back(now_);
}

/// The primary estimator is the last one: the first frame of each later one begins its state anew.
void PublishedStates::frame(const base::CanFrame& frame, bool& whole) {
  const std::uint32_t offset = frame.id - base_;
  const auto payload = bus::payload(frame);
  if (offset == bus::EstStatus::kOffset) return status(payload);
  if (offset < bus::EstPos::kOffset) return;
  const std::size_t k = (offset - bus::EstPos::kOffset) / bus::EstPos::kStride;
  if (k >= bus::EstPos::kCount) return;
  const auto own = static_cast<std::uint32_t>(offset - k * bus::EstPos::kStride);
  if (own == bus::EstPos::kOffset) {
    const auto position = bus::decode<bus::EstPos>(payload);
    if (!position) return;
    now_.position_m[0] = metres(position->x_raw);
    now_.position_m[1] = metres(position->y_raw);
    now_.position_m[2] = kNone;
    now_.velocity_mps.fill(kNone);
    now_.q_nb.fill(kNone);
    whole = false;
  } else if (own == bus::EstMotion::kOffset) {
    const auto motion = bus::decode<bus::EstMotion>(payload);
    if (!motion) return;
    now_.yaw_rad = wide(motion->yaw_rad);
    now_.valid = {motion->pos_valid, motion->vel_valid, motion->hdg_valid, motion->hdg_valid};
  } else if (own == bus::EstStdPose::kOffset) {
    const auto pose = bus::decode<bus::EstStdPose>(payload);
    if (!pose) return;
    now_.std_position_m[0] = wide(pose->std_x_m);
    now_.std_position_m[1] = wide(pose->std_y_m);
    now_.std_yaw_rad = wide(pose->std_yaw_rad);
    whole = true;
  } else {
    more(own, payload);
  }
}

void PublishedStates::more(std::uint32_t offset, std::span<const std::uint8_t> payload) {
  if (offset == bus::EstAtt::kOffset) {
    if (const auto q = bus::decode<bus::EstAtt>(payload)) now_.q_nb = {wide(q->w), wide(q->x), wide(q->y), wide(q->z)};
  } else if (offset == bus::EstVel::kOffset) {
    if (const auto v = bus::decode<bus::EstVel>(payload))
      now_.velocity_mps = {wide(v->east_mps), wide(v->north_mps), wide(v->up_mps)};
  } else if (offset == bus::EstStateHeight::kOffset) {
    if (const auto height = bus::decode<bus::EstStateHeight>(payload)) {
      now_.position_m[2] = wide(height->height_m);
      now_.std_position_m[2] = wide(height->std_height_m);
    }
    if (const auto s = bus::decode<bus::EstStateStdVel>(payload))
      now_.std_velocity_mps = {wide(s->std_vel_east_mps), wide(s->std_vel_north_mps), wide(s->std_vel_up_mps)};
    if (const auto s = bus::decode<bus::EstStateStdTilt>(payload))
      now_.std_tilt_rad = {wide(s->std_tilt_east_rad), wide(s->std_tilt_north_rad)};
    if (const auto s = bus::decode<bus::EstStateSources>(payload)) {
      const auto source = [this](const char* of, sensor::SourceState state) {
        if (state == sensor::SourceState::kRejecting || state == sensor::SourceState::kDistrusted)
          word(std::string(of) + " " + std::string(name(state)));
      };
      source("Imu", s->imu_state);
      source("GnssPosition", s->position_state);
      source("GnssVelocity", s->velocity_state);
      source("Wheels", s->wheel_state);
      source("ForwardSpeed", s->speed_state);
      source("Heading", s->heading_state);
      source("Magnetometer", s->mag_state);
      source("Barometer", s->baro_state);
    }
  }
}

void PublishedStates::status(std::span<const std::uint8_t> payload) {
  const auto s = bus::decode<bus::EstStatus>(payload);
  if (!s) return;
  if (s->mode != sensor::Mode::kNominal) word(std::string(name(s->mode)));
  for (unsigned bit = 0; bit < 16; ++bit)
    if ((s->faults >> bit & 1) != 0) word("fault " + std::to_string(bit));
  if (resets_ && *resets_ != s->reset_ctr) word("reset " + std::string(name(s->reset_cause)));
  resets_ = s->reset_ctr;
}

std::vector<Judged> judged(std::span<const PublishedState> states, const CleanLog& log, const GeodeticOrigin& origin) {
  const FrameChange change(Earth(log.origin), Earth(origin));
  std::vector<Judged> all;
  all.reserve(states.size());
  for (const PublishedState& s : states) {
    const Truth t = log.recorded ? log.truth[s.tick] : in_frame(log.truth[s.tick], change);
    Judged j{.tick = s.tick, .error = {}, .ratio = {}, .valid = s.valid};
    const Vector3 turn = attitude_error(s.q_nb, {t.roll_rad, t.pitch_rad, t.yaw_rad});
    const auto put = [&j](Quantity q, std::pair<double, double> found) {
      j.error[static_cast<std::size_t>(q)] = found.first;
      j.ratio[static_cast<std::size_t>(q)] = found.second;
    };
    put(Quantity::kPosition, error_of(s.position_m - Vector3{t.x_m, t.y_m, t.z_m}, s.std_position_m));
    const Vector3 unknown{kNone, kNone, kNone};  // differences of a track are no velocity to judge by
    const Vector3 off_mps = log.recorded ? unknown : s.velocity_mps - t.v_n_mps;
    put(Quantity::kVelocity, error_of(off_mps, s.std_velocity_mps));
    put(Quantity::kHeading, error_of<1>({std::remainder(s.yaw_rad - t.yaw_rad, 2 * kPi)}, {s.std_yaw_rad}));
    put(Quantity::kTilt, error_of<2>({turn[0], turn[1]}, s.std_tilt_rad));
    all.push_back(j);
  }
  return all;
}

std::array<Figures, kQuantities> compare(std::span<const Judged> run, std::span<const Judged> clean,
                                         std::size_t end_tick) {
  std::array<Figures, kQuantities> all;
  for (std::size_t q = 0; q < kQuantities; ++q) {
    Figures& f = all[q];
    double last_bad_s = 0, clean_error = 0;
    std::size_t c = 0;
    bool clean_valid = false;
    for (std::size_t i = 0; i < run.size(); ++i) {
      for (; c < clean.size() && clean[c].tick <= run[i].tick; ++c) {
        clean_valid = clean[c].valid[q];
        if (!std::isfinite(clean[c].ratio[q]) || !clean_valid) continue;
        clean_error = std::max(clean_error, clean[c].error[q]);
        f.clean_ratio = std::max(f.clean_ratio, clean[c].ratio[q]);
      }
      const Judged& j = run[i];
      const double span_s = i + 1 < run.size() ? kTick_s * static_cast<double>(run[i + 1].tick - j.tick) : 0;
      const bool known = std::isfinite(j.ratio[q]) && j.valid[q];
      const bool worse = known && j.error[q] > kCleanTimes * clean_error;
      if (known) {
        f.worst_ratio = std::max(f.worst_ratio, j.ratio[q]);
        f.worst_error = std::max(f.worst_error, j.error[q]);
      }
      if (worse && j.ratio[q] > kBeyond) f.beyond_s += span_s;
      if (worse && j.ratio[q] > kFarOut) f.valid_while_out_s += span_s;
      const bool bad = known ? worse && j.ratio[q] > kInside : clean_valid && !j.valid[q];
      if (bad && j.tick >= end_tick) last_bad_s = kTick_s * static_cast<double>(j.tick - end_tick) + span_s;
    }
    f.clean_error = clean_error;
    f.inside_after_s = last_bad_s;
    const double lasted_s =
        run.empty() ? 0 : kTick_s * static_cast<double>(run.back().tick - std::min(run.back().tick, end_tick));
    if (last_bad_s > 0 && last_bad_s >= lasted_s - 2 * kTick_s) f.inside_after_s = std::nullopt;
  }
  return all;
}

}  // namespace tetap::sim
