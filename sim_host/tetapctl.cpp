// SPDX-License-Identifier: Apache-2.0
// tetapctl: reads and changes the parameters of a running node over its bus.
#include "hal/board/linux/socket_can.hpp"
#include "sim_host/control/image_header.hpp"
#include "sim_host/control/parameter_client.hpp"
#include "sim_host/control/scan.hpp"
#include "sim_host/control/slcan.hpp"
#include "sim_host/parameter_settings.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/table.hpp"

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

namespace {

using namespace tetap;
using bus::ParamSource;

constexpr const char* kHelp =
    "usage: tetapctl [OPTION]... COMMAND\n\nParameters of a running node whose robot takes them from the bus.\n\n"
    "  scan               nodes on the bus: first identifier, commit, configuration, whether they take parameters\n"
    "  list               all rows with their active values\n"
    "  get PATH...        rows of these paths\n"
    "  diff               rows that are not as compiled: path, compiled value, active value\n"
    "  set PATH=VALUE...  all of these at one tick, or none\n"
    "  load FILE          the same with a file of `path = value` lines\n"
    "  apply              makes active what is staged, by an SDO client for example; with --restart the rows that "
    "need\n"
    "                     a restart too: the estimators begin anew, without map and origin of the\n"
    "                     bus, and a vehicle that moves refuses it\n"
    "  save               keeps the parameters without power, where the board can\n"
    "  restore            the compiled values, but for those of access\n"
    "  claim              gives a node without a key its first one, within a minute of power-on; a key file that is "
    "not "
    "there is made\n"
    "  image FILE         what a flash image (.bin, .elf) is for; refused where it is damaged, cut or another "
    "board's\n"
    "  export LOG OUT.mcap [OPTION]...  a log as MCAP or tables; `tetapctl export --help`\n\n"
    "  --can NAME         SocketCAN interface, --interface as well (default vcan0)\n"
    "  --slcan PORT       a serial port with an slcan adapter instead, --bitrate N (default 500000)\n"
    "  --base ID          first identifier of the node's block (default 0x300)\n"
    "  --board NAME       image: refused where it is for another board; --robot NAME in the same way\n"
    "  --key FILE         32 hexadecimal digits, for a node that obeys commands with a tag alone (default: TETAP_KEY "
    "of "
    "the environment)\n"
    "  --json             scan, list, get, diff: a list; else an object with the result\n\n"
    "A row that needs a restart waits for a Begin frame, a save or `apply --restart`.\n"
    "Status: 0 done, 1 refused or no answer, 2 wrong command line.\n";

base::Micros now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return {time.tv_sec * 1'000'000 + time.tv_nsec / 1'000};
}

std::optional<base::CanFrame> receive(hal::SocketCan& can, base::Micros patience) {
  const base::Micros until = now() + patience;
  for (;;) {
    if (const auto frame = can.receive()) return frame;
    const base::Micros left = until - now();
    if (left.us <= 0) return std::nullopt;
    can.wait(left);
  }
}

/// The key, or none where none is given. `made`: a file that is not there is made.
std::optional<base::SipKey> read_key(const std::optional<std::string>& file, bool made) {
  const char* const environment = std::getenv("TETAP_KEY");
  if (!file && environment == nullptr) return std::nullopt;
  std::string digits = file ? "" : environment;
  if (file) {
    if (const int create = made ? ::open(file->c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600) : -1;
        create >= 0) {
      std::array<unsigned char, 16> bytes{};
      bool whole = ::getrandom(bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
      for (const unsigned char byte : bytes) whole = whole && ::dprintf(create, "%02x", byte) == 2;
      whole = ::fsync(create) == 0 && whole;
      if (::close(create) != 0 || !whole) throw sim::UsageError(*file + ": cannot be written");
    }
    std::ifstream in(*file);
    if (!in) throw sim::UsageError(*file + ": " + std::strerror(errno));
    digits.assign(std::istreambuf_iterator<char>(in), {});
  }
  while (!digits.empty() && std::isspace(static_cast<unsigned char>(digits.back())) != 0) digits.pop_back();
  const auto key = sim::key_of_digits(digits);
  if (!key) throw sim::UsageError((file ? *file : "TETAP_KEY") + ": a key is 32 hexadecimal digits, not all zero");
  return key;
}

/// tools/can/export_log of the tree that this program was built in takes over: from build/PRESET/sim_host.
int export_log(const std::vector<std::string>& words) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const std::string tool = (program.parent_path() / "../../../tools/can/export_log").lexically_normal().string();
  std::vector<char*> arguments{const_cast<char*>(tool.c_str())};
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  ::execv(tool.c_str(), arguments.data());
  std::fprintf(stderr, "tetapctl: %s: %s; export needs the source tree\n", tool.c_str(), std::strerror(errno));
  return 1;
}

/// A bus by either adapter.
struct Port {
  std::unique_ptr<hal::SocketCan> can;
  std::unique_ptr<sim::Slcan> slcan;
  void send(const base::CanFrame& frame) const {
    if (slcan) return slcan->send(frame);
    can->send(frame);
    can->flush();
  }
  [[nodiscard]] std::optional<base::CanFrame> next(base::Micros patience) const {
    return slcan ? slcan->receive(patience) : receive(*can, patience);
  }
};

const param::Row& row_of(const std::string& path) {
  for (const param::Row& row : param::kTable)
    if (path == row.path) return row;
  throw sim::UsageError("there is no parameter '" + path + "'");
}

struct Printer {
  bool json;
  bool first = true;
  void row(const param::Row& row, const param::Parameters& p, const param::Parameters* compiled = nullptr) {
    if (json) {
      std::printf("%s {\"path\": \"%s\", \"unit\": \"%s\", \"value\": %s", first ? "[\n" : ",\n", row.path, row.unit,
                  sim::json_value(row, p).c_str());
      if (compiled != nullptr) std::printf(", \"compiled\": %s", sim::json_value(row, *compiled).c_str());
      std::printf(", \"needs_restart\": %s}", row.effect == param::Effect::kRestart ? "true" : "false");
    } else if (compiled != nullptr) {
      std::printf("%s: %s -> %s %s\n", row.path, sim::value_text(row, *compiled).c_str(),
                  sim::value_text(row, p).c_str(), row.unit);
    } else {
      std::printf("%-48s %s%s\n", (std::string(row.path) + " = " + sim::value_text(row, p)).c_str(),
                  *row.unit == '\0' ? "" : "# ", row.unit);
    }
    first = false;
  }
  void end() const {
    if (json) std::fputs(first ? "[]\n" : "\n]\n", stdout);
  }
};

void print_result(const bus::EstParamSet& set, bool json) {
  if (json)
    return void(std::printf("{\"configuration\": %u, \"words_not_as_compiled\": %u, \"rows_pending\": %u}\n",
                            set.set_config, set.set_changed, set.set_pending));
  std::printf("done: configuration 0x%08X, %u words are not as compiled", set.set_config, set.set_changed);
  if (set.set_pending != 0) std::printf(", %u rows wait for a restart", set.set_pending);
  std::fputs("\n", stdout);
}

void print_nodes(const std::vector<sim::FoundNode>& nodes, bool json) {
  if (nodes.empty() && !json)
    throw sim::ControlError("no node sends on this bus; a board with a new flash erases it first, for some seconds");
  const char* separator = "[\n";
  for (const sim::FoundNode& node : nodes) {
    const bus::EstVersion version = node.version.value_or(bus::EstVersion{});  // commit 0: it did not come
    const char* const dirty = version.dirty ? "-dirty" : "";
    if (json)
      std::printf("%s {\"base\": %u, \"commit\": \"%07x%s\", \"configuration\": %u, \"parameters\": %s}", separator,
                  node.can_base, version.git, dirty, version.config, node.parameters ? "true" : "false");
    else
      std::printf("0x%03X  commit %07x%s, configuration 0x%08X, %s\n", node.can_base, version.git, dirty,
                  version.config, node.parameters ? "takes parameters" : "takes no parameters from the bus");
    separator = ",\n";
  }
  if (json) std::fputs(nodes.empty() ? "[]\n" : "\n]\n", stdout);
}

std::vector<std::uint8_t> content_of(const std::string& path) {
  std::FILE* const in = std::fopen(path.c_str(), "rb");
  if (in == nullptr) throw sim::ImageRefused("cannot be opened");
  std::vector<std::uint8_t> content;
  std::array<std::uint8_t, 1 << 14> piece{};
  for (std::size_t n = 0; (n = std::fread(piece.data(), 1, piece.size(), in)) > 0;)
    content.insert(content.end(), piece.begin(), piece.begin() + static_cast<std::ptrdiff_t>(n));
  const bool failed = std::ferror(in) != 0;
  std::fclose(in);
  if (failed) throw sim::ImageRefused("cannot be read");
  return content;
}

/// Board and robot that an image must be for; empty: any.
struct Wanted {
  std::string board, robot;
};

void print_image(const std::string& path, const Wanted& wanted, bool json) try {
  const sim::ImageHeader header = sim::read_image(content_of(path));
  for (const auto& [what, name, given] :
       {std::tuple{"board", header.board, wanted.board}, std::tuple{"robot", header.robot, wanted.robot}})
    if (!given.empty() && name != given)
      throw sim::ImageRefused(std::string("for ") + what + " '" + name + "', not for '" + given + "'");
  std::printf(json ? "{\"board\": \"%s\", \"robot\": \"%s\", \"commit\": \"%07x%s\", \"length\": %u, \"address\": %u, "
                     "\"crc32\": %u}\n"
                   : "whole: board %s, robot %s, commit %07x%s, %u bytes for 0x%08X, CRC-32 0x%08X\n",
              header.board.c_str(), header.robot.c_str(), header.commit >> 4,
              (header.commit & 15U) != 0 ? "-dirty" : "", header.length, header.address, header.crc);
} catch (const sim::ImageRefused& refused) {
  throw sim::ImageRefused(path + ": " + refused.what());
}

void run(const std::string& command, const std::vector<std::string>& words, sim::ParameterClient& client, bool json) {
  const param::Parameters active = client.read(ParamSource::kActive);
  Printer printer{json};
  if (command == "list") {
    for (const param::Row& row : param::kTable)
      if (!param::is_secret(row)) printer.row(row, active);
    printer.end();
  } else if (command == "get") {
    for (const std::string& path : words) printer.row(row_of(path), active);
    printer.end();
  } else if (command == "diff") {
    const param::Parameters compiled = client.read(ParamSource::kCompiled);
    for (const param::Row& row : param::kTable)
      if (sim::value_text(row, active) != sim::value_text(row, compiled)) printer.row(row, active, &compiled);
    printer.end();
  } else if (command == "apply") {
    print_result(client.apply(active), json);
  } else if (command == "restart") {
    print_result(client.restart(active), json);
  } else if (command == "save") {
    print_result(client.save(active), json);
  } else if (command == "claim") {
    print_result(client.claim(active), json);
  } else if (command == "restore") {
    print_result(client.restore(active), json);
  } else {
    std::vector<std::string> arguments;
    for (const std::string& word : words)
      arguments.insert(arguments.end(), {command == "load" ? "--params" : "--set", word});
    sim::Arguments given(arguments);
    print_result(client.change(active, sim::ParameterSettings(given).over(active)), json);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> given(argv + 1, argv + argc);
  const auto first = std::find_if(given.begin(), given.end(), [](const auto& word) { return !word.starts_with("-"); });
  if (first != given.end() && *first == "export") return given.erase(first), export_log(given);
  sim::Arguments arguments(given);
  if (arguments.flag("--help") || arguments.flag("-h")) return std::fputs(kHelp, stdout), 0;
  const std::string interface = arguments.text("--interface").value_or("vcan0");
  const std::string name = arguments.text("--can").value_or(interface);
  const auto serial = arguments.text("--slcan");
  const auto bitrate = static_cast<std::uint32_t>(arguments.integer("--bitrate", 500'000, 10'000, 1'000'000));
  const auto key_file = arguments.text("--key");
  const std::uint32_t base = arguments.base();
  const bool json = arguments.flag("--json");
  const Wanted wanted{arguments.text("--board").value_or(""), arguments.text("--robot").value_or("")};
  const bool restarts = arguments.flag("--restart");
  std::vector<std::string> words;
  while (auto word = arguments.positional()) words.push_back(std::move(*word));
  arguments.finish();
  const std::string command = words.empty() ? "" : words.front();
  if (!words.empty()) words.erase(words.begin());
  const bool needs_words = command == "image" || command == "get" || command == "set" || command == "load";
  constexpr std::array kAlone{"scan", "list", "diff", "apply", "save", "restore", "claim"};
  if (!needs_words && std::find(kAlone.begin(), kAlone.end(), command) == kAlone.end())
    throw sim::UsageError(command.empty() ? "no command; see tetapctl --help"
                                          : "there is no command '" + command + "'");
  if (needs_words == words.empty()) throw sim::UsageError(command + (needs_words ? " needs a path" : " takes no path"));
  if (restarts && command != "apply") throw sim::UsageError("--restart is for apply");
  if (command == "get")
    for (const std::string& path : words) static_cast<void>(row_of(path));
  if (command == "image") {
    for (const std::string& path : words) print_image(path, wanted, json);
    return 0;
  }
  if (!wanted.board.empty() || !wanted.robot.empty()) throw sim::UsageError("--board and --robot are for image");
  const auto key = read_key(key_file, command == "claim");
  if (command == "claim" && !key) throw sim::UsageError("claim needs --key FILE, or TETAP_KEY in the environment");
  Port port;
  if (serial)
    port.slcan = std::make_unique<sim::Slcan>(*serial, bitrate);
  else
    port.can = std::make_unique<hal::SocketCan>(name);
  const sim::ParameterClient::Send send = [&](const base::CanFrame& frame) { port.send(frame); };
  const sim::ParameterClient::Receive next = [&](base::Micros patience) { return port.next(patience); };
  if (command == "scan") return print_nodes(sim::scan(send, next, now), json), 0;
  sim::ParameterClient client(base, send, next, now);
  if (key) client.use_key(*key);
  run(restarts ? "restart" : command, words, client, json);
  return 0;
} catch (const tetap::sim::UsageError& error) {
  std::fprintf(stderr, "tetapctl: %s\n", error.what());
  return 2;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tetapctl: %s\n", error.what());
  return 1;
}
