// SPDX-License-Identifier: Apache-2.0
// A planar scanner wired to the node's board: each whole turn becomes In_ScanHead and its 90 In_Scan. The frames leave
// one by one, so that a scan never fills the queue of the bus.
#pragma once

#include "drivers/lidar/ld19/driver.hpp"
#include "hal/byte_stream.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/encoder.hpp"
#include "tetap/firmware/wired_sensors.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

namespace tetap::firmware {

template <hal::ByteStream Port>
class WiredLidar {
 public:
  explicit WiredLidar(Port& port) : port_(port), driver_(port) {}

  /// put(message) for each frame that is due; `offset`: bus time minus board time.
  template <class Put>
  void poll(base::Micros now, base::Micros offset, Put&& put) {
    if constexpr (hal::SerialPort<Port>) {
      if (!std::exchange(opened_, true)) port_.set_baud(drivers::ld19::kBaud);
    }
    driver_.poll(now, [&](std::span<const std::uint16_t, kBeams> ranges, base::Micros first) {
      std::copy(ranges.begin(), ranges.end(), ranges_.begin());
      head_ = bus::SampleHead::of(first + offset, sequence_++, 0);
      next_ = 0;
      due_ = now;
    });
    for (; next_ < kFrames && now >= due_; ++next_, due_ += kFrameEvery) send(put);
  }

  /// The line's state in the receiver's fields: read only, and no receiver is wired.
  void note(bus::EstDiagWired& page) const {
    const hal::SerialFaults line = port_.faults();
    page.gnss_state = bus::GnssState::kReadOnly;
    page.gnss_baud = drivers::ld19::kBaud;
    page.gnss_checksum = saturated<std::uint8_t>(driver_.health().crc, 0xFF);
    page.gnss_framing = saturated<std::uint8_t>(line.framing, 0xFF);
    page.gnss_lost = saturated<std::uint8_t>(std::uint64_t{line.overrun} + line.lapped, 63);
  }
  [[nodiscard]] const drivers::ld19::Health& health() const { return driver_.health(); }
  /// Whether frames with this offset in the node's block are made here.
  [[nodiscard]] static constexpr bool owns(std::uint32_t offset) {
    return offset == bus::InScanHead::kOffset || offset == bus::InScan::kOffset;
  }

 private:
  static constexpr std::size_t kBeams = drivers::Turn::kBins, kFrames = 1 + kBeams / 4;
  /// All of a scan in 37 ms, within a window of 100 ms of its middle: 60 % of a bus of 500 kbit/s for so long.
  static constexpr base::Micros kFrameEvery{400};
  static_assert(std::int64_t{kFrames} * kFrameEvery.us * drivers::ld19::kMostSpeed_degps < 360'000'000);
  static constexpr float kStep_rad = -0.0174532925F;  ///< the scanner turns clockwise

  template <class Put>
  void send(Put& put) const {
    if (next_ == 0)
      return put(bus::InScanHead{
          .stamp_us = head_.stamp_us, .seq = head_.seq, .count = kBeams, .first_rad = 0, .step_rad = kStep_rad});
    const std::size_t first = 4 * (next_ - 1);
    const auto range_m = [&](std::size_t i) { return 1e-3F * drivers::Turn::kStep_mm * ranges_[first + i]; };
    put(bus::InScan{.seq = head_.seq,
                    .block = static_cast<std::uint8_t>(next_ - 1),
                    .range0_m = range_m(0),
                    .range1_m = range_m(1),
                    .range2_m = range_m(2),
                    .range3_m = range_m(3)});
  }

  Port& port_;
  drivers::ld19::Driver<Port> driver_;
  std::array<std::uint16_t, kBeams> ranges_{};
  bus::SampleHead head_{};
  std::size_t next_ = kFrames;  ///< frame of the scan that goes out next
  base::Micros due_{};
  std::uint8_t sequence_ = 0;
  bool opened_ = false;
};

}  // namespace tetap::firmware
