// SPDX-License-Identifier: Apache-2.0
#include "sim_host/csv/quantities.hpp"

#include "sim_host/csv/words.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace tetap::csv {

namespace {

using enum Dimension;
constexpr auto kQuantities = std::to_array<Quantity>({
    {"time", Kind::kTime, 0, kTime},
    {"gyro.x", Kind::kGyro, 0, kAngularRate},
    {"gyro.y", Kind::kGyro, 1, kAngularRate},
    {"gyro.z", Kind::kGyro, 2, kAngularRate},
    {"gyro.temperature", Kind::kGyro, 3, kTemperature},
    {"accel.x", Kind::kAccel, 0, kAcceleration},
    {"accel.y", Kind::kAccel, 1, kAcceleration},
    {"accel.z", Kind::kAccel, 2, kAcceleration},
    {"linear.x", Kind::kLinear, 0, kAcceleration},
    {"linear.y", Kind::kLinear, 1, kAcceleration},
    {"linear.z", Kind::kLinear, 2, kAcceleration},
    {"gravity.x", Kind::kGravity, 0, kAcceleration},
    {"gravity.y", Kind::kGravity, 1, kAcceleration},
    {"gravity.z", Kind::kGravity, 2, kAcceleration},
    {"mag.x", Kind::kMag, 0, kFlux},
    {"mag.y", Kind::kMag, 1, kFlux},
    {"mag.z", Kind::kMag, 2, kFlux},
    {"baro.pressure", Kind::kBaro, 0, kPressure},
    {"baro.temperature", Kind::kBaro, 1, kTemperature},
    {"gnss.lat", Kind::kFix, 0, kPlace},
    {"gnss.lon", Kind::kFix, 1, kPlace},
    {"gnss.height", Kind::kFix, 2, kLength},
    {"gnss.horizontal", Kind::kFix, 3, kLength},
    {"gnss.vertical", Kind::kFix, 4, kLength},
    {"gnss.satellites", Kind::kFix, 5, kNumber},
    {"velocity.speed", Kind::kVelocity, 0, kSpeed},
    {"velocity.course", Kind::kVelocity, 1, kAngle},
    {"velocity.east", Kind::kVelocity, 2, kSpeed},
    {"velocity.north", Kind::kVelocity, 3, kSpeed},
    {"velocity.up", Kind::kVelocity, 4, kSpeed},
    {"velocity.accuracy", Kind::kVelocity, 5, kSpeed},
    {"velocity.down", Kind::kVelocity, 6, kSpeed},
    {"wheels.left", Kind::kWheelSpeed, 0, kSpeed},
    {"wheels.right", Kind::kWheelSpeed, 1, kSpeed},
    {"counts.left", Kind::kWheelCounts, 0, kNumber},
    {"counts.right", Kind::kWheelCounts, 1, kNumber},
    {"body.forward", Kind::kBody, 0, kSpeed},
    {"body.yaw_rate", Kind::kBody, 1, kAngularRate},
    {"heading.yaw", Kind::kHeading, 0, kAngle},
    {"heading.compass", Kind::kHeading, 1, kAngle},
    {"heading.accuracy", Kind::kHeading, 2, kAngle},
    {"heading.qw", Kind::kHeading, 3, kNumber},
    {"heading.qx", Kind::kHeading, 4, kNumber},
    {"heading.qy", Kind::kHeading, 5, kNumber},
    {"heading.qz", Kind::kHeading, 6, kNumber},
    {"sighting.id", Kind::kSighting, 0, kNumber},
    {"sighting.range", Kind::kSighting, 1, kLength},
    {"sighting.bearing", Kind::kSighting, 2, kAngle},
    {"sighting.range_rate", Kind::kSighting, 3, kSpeed},
});

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }
char small(char c) { return is_capital(c) ? static_cast<char>(c - 'A' + 'a') : c; }

/// Small letters and digits in words: "accX", "acc_x" and "Acc. x" are "acc", "x".
std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  bool open = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (!is_letter(c) && !(c >= '0' && c <= '9')) {
      open = false;
      continue;
    }
    const bool hump = i > 0 && is_capital(c) && is_letter(text[i - 1]) && !is_capital(text[i - 1]);
    if (!open || hump) words.emplace_back();
    open = true;
    words.back() += small(c);
  }
  return words;
}

std::string joined(std::span<const std::string> words) {
  std::string text;
  for (const std::string& word : words) text += word;
  return text;
}

/// The unit within the brackets that end a name.
std::string cut_unit(std::string_view& column) {
  for (const auto& [open, close] : {std::pair{'(', ')'}, std::pair{'[', ']'}}) {
    const std::size_t at = column.rfind(open);
    if (at == std::string_view::npos || column.back() != close) continue;
    const std::string unit(column.substr(at + 1, column.size() - at - 2));
    column = column.substr(0, at);
    return unit;
  }
  return {};
}

std::optional<Guess> axis_quantity(std::string_view word, char axis) {
  for (const Word& row : kAxisWords)
    if (row.word == word) return Guess{find_quantity(std::string(row.quantity) + axis), {}, row.rank};
  return std::nullopt;
}

/// The word of a file whose columns are x, y and z alone.
std::string_view word_of_file(std::string_view stem) {
  const std::string plain = joined(words_of(stem));
  constexpr auto kParts = std::to_array<std::pair<std::string_view, std::string_view>>({
      {"gyroscopeuncalibrated", "gyroscopeuncalibrated"},
      {"accelerometeruncalibrated", "accelerometeruncalibrated"},
      {"magnetometeruncalibrated", "magnetometeruncalibrated"},
      {"totalacceleration", "totalacceleration"},
      {"accelerationwithoutg", "linearacceleration"},
      {"linear", "linearacceleration"},
      {"gravity", "gravity"},
      {"gyro", "gyro"},
      {"magnet", "mag"},
      {"accel", "accel"},
  });
  for (const auto& [part, word] : kParts)
    if (plain.find(part) != std::string::npos) return word;
  return {};
}

/// x, y and z of a sensor.
std::optional<Guess> guess_axis(std::vector<std::string> words, std::string_view unit, std::string_view stem) {
  std::erase_if(words, [](const auto& w) { return std::find(kNoise.begin(), kNoise.end(), w) != kNoise.end(); });
  const auto is_axis = [](const std::string& w) { return w == "x" || w == "y" || w == "z"; };
  char axis = 0;
  if (std::count_if(words.begin(), words.end(), is_axis) == 1) {
    const auto found = std::find_if(words.begin(), words.end(), is_axis);
    axis = found->front();
    words.erase(found);
  } else if (!words.empty() && words.back().size() > 1 && words.back().back() >= 'x' && words.back().back() <= 'z') {
    axis = words.back().back();
    words.back().pop_back();
  } else {
    return std::nullopt;
  }
  if (!words.empty()) return axis_quantity(joined(words), axis);
  if (const auto word = word_of_file(stem); !word.empty()) return axis_quantity(word, axis);
  if (unit.empty()) return std::nullopt;
  if (unit_of(unit, kAngularRate)) return axis_quantity("gyro", axis);
  if (unit_of(unit, kAcceleration)) return axis_quantity("accel", axis);
  return std::nullopt;
}

std::optional<Guess> guess_words(std::vector<std::string> words) {
  const std::size_t before = words.size();
  std::erase_if(words, [](const auto& w) { return std::find(kNoise.begin(), kNoise.end(), w) != kNoise.end(); });
  const std::string plain = joined(words);
  for (const Word& row : kWords) {
    if (row.word != plain) continue;
    const Quantity* quantity = find_quantity(row.quantity);
    const bool foreign = quantity->kind == Kind::kTime && words.size() != before;  // the receiver's own time
    return Guess{quantity, {}, row.rank + (foreign && plain != "stamp" ? 10 : 0)};
  }
  return std::nullopt;
}

std::optional<Guess> guess_name(const std::vector<std::string>& words, std::string_view unit, std::string_view stem) {
  if (auto guess = guess_words(words)) return guess;
  return guess_axis(words, unit, stem);
}

/// "gyro_rad[0]" of an array, as PX4 and ROS write three axes: the unit may stand before the index.
std::optional<Guess> guess_element(std::string_view column, std::string_view stem) {
  const bool indexed = column.size() > 3 && column.ends_with(']') && column[column.size() - 3] == '[';
  if (!indexed || column[column.size() - 2] < '0' || column[column.size() - 2] > '2') return std::nullopt;
  const std::vector<std::string> words = words_of(column.substr(0, column.size() - 3));
  const std::span<const std::string> all(words);
  for (std::size_t n = 0; n <= 2 && n < words.size(); ++n) {
    const std::string suffix = joined(all.last(n));
    std::vector<std::string> named(words.begin(), words.end() - static_cast<std::ptrdiff_t>(n));
    named.emplace_back(1, static_cast<char>('x' + column[column.size() - 2] - '0'));
    auto guess = guess_axis(std::move(named), suffix, stem);
    if (!guess || (n != 0 && !unit_of(suffix, guess->quantity->dimension))) continue;
    guess->unit = suffix;
    return guess;
  }
  return std::nullopt;
}

}  // namespace

std::span<const Quantity> quantities() { return kQuantities; }

const Quantity* find_quantity(std::string_view name) {
  const auto found =
      std::find_if(kQuantities.begin(), kQuantities.end(), [&](const Quantity& q) { return q.name == name; });
  return found == kQuantities.end() ? nullptr : &*found;
}

std::string_view kind_name(Kind kind) {
  const auto found =
      std::find_if(kQuantities.begin(), kQuantities.end(), [&](const Quantity& q) { return q.kind == kind; });
  return found->name.substr(0, found->name.find('.'));
}

std::size_t slots_of(Kind kind) {
  return static_cast<std::size_t>(
      std::count_if(kQuantities.begin(), kQuantities.end(), [&](const Quantity& q) { return q.kind == kind; }));
}

std::optional<Guess> guess_column(std::string_view column, std::string_view stem, bool phone, bool placed) {
  if (auto element = guess_element(column, stem)) return element;
  const bool in_g = column.starts_with("gF");  // Physics Toolbox: the specific force beside the acceleration without it
  std::string unit = cut_unit(column);
  if (unit == "txt") unit.clear();  // SensorLog: a date in words
  // ROS names the specific force so; telephones write the words apart where gravity is taken away.
  const bool of_ros = column.find("linear_acceleration") != std::string_view::npos;
  std::vector<std::string> words = words_of(column);
  if (words.empty()) return std::nullopt;
  auto guess = guess_name(words, unit, stem);
  for (std::size_t n = 1; !guess && unit.empty() && n <= 2 && n < words.size(); ++n) {  // "gyro_x_deg_s"
    const std::span<const std::string> all(words);
    const std::string suffix = joined(all.last(n));
    guess = guess_name({words.begin(), words.end() - static_cast<std::ptrdiff_t>(n)}, suffix, stem);
    if (guess && !unit_of(suffix, guess->quantity->dimension)) guess.reset();
    if (guess) unit = suffix;
  }
  if (!guess) return std::nullopt;
  const auto becomes = [&](std::string_view kind) {
    guess->quantity =
        find_quantity(std::string(kind) + std::string(guess->quantity->name.substr(guess->quantity->name.find('.'))));
  };
  if (of_ros && guess->quantity->kind == Kind::kLinear) becomes("accel");
  if (phone && guess->quantity->kind == Kind::kAccel && guess->rank == 1) becomes("linear");
  if (!placed && guess->quantity->name == "velocity.speed") guess->quantity = find_quantity("body.forward");
  if (!placed && guess->quantity->name == "velocity.course") guess->quantity = find_quantity("sighting.bearing");
  if (!placed && guess->quantity->kind == Kind::kFix) return std::nullopt;  // a height alone is no fix
  guess->unit = in_g && unit.empty() ? "g" : unit;
  return guess;
}

}  // namespace tetap::csv
