// SPDX-License-Identifier: Apache-2.0
// Laws of the parameter table. Paths and indices are unique and stable, every member has a row, and defaults lie inside
// the limits. Access by a row touches its member alone, and the CRC of the version frame covers every element.
#include "tetap/param/table.hpp"

#include "tetap/param/crc.hpp"
#include "tetap/param/limits.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <string_view>

namespace tetap::param {
namespace {

using Bytes = std::array<unsigned char, sizeof(Parameters)>;

Bytes bytes_of(const Parameters& parameters) {
  Bytes bytes{};
  std::memcpy(bytes.data(), &parameters, sizeof parameters);
  return bytes;
}

/// Another plausible value than the one it has.
double other(const Row& row, double value) { return value < row.maximum ? row.maximum : row.minimum; }

TEST(ParameterTable, paths_are_unique_and_indices_ascend_within_the_range_of_canopen) {
  std::set<std::string_view> paths;
  int before = 0;
  for (const Row& row : kTable) {
    EXPECT_TRUE(paths.insert(row.path).second) << row.path;
    EXPECT_GT(row.index, before) << row.path;
    before = row.index;
  }
  EXPECT_LT(before, 0x4000) << "0x2000 + index is a manufacturer's object up to 0x5FFF (CiA 301, 7.4.1)";
}

TEST(ParameterTable, a_group_has_its_block_of_64_indices) {
  std::map<int, std::string> groups;
  for (const Row& row : kTable) {
    const std::string path = row.path;
    const std::string group = path.substr(0, path.find('.'));
    EXPECT_EQ(groups.try_emplace(row.index / 64, group).first->second, group) << path;
  }
}

/// The list holds `INDEX PATH` lines; a row that is gone keeps its line, with the word retired behind it.
TEST(ParameterTable, an_index_is_never_changed_and_never_used_again) {
  std::ifstream file(TETAP_PARAMETER_INDICES);
  ASSERT_TRUE(file) << TETAP_PARAMETER_INDICES;
  std::map<std::string, int> listed;
  std::set<int> taken;
  std::set<std::string> retired;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    std::string index, path, mark;
    words >> index >> path >> mark;
    EXPECT_TRUE(taken.insert(std::stoi(index, nullptr, 16)).second) << line << ": the index is listed twice";
    listed[path] = std::stoi(index, nullptr, 16);
    if (mark == "retired") retired.insert(path);
  }
  for (const Row& row : kTable) {
    const auto found = listed.find(row.path);
    if (found == listed.end()) {
      ADD_FAILURE() << row.path << " is new: test/param/indices.txt needs its line";
      EXPECT_EQ(taken.count(row.index), 0U) << row.path << " has an index that was used before";
      continue;
    }
    EXPECT_EQ(row.index, found->second) << row.path << ": an index is stable for ever";
    listed.erase(found);
  }
  for (const auto& [path, index] : listed)
    EXPECT_EQ(retired.count(path), 1U) << path << " has no row any more: its line needs the word retired";
}

/// Two members have no row: the declination of the attitude filter, which a rule keeps at 0, and the padding of the
/// 64-bit origin. The padding is less than 8 bytes before the origin's struct, before the origin, and behind it.
TEST(ParameterTable, every_member_has_one_row) {
  std::array<int, sizeof(Parameters) + 1> rows{};
  rows.back() = 1;
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.size; ++i) ++rows.at(row.offset + i);
  for (std::size_t i = 0; i < sizeof(float); ++i) ++rows.at(offsetof(Parameters, attitude.declination_rad) + i);
  const std::set<std::size_t> aligned{offsetof(Parameters, gnss), offsetof(Parameters, gnss.origin_latitude_2ndeg),
                                      offsetof(Parameters, gnss) + sizeof(GnssParameters), sizeof(Parameters)};
  std::size_t gap = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_LE(rows[i], 1) << "byte " << i << " belongs to two rows";
    if (rows[i] == 0) {
      ++gap;
    } else if (gap != 0) {
      EXPECT_TRUE(gap < 8 && aligned.count(i) == 1) << "bytes " << i - gap << " to " << i << " have no row";
      gap = 0;
    }
  }
}

TEST(ParameterTable, defaults_are_plausible) {
  const Parameters defaults;
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.elements; ++i)
      EXPECT_TRUE(within(row, row.get(defaults, i))) << row.path << " " << row.get(defaults, i);
  EXPECT_EQ(broken_rule(defaults), nullptr);
}

TEST(ParameterTable, limits_are_an_interval_and_nothing_beyond_is_within) {
  for (const Row& row : kTable) {
    EXPECT_LT(row.minimum, row.maximum) << row.path;
    EXPECT_TRUE(within(row, row.minimum) && within(row, row.maximum)) << row.path;
    const double beyond = 1e-3 * (row.maximum - row.minimum) + 1e-6;
    EXPECT_FALSE(within(row, row.minimum - beyond)) << row.path;
    EXPECT_FALSE(within(row, row.maximum + beyond)) << row.path;
    EXPECT_FALSE(within(row, __builtin_nan(""))) << row.path;
  }
}

TEST(ParameterTable, a_row_reads_and_writes_its_own_member_alone) {
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.elements; ++i)
      for (const double value : {row.minimum, row.maximum}) {
        Parameters parameters;
        const Bytes before = bytes_of(parameters);
        row.set(parameters, i, value);
        EXPECT_NEAR(row.get(parameters, i), value, 1e-7 * (value < 0 ? -value : value)) << row.path;
        const Bytes after = bytes_of(parameters);
        for (std::size_t b = 0; b < before.size(); ++b) {
          const bool own = b >= row.offset && b < row.offset + row.size;
          EXPECT_TRUE(own || after[b] == before[b]) << row.path << " changes byte " << b;
        }
      }
}

bool outside_crc(const Row& row) {
  return std::string_view(row.path) == "bus.key" || std::string_view(row.path) == "loop.lockstep";
}

TEST(ParameterTable, the_crc_sees_every_element_of_every_row_that_estimates_depend_on) {
  Parameters wired;
  wired.wired.imu = wired.wired.encoders = wired.wired.gnss = 1;
  wired.camera.fu_px = 700;
  const std::uint32_t before = crc(wired);
  std::set<std::uint32_t> seen{before};
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.elements; ++i) {
      Parameters parameters = wired;
      row.set(parameters, i, other(row, row.get(parameters, i)));
      if (outside_crc(row)) {
        EXPECT_EQ(crc(parameters), before) << row.path << ": a key is not published, nor who may ask for lockstep";
        continue;
      }
      EXPECT_TRUE(seen.insert(crc(parameters)).second) << row.path << "[" << i << "]";
    }
}

TEST(ParameterTable, the_crc_is_that_of_the_rows_stored_words_in_the_order_of_the_table) {
  Parameters parameters;
  parameters.wired.gnss = 1;
  parameters.camera.fu_px = 700;
  base::BitCrc sum;
  const Bytes bytes = bytes_of(parameters);
  for (const Row& row : kTable)
    for (std::size_t i = 0; i < row.size && !outside_crc(row); i += 4) {
      std::uint32_t word = 0;
      std::memcpy(&word, bytes.data() + row.offset + i, sizeof word);
      sum(word);
    }
  EXPECT_EQ(crc(parameters), sum.value());
}

TEST(ParameterTable, the_crc_of_a_robot_without_wired_sensors_or_camera_leaves_their_groups_out_and_no_other) {
  const std::uint32_t before = crc(Parameters{});
  for (const Row& row : kTable) {
    if (outside_crc(row)) continue;
    const std::string_view path = row.path;
    if (!path.starts_with("wired.") && !path.starts_with("camera.")) {
      Parameters parameters;
      row.set(parameters, 0, other(row, row.get(parameters, 0)));
      EXPECT_NE(crc(parameters), before) << row.path;
      continue;
    }
    Parameters parameters;
    row.set(parameters, 0, other(row, row.get(parameters, 0)));
    EXPECT_EQ(crc(parameters) == before, !parameters.wired.any() && !parameters.camera.any()) << row.path;
  }
}

TEST(ParameterTable, an_origin_is_given_in_degrees_and_kept_to_a_step) {
  Parameters parameters;
  const Row* const latitude = row_of("gnss.origin_latitude_deg");
  ASSERT_NE(latitude, nullptr);
  latitude->set(parameters, 0, 48.2627);
  EXPECT_EQ(parameters.gnss.origin_latitude_2ndeg, 24'131'350'000);
  latitude->set(parameters, 0, -48.2627);
  EXPECT_EQ(parameters.gnss.origin_latitude_2ndeg, -24'131'350'000);
  EXPECT_DOUBLE_EQ(latitude->get(parameters, 0), -48.2627);
}

TEST(ParameterTable, each_text_is_one_sentence_of_at_most_25_words) {
  for (const Row& row : kTable) {
    const std::string text = row.text;
    EXPECT_TRUE(text.ends_with(".")) << row.path;
    EXPECT_EQ(text.find(". "), std::string::npos) << row.path;
    EXPECT_EQ(text.find_first_of("\"|\\"), std::string::npos) << row.path << ": JSON and tables hold it as it is";
    std::istringstream words(text);
    EXPECT_LE(std::distance(std::istream_iterator<std::string>(words), {}), 25) << row.path;
  }
}

}  // namespace
}  // namespace tetap::param
