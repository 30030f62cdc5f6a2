// SPDX-License-Identifier: Apache-2.0
#include "sim_host/control/slcan.hpp"

#include "hal/board/linux/clock.hpp"

#include <fcntl.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace tetap::sim {
namespace {

constexpr char kEnd = '\r', kBell = '\a';
constexpr base::Micros kAnswer{200'000}, kRoom{1'000'000};
constexpr std::array<std::uint32_t, 9> kBitrates{10'000,  20'000,  50'000,  100'000,  125'000,
                                                 250'000, 500'000, 800'000, 1'000'000};

template <class Number>
bool read_hex(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  return error == std::errc{} && end == text.data() + text.size();
}
bool is_ready(int file, short events, base::Micros patience) {
  pollfd waiting{.fd = file, .events = events, .revents = 0};
  const auto ms = static_cast<int>((std::max<std::int64_t>(patience.us, 0) + 999) / 1'000);
  return ::poll(&waiting, 1, ms) > 0 && (waiting.revents & events) != 0;
}

}  // namespace

std::string slcan_line(const base::CanFrame& frame) {
  std::array<char, 32> text{};
  const int size = std::snprintf(text.data(), text.size(), frame.extended ? "T%08X%u" : "t%03X%u",
                                 static_cast<unsigned>(frame.id), static_cast<unsigned>(frame.size));
  std::string line(text.data(), static_cast<std::size_t>(size));
  for (std::size_t i = 0; i < frame.size; ++i) {
    std::snprintf(text.data(), text.size(), "%02X", static_cast<unsigned>(frame.data[i]));
    line += text.data();
  }
  return line + kEnd;
}

std::optional<base::CanFrame> frame_of_slcan(std::string_view line) {
  if (line.empty() || (line[0] != 't' && line[0] != 'T')) return std::nullopt;
  base::CanFrame frame{.extended = line[0] == 'T'};
  const std::size_t digits = frame.extended ? 8 : 3;
  if (line.size() < digits + 2 || !read_hex(line.substr(1, digits), frame.id)) return std::nullopt;
  if (!read_hex(line.substr(1 + digits, 1), frame.size) || frame.size > 8) return std::nullopt;
  const std::string_view data = line.substr(2 + digits);
  const std::size_t stamp = 4;
  if (data.size() != std::size_t{2} * frame.size && data.size() != std::size_t{2} * frame.size + stamp)
    return std::nullopt;
  for (std::size_t i = 0; i < frame.size; ++i)
    if (!read_hex(data.substr(2 * i, 2), frame.data[i])) return std::nullopt;
  return frame;
}

Slcan::Slcan(const std::string& port, std::uint32_t bitrate) : port_(port) {
  const auto* const found = std::find(kBitrates.begin(), kBitrates.end(), bitrate);
  if (found == kBitrates.end())
    throw std::runtime_error(port + ": slcan has no bitrate of " + std::to_string(bitrate) + " bit/s");
  file_ = ::open(port.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file_ < 0) throw std::runtime_error(port + ": " + std::strerror(errno));
  termios settings{};
  if (::tcgetattr(file_, &settings) != 0) {
    ::close(file_);
    throw std::runtime_error(port + ": no serial port");
  }
  ::cfmakeraw(&settings);
  ::cfsetspeed(&settings, B115200);
  ::tcsetattr(file_, TCSANOW, &settings);
  ::tcflush(file_, TCIOFLUSH);
  static_cast<void>(command("C"));  // refused where it was closed
  const std::string speed = "S" + std::to_string(found - kBitrates.begin());
  if (command(speed) && command("O")) return;
  ::close(file_);
  throw std::runtime_error(port + ": the adapter refuses to open its bus with " + std::to_string(bitrate) + " bit/s");
}

Slcan::~Slcan() {
  static_cast<void>(::write(file_, "C\r", 2) == 2);
  ::close(file_);
}

std::optional<base::CanFrame> Slcan::receive(base::Micros patience) {
  const base::Micros until = hal::monotonic_clock() + patience;
  for (;;) {
    const auto text = line(until - hal::monotonic_clock());
    if (!text) return std::nullopt;
    if (auto frame = frame_of_slcan(*text)) return frame;
  }
}

void Slcan::write(const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(file_, text.data() + done, text.size() - done);
    if (count > 0)
      done += static_cast<std::size_t>(count);
    else if (errno != EAGAIN || !is_ready(file_, POLLOUT, kRoom))
      throw std::runtime_error(port_ + ": the adapter takes no frame");
  }
}

bool Slcan::command(const std::string& text) {
  write(text + kEnd);
  const auto answer = line(kAnswer);
  return !answer || *answer != std::string(1, kBell);
}

std::optional<std::string> Slcan::line(base::Micros patience) {
  const base::Micros until = hal::monotonic_clock() + patience;
  for (;;) {
    constexpr std::array kEnds{kEnd, kBell};
    const auto end = std::find_first_of(received_.begin(), received_.end(), kEnds.begin(), kEnds.end());
    if (end != received_.end()) {
      std::string text(received_.begin(), *end == kBell ? end + 1 : end);
      received_.erase(received_.begin(), end + 1);
      return text;
    }
    if (received_.size() > kLongestLine) received_.clear();
    if (!is_ready(file_, POLLIN, until - hal::monotonic_clock())) return std::nullopt;
    std::array<char, 4096> bytes{};
    const ssize_t count = ::read(file_, bytes.data(), bytes.size());
    if (count <= 0) throw std::runtime_error(port_ + ": the port is gone");
    received_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace tetap::sim
