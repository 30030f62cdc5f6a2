// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/sensors.hpp"

#include <limits>

namespace tetap::sim {
namespace {

constexpr double kSensorsStep_s = 500e-6;
constexpr int kGravitySteps = 200;
constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

double period_s(int rate_hz) { return rate_hz > 0 ? 1.0 / rate_hz : 1.0; }
float single(double x) { return static_cast<float>(x); }

Vector3 three(Chance& chance, double sigma) {
  const double x = chance.normal(sigma);
  const double y = chance.normal(sigma);
  return {x, y, chance.normal(sigma)};
}

}  // namespace

Imu::Imu(const ImuParameters& parameters, double wheel_radius_m, const Earth& earth, std::uint64_t seed)
    : parameters_{parameters},
      period_s_{period_s(parameters.rate_hz)},
      wheel_radius_m_{wheel_radius_m},
      earth_{&earth},
      earth_rate_n_radps_{parameters.earth_rotation ? earth.earth_rate_n_radps() : Vector3{}},
      gravity_n_mps2_{earth.gravity_n_mps2({})},
      body_to_sensor_{parameters.mounting_bs.transposed()},
      uncalibrated_{parameters.accel_matrix.inverse()},
      noise_{seed, Stream::kImuNoise},
      vibration_{seed, Stream::kImuVibration},
      gyro_walk_{walks(parameters.gyro_walk_radps)},
      accel_walk_{walks(parameters.accel_walk_mps2)} {
  Chance turn_on{seed, Stream::kImuTurnOn};
  gyro_bias_ = three(turn_on, parameters.gyro_turn_on_radps);
  accel_bias_ = three(turn_on, parameters.accel_turn_on_mps2);
  gyro_scale_ = three(turn_on, parameters.gyro_scale);
  accel_scale_ = three(turn_on, parameters.scale);
}

Imu::Processes Imu::walks(double sigma) {
  const auto one = [&] { return GaussMarkov{sigma, parameters_.walk_tau_s, period_s_, noise_}; };
  return Processes{one(), one(), one()};
}

void Imu::sense(const Motion& motion, double speed_mps, base::Micros now, const Faults& faults) {
  speed_mps_ = speed_mps;
  if (until_gravity_-- == 0) {
    gravity_n_mps2_ = earth_->gravity_n_mps2(motion.position_n_m);
    until_gravity_ = kGravitySteps - 1;
  }
  const Matrix3 to_b = rotation(motion.attitude_rad).transposed();
  const Vector3 coriolis = 2 * cross(earth_rate_n_radps_, motion.velocity_n_mps);
  const Vector3& position_b_m = parameters_.position_b_m;
  const Vector3& rate_b_radps = motion.rate_b_radps;
  Vector3 force_b = to_b * (motion.acceleration_n_mps2 + coriolis - gravity_n_mps2_);
  if (position_b_m != Vector3{}) {
    const Vector3 turned = (1 / kSensorsStep_s) * (rate_b_radps - last_rate_radps_.value_or(rate_b_radps));
    force_b = force_b + cross(turned, position_b_m) + cross(rate_b_radps, cross(rate_b_radps, position_b_m));
  }
  last_rate_radps_ = rate_b_radps;
  Vector3 force = body_to_sensor_ * force_b;
  Vector3 rate = body_to_sensor_ * (to_b * earth_rate_n_radps_ + motion.rate_b_radps);

  // Tyre lugs: each axis vibrates with another phase.
  lug_phase_rad_ = wrap(lug_phase_rad_ + parameters_.lugs * speed_mps * kSensorsStep_s / wheel_radius_m_);
  const Direction lug = direction(lug_phase_rad_);
  const double share = magnitude(speed_mps) / parameters_.vibration_speed_mps;
  const Vector3 shape{0.5 * lug.cos, 0.5 * lug.sin, 0.7 * (lug.cos + lug.sin)};
  for (std::size_t i = 0; i < 3; ++i) {
    force[i] = (force[i] + share * parameters_.vibration_mps2 * shape[i]) * (1 + accel_scale_[i]);
    rate[i] = (rate[i] + share * parameters_.vibration_radps * shape[i]) * (1 + gyro_scale_[i]);
  }
  const auto shake = [&](Fault fault, double by_mps2, double by_radps) {
    const auto on = faults.since(fault, now);
    if (!on) return;
    constexpr double kLoose_radps = 2 * kPi * 97;  // a loose mount
    const double swing = sim::sin(kLoose_radps * static_cast<double>(on->us) * 1e-6);
    for (std::size_t i = 0; i < 3; ++i) force[i] += by_mps2 * swing, rate[i] += by_radps * swing;
  };
  shake(Fault::kImuClipping, FaultNumbers::kClipVibration_mps2, FaultNumbers::kClipVibration_radps);
  shake(Fault::kVibration, FaultNumbers::kShake_mps2, FaultNumbers::kShake_radps);

  rate_radps_ = rate;
  force_mps2_ = force;
  bool gyro_clips = false;
  bool accel_clips = false;
  const auto within = [](double raw, double range, bool& clips) {
    clips = clips || magnitude(raw) > range;
    return clamp(raw, -range, range) * kSensorsStep_s;
  };
  Vector3 turn{}, push{};
  for (std::size_t i = 0; i < 3; ++i) {
    turn[i] = within(rate[i], parameters_.gyro_range_radps, gyro_clips);
    push[i] = within(force[i], parameters_.accel_range_mps2, accel_clips);
  }
  // Coning and sculling as in a driver that reads the sensor at 1 kHz. Both are then in the axes at the begin of the
  // sample (Savage 1998; to first order of the angle within it).
  velocity_ = velocity_ + push + cross(angle_ + 0.5 * turn, push);
  angle_ = angle_ + turn + 0.5 * cross(angle_, turn);
  clipped_gyro_ += gyro_clips ? 1 : 0;
  clipped_accel_ += accel_clips ? 1 : 0;
}

sensor::ImuSample Imu::sample(base::Micros now, const Faults& faults) {
  const double root = sim::sqrt(period_s_);
  const double share = magnitude(speed_mps_) / parameters_.vibration_speed_mps;
  sensor::ImuSample s{.temperature_degC = single(parameters_.temperature_degC),
                      .interval_us = static_cast<std::uint16_t>(sim::floor(period_s_ * 1e6 + 0.5)),
                      .clipped_gyro = static_cast<std::uint8_t>(clipped_gyro_),
                      .clipped_accel = static_cast<std::uint8_t>(clipped_accel_)};
  stepped_ = faults.active(Fault::kGyroBiasStep, now);
  for (std::size_t i = 0; i < 3; ++i) {
    double gyro_bias = gyro_bias_[i] + gyro_walk_[i].next(noise_);
    if (stepped_ && i == 2) gyro_bias += FaultNumbers::kGyroStep_radps;
    const double accel_bias = accel_bias_[i] + accel_walk_[i].next(noise_);
    const double angle_noise = noise_.normal(parameters_.gyro_noise * root) +
                               vibration_.normal(parameters_.vibration_gyro_noise * share * root);
    const double velocity_noise = noise_.normal(parameters_.accel_noise[i] * root) +
                                  vibration_.normal(parameters_.vibration_noise * share * root);
    s.dangle_b_rad[i] = single(angle_[i] + (gyro_bias + parameters_.gyro_bias_radps[i]) * period_s_ + angle_noise);
    velocity_[i] += accel_bias * period_s_ + velocity_noise;
  }
  const Vector3 shown = uncalibrated_ * velocity_ + period_s_ * parameters_.accel_bias_mps2;
  for (std::size_t i = 0; i < 3; ++i) s.dvelocity_b_mps[i] = single(shown[i]);
  angle_ = velocity_ = {};
  clipped_gyro_ = clipped_accel_ = 0;
  if (!faults.active(Fault::kImuStuck, now)) last_ = s;
  return last_;
}

Imu::Signals Imu::signals() const {
  const Vector3 bias = gyro_bias_radps();
  Vector3 felt;
  for (std::size_t i = 0; i < 3; ++i) felt[i] = force_mps2_[i] + accel_bias_[i] + accel_walk_[i].value();
  return {.rate_radps = rate_radps_ + bias,
          .force_mps2 = uncalibrated_ * felt + parameters_.accel_bias_mps2,
          .vibration_share = magnitude(speed_mps_) / parameters_.vibration_speed_mps};
}

Vector3 Imu::gyro_bias_radps() const {
  Vector3 bias;
  for (std::size_t i = 0; i < 3; ++i) bias[i] = gyro_bias_[i] + gyro_walk_[i].value() + parameters_.gyro_bias_radps[i];
  if (stepped_) bias[2] += FaultNumbers::kGyroStep_radps;
  return bias;
}

Vector3 Imu::accel_bias_mps2() const {
  const Vector3 level = body_to_sensor_ * Vector3{0, 0, earth_->gravity_mps2()};
  Vector3 felt;
  for (std::size_t i = 0; i < 3; ++i)
    felt[i] = level[i] * (1 + accel_scale_[i]) + accel_bias_[i] + accel_walk_[i].value();
  return uncalibrated_ * felt + parameters_.accel_bias_mps2 - level;
}

Wheels::Wheels(const WheelSensorNumbers& parameters, const VehicleParameters& vehicle, std::uint64_t seed)
    : parameters_{parameters}, nominal_track_m_{vehicle.track_m}, chance_{seed, Stream::kWheels} {
  const double per_count_m = 2 * kPi * vehicle.wheel_radius_m / parameters.counts_per_turn;
  left_.drawn_per_count = per_count_m * (1 + 0.5 * vehicle.drawn_difference);
  right_.drawn_per_count = per_count_m * (1 - 0.5 * vehicle.drawn_difference);
  left_.metres_per_count = left_.drawn_per_count * (1 + 0.5 * vehicle.radius_difference);
  right_.metres_per_count = right_.drawn_per_count * (1 - 0.5 * vehicle.radius_difference);
  for (Wheel* wheel : {&left_, &right_}) {
    wheel->offset = static_cast<std::uint16_t>(65536 * chance_.uniform());
    wheel->travel_m = wheel->metres_per_count * chance_.uniform();  // nobody parks on an edge of the encoder
  }
  if (parameters.speed_scale > 0) speed_scale_ += chance_.normal(parameters.speed_scale);
}

void Wheels::sense(const Motion& motion, base::Micros now, const Faults& faults) {
  double left_m = motion.rim_left_m;
  double right_m = motion.rim_right_m;
  if (faults.active(Fault::kSlipLeft, now)) left_m += FaultNumbers::kSpin_mps * kSensorsStep_s;
  if (faults.active(Fault::kSlipRight, now)) right_m += FaultNumbers::kSpin_mps * kSensorsStep_s;
  if (faults.active(Fault::kWheelSpin, now)) right_m += FaultNumbers::kFreeWheel_mps * kSensorsStep_s;
  if (faults.active(Fault::kWheelStuck, now)) left_m = 0;
  if (const auto on = faults.since(Fault::kEncoderDropout, now); on && on->us / FaultNumbers::kDropout_us % 2 == 0)
    right_m = 0;
  left_.travel_m += left_m;
  left_.unread_m += left_m;
  right_.travel_m += right_m;
  right_.unread_m += right_m;
}

void Wheels::read() {
  for (Wheel* wheel : {&left_, &right_}) {
    const double share_m = parameters_.noise_share * wheel->unread_m;
    wheel->travel_m +=
        chance_.normal() * sim::sqrt(parameters_.noise_m * magnitude(wheel->unread_m) + share_m * share_m);
    wheel->unread_m = 0;
    wheel->read = wheel->count;
    wheel->count = static_cast<std::int64_t>(sim::floor(wheel->travel_m / wheel->metres_per_count));
  }
}

sensor::WheelCounts Wheels::counts() {
  read();
  const auto wrapped = [](const Wheel& w) {
    return static_cast<std::uint16_t>(static_cast<std::uint64_t>(w.count) + w.offset);
  };
  return {.left = wrapped(left_), .right = wrapped(right_)};
}

sensor::WheelSpeeds Wheels::wheel_speeds() {
  read();
  const auto speed = [this](const Wheel& w, double scale) {
    return single(static_cast<double>(w.count - w.read) * w.drawn_per_count * parameters_.rate_hz * scale);
  };
  return {.left_mps = speed(left_, parameters_.stated_scale[0]),
          .right_mps = speed(right_, parameters_.stated_scale[1])};
}

sensor::BodySpeed Wheels::body_speed() {
  read();
  const auto speed = [this](const Wheel& w) {
    return static_cast<double>(w.count - w.read) * w.drawn_per_count * parameters_.rate_hz;
  };
  const double left = speed(left_), right = speed(right_);
  double forward = 0.5 * (left + right) * speed_scale_;
  const double noise_mps = chance_.normal(parameters_.speed_noise_mps);
  if (magnitude(forward) > 0) forward += noise_mps;  // a speedometer at rest shows 0
  const double turn = (right - left) / nominal_track_m_ * parameters_.stated_scale[1];
  return {.forward_mps = single(forward * parameters_.stated_scale[0]),
          .yaw_rate_radps = parameters_.yaw_rate ? single(turn) : kNone};
}

Gnss::Gnss(const GnssParameters& parameters, const Earth& earth, std::uint64_t seed)
    : parameters_{parameters},
      earth_{&earth},
      period_s_{period_s(parameters.rate_hz)},
      noise_{seed, Stream::kGnssNoise},
      outage_chance_{seed, Stream::kGnssOutage},
      glitch_chance_{seed, Stream::kGnssGlitch},
      accuracy_chance_{seed, Stream::kGnssAccuracy},
      correlated_{GaussMarkov{parameters.correlated_m, parameters.correlated_tau_s, period_s_, noise_},
                  GaussMarkov{parameters.correlated_m, parameters.correlated_tau_s, period_s_, noise_},
                  GaussMarkov{parameters.correlated_m * parameters.vertical_factor, parameters.correlated_tau_s,
                              period_s_, noise_}},
      accuracy_{parameters.accuracy_error, 20, period_s_, accuracy_chance_} {}

void Gnss::advance_errors(base::Micros now) {
  for (auto& error : correlated_) error.next(noise_);
  accuracy_.next(accuracy_chance_);

  const bool quiet = now < parameters_.quiet_start;
  const bool begins = parameters_.outage_every_s > 0 && outage_chance_.happens(period_s_ / parameters_.outage_every_s);
  const double lasts_s = outage_chance_.uniform(parameters_.outage_min_s, parameters_.outage_max_s);
  if (begins && !quiet && now >= outage_until_)
    outage_until_ = now + base::Micros{static_cast<std::int64_t>(lasts_s * 1e6)};

  const bool strikes = glitch_chance_.happens(parameters_.glitch_probability);
  const double size_m = glitch_chance_.uniform(parameters_.glitch_min_m, parameters_.glitch_max_m);
  const Direction towards = direction(glitch_chance_.uniform(-kPi, kPi));
  const int fixes = 1 + static_cast<int>(parameters_.glitch_fixes_max * glitch_chance_.uniform());
  if (glitch_fixes_ > 0) --glitch_fixes_;
  if (strikes && !quiet && glitch_fixes_ == 0)
    glitch_fixes_ = fixes, glitch_m_ = {size_m * towards.cos, size_m * towards.sin};
}

Gnss::Reading Gnss::sample(const Truth& truth, base::Micros now, const Faults& faults) {
  advance_errors(now);
  const Vector3 white = three(noise_, parameters_.white_m);
  Vector3 velocity_noise = three(noise_, parameters_.velocity_mps);
  velocity_noise[2] *= parameters_.velocity_vertical_factor;

  const Vector3& l = parameters_.antenna_b_m;
  const Matrix3 to_n = rotation({truth.roll_rad, truth.pitch_rad, truth.yaw_rad});
  const Vector3 antenna_n_m = Vector3{truth.x_m, truth.y_m, truth.z_m} + to_n * l;
  const Vector3 swing_n = to_n * cross(truth.rate_b_radps, l);

  // Errors, by chance and by fault, are to the east, north and up of the antenna's place.
  const Matrix3 axes = earth_->axes(antenna_n_m);
  Vector3 error_m{correlated_[0].value() + white[0], correlated_[1].value() + white[1],
                  correlated_[2].value() + white[2] * parameters_.vertical_factor};
  if (glitch_fixes_ > 0) error_m[0] += glitch_m_[0], error_m[1] += glitch_m_[1];
  if (faults.active(Fault::kGnssJump, now)) error_m[0] += FaultNumbers::kJump_m;
  if (const auto on = faults.since(Fault::kGnssRamp, now))
    error_m[1] += FaultNumbers::kRamp_mps * static_cast<double>(on->us) * 1e-6;
  const auto lost = faults.since(Fault::kGnssFar, now);
  const bool silent = lost && lost->us < FaultNumbers::kFarSilent_us;
  if (lost && !silent && far_fixes_++ < FaultNumbers::kFarFixes) error_m[0] -= FaultNumbers::kFar_m;
  if (faults.active(Fault::kGnssWrongHeight, now)) error_m[2] += FaultNumbers::kHeight_m;

  const double assumed = clamp(1 + accuracy_.value(), 0.5, 2);
  const double sigma_m =
      sim::sqrt(parameters_.white_m * parameters_.white_m + parameters_.correlated_m * parameters_.correlated_m) *
      assumed * parameters_.accuracy_scale;
  const GeodeticPoint point = earth_->geodetic(antenna_n_m + axes * error_m);
  Reading reading;
  reading.position = sensor::GnssPosition{.latitude_2ndeg = point.latitude_2ndeg,
                                          .longitude_2ndeg = point.longitude_2ndeg,
                                          .height_m = single(point.height_m),
                                          .horizontal_acc_m = single(sigma_m),
                                          .vertical_acc_m = single(sigma_m * parameters_.vertical_factor),
                                          .fix = sensor::GnssFix::kDifferential,
                                          .satellites = 14};
  const Vector3 v = axes.transposed() * (truth.v_n_mps + swing_n) + velocity_noise;
  reading.velocity = sensor::GnssVelocity{.v_n_mps = {single(v[0]), single(v[1]), single(v[2])},
                                          .acc_mps = single(parameters_.velocity_mps * assumed)};

  if (now < outage_until_ && last_.position) {
    // A receiver that lost the sky goes on talking: its last position, and the word that it is none.
    sensor::GnssPosition none = *last_.position;
    none.fix = sensor::GnssFix::kNone;
    none.satellites = 2;
    none.horizontal_acc_m = none.vertical_acc_m = kNone;
    reading = {.position = none, .velocity = std::nullopt};
  } else if (faults.active(Fault::kGnssFrozen, now) && last_.position) {
    reading = last_;
  } else {
    last_ = reading;
  }
  if (silent || faults.active(Fault::kGnssOutage, now)) return {};
  return reading;
}

Magnetometer::Magnetometer(const MagnetometerNumbers& parameters, const Earth& earth, std::uint64_t seed)
    : parameters_{parameters},
      earth_{&earth},
      field_uT_{parameters.field_uT * sim::cos(parameters.dip_rad) * sim::sin(parameters.declination_rad),
                parameters.field_uT * sim::cos(parameters.dip_rad) * sim::cos(parameters.declination_rad),
                -parameters.field_uT * sim::sin(parameters.dip_rad)},
      body_to_sensor_{parameters.mounting_bs.transposed()},
      uncalibrated_{parameters.soft_iron.inverse()},
      noise_{seed, Stream::kMagnetometer},
      local_{GaussMarkov{parameters.local_uT, parameters.local_tau_s, period_s(parameters.rate_hz), noise_},
             GaussMarkov{parameters.local_uT, parameters.local_tau_s, period_s(parameters.rate_hz), noise_},
             GaussMarkov{parameters.local_uT, parameters.local_tau_s, period_s(parameters.rate_hz), noise_}} {
  Chance turn_on{seed, Stream::kMagnetometerTurnOn};
  hard_iron_uT_ = three(turn_on, parameters.hard_iron_uT);
  scale_ = three(turn_on, parameters.scale);
}

sensor::MagneticFlux Magnetometer::sample(const Truth& truth, base::Micros now, const Faults& faults) {
  Vector3 field = field_uT_;
  // Iron in the ground passes by at the vehicle's speed; where it stands, nothing changes.
  for (std::size_t i = 0; i < 3; ++i)
    field[i] += magnitude(truth.speed_mps) > 0.05 ? local_[i].next(noise_) : local_[i].value();
  if (faults.active(Fault::kMagDisturbance, now)) field[0] += FaultNumbers::kIron_uT;
  const Vector3 field_n = earth_->axes({truth.x_m, truth.y_m, truth.z_m}) * field;
  const Vector3 field_s = body_to_sensor_ * to_body({truth.roll_rad, truth.pitch_rad, truth.yaw_rad}, field_n);
  const Vector3 white = three(noise_, parameters_.noise_uT);
  Vector3 felt;
  for (std::size_t i = 0; i < 3; ++i) felt[i] = field_s[i] * (1 + scale_[i]) + hard_iron_uT_[i] + white[i];
  const Vector3 shown = uncalibrated_ * felt + parameters_.found_hard_iron_uT;
  return {.flux_b_uT = {single(shown[0]), single(shown[1]), single(shown[2])}};
}

Barometer::Barometer(const BarometerNumbers& parameters, const Earth& earth, std::uint64_t seed)
    : parameters_{parameters},
      earth_{&earth},
      noise_{seed, Stream::kBarometer},
      offset_Pa_{noise_.normal(parameters.turn_on_Pa)},
      drift_{parameters.drift_Pa, parameters.drift_tau_s, period_s(parameters.rate_hz), noise_} {}

sensor::AirPressure Barometer::sample(const Truth& truth) {
  // Troposphere: 101325 Pa, 288.15 K, 6.5 K/km.
  const double share = 1 - 0.0065 / 288.15 * earth_->place({truth.x_m, truth.y_m, truth.z_m}).height_m;
  const double standard_Pa = 101'325 * sim::exp(5.25588 * base::log(share));
  const double noise_Pa = noise_.normal(parameters_.noise_Pa);
  return {.pressure_Pa = single(standard_Pa + offset_Pa_ + drift_.next(noise_) + noise_Pa),
          .temperature_degC = single(parameters_.temperature_degC)};
}

Camera::Camera(const CameraNumbers& parameters, std::vector<Landmark> landmarks, std::uint64_t seed)
    : parameters_{parameters},
      landmarks_{std::move(landmarks)},
      map_{landmarks_},
      noise_{seed, Stream::kCamera},
      wrong_{seed, Stream::kCameraWrong},
      outlier_{seed, Stream::kFaultOutlier},
      clutter_{seed, Stream::kClutter},
      mover_noise_{seed, Stream::kMovers} {
  Chance survey{seed, Stream::kSurvey};
  for (auto& landmark : map_) {
    landmark.x_m += survey.normal(parameters.survey_m);
    landmark.y_m += survey.normal(parameters.survey_m);
  }
  place_movers(mover_noise_);
}

/// Each begins beside a landmark, on a line of any direction.
void Camera::place_movers(Chance& chance) {
  for (int i = 0; i < parameters_.movers && !landmarks_.empty(); ++i) {
    const auto nearest = static_cast<std::size_t>(static_cast<double>(landmarks_.size()) * chance.uniform());
    const double x_m = landmarks_[nearest].x_m + chance.uniform(-2, 2);
    const double y_m = landmarks_[nearest].y_m + chance.uniform(-2, 2);
    const Direction along = direction(chance.uniform(-kPi, kPi));
    movers_.push_back({x_m, y_m, along, chance.uniform(0, 2 * parameters_.mover_way_m)});
  }
}

Camera::Line Camera::line_from(const Place& eye, double x_m, double y_m) const {
  const double dx = x_m - eye.x_m, dy = y_m - eye.y_m;
  const double range_m = sim::sqrt(dx * dx + dy * dy);
  const double bearing_rad = wrap(sim::atan2(dy, dx) - eye.yaw_rad - parameters_.yaw_rad);
  return {range_m, bearing_rad,
          range_m <= parameters_.range_max_m && magnitude(bearing_rad) <= 0.5 * parameters_.field_of_view_rad};
}

sensor::LandmarkSighting Camera::nameless(double range_m, double bearing_rad) {
  return {
      .landmark = kNoLandmark, .range_m = single(range_m > 0 ? range_m : 0), .bearing_rad = single(wrap(bearing_rad))};
}

void Camera::add_movers(const Place& eye, base::Micros now, std::vector<Seen>& seen) {
  const double way_m = parameters_.mover_mps * static_cast<double>(now.us) * 1e-6;
  const double round_m = 2 * parameters_.mover_way_m;
  for (const Mover& mover : movers_) {
    const double rounds = (mover.phase_m + way_m) / round_m;
    const double on_m = round_m * (rounds - sim::floor(rounds));
    const double at_m = on_m < parameters_.mover_way_m ? on_m : round_m - on_m;
    const Line line = line_from(eye, mover.x_m + at_m * mover.along.cos, mover.y_m + at_m * mover.along.sin);
    const double range_noise =
        mover_noise_.normal(parameters_.sigma_range_m + parameters_.sigma_range_per_m * line.range_m);
    const double bearing_noise = mover_noise_.normal(parameters_.sigma_bearing_rad);
    if (line.visible) seen.push_back({nameless(line.range_m + range_noise, line.bearing_rad + bearing_noise)});
  }
}

void Camera::add_clutter(std::vector<Seen>& seen) {
  if (!(parameters_.clutter > 0)) return;
  const double whole = sim::floor(parameters_.clutter);
  const int count = static_cast<int>(whole) + (clutter_.happens(parameters_.clutter - whole) ? 1 : 0);
  const double half_rad = 0.5 * parameters_.field_of_view_rad;
  for (int i = 0; i < count; ++i) {
    const double range_m = clutter_.uniform(0.5, parameters_.range_max_m);
    seen.push_back({nameless(range_m, clutter_.uniform(-half_rad, half_rad))});
  }
}

std::vector<Camera::Seen> Camera::sample(const Truth& truth, base::Micros now, const Faults& faults) {
  std::vector<Seen> seen;
  const Direction d = direction(truth.yaw_rad);
  const Place eye{.x_m = truth.x_m + d.cos * parameters_.x_b_m - d.sin * parameters_.y_b_m,
                  .y_m = truth.y_m + d.sin * parameters_.x_b_m + d.cos * parameters_.y_b_m,
                  .yaw_rad = truth.yaw_rad};
  for (std::size_t i = 0; i < landmarks_.size(); ++i) {
    const Line line = line_from(eye, landmarks_[i].x_m, landmarks_[i].y_m);
    if (!line.visible) continue;

    const bool missed = noise_.happens(parameters_.miss_probability);
    const double range_noise = noise_.normal(parameters_.sigma_range_m + parameters_.sigma_range_per_m * line.range_m);
    const double bearing_noise = noise_.normal(parameters_.sigma_bearing_rad);
    const bool mistaken = wrong_.happens(parameters_.wrong_id_probability);
    const auto other = static_cast<std::size_t>(static_cast<double>(landmarks_.size()) * wrong_.uniform());
    const bool outlier = outlier_.happens(FaultNumbers::kOutlierShare);
    const double outlier_range_m = outlier_.uniform(FaultNumbers::kOutlierRange_m[0], FaultNumbers::kOutlierRange_m[1]);
    const double outlier_bearing_rad =
        outlier_.uniform(-FaultNumbers::kOutlierBearing_rad, FaultNumbers::kOutlierBearing_rad);
    if (missed) continue;

    double seen_m = line.range_m * (1 + parameters_.scale_error) + range_noise;
    double seen_rad = line.bearing_rad - parameters_.mount_error_rad + bearing_noise;
    std::size_t named = mistaken ? other : i;
    if (faults.active(Fault::kLandmarkWrongId, now) && (named ^ 1U) < landmarks_.size()) named ^= 1U;
    if (outlier && faults.active(Fault::kLandmarkOutlier, now))
      seen_m += outlier_range_m, seen_rad += outlier_bearing_rad;
    seen.push_back({.sighting = nameless(seen_m, seen_rad), .landmark = landmarks_[i].id});
    if (parameters_.identities) seen.back().sighting.landmark = landmarks_[named].id;
  }
  add_movers(eye, now, seen);
  add_clutter(seen);
  return seen;
}

}  // namespace tetap::sim
