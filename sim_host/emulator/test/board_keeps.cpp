// SPDX-License-Identifier: Apache-2.0
// board_keeps IMAGE.elf: parameters of a flash image on its emulated board, over the bus, by tetapctl's client. Each
// row is read, set to a neighbour of its value, refused beyond its limits, saved, and there after a power cycle. Exit
// status 1: a row is not, or a model complains.
#include "sim_host/control/parameter_client.hpp"
#include "sim_host/emulator/ark_cannode.hpp"
#include "sim_host/emulator/machine.hpp"
#include "sim_host/emulator/nucleo_g474re.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/e2e.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/param/stored_row.hpp"
#include "tetap/param/table.hpp"

#include <array>
#include <cstdio>
#include <cstring>
#include <deque>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>

namespace {

using namespace tetap;

board::SensorWorld world_at_rest() {
  board::SensorWorld world;
  world.imu = [](board::Picoseconds) { return board::ImuTruth{.force_mps2 = {0, 0, 9.80665}}; };
  world.left_edges = world.right_edges = [](board::Picoseconds) { return std::int64_t{0}; };
  return world;
}

/// A board in virtual time that runs while its client waits.
class Bench {
 public:
  explicit Bench(const std::string& image) : board_(made(image)), machine_(board_->processor, {}) {
    board_->processor.can_line().on_frame = [this](board::Picoseconds, const board::CanOffer& frame, bool own) {
      if (own) frames_.push_back(frame.frame);
    };
    if (const std::string wrong = machine_.load_elf(image); !wrong.empty()) throw std::runtime_error(wrong);
  }
  sim::ParameterClient client() {
    return {kBase, [this](const base::CanFrame& frame) { send(frame); },
            [this](base::Micros patience) { return receive(patience); }, [this] { return now(); }};
  }
  void send(const base::CanFrame& frame) {
    board_->processor.can_line().send(frame, board_->processor.scheduler.now());
  }
  std::optional<base::CanFrame> receive(base::Micros patience) {
    const base::Micros until = now() + patience;
    while (frames_.empty() && now() < until) machine_.run(board_->processor.scheduler.now() + board::kMillisecond);
    if (frames_.empty()) return std::nullopt;
    const base::CanFrame frame = frames_.front();
    return frames_.pop_front(), frame;
  }
  /// Seconds from a power-on to the first epoch.
  double start() {
    frames_.clear();
    const base::Micros began = now();
    while (const auto frame = receive(base::Micros{30'000'000}))
      if (frame->id == kBase + bus::EstEpoch::kOffset) return static_cast<double>((now() - began).us) * 1e-6;
    throw std::runtime_error("the board sends nothing: " + board_->console);
  }
  void power_cycle() { board_->processor.lose_power(); }
  [[nodiscard]] base::Micros now() const {
    return base::Micros{board_->processor.scheduler.now() / board::kMicrosecond};
  }
  [[nodiscard]] int end() const {
    std::printf("resets %d, longest gap of the watchdog %.3f s, %zu complaints\n%s", machine_.resets(),
                static_cast<double>(board_->processor.watchdog().longest_gap() / board::kMicrosecond) * 1e-6,
                board_->processor.complaints.list().size(), board_->processor.complaints.text().c_str());
    return board_->processor.complaints.empty() && !machine_.locked_up() ? 0 : 1;
  }
  static constexpr std::uint32_t kBase = 0x300;

 private:
  static std::unique_ptr<board::Board> made(const std::string& image) {
    if (image.find("nucleo_g474re") != std::string::npos)
      return std::make_unique<board::NucleoG474re>(board::BoardOptions{}, world_at_rest());
    return std::make_unique<board::ArkCannode>(board::BoardOptions{}, world_at_rest());
  }
  std::unique_ptr<board::Board> board_;
  board::Machine machine_;
  std::deque<base::CanFrame> frames_;
};

bool of_access(const param::Row& row) {
  for (const param::StoredRow& stored : param::kStoredRows)
    if (stored.index == row.index) return stored.access;
  return true;
}

/// A set in which every row that the bus may change has another value, as far as no rule between rows is broken.
param::Parameters neighbour(const param::Parameters& of, std::size_t& rows) {
  param::Parameters all = of;
  for (const param::Row& row : param::kTable) {
    if (of_access(row)) continue;
    const double value = row.get(of, 0), span = row.maximum - row.minimum;
    for (const double other :
         {value * 1.01, value * 0.99, value + 1, value - 1, value + 1e-3 * span, row.minimum, row.maximum}) {
      param::Parameters q = all;
      row.set(q, 0, other);
      if (param::crc(q) == param::crc(all) || !param::within(row, row.get(q, 0)) || param::broken_rule(q) != nullptr)
        continue;
      all = q;
      ++rows;
      break;
    }
  }
  return all;
}

/// A word beyond its row's limits is refused by the node itself. False: it was taken.
bool refused(Bench& bench, const param::Row& row, std::uint8_t counter) {
  std::uint32_t beyond = 0x7F800000;  // infinity
  if (row.storage != param::Storage::kFloat) {
    const auto next = static_cast<std::int64_t>(row.maximum) + 1;
    if (next > INT32_MAX) return true;  // every word is a value of the row
    beyond = static_cast<std::uint32_t>(next);
  }
  bench.send(bus::frame(Bench::kBase,
                        bus::protect(bus::CmdParamSet{.ctr = counter, .set_row_id = row.index, .set_value = beyond})));
  const base::Micros until = bench.now() + base::Micros{300'000};
  while (bench.now() < until) {
    const auto frame = bench.receive(until - bench.now());
    if (!frame || frame->id != Bench::kBase + bus::EstParamRow::kOffset) continue;
    const auto told = bus::decode<bus::EstParamRow>(bus::payload(*frame));
    if (told && told->row_ctr == counter && told->row_id == row.index)
      return told->row_answer == bus::ParamAnswer::kOutOfLimits;
  }
  return false;
}

int run(const std::string& image) {
  Bench bench(image);
  std::printf("first epoch after %.3f s\n", bench.start());
  sim::ParameterClient client = bench.client();
  const param::Parameters before = client.read(bus::ParamSource::kActive);
  std::size_t rows = 0, beyond = 0;
  const param::Parameters wanted = neighbour(before, rows);
  for (const param::Row& row : param::kTable) {
    if (of_access(row) || row.size / row.elements == 8) continue;
    if (!refused(bench, row, static_cast<std::uint8_t>(beyond & 0xF)))
      throw std::runtime_error(std::string(row.path) + ": not refused out of its limits");
    ++beyond;
  }
  const bus::EstParamSet set = client.change(before, wanted);
  const param::Parameters active = client.read(bus::ParamSource::kActive);
  const base::Micros saving = bench.now();
  client.save(active);
  std::printf("%zu rows changed, %d of them wait for a restart; %zu refused out of limits; saved in %.3f s\n", rows,
              set.set_pending, beyond, static_cast<double>((bench.now() - saving).us) * 1e-6);
  bench.power_cycle();
  std::printf("first epoch after the power cycle: %.3f s\n", bench.start());
  const param::Parameters kept = client.read(bus::ParamSource::kActive);
  std::size_t other = 0;
  for (const param::Row& row : param::kTable) {
    const auto* const a = reinterpret_cast<const char*>(&kept) + row.offset;
    if (param::is_secret(row) || std::memcmp(a, reinterpret_cast<const char*>(&wanted) + row.offset, row.size) == 0)
      continue;
    ++other;
    std::printf("%s is %.9g, not %.9g\n", row.path, row.get(kept, 0), row.get(wanted, 0));
  }
  std::printf("%zu rows are other than saved\n", other);
  return bench.end() != 0 || other != 0 ? 1 : 0;
}

}  // namespace

int main(int count, char** values) try {
  if (count != 2) throw std::runtime_error("usage: board_keeps IMAGE.elf");
  return run(values[1]);
} catch (const std::exception& error) {
  std::fprintf(stderr, "board_keeps: %s\n", error.what());
  return 1;
}
