// SPDX-License-Identifier: Apache-2.0
// Checksums of other frames in frames of their own (In_Guard): against damage and against frames of a stray sender, not
// against malice. CRC-16/IBM-3740 over id offset and data.
#pragma once

#include "tetap/base/can_frame.hpp"
#include "tetap/base/crc.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace tetap::bus {

[[nodiscard]] constexpr std::uint16_t guard_crc(std::uint8_t offset, std::span<const std::uint8_t> data) {
  base::Crc16 crc;
  crc.add(offset);
  crc.add(data);
  return crc.value();
}

/// A sync frame's guard: no input of the estimators, and not counted as one.
[[nodiscard]] constexpr bool is_sync_guard(std::uint32_t offset, const base::CanFrame& frame) {
  return offset == InGuardSync::kOffset && frame.size == 8 && (frame.data[0] & 0x0FU) == InGuardSync::kPage;
}

/// A guard or tag of an input.
[[nodiscard]] constexpr bool is_guard(std::uint8_t offset, const base::CanFrame& frame) {
  const unsigned page = frame.data[0] & 0x0FU;
  return offset == InGuardSample::kOffset && frame.size == 8 &&
         (page == InGuardSample::kPage || page == InGuardEntry::kPage || page == InGuardTag::kPage);
}

/// The guard to be sent before this In_Sync frame.
[[nodiscard]] constexpr InGuardSync guard_of_sync(const InSync& sync) {
  return {.sync_ctr = sync.ctr, .sync_crc = guard_crc(InSync::kOffset, encode(sync))};
}

/// Waits for the In_Sync frame that a guard announces: the next one, or none.
class SyncGuard {
 public:
  void announce(const base::CanFrame& guard) {
    static_assert(InGuardSync::kSyncCtr.start == 8 && InGuardSync::kSyncCrc.start == 16);
    counter_ = guard.data[1];
    crc_ = static_cast<std::uint16_t>(guard.data[2] | guard.data[3] << 8);
    waits_ = true;
  }
  [[nodiscard]] bool covers(const base::CanFrame& sync) {
    static_assert(InSync::kCtr.start == 48);
    const bool covers = waits_ && counter_ == sync.data[6] &&
                        crc_ == guard_crc(InSync::kOffset, std::span<const std::uint8_t>(sync.data));
    waits_ = false;
    return covers;
  }

 private:
  std::uint16_t crc_ = 0;
  std::uint8_t counter_ = 0;
  bool waits_ = false;
};

/// A frame's place in a sample; part 0xFF: no guarded sample.
struct SamplePart {
  sensor::Sensor sensor = sensor::Sensor::kNotAvailable;
  std::uint8_t instance = 0;
  std::uint8_t sequence = 0;
  std::uint8_t part = 0xFF;
  static constexpr std::uint8_t kRepeated = 7;  ///< one of any number of frames: a feature of an image
};

/// Part of all blocks of a scan: the assembly checks their order.
inline constexpr std::uint8_t kScanBlock = 1;

[[nodiscard]] constexpr SamplePart part_of(std::uint8_t offset, const base::CanFrame& frame) {
  static_assert(InWheelCounts::kSeq.start == 20 && InGnssVelU::kSeq.start == 20 && InGnssLat::kInst.start == 24);
  static_assert(InFeature::kSeq.start == 20 && InFeature::kInst.start == 24 && InImage::kSeq.start == 20 &&
                InImage::kInst.start == 24);
  static_assert(ImuGyro::kSeq.start == 60 && ImuTime::kSeq.start == 60);
  using sensor::Sensor;
  if (offset >= ImuGyro::kOffset && offset < ImuGyro::kOffset + ImuGyro::kCount * ImuGyro::kStride) {
    const auto of = static_cast<std::uint8_t>(offset - ImuGyro::kOffset);
    return {.sensor = Sensor::kImu,
            .instance = static_cast<std::uint8_t>(of / ImuGyro::kStride),
            .sequence = static_cast<std::uint8_t>(frame.data[7] >> 4),
            .part = static_cast<std::uint8_t>(of % ImuGyro::kStride)};
  }
  SamplePart part{.instance = static_cast<std::uint8_t>(frame.data[3] & 3U),
                  .sequence = static_cast<std::uint8_t>(frame.data[2] >> 4)};
  const auto is = [&](Sensor sensor, std::uint8_t first) {
    part.sensor = sensor;
    part.part = static_cast<std::uint8_t>(offset - first);
  };
  if (offset == InWheelCounts::kOffset) is(Sensor::kWheelCounts, offset);
  if (offset == InWheelSpeed::kOffset) is(Sensor::kWheelSpeed, offset);
  if (offset == InBodySpeed::kOffset) is(Sensor::kBodySpeed, offset);
  if (offset >= InGnssLat::kOffset && offset <= InGnssAcc::kOffset) is(Sensor::kGnssPosition, InGnssLat::kOffset);
  if (offset == InGnssVelEN::kOffset || offset == InGnssVelU::kOffset) is(Sensor::kGnssVelocity, InGnssVelEN::kOffset);
  if (offset == InScanHead::kOffset) is(Sensor::kScan, offset);
  if (offset == InScan::kOffset) {  // of the instance of the latest head
    static_assert(InScan::kSeq.start == 0 && InScan::kSeq.length == 4);
    part = {.sensor = Sensor::kScan, .sequence = static_cast<std::uint8_t>(frame.data[0] & 0x0F), .part = kScanBlock};
  }
  if (offset == InImage::kOffset) is(Sensor::kFeature, offset);
  if (offset == InFeature::kOffset) is(Sensor::kFeature, InFeature::kOffset - SamplePart::kRepeated);
  return part;
}

/// Samples that have guards: their places in a list of four instances each.
inline constexpr std::size_t kGuardedSamples = 4 * (static_cast<std::size_t>(sensor::Sensor::kGnssVelocity) + 2);
[[nodiscard]] constexpr std::size_t guarded_place(sensor::Sensor sensor, std::uint8_t instance) {
  // Sightings have no guards: images are in their place.
  const auto kind =
      static_cast<std::size_t>(sensor == sensor::Sensor::kFeature ? sensor::Sensor::kRangeBearing : sensor);
  return (sensor == sensor::Sensor::kScan ? kGuardedSamples / 4 - 1 : kind) * 4 + instance;
}

/// The checksum that a sample's guard states, of the guard without it and of the sample's frames.
[[nodiscard]] constexpr std::uint16_t sample_guard_crc(InGuardSample guard, std::uint16_t sum_of_frames) {
  guard.sample_crc = 0;
  const Payload bytes = encode(guard);
  return static_cast<std::uint16_t>(sum_of_frames +
                                    guard_crc(InGuardSample::kOffset, std::span(bytes).template first<3>()));
}
[[nodiscard]] constexpr std::uint16_t entry_guard_crc(InGuardEntry guard, const base::CanFrame& entry) {
  guard.entry_crc = 0;
  const Payload bytes = encode(guard);
  return static_cast<std::uint16_t>(guard_crc(InMapEntry::kOffset, payload(entry)) +
                                    guard_crc(InGuardEntry::kOffset, std::span(bytes).template first<3>()));
}

/// A window of 32 counters modulo 256 as in RFC 4303, section 3.4.3: each is good once, none that is further behind. A
/// sender that was silent for kForgets begins anew.
class GuardCounter {
 public:
  [[nodiscard]] bool admits(std::uint8_t counter, base::Micros now) {
    const auto ahead = static_cast<std::uint8_t>(counter - last_);
    const bool anew = seen_ == 0 || now - at_ > kForgets || now < at_;
    if (anew || ahead - 1U < 127U) {
      seen_ = anew || ahead >= 32 ? 1U : seen_ << ahead | 1U;
      last_ = counter;
      at_ = now;
      return true;
    }
    const auto behind = static_cast<std::uint8_t>(last_ - counter);
    if (behind >= 32 || (seen_ >> behind & 1U) != 0) return false;
    seen_ |= 1U << behind;
    return true;
  }

 private:
  static constexpr base::Micros kForgets{500'000};
  std::uint32_t seen_ = 0;  ///< bit n: the counter n behind the last one; 0: none yet
  base::Micros at_;
  std::uint8_t last_ = 0;
};

/// Samples wait for their guard, and guards for their sample; out(sample) gets those that fit.
class SampleGuard {
 public:
  void power_on() { *this = {}; }

  /// A frame of a sample, before the sample is put together.
  void frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros now, Counters& counters) {
    SamplePart part = part_of(offset, frame);
    if (part.part == 0xFF) return;
    const bool scan = part.sensor == sensor::Sensor::kScan, block = scan && part.part == kScanBlock;
    if (block) part.instance = scan_instance_;
    if (scan) scan_instance_ = part.instance;
    Slot* slot = &slot_of(part, now, counters);
    if (scan) slot->since = now;  // its frames may take longer than a guard waits
    if (!block && part.part != SamplePart::kRepeated &&
        (slot->parts >> part.part & 1U) != 0) {  // of the sample that had this number before
      drop(*slot, counters);
      slot = &slot_of(part, now, counters);
    }
    slot->parts = static_cast<std::uint8_t>(slot->parts | 1U << part.part);
    slot->sum = static_cast<std::uint16_t>(slot->sum + guard_crc(offset, payload(frame)));
  }
  template <class Out>
  void guard(const InGuardSample& guard, base::Micros now, Counters& counters, Out&& out) {
    Slot& slot =
        slot_of({.sensor = guard.sensor, .instance = guard.sample_inst, .sequence = guard.sample_seq}, now, counters);
    slot.guard = guard;
    if (slot.sample) judge(slot, now, counters, out);
  }
  /// A sample that is whole.
  template <class Out>
  void sample(const sensor::Sample& sample, base::Micros now, Counters& counters, Out&& out) {
    if (!guarded(sample.sensor)) return out(sample);
    Slot& slot =
        slot_of({.sensor = sample.sensor, .instance = sample.instance, .sequence = sample.sequence}, now, counters);
    slot.sample = sample;
    if (slot.guard) judge(slot, now, counters, out);
  }
  /// Every whole sample that waits for its guard.
  template <class F>
  void each_waiting(F&& f) const {
    for (const Slot& slot : slots_)
      if (slot.sample) f(*slot.sample);
  }
  /// At each tick: what still waits for its other half is given up and counted.
  void expire(base::Micros now, Counters& counters) {
    for (Slot& slot : slots_)
      if (slot.used && (now - slot.since > kPatience || slot.since > now)) drop(slot, counters);
  }

 private:
  static constexpr base::Micros kPatience{50'000};
  struct Slot {
    SamplePart of;
    std::optional<InGuardSample> guard;
    std::optional<sensor::Sample> sample;
    base::Micros since;
    std::uint16_t sum = 0;  ///< sum of the frames' checksums
    std::uint8_t parts = 0;
    bool used = false;
  };
  [[nodiscard]] static constexpr bool guarded(sensor::Sensor sensor) {
    return sensor <= sensor::Sensor::kBodySpeed || sensor == sensor::Sensor::kGnssPosition ||
           sensor == sensor::Sensor::kGnssVelocity || sensor == sensor::Sensor::kScan ||
           sensor == sensor::Sensor::kFeature;
  }
  static void drop(Slot& slot, Counters& counters) {
    if (slot.guard || slot.sample) ++counters.guard_bad;  // of a sample that is not whole that is counted already
    slot = {};
  }
  Slot& slot_of(const SamplePart& of, base::Micros now, Counters& counters) {
    Slot* free = &slots_[0];
    for (Slot& slot : slots_) {
      const SamplePart& has = slot.of;
      if (slot.used && has.sensor == of.sensor && has.instance == of.instance && has.sequence == of.sequence)
        return slot;
      if (free->used && (!slot.used || slot.since < free->since)) free = &slot;
    }
    if (free->used) drop(*free, counters);
    free->of = of;
    free->since = now;
    free->used = true;
    return *free;
  }
  template <class Out>
  void judge(Slot& slot, base::Micros now, Counters& counters, Out& out) {
    const InGuardSample guard = *slot.guard;
    const sensor::Sample sample = *slot.sample;
    const bool fits = guard.sample_crc == sample_guard_crc(guard, slot.sum);
    slot = {};
    const std::size_t counter = guarded_place(sample.sensor, sample.instance);
    if (!fits || !counters_[counter].admits(guard.sample_ctr, now)) return void(++counters.guard_bad);
    out(sample);
  }

  std::array<Slot, 8> slots_{};
  std::array<GuardCounter, kGuardedSamples> counters_{};
  std::uint8_t scan_instance_ = 0;  ///< instance of the latest head of a scan
};

/// One map entry at a time has its guard before it.
class EntryGuard {
 public:
  void power_on() { *this = {}; }
  void announce(const InGuardEntry& guard) { guard_ = guard; }
  [[nodiscard]] bool admits(const base::CanFrame& entry, base::Micros now) {
    const auto guard = guard_;
    guard_.reset();
    return guard && guard->entry_id == entry.data[0] && guard->entry_crc == entry_guard_crc(*guard, entry) &&
           counter_.admits(guard->entry_ctr, now);
  }

 private:
  std::optional<InGuardEntry> guard_;
  GuardCounter counter_;
};

}  // namespace tetap::bus
