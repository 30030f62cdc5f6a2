// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/bus_twin.hpp"

#include "sim_host/encode.hpp"

#include <algorithm>
#include <optional>
#include <utility>
#include <variant>

namespace tetap::board {

namespace {

// A receiver sends latitude and longitude in steps of 1e-7 deg, which are 50 of a frame's.
std::int64_t in_receiver_steps(std::int64_t raw_2ndeg) {
  constexpr std::int64_t kStep = 50;
  return (raw_2ndeg + (raw_2ndeg < 0 ? -kStep : kStep) / 2) / kStep * kStep;
}

}  // namespace

BusTwin::BusTwin(Board& node, SimulatedSensors& sensors, const param::Parameters& parameters)
    : sensors_(sensors),
      parameters_(parameters),
      tick_(node.processor.scheduler, [this] { tick(); }),
      next_tick_us_(sensors.world().start().us + kTick_us) {
  node.imu.on_reading = [this](const Icm42688::Reading& reading) { integrate(reading); };
  sensors.on_wired = [this](const sim::Measurement& one) { measured_.push_back(one); };
  tick_.set(next_tick_us_ * kMicrosecond);
}

// A sum of rates: between two readings of a millisecond the axes of a rover hardly turn.
void BusTwin::integrate(const Icm42688::Reading& reading) {
  const Picoseconds since = last_reading_ == kNever ? 0 : reading.time - last_reading_;
  last_reading_ = reading.time;
  delay_ = reading.delay;
  temperature_degC_ = static_cast<float>(reading.temperature_c);
  const auto rate = sensors_.from_chip(reading.rate_radps), force = sensors_.from_chip(reading.force_mps2);
  const double seconds = static_cast<double>(since) / static_cast<double>(kSecond);
  for (std::size_t i = 0; i < 3; ++i) {
    angle_rad_[i] += rate[i] * seconds;
    velocity_mps_[i] += force[i] * seconds;
  }
}

void BusTwin::send_imu() {
  if (last_reading_ == kNever) return;
  const std::int64_t stamp_us = (last_reading_ - delay_) / kMicrosecond;
  const std::int64_t interval_us = stamp_us - stamp_us_;
  const bool begun = stamp_us_ >= 0 && interval_us < 5 * kTick_us;
  stamp_us_ = stamp_us;
  sensor::ImuSample sample;
  for (std::size_t i = 0; i < 3; ++i) {
    sample.dangle_b_rad[i] = static_cast<float>(std::exchange(angle_rad_[i], 0));
    sample.dvelocity_b_mps[i] = static_cast<float>(std::exchange(velocity_mps_[i], 0));
  }
  if (!begun || interval_us <= 0) return;
  sample.temperature_degC = temperature_degC_;
  sample.interval_us = static_cast<std::uint16_t>(interval_us);
  sim::encode(parameters_.can_base, {.stamp = {stamp_us}, .arrival = {}, .sequence = imu_sequence_++, .value = sample},
              waiting_);
}

// Frames that have arrived by now, then the tick.
void BusTwin::tick() {
  const base::Micros now{next_tick_us_};
  const auto arrived = std::stable_partition(measured_.begin(), measured_.end(),
                                             [now](const sim::Measurement& one) { return one.arrival <= now; });
  send_imu();
  for (auto one = measured_.begin(); one != arrived; ++one) {
    if (auto* const position = std::get_if<sensor::GnssPosition>(&one->value)) {
      position->latitude_2ndeg = in_receiver_steps(position->latitude_2ndeg);
      position->longitude_2ndeg = in_receiver_steps(position->longitude_2ndeg);
    }
    sim::encode(parameters_.can_base, *one, waiting_);
  }
  measured_.erase(measured_.begin(), arrived);
  for (const base::CanFrame& frame : waiting_) script_.add_input(frame);
  waiting_.clear();
  const base::Micros time = now + sensors_.world().clock_offset();
  script_.add_tick(time, script_.ticks() == 0 ? std::optional(time - base::Micros{kTick_us}) : std::nullopt);
  next_tick_us_ += kTick_us;
  tick_.set(next_tick_us_ * kMicrosecond);
}

}  // namespace tetap::board
