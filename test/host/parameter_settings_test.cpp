// SPDX-License-Identifier: Apache-2.0
// A file of parameters and single settings. A valid one counts, a wrong one is one error with file and line, and
// printed numbers read back as the same bits.
#include "sim_host/parameter_settings.hpp"

#include "tetap/param/crc.hpp"

#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

namespace tetap::sim {
namespace {

param::Parameters set_by(const std::string& text) {
  ParameterSettings settings;
  settings.read(text, "my.params");
  return settings.over({});
}

std::string error_of(const std::string& text) {
  try {
    (void)set_by(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(ParameterFile, settings_count_over_what_the_robot_has) {
  const param::Parameters p = set_by(
      "# a comment\n"
      "wheels.drive.left_radius_m = 0.0825  # another\n"
      "\n"
      "  wheels.drive.right_radius_m=0.0826\r\n"
      "wheels.drive.track_m =\t0.42\n"
      "imu.accel_bias_mps2 = 0.1, -0.2 +0.3\n"
      "can_base = 0x340\n"
      "wheels.hold = 0\n"
      "gnss.origin_latitude_deg = 48.2627\n"
      "loop.period_us = 2e4");
  EXPECT_EQ(p.wheels.drive.left_radius_m, 0.0825F);
  EXPECT_EQ(p.wheels.drive.right_radius_m, 0.0826F);
  EXPECT_EQ(p.wheels.drive.track_m, 0.42F);
  EXPECT_EQ(p.imu.accel_bias_mps2, (std::array{0.1F, -0.2F, 0.3F}));
  EXPECT_EQ(p.can_base, 0x340U);
  EXPECT_EQ(p.wheels.hold, param::Hold::kForward);
  EXPECT_EQ(p.gnss.origin_latitude_2ndeg, 24'131'350'000);
  EXPECT_EQ(p.loop.period_us, 20'000);
  EXPECT_EQ(p.loop.window_us, param::Parameters{}.loop.window_us);
  EXPECT_EQ(param::crc(set_by("# nothing\n\n")), param::crc({}));
}

TEST(ParameterFile, the_last_setting_of_a_path_counts_and_a_command_line_counts_over_a_file) {
  ParameterSettings settings;
  settings.read("loop.period_us = 20000\nloop.period_us = 30000\n", "my.params");
  EXPECT_EQ(settings.over({}).loop.period_us, 30'000);
  settings.set("loop.period_us=40000", "--set");
  EXPECT_EQ(settings.over({}).loop.period_us, 40'000);
  EXPECT_EQ(settings.words(), "loop.period_us=20000 loop.period_us=30000 loop.period_us=40000");
}

TEST(ParameterFile, what_is_wrong_is_named_with_file_line_value_and_limits) {
  EXPECT_EQ(error_of("\n# c\nwheels.drive.radius_m = 0.1\n"),
            "my.params:3: no parameter 'wheels.drive.radius_m' (tetap-params lists them)");
  EXPECT_EQ(error_of("loop.period_us = 20000\nwheels.drive.track_m = 420\n"),
            "my.params:2: wheels.drive.track_m is 420 m; it has to be from 0 to 10");
  EXPECT_EQ(error_of("loop.period_us = 10"), "my.params:1: loop.period_us is 10 us; it has to be from 1000 to 100000");
  EXPECT_EQ(error_of("loop.period_us = 1000.5"),
            "my.params:1: loop.period_us is 1000.5 us; it has to be a whole number");
  EXPECT_EQ(error_of("gnss.origin_latitude_deg = 4826"),
            "my.params:1: gnss.origin_latitude_deg is 4826 deg; it has to be from -90 to 90");
  EXPECT_EQ(error_of("gnss.sigma_scale = nan"), "my.params:1: gnss.sigma_scale is nan; it has to be from 0.1 to 20");
  EXPECT_EQ(error_of("gnss.sigma_scale = 1e999"), "my.params:1: gnss.sigma_scale: '1e999' is no number");
  EXPECT_EQ(error_of("gnss.sigma_scale = 2F"), "my.params:1: gnss.sigma_scale: '2F' is no number");
  EXPECT_EQ(error_of("gnss.sigma_scale 2"), "my.params:1: 'gnss.sigma_scale 2' is not PATH = VALUE");
  EXPECT_EQ(error_of("gnss.sigma_scale ="), "my.params:1: gnss.sigma_scale has 1 value, not 0");
  EXPECT_EQ(error_of("gyro.up_s = 0 1"), "my.params:1: gyro.up_s has 3 values, not 2");
}

TEST(ParameterFile, a_broken_rule_is_named_where_one_of_its_fields_is_set) {
  EXPECT_EQ(error_of("loop.ahead_us = 0\nloop.window_us = 5000\ngyro.use = 1\n"),
            "my.params:2: loop.window_us is 5000 us; it has to be at least loop.period_us");
  EXPECT_EQ(error_of("gyro.use = 1\nwheels.timeout_us = 20000\n"),
            "my.params:2: inertial.wheels_every_us is 15000 us; it has to be at most half of wheels.timeout_us");
  EXPECT_EQ(error_of("gyro.up_s = 0 0 0.5"), "my.params:1: gyro.up_s has to be a unit vector");
}

TEST(ParameterFile, options_are_taken_out_of_the_command_line) {
  Arguments arguments(std::vector<std::string>{"--set", "gyro.use=1", "--other", "--set=baro.use=1"});
  const param::Parameters p = ParameterSettings(arguments).over({});
  EXPECT_EQ(p.gyro.use, 1);
  EXPECT_EQ(p.baro.use, 1);
  EXPECT_TRUE(arguments.flag("--other"));
  EXPECT_NO_THROW(arguments.finish());
  Arguments missing(std::vector<std::string>{"--params", "/nowhere/my.params"});
  EXPECT_THROW(ParameterSettings{missing}, UsageError);
}

/// Every row at its limits and at values with all digits.
TEST(ParameterFile, what_is_printed_reads_back_as_the_same_bits) {
  for (const param::Row& row : param::kTable)
    for (const double share : {0.0, 1.0 / 3, 0.7123456789, 1.0}) {
      param::Parameters p;
      for (std::size_t i = 0; i < row.elements; ++i) row.set(p, i, row.minimum + share * (row.maximum - row.minimum));
      const std::string text = value_text(row, p);
      ParameterSettings settings;
      settings.set(std::string(row.path) + " = " + text, "printed");
      EXPECT_EQ(param::crc(settings.unchecked_over({})), param::crc(p)) << row.path << " " << text;
    }
}

TEST(ParameterFile, changes_are_listed_without_what_is_at_its_default) {
  EXPECT_EQ(changed_parameters({}), "");
  EXPECT_EQ(changed_parameters(set_by("gyro.up_s = 0 1 0\nloop.period_us = 20000\n")),
            "loop.period_us 20000, gyro.up_s 0 1 0");
  const std::string json = parameters_json(set_by("gyro.up_s = 0 1 0\nloop.period_us = 20000\n"));
  EXPECT_NE(json.find("\"loop.period_us\": 20000, "), std::string::npos) << json;
  EXPECT_NE(json.find("\"gyro.up_s\": [0, 1, 0], "), std::string::npos) << json;
}

}  // namespace
}  // namespace tetap::sim
