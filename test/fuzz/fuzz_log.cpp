// SPDX-License-Identifier: Apache-2.0
// libFuzzer: the candump reader and what is made of a log. Any text is a log, or one clear message; what was read,
// written and read again is the same.
#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/log.hpp"
#include "sim_host/replay/recording.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string_view>

namespace tetap {
namespace {

[[noreturn]] void fail(const char* what, std::string_view detail) {
  std::fprintf(stderr, "fuzz_log: %s: %.*s\n", what, static_cast<int>(detail.size()), detail.data());
  std::abort();
}

void check_message(std::string_view message) {
  if (!message.starts_with("fuzz.log:")) fail("a message without file and line", message);
  for (const char c : message)
    if (c < ' ' || c > '~') fail("a message with control characters", message);
}

void check_round_trip(const sim::TimedFrame& entry) {
  sim::Line line;
  sim::append_log_line(line, entry.time, "vcan0", entry.frame);
  const sim::Log again = sim::parse_log(line.view(), "again");
  if (again.frames.size() != 1) fail("written, but not read", line.view());
  const base::CanFrame& frame = again.frames[0].frame;
  if (again.frames[0].time != entry.time || frame.id != entry.frame.id || frame.extended != entry.frame.extended ||
      frame.size != entry.frame.size || frame.data != entry.frame.data)
    fail("read as something else than was written", line.view());
}

}  // namespace
}  // namespace tetap

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace tetap;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const sim::Log log = sim::parse_log(text, "fuzz.log", {.keep_going = true});
  if (log.failure) return check_message(log.failure->text), 0;  // a line that is too long
  if ((log.malformed > 0) != !log.first_malformed.empty())
    fail("malformed lines without a message", log.first_malformed);
  if (log.malformed > 0) check_message(log.first_malformed);
  const sim::Log strict = sim::parse_log(text, "fuzz.log");
  if (strict.failure) {
    if (strict.failure->text != log.first_malformed) fail("another message than when going on", strict.failure->text);
  } else {
    if (log.malformed > 0) fail("a malformed line was accepted", log.first_malformed);
    if (strict.frames.size() != log.frames.size()) fail("two readings differ", "");
  }
  for (const sim::TimedFrame& entry : log.frames) check_round_trip(entry);

  // A pause of a minute is played in full: a long period keeps the number of its ticks small.
  const sim::ScriptOptions options{.period = base::Micros{1'000'000}};
  sim::FramesInMemory frames(log.frames);
  const std::size_t inputs = sim::inputs_of(frames, options).size();
  const bool has_ticks = std::any_of(log.frames.begin(), log.frames.end(), [&](const sim::TimedFrame& entry) {
    return sim::is_tick(entry.frame, options.log_base);
  });
  sim::LogTicks ticks(frames, options, has_ticks);
  sim::Tick tick;
  while (ticks.next(tick)) continue;
  if (ticks.inputs() != inputs) fail("inputs were lost on the way to the ticks", "");
  if (const auto surveyed = sim::recording_of(frames, "fuzz.log", options)) {
    const sim::Recording& recording = *surveyed;
    sim::RecordedTicks repeated(frames, recording, options);
    std::uint64_t given = 0;
    for (; repeated.next(tick); ++given)
      if (!repeated.answer(tick.time)) fail("a tick of the record without its answer", "");
    if (given != recording.epochs) fail("other ticks than the survey saw", "");
  } else if (!surveyed.failure().text.starts_with("fuzz.log: ")) {
    fail("a message without the file", surveyed.failure().text);
  }
  return 0;
}
