// SPDX-License-Identifier: Apache-2.0
#include "sim_host/played_run.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <utility>

namespace tetap::sim {

namespace {

std::string_view trimmed(std::string_view text) {
  constexpr const char* kBlanks = " \t\r";
  const auto first = text.find_first_not_of(kBlanks);
  return first == std::string_view::npos ? "" : text.substr(first, text.find_last_not_of(kBlanks) + 1 - first);
}

/// Mistake in a value; empty: none.
std::string take(std::string_view name, std::string_view value, PlayedRun& run) {
  if (name == "robot") {
    if (value.empty()) return "a robot has a name";
    run.robot = value;
  } else if (name == "seed") {
    const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), run.seed);
    if (error != std::errc{} || end != value.data() + value.size()) return "a seed is a whole number of 64 bits";
  } else if (name == "duration") {
    const std::optional<base::Micros> duration = parse_seconds(value);
    if (!duration || duration->us < 10'000) return "a duration is a number of seconds from 0.01 on";
    run.duration = *duration;
  } else if (name == "fault") {
    const FaultsParsed parsed = parse_faults(value);
    if (!parsed.error.empty()) return parsed.error;
    if (parsed.settings.empty()) return "a fault is NAME@START+DURATION";
    run.faults.insert(run.faults.end(), parsed.settings.begin(), parsed.settings.end());
  } else {
    return "no line begins with '" + std::string(name) + "'; there are robot, seed, duration, fault";
  }
  return "";
}

}  // namespace

std::string text_of(const PlayedRun& run) {
  std::string text = "# A played run: make sim FAULT=this file repeats it to the bit.\nrobot = " + run.robot +
                     "\nseed = " + std::to_string(run.seed) + "\nduration = " + seconds_text(run.duration) + "\n";
  for (const FaultSetting& fault : run.faults) text += "fault = " + text_of(fault) + "\n";
  return text;
}

std::string fault_words(const PlayedRun& run) {
  std::string words;
  for (const FaultSetting& fault : run.faults) words += (words.empty() ? "" : ",") + text_of(fault);
  return words;
}

Result<PlayedRun> played_run(std::string_view text, const std::string& name) {
  PlayedRun run;
  std::string seen = " ";
  for (std::uint64_t number = 1; !text.empty(); ++number) {
    const std::string_view whole = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), whole.size() + 1));
    const std::string_view line = trimmed(whole.substr(0, whole.find('#')));
    if (line.empty()) continue;
    const auto equals = line.find('=');
    const std::string key{trimmed(line.substr(0, equals))};
    const auto complain = [&](const std::string& why) {
      return Failure{name + ":" + std::to_string(number) + ": " + why, number};
    };
    if (equals == std::string_view::npos) return complain("a line is 'name = value'");
    if (key != "fault" && seen.find(" " + key + " ") != std::string::npos) return complain(key + " comes twice");
    if (const std::string why = take(key, trimmed(line.substr(equals + 1)), run); !why.empty()) return complain(why);
    seen += key + " ";
  }
  for (const char* const key : {"robot", "seed", "duration"})
    if (seen.find(std::string(" ") + key + " ") == std::string::npos)
      return Failure{name + ": no line '" + key + " = ...'"};
  return run;
}

}  // namespace tetap::sim
