// SPDX-License-Identifier: Apache-2.0
// A CAN adapter at a serial port that speaks slcan (the Lawicel protocol): one line of ASCII a frame.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tetap::sim {

/// A frame as its line, with its end.
[[nodiscard]] std::string slcan_line(const base::CanFrame& frame);
/// The data frame of a line without its end, with or without a time stamp behind; none for anything else.
[[nodiscard]] std::optional<base::CanFrame> frame_of_slcan(std::string_view line);

class Slcan {
 public:
  /// Opens the bus. Throws std::runtime_error with one line that names the port: it cannot be opened, or the adapter
  /// refuses the bitrate.
  Slcan(const std::string& port, std::uint32_t bitrate);
  ~Slcan();
  Slcan(const Slcan&) = delete;
  Slcan& operator=(const Slcan&) = delete;

  /// Throws std::runtime_error where the port takes no more for a second.
  void send(const base::CanFrame& frame) { write(slcan_line(frame)); }
  /// The next data frame, or none after so long. Throws std::runtime_error where the port is gone.
  std::optional<base::CanFrame> receive(base::Micros patience);

 private:
  static constexpr std::size_t kLongestLine = 64;
  void write(const std::string& text);
  /// A command; false: the adapter answers with a bell. Some adapters answer nothing.
  bool command(const std::string& text);
  /// The next line or bell, without its end.
  std::optional<std::string> line(base::Micros patience);

  std::string port_;
  int file_ = -1;
  std::string received_;
};

}  // namespace tetap::sim
