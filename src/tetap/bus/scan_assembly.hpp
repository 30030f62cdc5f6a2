// SPDX-License-Identifier: Apache-2.0
// In_ScanHead and its In_Scan blocks as a sample. The blocks come in their order from one sender; one that is not the
// next ends what was begun, so blocks of two scans are never mixed. The ranges go into a pool, and the sample names
// their place there. In_Scan frames are a tenth of a bus, so a block is read as integers.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/sample.hpp"
#include "tetap/sensor/scan_pool.hpp"

#include <array>
#include <cstdint>

namespace tetap::bus {

class ScanAssembly {
 public:
  void power_on() {
    left_ = 0;
    pool_.power_on();
  }
  /// At each tick: a scan of which no frame came for `patience`, or which is from a time still to come, is given up.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    if (left_ != 0 && (now - since_ > patience || since_ > now)) give_up(counters);
  }
  /// Time has jumped: a half belongs to another time.
  void discard(Counters& counters) {
    if (left_ != 0) give_up(counters);
  }
  [[nodiscard]] static constexpr bool takes(std::uint8_t offset) {
    return offset == InScanHead::kOffset || offset == InScan::kOffset;
  }
  [[nodiscard]] const sensor::Scans& pool() const { return pool_; }
  /// A frame of a scan, with its CRC; a whole scan goes to out.sample().
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                Counters& counters, Out&& out) {
    const auto bytes = payload(frame);
    if (bytes.size() != 8) return void(++counters.malformed);
    if (offset == InScanHead::kOffset) return begin(*decode<InScanHead>(bytes), bits, reference, counters);
    const std::uint64_t packed = word(bytes);
    const auto sequence = static_cast<std::uint8_t>(InScan::kSeq.get(packed));
    const auto block = static_cast<std::uint8_t>(InScan::kBlock.get(packed));
    if (left_ == 0) return void(++counters.incomplete);
    if (sequence != sample_.sequence || block != next_) return give_up(counters);
    constexpr std::array kRanges{InScan::kRange0, InScan::kRange1, InScan::kRange2, InScan::kRange3};
    for (const Signal& range : kRanges) {
      if (left_ == 0) break;
      const auto steps = static_cast<std::uint16_t>(range.get(packed));
      const auto beam = static_cast<std::uint16_t>(sample_.payload.scan.beams - left_);
      pool_.put(beam, steps == static_cast<std::uint16_t>(range.gap()) ? std::uint16_t{0} : steps);
      --left_;
    }
    ++next_;
    sample_.bits += bits;
    since_ = reference;
    if (left_ == 0) out.sample(sample_);
  }

 private:
  void give_up(Counters& counters) {
    left_ = 0;
    ++counters.incomplete;
  }
  void begin(const InScanHead& head, std::uint32_t bits, base::Micros reference, Counters& counters) {
    if (left_ != 0) give_up(counters);
    const bool fits = head.count >= 3 && head.count <= sensor::Scans::kMostBeams;
    if (!fits || !all_finite(head.first_rad, head.step_rad)) return void(++counters.out_of_range);
    sample_ = stamped(head, sensor::Sensor::kScan, bits, reference);
    pool_.begin();
    left_ = head.count;
    sample_.payload.scan = {.number = pool_.newest(),
                            .first_rad = head.first_rad,
                            .step_rad = head.step_rad,
                            .beams = head.count,
                            .sequence = head.seq};
    next_ = 0;
    since_ = reference;
  }

  sensor::Scans pool_;
  sensor::Sample sample_;
  base::Micros since_;      ///< arrival of the latest frame of the scan
  std::uint16_t left_ = 0;  ///< ranges of the scan that are still to come; 0: no scan
  std::uint8_t next_ = 0;   ///< block that comes next
};

/// For robots none of whose estimators takes scans: no memory.
struct NoScans {
  static void power_on() {}
  static void expire(base::Micros, base::Micros, Counters&) {}
  static void discard(Counters&) {}
};

}  // namespace tetap::bus
