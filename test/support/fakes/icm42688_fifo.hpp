// SPDX-License-Identifier: Apache-2.0
// The ICM-42688-P's FIFO memory: whole packets in order, read byte by byte (TDK DS-000347 revision 1.8, sections 6 and
// 14.45).
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

namespace tetap::fakes::icm42688 {

class Fifo {
 public:
  /// 6.3: "the physical FIFO size is 2048 bytes"; one packet is reserved against reading while writing. A read cache of
  /// two packets "may become available for storing", which the sheet calls non-deterministic. The default is the worst
  /// case for the host: 129 packets of 16 bytes, 2064 bytes.
  int read_cache_packets = 2;

  [[nodiscard]] std::size_t capacity(std::size_t packet_bytes) const {
    return (2048 / packet_bytes - 1 + static_cast<std::size_t>(read_cache_packets)) * packet_bytes;
  }

  /// 14.4: stream replaces the oldest, stop-on-full refuses the new. Either way a packet is lost (14.55).
  void write(std::vector<std::uint8_t> packet, bool replaces_oldest) {
    const std::size_t size = packet.size();
    if (!replaces_oldest && bytes() + size > capacity(size)) {
      ++lost_;
      return;
    }
    while (!packets_.empty() && bytes() + size > capacity(size)) {
      drop_front();
      ++lost_;
    }
    packets_.push_back(std::move(packet));
  }

  [[nodiscard]] bool full() const {
    return !packets_.empty() && bytes() + packets_.back().size() > capacity(packets_.back().size());
  }
  /// Bytes left to read. The sheet does not say what a half-read packet counts as; here it is still a record.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& packet : packets_) sum += packet.size();
    return sum - consumed_;
  }
  [[nodiscard]] std::size_t records() const { return packets_.size(); }
  [[nodiscard]] std::uint16_t lost() const { return lost_; }

  /// A burst: begin, any number of next(), end. Past the end comes 0xFF, FIFO_DATA's reset value (14.24), whose bit 7
  /// read as a header says "FIFO is empty" (6.2).
  void begin_burst() {
    packet_ = 0;
    byte_ = consumed_;
    burst_bytes_ = 0;
  }
  [[nodiscard]] std::uint8_t next(bool& beyond_end) {
    beyond_end = packet_ >= packets_.size();
    if (beyond_end) return 0xFF;
    const std::uint8_t value = packets_[packet_][byte_];
    ++burst_bytes_;
    if (++byte_ == packets_[packet_].size()) {
      ++packet_;
      byte_ = 0;
    }
    return value;
  }
  /// 14.45 FIFO_RESUME_PARTIAL_RD. Set: "FIFO read can be partial, and resume from last read point". Clear: "requires
  /// re-reading of the entire FIFO", taken as: a burst shorter than what FIFO_COUNT last said consumes nothing.
  void end_burst(bool resume_partial, std::size_t announced_bytes) {
    if (burst_bytes_ == 0) return;
    if (resume_partial) {
      for (std::size_t i = 0; i < packet_; ++i) drop_front();
      consumed_ = byte_;
    } else if (burst_bytes_ >= std::min(announced_bytes, bytes())) {
      for (std::size_t i = 0; i < packet_; ++i) drop_front();
    }
    burst_bytes_ = 0;
  }
  void clear() {
    packets_.clear();
    consumed_ = 0;
    packet_ = 0;
    byte_ = 0;
  }
  void forget_losses() { lost_ = 0; }

 private:
  void drop_front() {
    packets_.pop_front();
    consumed_ = 0;
  }

  std::deque<std::vector<std::uint8_t>> packets_;
  std::size_t consumed_ = 0;  ///< bytes of the front packet that are read for good
  std::size_t packet_ = 0;    ///< where this burst stands
  std::size_t byte_ = 0;
  std::size_t burst_bytes_ = 0;
  std::uint16_t lost_ = 0;
};

}  // namespace tetap::fakes::icm42688
