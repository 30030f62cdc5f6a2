// SPDX-License-Identifier: Apache-2.0
// Every estimator behind everything that a sample or a frame can hold: finite states and covariances that are positive
// definite. The judge is eigenvalues in double. No restart comes because an invariant broke.
#include "support/never_nan.hpp"
#include "bench.hpp"
#include "config/rover.hpp"
#include "tetap/estimators/attitude.hpp"
#include "tetap/estimators/inertial/inertial.hpp"
#include "tetap/estimators/odometry.hpp"
#include "tetap/estimators/planar/pose_ekf.hpp"
#include "tetap/firmware/boot_self_check.hpp"
#include "tetap/node/node.hpp"
#include "tetap/sensor/plausibility.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace tetap {
namespace {

using test::kHostile;
using test::least_eigenvalue;

param::Parameters hostile_numbers() {
  param::Parameters n = robot::rover::parameters;
  n.landmark = {.sigma_range_m = 0.1F, .sigma_bearing_rad = 0.02F};
  n.gnss.antenna_x_b_m = 0.3F, n.gnss.antenna_z_b_m = 1.0F;
  n.start = {.known = 1};
  n.magnetic.use = n.baro.use = 1;
  n.magnetic.sigma_rad = 0.02F;  // sharp enough to be worth an update
  return n;
}
const param::Parameters kNumbers = hostile_numbers();

/// The estimators with nothing in front of them: what a wired driver would hand its samples to.
class Wired {
 private:
  [[nodiscard]] auto noting() {
    return [this](std::size_t instance, const sensor::Sample& sample, const estimators::Innovation& innovation) {
      if (innovation.verdict == sensor::Verdict::kAccepted) taken_.insert({instance, sample.sensor});
    };
  }

 public:
  using FusionWindow = node::FusionWindow<
      node::Estimators<estimators::Odometry, estimators::PoseEkf, estimators::Attitude, estimators::Inertial>, 96>;

  Wired() {
    const param::GnssParameters& g = kNumbers.gnss;
    map_frame_.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
    map_frame_.origin = sensor::OriginSource::kConfigured;
    map_frame_.map = &map_;
    EXPECT_TRUE(map_.put({.x_mm = 5000, .y_mm = 2000, .id = 1}));
    history_.power_on(now_, context());
  }
  /// False: refused at the door.
  bool offer(const sensor::Sample& sample) {
    if (!sensor::plausible(sample)) return false;
    if (sample.stamp > history_.closed_until() && sample.stamp <= now_ + base::Micros{200'000})
      static_cast<void>(history_.insert(sample, context(), noting()));
    return true;
  }
  void tick() {
    now_ += base::Micros{10'000};
    history_.consume(
        now_, context(), [](const sensor::Sample&) {}, noting());
    history_.advance(now_, context());
    history_.retire_until(now_ - base::Micros{200'000}, context(), noting());
  }
  /// Everything at once, or what is wrong.
  void judge() {
    history_.each_slot([&](const auto& slot) {
      const estimators::Estimate e = slot.estimate(context());
      EXPECT_TRUE(base::is_finite(e.pose.x.offset_m) && base::is_finite(e.pose.y.offset_m));
      EXPECT_TRUE(base::is_finite(e.pose.yaw_rad));
      EXPECT_TRUE(base::is_finite(e.forward_mps) && base::is_finite(e.yaw_rate_radps));
      EXPECT_GT(least_eigenvalue(e.p), 0);
    });
    history_.each_slot([&](const auto& slot) {
      if constexpr (requires { slot.inertial(context()); }) {
        const estimators::InertialEstimate e = slot.inertial(context());
        EXPECT_TRUE(e.state.finite());
        EXPECT_NEAR(e.state.q_nb.norm2(), 1.0F, 1e-3F);
        if (e.valid) {
          EXPECT_GT(least_eigenvalue(e.p), 0);
        }
      }
    });
  }
  [[nodiscard]] bool navigates() {
    bool valid = false;
    history_.each_slot([&](const auto& slot) {
      if constexpr (requires { slot.inertial(context()); }) valid = slot.inertial(context()).valid;
    });
    return valid;
  }
  [[nodiscard]] base::Micros now() const { return now_; }
  /// Whether this estimator ever accepted a sample of that kind.
  [[nodiscard]] bool took(std::size_t instance, sensor::Sensor sensor) const {
    return taken_.contains({instance, sensor});
  }

 private:
  [[nodiscard]] estimators::Context context() const { return {.parameters = kNumbers, .map_frame = map_frame_}; }

  FusionWindow history_;
  estimators::MapFrame map_frame_;
  estimators::LandmarkMap<estimators::kMapCapacity> map_;
  std::set<std::pair<std::size_t, sensor::Sensor>> taken_;
  base::Micros now_{5'000'000};
};

template <class Payload>
void put(sensor::Sample& sample, const Payload& payload) {
  sensor::visit(sample, [&payload]<class T>(const T& there) {
    if constexpr (std::is_same_v<T, Payload>) const_cast<T&>(there) = payload;  // NOLINT: the sample is not const
  });
}
template <class Payload>
sensor::Sample sample_of(sensor::Sensor sensor, base::Micros stamp, const Payload& payload) {
  sensor::Sample sample;
  sample.stamp = stamp;
  sample.sensor = sensor;
  put(sample, payload);
  return sample;
}

/// Samples of good sensors on a robot that drives east at 1 m/s: they agree, or the rest of them would be refused.
std::vector<sensor::Sample> good(int k, base::Micros t) {
  using sensor::Sensor;
  const auto counts = static_cast<std::uint16_t>(32 * k);
  std::vector<sensor::Sample> all{
      sample_of(sensor::Sensor::kImu, t,
                sensor::ImuSample{.dangle_b_rad = {0, 0, 1e-6F * static_cast<float>(k % 7 - 3)},  // not stuck
                                  .dvelocity_b_mps = {0, 0, 0.0981F + 1e-5F * static_cast<float>(k % 5)},
                                  .interval_us = 10'000}),
      sample_of(sensor::Sensor::kWheelCounts, t, sensor::WheelCounts{.left = counts, .right = counts}),
      sample_of(sensor::Sensor::kMagnetometer, t,
                sensor::MagneticFlux{.flux_b_uT = {0.02F * static_cast<float>(k % 7), 17, -46}})};
  if (k % 20 == 7) {
    const param::GnssParameters& g = kNumbers.gnss;
    all.push_back(sample_of(sensor::Sensor::kGnssPosition, t,
                            sensor::GnssPosition{.latitude_2ndeg = g.origin_latitude_2ndeg,
                                                 .longitude_2ndeg = g.origin_longitude_2ndeg + 68 * k,
                                                 .height_m = 520,
                                                 .horizontal_acc_m = 1.5F,
                                                 .vertical_acc_m = 3,
                                                 .fix = sensor::GnssFix::k3d}));
    all.push_back(
        sample_of(sensor::Sensor::kGnssVelocity, t, sensor::GnssVelocity{.v_n_mps = {1, 0, 0}, .acc_mps = 0.2F}));
    all.push_back(
        sample_of(sensor::Sensor::kBarometer, t,
                  sensor::AirPressure{.pressure_Pa = 95'000 + static_cast<float>(k % 3), .temperature_degC = 15}));
    all.push_back(sample_of(sensor::Sensor::kHeading, t, sensor::OutsideHeading{.yaw_rad = 0.01F, .acc_rad = 0.02F}));
    all.push_back(sample_of(sensor::Sensor::kWheelSpeed, t, sensor::WheelSpeeds{.left_mps = 1, .right_mps = 1}));
    all.push_back(sample_of(sensor::Sensor::kBodySpeed, t, sensor::BodySpeed{.forward_mps = 1, .yaw_rate_radps = 0}));
    all.push_back(sample_of(sensor::Sensor::kRangeBearing, t,
                            sensor::LandmarkSighting{.landmark = 1, .range_m = 5.3F, .bearing_rad = 0.4F}));
  }
  return all;
}

/// Whether this sensor is left to the IMU alone, after the first fixes: what it says then decides.
enum class Others : std::uint8_t { kThere, kGone };
std::vector<sensor::Sample> good(int k, base::Micros t, sensor::Sensor sensor, Others others) {
  std::vector<sensor::Sample> all = good(k, t);
  if (others == Others::kGone)
    std::erase_if(all, [&](const sensor::Sample& sample) {
      const bool first_fix = sample.sensor == sensor::Sensor::kGnssPosition && k < 250;
      return sample.sensor != sensor && sample.sensor != sensor::Sensor::kImu && !first_fix;
    });
  return all;
}

/// The floats of a payload, and which of them may be not available.
struct Field {
  float* value;
  bool optional = false;
};
std::vector<Field> fields_of(sensor::Sample& s) {
  using sensor::Sensor;
  auto& p = s.payload;
  switch (s.sensor) {
    case sensor::Sensor::kImu: {
      auto &a = p.imu.dangle_b_rad, &v = p.imu.dvelocity_b_mps;
      return {{&a[0]}, {&a[1]}, {&a[2]}, {&v[0]}, {&v[1]}, {&v[2]}};
    }
    case sensor::Sensor::kWheelSpeed:
      return {{&p.wheel_speeds.left_mps}, {&p.wheel_speeds.right_mps}};
    case sensor::Sensor::kBodySpeed:
      return {{&p.body_speed.forward_mps}, {&p.body_speed.yaw_rate_radps, true}};
    case sensor::Sensor::kGnssPosition:
      return {{&p.gnss_position.height_m, true},
              {&p.gnss_position.horizontal_acc_m, true},
              {&p.gnss_position.vertical_acc_m, true}};
    case sensor::Sensor::kGnssVelocity: {
      auto& v = p.gnss_velocity.v_n_mps;
      return {{&v[0]}, {&v[1]}, {&v[2], true}, {&p.gnss_velocity.acc_mps, true}};
    }
    case sensor::Sensor::kRangeBearing:
      return {{&p.sighting.range_m, true}, {&p.sighting.bearing_rad, true}};
    case sensor::Sensor::kMagnetometer: {
      auto& m = p.magnetic.flux_b_uT;
      return {{&m[0]}, {&m[1]}, {&m[2]}};
    }
    case sensor::Sensor::kBarometer:
      return {{&p.pressure.pressure_Pa}};
    case sensor::Sensor::kHeading:
      return {{&p.heading.yaw_rad}, {&p.heading.acc_rad, true}};
    default:
      return {};
  }
}
/// Hostile values, and the sizes at which plausible() draws its line.
std::vector<float> values() {
  std::vector<float> all(kHostile.begin(), kHostile.end());
  for (const float limit : {10.0F, 20.0F, 100.0F, 200.0F, 1e3F, 1e4F, 1e5F, 1e6F})
    all.insert(all.end(), {limit, -limit});
  return all;
}

/// An unused sensor would leave nothing behind the door for the hostile ones to break.
TEST(NeverNan, EverySensorIsUsedWhileItIsGood) {
  using sensor::Sensor;
  Wired wired;
  for (int k = 0; k < 600; ++k) {
    for (const sensor::Sample& sample : good(k, wired.now() + base::Micros{5'000})) EXPECT_TRUE(wired.offer(sample));
    wired.tick();
  }
  constexpr std::size_t kEkf = 1, kAttitude = 2, kInertial = 3;
  for (const sensor::Sensor sensor :
       {sensor::Sensor::kImu, sensor::Sensor::kWheelCounts, sensor::Sensor::kWheelSpeed, sensor::Sensor::kBodySpeed,
        sensor::Sensor::kGnssPosition, sensor::Sensor::kGnssVelocity, sensor::Sensor::kMagnetometer,
        sensor::Sensor::kBarometer, sensor::Sensor::kHeading})
    EXPECT_TRUE(wired.took(kInertial, sensor)) << static_cast<int>(sensor);
  EXPECT_TRUE(wired.took(kAttitude, sensor::Sensor::kMagnetometer));
  EXPECT_TRUE(wired.took(kEkf, sensor::Sensor::kRangeBearing));
}

/// A run in which every sample of this kind is spoilt, from tick `from` on, for two seconds. `taken` is told of each
/// whether it was let in.
template <class Spoil, class Taken>
void run_spoilt(sensor::Sensor sensor, int from, Others others, Spoil&& spoil, Taken&& taken) {
  Wired wired;
  for (int k = 0; k < from + 400; ++k) {
    const base::Micros t = wired.now() + base::Micros{5'000};
    for (sensor::Sample& sample : good(k, t, sensor, others)) {
      if (sample.sensor == sensor && k >= from && k < from + 200) {
        spoil(sample);
        taken(wired.offer(sample));
      } else {
        EXPECT_TRUE(wired.offer(sample));
      }
    }
    wired.tick();
    if (k % 40 == 39) wired.judge();
  }
  EXPECT_TRUE(wired.navigates());
}
/// Runs with one field of a sensor at one value.
void run_broken(sensor::Sensor sensor, std::size_t field, float value, int from, Others others) {
  bool optional = false;
  run_spoilt(
      sensor, from, others,
      [&](sensor::Sample& sample) {
        const Field of = fields_of(sample)[field];
        *of.value = value;
        optional = of.optional;
      },
      [&](bool taken) {
        if (!base::is_finite(value) && !(optional && base::is_nan(value))) {
          EXPECT_FALSE(taken);
        }
      });
}

TEST(NeverNan, EveryFieldOfEverySampleWhileStartingAndWhileNavigating) {
  std::vector<sensor::Sample> kinds = good(7, {});
  for (sensor::Sample& kind : kinds)
    for (std::size_t field = 0; field < fields_of(kind).size(); ++field)
      for (const float value : values())
        for (const int from : {0, 300})
          for (const Others others : {Others::kThere, Others::kGone}) {
            SCOPED_TRACE(testing::Message() << "sensor " << static_cast<int>(kind.sensor) << " field " << field << " = "
                                            << value << " from " << from << (others == Others::kGone ? " alone" : ""));
            run_broken(kind.sensor, field, value, from, others);
            if (HasFailure()) return;
          }
}

/// Refused input is counted, and the count is on the bus.
TEST(NeverNan, EveryFieldThatIsRefusedIsSaid) {
  using Node = node::Node<
      node::Estimators<estimators::Odometry, estimators::PoseEkf, estimators::Attitude, estimators::Inertial>>;
  param::Parameters parameters = kNumbers;
  parameters.publish.diagnostics_every = 1;
  static Node node{parameters, {}};
  std::int64_t now_us = 1'000'000;
  node.power_on({now_us});
  // Until the counters' page has come once more.
  const auto counted = [&] {
    std::optional<bus::EstDiagFrames> page;
    for (int k = 0; k < 20 && !page; ++k) {
      now_us += 10'000;
      node.tick({now_us}, {}, [&](const base::CanFrame& frame) {
        if (frame.id - parameters.can_base == bus::EstDiagFrames::kOffset)
          page = bus::decode<bus::EstDiagFrames>(bus::payload(frame));
      });
    }
    EXPECT_TRUE(page.has_value());
    return page ? *page : bus::EstDiagFrames{};
  };
  int refused = 0, after = counted().out_of_range;
  EXPECT_EQ(after, 0);
  std::vector<sensor::Sample> kinds = good(7, {});
  for (sensor::Sample& kind : kinds)
    for (std::size_t field = 0; field < fields_of(kind).size(); ++field)
      for (const float value : values()) {
        sensor::Sample sample = kind;
        const Field of = fields_of(sample)[field];
        *of.value = value;
        const bool nothing = !base::is_finite(value) && !(of.optional && base::is_nan(value));
        if (nothing) {
          EXPECT_FALSE(sensor::plausible(sample));
        }
        if (sensor::plausible(sample)) continue;
        sample.stamp = {now_us - 1'000};
        node.sample(sample);
        const int before = after;
        after = counted().out_of_range;
        EXPECT_EQ(after, before + 1) << "sensor " << static_cast<int>(kind.sensor) << " field " << field << " = "
                                     << value;
        ++refused;
      }
  EXPECT_GT(refused, 200);
}

/// Counts, and the reading of a thermometer.
TEST(NeverNan, EveryIntegerOfEverySampleWhileStartingAndWhileNavigating) {
  using sensor::Sensor;
  struct Spoilt {
    const char* what;
    sensor::Sensor sensor;
    void (*spoil)(sensor::Sample&);
  };
  constexpr auto kMost = std::numeric_limits<std::int64_t>::max(), kLeast = std::numeric_limits<std::int64_t>::min();
  const std::vector<Spoilt> all{
      {"no interval", sensor::Sensor::kImu, [](sensor::Sample& s) { s.payload.imu.interval_us = 0; }},
      {"1 us", sensor::Sensor::kImu, [](sensor::Sample& s) { s.payload.imu.interval_us = 1; }},
      {"the longest interval", sensor::Sensor::kImu, [](sensor::Sample& s) { s.payload.imu.interval_us = 0xFFFF; }},
      {"all clipped", sensor::Sensor::kImu,
       [](sensor::Sample& s) { s.payload.imu.clipped_gyro = s.payload.imu.clipped_accel = 255; }},
      {"no temperature", sensor::Sensor::kImu, [](sensor::Sample& s) { s.payload.imu.temperature_degC = base::kNan; }},
      {"infinitely hot", sensor::Sensor::kImu,
       [](sensor::Sample& s) { s.payload.imu.temperature_degC = base::kInfinity; }},
      {"counts that stay", sensor::Sensor::kWheelCounts, [](sensor::Sample& s) { s.payload.counts = {}; }},
      {"counts that leap", sensor::Sensor::kWheelCounts,
       [](sensor::Sample& s) {
         s.payload.counts = {.left = static_cast<std::uint16_t>(s.stamp.us & 0xFFFF), .right = 0x8000};
       }},
      {"beyond the pole", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.latitude_2ndeg = kMost; }},
      {"beyond the other", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.latitude_2ndeg = kLeast; }},
      {"round the world", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.longitude_2ndeg = kMost; }},
      {"and back", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.longitude_2ndeg = kLeast; }},
      {"the pole", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.latitude_2ndeg = 45'000'000'000; }},
      {"nowhere", sensor::Sensor::kGnssPosition,
       [](sensor::Sample& s) { s.payload.gnss_position.latitude_2ndeg = s.payload.gnss_position.longitude_2ndeg = 0; }},
      {"no thermometer", sensor::Sensor::kBarometer,
       [](sensor::Sample& s) { s.payload.pressure.temperature_degC = base::kNan; }},
      {"absolute zero", sensor::Sensor::kBarometer,
       [](sensor::Sample& s) { s.payload.pressure.temperature_degC = -274; }},
      {"no such landmark", sensor::Sensor::kRangeBearing, [](sensor::Sample& s) { s.payload.sighting.landmark = 255; }},
  };
  for (const Spoilt& one : all)
    for (const int from : {0, 300})
      for (const Others others : {Others::kThere, Others::kGone}) {
        SCOPED_TRACE(testing::Message() << one.what << " from " << from << (others == Others::kGone ? " alone" : ""));
        run_spoilt(one.sensor, from, others, one.spoil, [](bool) {});
        if (HasFailure()) return;
      }
}

/// Past the rule of lateness: whatever an estimator is handed, and however it is dated.
TEST(NeverNan, StampsOfAnyAgeInTheInertialEstimatorItself) {
  const param::GnssParameters& g = kNumbers.gnss;
  estimators::MapFrame map_frame;
  map_frame.frame = nav::LocalFrame(g.origin_latitude_2ndeg, g.origin_longitude_2ndeg, g.origin_height_m);
  map_frame.origin = sensor::OriginSource::kConfigured;
  const estimators::Context ctx{.parameters = kNumbers, .map_frame = map_frame};
  for (const sensor::Sample& kind : good(7, {}))
    for (const std::int64_t off_us : std::initializer_list<std::int64_t>{-1'000'000'000'000, -10'000'000, -200'001, -1,
                                                                         1, 200'001, 10'000'000, 1'000'000'000'000}) {
      SCOPED_TRACE(testing::Message() << "sensor " << static_cast<int>(kind.sensor) << ", " << off_us << " us");
      estimators::Inertial estimator;
      base::Micros now{2'000'000'000'000};
      estimator.restart(now, ctx);
      for (int k = 0; k < 600; ++k) {
        now += base::Micros{10'000};
        for (const sensor::Sample& sample : good(k, now)) {
          const bool odd = sample.sensor == kind.sensor && k >= 300 && k < 320;
          sensor::visit(sample, [&](const auto& payload) {
            if constexpr (requires { estimator.fuse(payload, now, ctx); })
              static_cast<void>(estimator.fuse(payload, odd ? now + base::Micros{off_us} : now, ctx));
          });
        }
        estimator.advance(now, ctx, {});
        if (k % 20 != 0) continue;
        const estimators::InertialEstimate e = estimator.inertial(ctx);
        ASSERT_TRUE(e.state.finite()) << k;
        if (e.valid) {
          ASSERT_GT(least_eigenvalue(e.p), 0) << k;
        }
      }
    }
}

TEST(NeverNan, StaleAndFutureStampsOfEverySensor) {
  std::vector<sensor::Sample> kinds = good(7, {});
  for (const sensor::Sample& kind : kinds)
    for (const std::int64_t off_us : std::initializer_list<std::int64_t>{-10'000'000'000, -600'000, -200'001, -150'000,
                                                                         150'000, 200'001, 600'000, 10'000'000'000}) {
      Wired wired;
      for (int k = 0; k < 500; ++k) {
        const base::Micros t = wired.now() + base::Micros{5'000};
        for (sensor::Sample& sample : good(k, t)) {
          if (sample.sensor == kind.sensor && k > 200 && k < 400) sample.stamp += base::Micros{off_us};
          EXPECT_TRUE(wired.offer(sample));
        }
        wired.tick();
        if (k % 20 == 0) wired.judge();
      }
      EXPECT_TRUE(wired.navigates()) << static_cast<int>(kind.sensor) << ' ' << off_us;
    }
}

/// Frames whose payload is random bits, among good ones; commands with a right CRC among them.
TEST(NeverNan, RandomBitsInEveryInputFrame) {
  using Node = node::Node<
      node::Estimators<estimators::Odometry, estimators::PoseEkf, estimators::Attitude, estimators::Inertial>>;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    static Node node{kNumbers, {}};
    firmware::Dice dice(seed * 7919);
    std::int64_t now_us = 1'000'000;
    node.power_on({now_us});
    const std::uint32_t base = kNumbers.can_base;
    std::uint32_t statuses = 0, fused = 0;
    for (int k = 0; k < 4'000; ++k) {
      now_us += 10'000;
      const auto seq = static_cast<std::uint8_t>(k & 15);
      const auto stamp = [&] { return static_cast<std::uint32_t>((now_us - dice.below(9'000)) & 0xFFFFF); };
      const auto bits = [&] { return dice.roll(); };
      const auto send = [&](base::CanFrame frame, bool random) {
        // Stamp, sequence and instance stay, so that the rest is taken for a sample.
        if (random)
          for (std::size_t i = 3; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(bits() >> 11);
        node.on_frame(frame);
      };
      // IMU: mostly good, or nothing would ever be navigated.
      const bool wild = dice.one_in(4);
      base::CanFrame part = bus::frame(base, bus::ImuGyro{.ang_z_rad = 0.001F, .seq = seq});
      if (wild && dice.one_in(2))
        for (std::size_t i = 0; i < 7; ++i) part.data[i] = static_cast<std::uint8_t>(bits() >> 11);
      node.on_frame(part);
      part = bus::frame(base, bus::ImuAccel{.vel_z_mps = 0.0981F, .seq = seq});
      if (wild && dice.one_in(2))
        for (std::size_t i = 0; i < 7; ++i) part.data[i] = static_cast<std::uint8_t>(bits() >> 11);
      node.on_frame(part);
      send(bus::frame(base, bus::ImuTime{.stamp_us = stamp(), .interval_us = 10'000, .seq = seq}),
           wild && dice.one_in(3));
      if (dice.one_in(2)) send(bus::frame(base, bus::InWheelCounts{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(3)) send(bus::frame(base, bus::InWheelSpeed{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(3)) send(bus::frame(base, bus::InBodySpeed{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(3)) send(bus::frame(base, bus::InRangeBearing{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(3)) send(bus::frame(base, bus::InMag{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(5)) send(bus::frame(base, bus::InBaro{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(9)) send(bus::frame(base, bus::InHeading{.stamp_us = stamp(), .seq = seq}), true);
      if (dice.one_in(5)) {
        const std::uint32_t t = stamp();
        const bool place = dice.one_in(3);  // false: where the robot is, with random accuracies
        send(bus::frame(base, bus::InGnssLat{.stamp_us = t, .seq = seq, .lat_raw = 24'131'350'000}), place);
        send(bus::frame(base, bus::InGnssLon{.stamp_us = t, .seq = seq, .lon_raw = 5'834'150'000}), place);
        send(bus::frame(
                 base, bus::InGnssAlt{.stamp_us = t, .seq = seq, .height_m = 520, .fix = static_cast<bus::GnssFix>(3)}),
             dice.one_in(3));
        send(bus::frame(base, bus::InGnssAcc{.stamp_us = t, .seq = seq}), true);
      }
      if (dice.one_in(5)) {
        const std::uint32_t t = stamp();
        send(bus::frame(base, bus::InGnssVelEN{.stamp_us = t, .seq = seq}), true);
        send(bus::frame(base, bus::InGnssVelU{.stamp_us = t, .seq = seq}), true);
      }
      if (dice.one_in(20)) send(bus::frame(base, bus::InMapEntry{.id = static_cast<std::uint8_t>(bits() >> 24)}), true);
      if (dice.one_in(200)) {
        const auto ctr = static_cast<std::uint8_t>(bits() & 15);
        for (base::CanFrame frame :
             {bus::frame(base, bus::CmdSetPos{.ctr = ctr}), bus::frame(base, bus::CmdSetYaw{.ctr = ctr})}) {
          for (std::size_t i = 2; i < 8; ++i) frame.data[i] = static_cast<std::uint8_t>(bits() >> 11);
          frame.data[0] = bus::e2e_crc(static_cast<std::uint8_t>(frame.id - base), frame.data);
          node.on_frame(frame);
        }
      }
      node.tick({now_us}, {}, [&](const base::CanFrame& frame) {
        const std::uint32_t offset = frame.id - base;
        if (offset == bus::EstInnov::kOffset) ++fused;
        if (offset != bus::EstStatus::kOffset) return;
        const auto status = bus::decode<bus::EstStatus>(bus::payload(frame));
        ASSERT_TRUE(status.has_value());
        ++statuses;
        EXPECT_NE(status->reset_cause, sensor::ResetCause::kNotFinite) << seed << ' ' << k;
        EXPECT_NE(status->reset_cause, sensor::ResetCause::kNotPositive) << seed << ' ' << k;
      });
      if (HasFailure()) return;
    }
    EXPECT_GT(statuses, 100U);
    EXPECT_GT(fused, 500U);
  }
}

}  // namespace
}  // namespace tetap
