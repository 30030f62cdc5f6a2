// SPDX-License-Identifier: Apache-2.0
#include "sim_host/play/log.hpp"

#include "sim_host/play/candump.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <variant>

namespace tetap::sim {

namespace {

/// What may be shown on a terminal of a line that may be anything.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 60;
  std::string shown(text.substr(0, kLongest));
  for (char& c : shown)
    if (c < ' ' || c > '~') c = '?';
  return text.size() > kLongest ? shown + "..." : shown;
}

void add_line(Log& log, const LogLine& line, std::uint64_t number, const LogOptions& options, base::Micros& latest) {
  constexpr base::Micros kLongGap{60'000'000};
  if (!options.interface.empty() && line.interface != options.interface) return void(++log.other_interface);
  if (line.kind != LogLine::Kind::kData) return void(++log.not_data);
  if (line.time < latest) ++log.back_in_time;
  if (!log.frames.empty() && kLongGap < line.time - latest && log.gaps++ == 0)
    log.first_gap = log.name + ":" + std::to_string(number);
  if (latest < line.time) latest = line.time;
  const base::CanFrame frame = line.classic();
  constexpr std::uint32_t kInputs = 0x20;
  const bool input = !frame.extended && frame.id >= options.base && frame.id < options.base + kInputs;
  if (input && frame.size != 8 && log.wrong_length++ == 0)
    log.first_wrong_length = log.name + ":" + std::to_string(number);
  log.frames.push_back({line.time, frame});
}

}  // namespace

Log parse_log(std::string_view text, const std::string& name, const LogOptions& options) {
  Log log;
  log.name = name;
  log.frames.reserve(text.size() / 40);
  base::Micros latest{};
  std::uint64_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const auto parsed = parse_log_line(line);
    if (const auto* good = std::get_if<LogLine>(&parsed)) {
      add_line(log, *good, number, options, latest);
      continue;
    }
    const std::string message = name + ":" + std::to_string(number) + ": " +
                                std::string(std::get<BadLine>(parsed).reason) + ": '" + excerpt(line) + "'";
    if (!options.keep_going) throw std::runtime_error(message);
    if (log.malformed++ == 0) log.first_malformed = message;
  }
  return log;
}

Log read_log(const std::string& path, const LogOptions& options) {
  const auto refuse = [&path](const std::string& reason) { throw std::runtime_error(path + ": " + reason); };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) refuse(std::string("cannot be read: ") + std::strerror(errno));
  std::string text;
  constexpr std::size_t kBlock = 1 << 20;
  for (std::size_t got = kBlock; got == kBlock;) {
    const std::size_t before = text.size();
    text.resize(before + kBlock);
    got = std::fread(text.data() + before, 1, kBlock, file.get());
    text.resize(before + got);
  }
  if (std::ferror(file.get()) != 0) refuse(std::string("cannot be read: ") + std::strerror(errno));
  Log log = parse_log(text, path, options);
  if (log.frames.empty())
    refuse(
        log.other_interface > 0 ? "no frame of interface " + options.interface : std::string("no CAN data frame in it"));
  return log;
}

}  // namespace tetap::sim
