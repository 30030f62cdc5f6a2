// SPDX-License-Identifier: Apache-2.0
// From the packets of one reading to samples. Stamps are unwrapped and put on the MCU's clock; gaps, markers, stuck
// values and the ends of the range are found; axes become the body's. DS-000347: 12.7 (ticks), 5.5 (delay of the
// filter).
#pragma once

#include "drivers/imu/clock_map.hpp"
#include "drivers/imu/icm42688/health.hpp"
#include "drivers/imu/icm42688/noise.hpp"
#include "drivers/imu/icm42688/packet.hpp"
#include "drivers/imu/reading.hpp"

namespace tetap::drivers::icm42688 {

class Stream {
 public:
  explicit constexpr Stream(const Settings& settings)
      : settings_(settings),
        scales_(scales(settings)),
        clock_(settings.tick_q32()),
        delay_{group_delay_us(settings) + settings.more_delay_us},
        accel_limit_(stuck_samples(settings.stuck_accel_samples, noise_counts(settings).accel, settings)),
        gyro_limit_(stuck_samples(settings.stuck_gyro_samples, noise_counts(settings).gyro, settings)),
        turn_(static_cast<std::int32_t>(4.0F + kTurnSigmas * noise_counts(settings).gyro)) {}

  [[nodiscard]] constexpr std::int32_t clock_error_ppm() const { return clock_.rate_error_ppm(); }

  /// The chip was reset, and its ticks with it.
  constexpr void restart() {
    interrupt();
    clock_.stop();
  }

  /// The FIFO was emptied: the next sample follows nothing.
  constexpr void interrupt() {
    follows_ = false;
    accel_ = gyro_ = {};
    change_ = 0;
    has_rate_ = false;
  }

  /// `packets`, oldest first, are the first of `waiting` that were in the FIFO at `now`. True: time went on.
  template <class Sink>
  constexpr bool take(std::span<const Packet> packets, int waiting, base::Micros now, Health& health, Sink&& sink) {
    if (packets.empty()) return false;
    std::int64_t ticks = unwrap(packets[0].ticks, waiting, now);
    std::int64_t newest = ticks;
    for (std::size_t i = 1; i < packets.size(); ++i) newest += since(packets[i - 1].ticks, packets[i].ticks);
    // Only when nothing is left behind is the newest sample a fresh one.
    if (static_cast<int>(packets.size()) == waiting) watch_clock(newest, now, health);
    bool went_on = false;
    for (std::size_t i = 0; i < packets.size(); ++i) {
      if (i > 0) ticks += since(packets[i - 1].ticks, packets[i].ticks);
      went_on |= one(packets[i], ticks, now, health, sink);
    }
    if (went_on) taken_ = now;
    return went_on;
  }

 private:
  struct Repeats {
    std::array<std::int32_t, 3> value{};
    std::array<std::uint16_t, 3> times{};
  };

  /// Signed: a stamp that goes back is a bad one, not nearly a whole turn.
  [[nodiscard]] static constexpr std::int16_t since(std::uint16_t before, std::uint16_t after) {
    return static_cast<std::int16_t>(after - before);
  }

  /// A stamp from the future is a bad one, unless all of them are: then the clock jumped.
  constexpr void watch_clock(std::int64_t newest, base::Micros now, Health& health) {
    if (clock_.observe(newest, now)) {
      refused_ = 0;
    } else if (++refused_ >= kRefusals) {
      refused_ = 0;
      interrupt();
      clock_.start(newest, now);
    }
    const bool off = clock_.rate_at_limit();
    if (off && !clock_off_) health.add(Reason::kClockOff);
    clock_off_ = off;
  }

  /// The oldest of `waiting` packets: on from the last one, by as many turns of the counter as the MCU's clock saw.
  constexpr std::int64_t unwrap(std::uint16_t low, int waiting, base::Micros now) {
    constexpr std::int64_t kTurn = 0x1'0000;
    const base::Micros oldest = now - base::Micros{settings_.period_ns() * (waiting - 1) / 1000};
    if (!clock_.running() || now - taken_ > kLongGap) {
      clock_.start(low, oldest);
      follows_ = false;
      return low;
    }
    const std::int64_t expected = clock_.ticks(oldest);
    // The nearest to what the clock expects; half a turn is 35 ms at least.
    const std::int64_t off = (low - expected) & (kTurn - 1);
    return expected + off - (off >= kTurn / 2 ? kTurn : 0);
  }

  /// Everything but the measured values. False: the sample has no time of its own.
  constexpr bool stamp(const Packet& packet, std::int64_t ticks, ImuReading& reading, Health& health) {
    if (packet.rate_changed && follows_) health.add(Reason::kRateChanged);
    reading.stamp = clock_.time(ticks) - delay_;
    reading.interval = base::Micros{settings_.period_ns() / 1000};
    reading.after_gap = true;
    if (!follows_) return true;
    if (ticks <= last_ticks_) return health.add(Reason::kBadStamp), false;
    const std::int64_t elapsed_us = (clock_.time(ticks) - clock_.time(last_ticks_)).us;
    if (elapsed_us * 2000 >= 3 * settings_.period_ns()) {
      const std::int64_t periods = (elapsed_us * 2000 + settings_.period_ns()) / (2 * settings_.period_ns());
      health.add(Reason::kLostSamples, static_cast<std::uint32_t>(periods - 1));
      return true;
    }
    // From stamp to stamp, so that intervals add up to time exactly; never back.
    if (reading.stamp <= last_stamp_) reading.stamp = last_stamp_ + base::Micros{1};
    reading.interval = reading.stamp - last_stamp_;
    reading.after_gap = after_withheld_;
    return true;
  }

  template <class Sink>
  constexpr bool one(const Packet& packet, std::int64_t ticks, base::Micros now, Health& health, Sink&& sink) {
    ImuReading reading{};
    if (clock_.time(ticks) > now + kAhead) return health.add(Reason::kBadStamp), false;
    if (!stamp(packet, ticks, reading, health)) return false;
    // Whatever happened to the chip or its ticks, time goes on for those who listen.
    if (stamped_ && reading.stamp <= last_stamp_) return health.add(Reason::kBadStamp), false;
    last_ticks_ = ticks;
    last_stamp_ = reading.stamp;
    follows_ = stamped_ = true;
    after_withheld_ = true;
    if (packet.kind != PacketKind::kSample) return health.add(Reason::kInvalidSample), true;
    if (repeats(packet.gyro)) health.add(Reason::kRepeatedGyro);
    const bool stuck_accel = stuck(packet.accel, accel_, accel_limit_);
    const bool stuck_gyro = stuck(packet.gyro, gyro_, gyro_limit_);
    if (stuck_accel) health.add(Reason::kStuckAccel);
    if (stuck_gyro) health.add(Reason::kStuckGyro);
    if (stuck_accel || stuck_gyro) return true;
    after_withheld_ = false;
    reading.rate_b_radps = settings_.mounting.to_body(scaled(packet.gyro, scales_.rate_radps));
    reading.force_b_mps2 = settings_.mounting.to_body(scaled(packet.accel, scales_.force_mps2));
    reading.temperature_degC = temperature_degC(packet, settings_.resolution, scales_);
    reading.clipped_gyro = beyond(packet.gyro, scales_.limit);
    reading.clipped_accel = beyond(packet.accel, scales_.limit);
    if (reading.clipped_gyro) health.add(Reason::kClippedGyro);
    if (reading.clipped_accel) health.add(Reason::kClippedAccel);
    ++health.samples;
    sink(static_cast<const ImuReading&>(reading));
    return true;
  }

  /// Any axis that repeats itself so often: a living sensor has noise.
  [[nodiscard]] static constexpr bool stuck(const std::array<std::int32_t, 3>& now, Repeats& repeats,
                                            std::uint16_t limit) {
    bool any = false;
    for (std::size_t i = 0; i < 3; ++i) {
      auto& times = repeats.times[i];
      times = now[i] != repeats.value[i] ? std::uint16_t{0} : static_cast<std::uint16_t>(times + (times < 0xFFFF));
      any |= limit != 0 && times >= limit;
    }
    repeats.value = now;
    return any;
  }

  /// The same triple although the rate was changing by more than noise does: at rest equal triples are common.
  constexpr bool repeats(const std::array<std::int32_t, 3>& now) {
    const bool first = !has_rate_;
    has_rate_ = true;
    if (!first && now == gyro_.value) return change_ > turn_;
    change_ = 0;
    for (std::size_t i = 0; i < 3 && !first; ++i) {
      const std::int32_t step = now[i] - gyro_.value[i];
      const std::int32_t size = step < 0 ? -step : step;
      if (size > change_) change_ = size;
    }
    return false;
  }

  static constexpr float kTurnSigmas = 11.3F;  ///< 8 sigma of a difference of two samples
  static constexpr base::Micros kLongGap{1'000'000};
  static constexpr base::Micros kAhead{200};  ///< allowance for stamps after `now`, which ages during the read
  static constexpr std::uint8_t kRefusals = 8;

  Settings settings_;
  Scales scales_;
  ClockMap clock_;
  base::Micros delay_;
  std::uint16_t accel_limit_, gyro_limit_;  ///< equal samples in a row that are a fault; 0: never
  std::int32_t turn_;                       ///< counts from sample to sample that are no noise
  std::int32_t change_ = 0;                 ///< largest axis of the last change of the rate
  bool has_rate_ = false;                   ///< a rate came since the last interruption
  base::Micros taken_{};
  base::Micros last_stamp_{};
  std::int64_t last_ticks_ = 0;
  Repeats accel_{}, gyro_{};
  std::uint8_t refused_ = 0;
  bool stamped_ = false;         ///< some sample got a stamp since power-on
  bool follows_ = false;         ///< a sample with a stamp came before
  bool after_withheld_ = false;  ///< the sample before had a stamp and was not delivered
  bool clock_off_ = false;
};

}  // namespace tetap::drivers::icm42688
