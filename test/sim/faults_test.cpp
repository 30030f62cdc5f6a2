// SPDX-License-Identifier: Apache-2.0
// Every fault does what its description says, within its window, and nothing else.
#include "sim_host/world/faults.hpp"

#include "test/sim/support.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

namespace tetap::sim {
namespace {

constexpr base::Micros kFrom = seconds_us(40.0);
constexpr base::Micros kLasts = seconds_us(6.0);
constexpr base::Micros kLength = seconds_us(60.0);
const Earth kEarth{World::Options{}.origin};

/// A measurement by what no fault changes: what it is and when it arrives.
using Key = std::tuple<std::size_t, std::int64_t, int>;

struct Recording {
  std::map<Key, Measurement> all;
  /// `sights`: with a scanner and a camera that follows features.
  explicit Recording(std::vector<FaultSetting> faults, bool sights = false) {
    World::Options options;
    options.faults = std::move(faults);
    options.parameters.lidar.beams = 90;
    if (sights) options.parameters.lidar.rate_hz = options.parameters.features.rate_hz = 10;
    options.parameters.magnetometer.rate_hz = 20;
    options.parameters.barometer.rate_hz = 10;
    std::map<std::pair<std::size_t, std::int64_t>, int> nth;
    for (const auto& m : run(options, 21, kLength)) all.emplace(key(m, nth), m);
  }

 private:
  static Key key(const Measurement& m, std::map<std::pair<std::size_t, std::int64_t>, int>& nth) {
    const int n = nth[{m.value.index(), m.arrival.us}]++;
    return {m.value.index(), m.arrival.us, n};
  }
};

const Recording& plain(bool sights = false) {
  static const Recording kRun{{}};
  if (!sights) return kRun;
  static const Recording kSights{{}, true};
  return kSights;
}

std::vector<FaultSetting> only(Fault fault) { return {{fault, kFrom, kLasts}}; }

/// When the measurement was true, since the start: the unfaulty run's stamp.
base::Micros true_time(const Measurement& unfaulty) { return unfaulty.stamp - World::Options{}.start; }
bool inside(base::Micros t) { return t >= kFrom && t < kFrom + kLasts; }

/// Pairs (plain, faulty) of one kind of value that both runs have.
template <class T>
std::vector<std::tuple<base::Micros, T, T>> pairs(const Recording& faulty) {
  std::vector<std::tuple<base::Micros, T, T>> both;
  for (const auto& [key, m] : plain().all)
    if (const auto* value = std::get_if<T>(&m.value))
      if (const auto other = faulty.all.find(key); other != faulty.all.end())
        both.emplace_back(true_time(m), *value, std::get<T>(other->second.value));
  return both;
}

std::array<double, 3> enu(const sensor::GnssPosition& p) {
  return kEarth.enu_m({p.latitude_2ndeg, p.longitude_2ndeg, static_cast<double>(p.height_m)});
}

std::int16_t difference(std::uint16_t a, std::uint16_t b) { return static_cast<std::int16_t>(a - b); }

bool lasts_beyond(Fault f) {  // a counter that missed or gained turns, a rover that is elsewhere
  return f == Fault::kSlipLeft || f == Fault::kSlipRight || f == Fault::kWheelStuck || f == Fault::kEncoderDropout ||
         f == Fault::kWheelSpin || f == Fault::kKidnapped || f == Fault::kLorry ||
         f == Fault::kMovingFeatures;  // tracks that ended do not come back
}

class EveryFault : public testing::TestWithParam<FaultInfo> {};

TEST_P(EveryFault, changes_measurements_within_its_window_and_none_before_or_after) {
  const Fault fault = GetParam().fault;
  const bool sights = GetParam().falls_on == FallsOn::kLidar || GetParam().falls_on == FallsOn::kFeatures;
  const Recording faulty{only(fault), sights};
  const Recording& right = plain(sights);
  std::set<Key> keys;
  for (const auto& [key, m] : right.all) keys.insert(key);
  for (const auto& [key, m] : faulty.all) keys.insert(key);
  int changed = 0;
  for (const Key& key : keys) {
    const auto a = right.all.find(key);
    const auto b = faulty.all.find(key);
    const bool both = a != right.all.end() && b != faulty.all.end();
    const base::Micros at{std::get<1>(key) - World::Options{}.start.us};
    // The sequence number counts what was sent, so a silence moves it for the rest of the run.
    const bool differs = !both || a->second.stamp != b->second.stamp || a->second.lost_parts != b->second.lost_parts ||
                         !same(Measurement{.value = a->second.value}, Measurement{.value = b->second.value});
    if (at < kFrom) {
      ASSERT_FALSE(differs) << at.us;
    }
    if (!lasts_beyond(fault) && at > kFrom + kLasts + base::Micros{sights ? 230'000 : 130'000}) {
      ASSERT_FALSE(differs) << at.us;
    }
    changed += differs ? 1 : 0;
  }
  EXPECT_GT(changed, 0);
}

TEST_P(EveryFault, is_understood_by_name_with_and_without_its_times) {
  const std::string name{GetParam().name};
  const auto bare = parse_faults(name);
  ASSERT_EQ(bare.error, "");
  EXPECT_EQ(bare.settings.at(0).fault, GetParam().fault);
  EXPECT_EQ(bare.settings.at(0).start, seconds_us(GetParam().start_s));
  EXPECT_EQ(bare.settings.at(0).duration, seconds_us(GetParam().duration_s));
  const auto timed = parse_faults(name + "@12.5+0.25");
  ASSERT_EQ(timed.error, "");
  EXPECT_EQ(timed.settings.at(0).start.us, 12'500'000);
  EXPECT_EQ(timed.settings.at(0).duration.us, 250'000);
  EXPECT_NE(fault_help().find(name), std::string::npos);
  EXPECT_EQ(info(GetParam().fault).name, name);
  const double laps = GetParam().fault == Fault::kGnssFar ? 2 : 1;
  EXPECT_LE(GetParam().start_s + GetParam().duration_s, laps * 200) << "its default lies within the course";
}

INSTANTIATE_TEST_SUITE_P(Faults, EveryFault, testing::ValuesIn(fault_table().begin(), fault_table().end()),
                         [](const auto& p) { return std::string{p.param.name}; });

TEST(Faults, several_are_separated_by_commas_and_what_is_not_understood_is_named) {
  const auto two = parse_faults("gnss_jump@5,slip_left@7+1");
  ASSERT_EQ(two.error, "");
  ASSERT_EQ(two.settings.size(), 2U);
  EXPECT_EQ(two.settings[0].duration, seconds_us(info(Fault::kGnssJump).duration_s));
  EXPECT_EQ(two.settings[1].start, seconds_us(7));
  EXPECT_TRUE(parse_faults("").settings.empty());
  const std::string unknown = parse_faults("gnss_jump,gnss_jmp").error;
  EXPECT_NE(unknown.find("'gnss_jmp'"), std::string::npos);
  for (const auto& row : fault_table()) EXPECT_NE(unknown.find(row.name), std::string::npos);
  for (const char* bad :
       {"gnss_jump@", "gnss_jump@x", "gnss_jump@5+", "gnss_jump@5+x", "gnss_jump@-1", "gnss_jump@1e9", "gnss_jump@nan",
        "gnss_jump@5 ", "gnss_jump@5+1+2", "gnss_jump@5+0", "gnss_jump,,slip_left", "@5"})
    EXPECT_NE(parse_faults(bad).error, "") << bad;
  for (const std::int64_t us : {0L, 1L, 999'999L, 12'345'678L, 1'000'000'000'000L})
    EXPECT_EQ(parse_seconds(seconds_text({us})), base::Micros{us});
  for (const char* bad : {"", ".", "1.2.3", "+1", "1e3", "1000000.000001", "99999999999999999999999"})
    EXPECT_EQ(parse_seconds(bad), std::nullopt) << bad;
}

TEST(Faults, gnss_jump_is_a_hundred_metres_to_the_east) {
  int n = 0;
  for (const auto& [t, a, b] : pairs<sensor::GnssPosition>(Recording{only(Fault::kGnssJump)})) {
    if (!inside(t) || a.fix == sensor::GnssFix::kNone) continue;
    // East of the antenna, whose meridian is up to 50 m from the origin's.
    EXPECT_NEAR(enu(b)[0] - enu(a)[0], 100, 2e-3);
    EXPECT_NEAR(enu(b)[1] - enu(a)[1], 0, 2e-3);
    EXPECT_EQ(a.horizontal_acc_m, b.horizontal_acc_m);
    ++n;
  }
  EXPECT_GE(n, 29);
}

TEST(Faults, gnss_ramp_walks_north_at_a_metre_a_second) {
  for (const auto& [t, a, b] : pairs<sensor::GnssPosition>(Recording{only(Fault::kGnssRamp)}))
    if (inside(t)) {
      EXPECT_NEAR(enu(b)[1] - enu(a)[1], static_cast<double>((t - kFrom).us) * 1e-6, 1e-3);
    }
}

TEST(Faults, gnss_wrong_height_is_the_geoid) {
  for (const auto& [t, a, b] : pairs<sensor::GnssPosition>(Recording{only(Fault::kGnssWrongHeight)}))
    if (inside(t)) {
      EXPECT_NEAR(b.height_m - a.height_m, 47, 1e-3);
    }
}

TEST(Faults, gnss_outage_is_silence) {
  const Recording faulty{only(Fault::kGnssOutage)};
  int silent = 0;
  for (const auto& [key, m] : plain().all) {
    const bool gnss =
        std::holds_alternative<sensor::GnssPosition>(m.value) || std::holds_alternative<sensor::GnssVelocity>(m.value);
    if (!inside(true_time(m))) continue;
    EXPECT_EQ(faulty.all.count(key), gnss ? 0U : 1U);
    silent += gnss ? 1 : 0;
  }
  EXPECT_GE(silent, 58);
}

TEST(Faults, gnss_frozen_repeats_the_last_fix_with_fresh_stamps) {
  std::optional<sensor::GnssPosition> last;
  int n = 0;
  for (const auto& [t, a, b] : pairs<sensor::GnssPosition>(Recording{only(Fault::kGnssFrozen)})) {
    if (t < kFrom) last = a;
    if (!inside(t)) continue;
    EXPECT_EQ(b.latitude_2ndeg, last->latitude_2ndeg);
    EXPECT_EQ(b.longitude_2ndeg, last->longitude_2ndeg);
    EXPECT_NE(a.latitude_2ndeg, last->latitude_2ndeg);
    ++n;
  }
  EXPECT_GE(n, 29);
}

TEST(Faults, a_spinning_wheel_counts_a_metre_a_second_too_much_and_only_it) {
  const double per_metre = 2000 / (2 * kPi * 0.1);
  for (const Fault fault : {Fault::kSlipLeft, Fault::kSlipRight}) {
    const bool left = fault == Fault::kSlipLeft;
    for (const auto& [t, a, b] : pairs<sensor::WheelCounts>(Recording{only(fault)})) {
      const double on_s = clamp(static_cast<double>((t - kFrom).us) * 1e-6, 0, 6);
      const double expected = on_s * per_metre / (left ? 1.0025 : 0.9975);
      const int more_left = static_cast<std::uint16_t>(b.left - a.left);
      const int more_right = static_cast<std::uint16_t>(b.right - a.right);
      ASSERT_NEAR(left ? more_left : more_right, expected, 3);
      ASSERT_EQ(left ? more_right : more_left, 0);
    }
  }
}

TEST(Faults, a_wheel_on_ice_counts_two_metres_a_second_too_much_and_only_it) {
  const double per_metre = 2000 / (2 * kPi * 0.1) / 0.9975;
  for (const auto& [t, a, b] : pairs<sensor::WheelCounts>(Recording{only(Fault::kWheelSpin)})) {
    const double on_s = clamp(static_cast<double>((t - kFrom).us) * 1e-6, 0, 6);
    ASSERT_NEAR(static_cast<std::uint16_t>(b.right - a.right), 2 * on_s * per_metre, 5);
    ASSERT_EQ(a.left, b.left);
  }
}

TEST(Faults, gnss_far_is_silent_for_211_s_then_105_fixes_are_800_m_west_and_the_next_is_right) {
  World::Options options;
  options.course = default_course(2);
  options.parameters.gnss.glitch_probability = options.parameters.gnss.outage_every_s = 0;
  const auto right = run(options, 3, seconds_us(320));
  options.faults = {{Fault::kGnssFar, kFrom, seconds_us(260)}};
  const auto wrong = run(options, 3, seconds_us(320));
  std::map<std::int64_t, sensor::GnssPosition> fixes;
  for (const auto& m : right)
    if (const auto* fix = std::get_if<sensor::GnssPosition>(&m.value)) fixes[m.stamp.us] = *fix;
  int far = 0;
  std::int64_t last_far = 0, next_right = 0;
  for (const auto& m : wrong) {
    const auto* fix = std::get_if<sensor::GnssPosition>(&m.value);
    if (fix == nullptr) continue;
    const base::Micros at = m.stamp - options.start;
    ASSERT_FALSE(at >= kFrom && at < kFrom + seconds_us(211));
    const double west = enu(fixes.at(m.stamp.us))[0] - enu(*fix)[0];
    if (west > 1) {
      ASSERT_NEAR(west, 800, 0.01);
      ASSERT_EQ(fix->horizontal_acc_m, fixes.at(m.stamp.us).horizontal_acc_m);
      ++far;
      last_far = m.stamp.us;
    } else if (far > 0 && next_right == 0) {
      next_right = m.stamp.us;
    }
  }
  EXPECT_EQ(far, 105);
  EXPECT_EQ(next_right - last_far, 200'000);
}

TEST(Faults, vibration_stays_within_the_ranges_and_is_felt) {
  int felt = 0;
  for (const auto& [t, a, b] : pairs<sensor::ImuSample>(Recording{only(Fault::kVibration)})) {
    ASSERT_EQ(b.clipped_accel + b.clipped_gyro, 0);
    felt += !same(Measurement{.value = a}, Measurement{.value = b}) ? 1 : 0;
  }
  EXPECT_NEAR(felt, 600, 2);
}

TEST(Faults, a_magnetic_disturbance_adds_its_field_wherever_the_rover_looks) {
  for (const auto& [t, a, b] : pairs<sensor::MagneticFlux>(Recording{only(Fault::kMagDisturbance)})) {
    double square = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double more = static_cast<double>(b.flux_b_uT[i]) - static_cast<double>(a.flux_b_uT[i]);
      square += more * more;
    }
    ASSERT_NEAR(sim::sqrt(square), inside(t) ? FaultNumbers::kIron_uT : 0, 1.5);
  }
}

TEST(Faults, a_start_in_motion_is_silence_of_every_sensor) {
  for (const auto& [key, m] : Recording{only(Fault::kMovingStart)}.all) {
    const base::Micros at = m.stamp - World::Options{}.start;
    ASSERT_FALSE(at > kFrom + base::Micros{100} && at < kFrom + kLasts) << at.us;
  }
}

TEST(Faults, a_stuck_wheel_stands_still) {
  std::set<std::uint16_t> left, right;
  for (const auto& [t, a, b] : pairs<sensor::WheelCounts>(Recording{only(Fault::kWheelStuck)})) {
    if (inside(t) && t > kFrom + base::Micros{1'000}) left.insert(b.left), right.insert(b.right);
    if (inside(t)) {
      EXPECT_EQ(a.right, b.right);
    }
  }
  EXPECT_LE(left.size(), 1U);
  EXPECT_GT(right.size(), 500U);
}

TEST(Faults, an_encoder_with_a_loose_contact_loses_half_its_counts_in_bursts) {
  double plain_counts = 0, faulty_counts = 0;
  int still = 0, n = 0;
  std::optional<std::pair<sensor::WheelCounts, sensor::WheelCounts>> last;
  for (const auto& [t, a, b] : pairs<sensor::WheelCounts>(Recording{only(Fault::kEncoderDropout)})) {
    if (inside(t) && last) {
      plain_counts += difference(a.right, last->first.right);
      faulty_counts += difference(b.right, last->second.right);
      still += difference(b.right, last->second.right) == 0 ? 1 : 0;
      ++n;
      EXPECT_EQ(a.left, b.left);
    }
    last = {a, b};
  }
  EXPECT_NEAR(faulty_counts / plain_counts, 0.5, 0.03);
  EXPECT_NEAR(still, n / 2, n / 10);
}

TEST(Faults, a_stuck_imu_repeats_its_last_sample) {
  std::optional<sensor::ImuSample> last;
  for (const auto& [t, a, b] : pairs<sensor::ImuSample>(Recording{only(Fault::kImuStuck)})) {
    if (t < kFrom) last = a;
    if (inside(t)) {
      EXPECT_TRUE(same(Measurement{.value = *last}, Measurement{.value = b}));
    }
  }
}

TEST(Faults, a_shaken_imu_clips_says_so_and_stays_within_full_scale) {
  int gyro = 0, accel = 0, n = 0;
  double up = 0, up_plain = 0;
  for (const auto& [t, a, b] : pairs<sensor::ImuSample>(Recording{only(Fault::kImuClipping)})) {
    if (!inside(t)) {
      EXPECT_EQ(b.clipped_gyro, 0);
      continue;
    }
    gyro += b.clipped_gyro, accel += b.clipped_accel, ++n;
    EXPECT_LE(b.clipped_accel, 20);
    up += static_cast<double>(b.dvelocity_b_mps[2]), up_plain += static_cast<double>(a.dvelocity_b_mps[2]);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_LE(magnitude(static_cast<double>(b.dvelocity_b_mps[i])), 4 * kG0 * 0.01 + 0.01);
  }
  EXPECT_GT(gyro, n);
  EXPECT_GT(accel, n);
  EXPECT_LT(up, up_plain - n * 0.01);  // gravity makes the upper half clip more: more than 1 m/s^2 is missing
}

TEST(Faults, gyro_bias_step_turns_the_vertical_axis_only) {
  for (const auto& [t, a, b] : pairs<sensor::ImuSample>(Recording{only(Fault::kGyroBiasStep)})) {
    const float step = inside(t) ? 0.02F * 0.01F : 0.0F;
    ASSERT_NEAR(b.dangle_b_rad[2] - a.dangle_b_rad[2], step, 2e-9F);
    ASSERT_EQ(b.dangle_b_rad[0], a.dangle_b_rad[0]);
  }
}

TEST(Faults, landmark_wrong_id_swaps_neighbours) {
  int n = 0;
  for (const auto& [t, a, b] : pairs<sensor::LandmarkSighting>(Recording{only(Fault::kLandmarkWrongId)})) {
    const int swapped = ((a.landmark - 1) ^ 1) + 1;  // ids count from 1
    EXPECT_EQ(b.landmark, inside(t) ? swapped : a.landmark);
    EXPECT_EQ(a.range_m, b.range_m);
    n += inside(t) ? 1 : 0;
  }
  EXPECT_GT(n, 5);
}

TEST(Faults, landmark_outliers_are_half_of_the_sightings_and_metres_off) {
  const Recording faulty{{{Fault::kLandmarkOutlier, {}, kLength}}};
  int off = 0, n = 0;
  for (const auto& [t, a, b] : pairs<sensor::LandmarkSighting>(faulty)) {
    ++n;
    EXPECT_EQ(a.landmark, b.landmark);
    const float more = b.range_m - a.range_m;
    if (magnitude(static_cast<double>(more)) < 1e-9) continue;
    EXPECT_GE(more, 2 - 1e-5F);
    EXPECT_LE(more, 6 + 1e-5F);
    ++off;
  }
  EXPECT_GT(n, 150);
  EXPECT_NEAR(off, n / 2.0, 4 * sim::sqrt(n / 4.0));
}

TEST(Faults, stamps_are_old_ahead_or_jump_as_said_and_arrivals_are_not) {
  const std::pair<Fault, std::int64_t> cases[] = {
      {Fault::kStaleStamps, -400'000}, {Fault::kFutureStamps, 400'000}, {Fault::kClockJump, 3'000'000}};
  for (const auto& [fault, shift_us] : cases) {
    const Recording faulty{only(fault)};
    ASSERT_EQ(faulty.all.size(), plain().all.size());
    for (const auto& [key, m] : plain().all) {
      // Wheels are stamped up to 0.1 ms after the instant that decides.
      const base::Micros t = true_time(m);
      if (std::holds_alternative<sensor::WheelCounts>(m.value) && !(inside(t) == inside(t - base::Micros{100})))
        continue;
      ASSERT_EQ((faulty.all.at(key).stamp - m.stamp).us, inside(t) ? shift_us : 0);
    }
  }
}

TEST(Faults, clock_jump_takes_the_sync_along) {
  World::Options options;
  options.faults = only(Fault::kClockJump);
  World world{options, 1};
  std::vector<Measurement> arrived;
  for (const auto& [at_s, offset_us] : {std::pair{39.9, 0}, {40.0, 3'000'000}, {45.9, 3'000'000}, {46.0, 0}}) {
    world.advance_to(world.start() + seconds_us(at_s), arrived);
    EXPECT_EQ(world.clock_offset().us, offset_us) << at_s;
  }
}

TEST(Faults, lost_frames_are_a_fifth_of_all_parts) {
  const Recording faulty{{{Fault::kLostFrames, {}, kLength}}};
  double lost = 0, sent = 0;
  for (const auto& [key, m] : faulty.all) {
    sent += parts(m.value);
    lost += std::popcount(m.lost_parts);
    ASSERT_EQ(m.lost_parts >> parts(m.value), 0);
  }
  EXPECT_NEAR(lost / sent, 0.2, 0.01);
}

TEST(Faults, a_kidnapped_rover_is_eight_metres_further_and_nobody_felt_it) {
  World::Options options;
  World left_alone{options, 21};
  options.faults = {{Fault::kKidnapped, seconds_us(20), {}}};
  World taken{options, 21};
  std::vector<Measurement> a, b;
  const auto until = [&](double s) {
    left_alone.advance_to(left_alone.start() + seconds_us(s), a);
    taken.advance_to(taken.start() + seconds_us(s), b);
  };
  until(19.9995);
  EXPECT_EQ(left_alone.truth().x_m, taken.truth().x_m);
  const Truth before = taken.truth();
  until(20.0005);
  const Truth after = taken.truth();
  EXPECT_NEAR(after.x_m - before.x_m, 8, 0.15);
  a.clear(), b.clear();
  until(20.5);  // on a straight: wheels and IMU go on as if nothing had been
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    if (const auto* s = std::get_if<sensor::ImuSample>(&a[i].value)) {
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(s->dvelocity_b_mps[k], std::get<sensor::ImuSample>(b[i].value).dvelocity_b_mps[k], 0.02F);
    }
  until(213);
  EXPECT_LT(sim::sqrt(taken.truth().x_m * taken.truth().x_m + taken.truth().y_m * taken.truth().y_m), 1.0)
      << "and drives the course to its end";
}

}  // namespace
}  // namespace tetap::sim
