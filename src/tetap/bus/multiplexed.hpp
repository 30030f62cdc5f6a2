// SPDX-License-Identifier: Apache-2.0
// Messages of several pages, one page at a time: counters, and what an inertial estimator has beyond pose and velocity.
#pragma once

#include "tetap/base/math.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/estimators/estimate.hpp"

#include <cstdint>

namespace tetap::bus {

/// put(message) is called once; `page` is from 0 to 8.
template <class Put>
void put_diagnostics(std::uint32_t page, const Counters& c, const LoopHealth& l, std::uint16_t timeline_high,
                     Put&& put) {
  constexpr std::uint32_t kLongest = 0xFFFFFE;
  switch (page) {
    case 0:
      put(bus::EstDiagLoop{.loop_max_us = l.longest_us < kLongest ? l.longest_us : kLongest,
                           .loop_mean_us = static_cast<std::uint16_t>(l.mean_us < 65534.0F ? l.mean_us : 65534.0F),
                           .sync = l.sync,
                           .tx_high = static_cast<std::uint16_t>(l.bus.tx_high < 0xFFF ? l.bus.tx_high : 0xFFF)});
      break;
    case 1:
      put(bus::EstDiagTicks{.ticks_late = l.ticks_late, .sync_lost = l.sync_lost, .sync_back = l.sync_back});
      break;
    case 2:
      put(bus::EstDiagQueues{
          .timeline_high = timeline_high, .events_high = c.events_high_water, .events_dropped = c.events_dropped});
      break;
    case 3:
      put(bus::EstDiagOrder{.too_late = c.too_late, .too_early = c.too_early, .duplicate = c.duplicate});
      break;
    case 4:
      put(bus::EstDiagFrames{.incomplete = c.incomplete, .malformed = c.malformed, .out_of_range = c.out_of_range});
      break;
    case 5:
      put(bus::EstDiagBus{.rx_overflow = static_cast<std::uint16_t>(l.bus.rx_overflow),
                          .tx_full = static_cast<std::uint16_t>(l.bus.tx_full),
                          .bus_off = static_cast<std::uint16_t>(l.bus.bus_off)});
      break;
    case 6:
      put(bus::EstDiagRefused{.not_used = c.not_used, .no_time = c.no_time, .cmd_refused = c.command_refused});
      break;
    case 7:
      put(bus::EstDiagCapacity{
          .map_full = c.map_full, .timeline_full = c.timeline_full, .window_short = c.window_short});
      break;
    default:
      put(bus::EstDiagSync{.sync_jump = l.sync_jump, .sync_gap = l.sync_gap, .sync_bad = l.sync_bad});
      break;
  }
}

/// Pages that are not in this cycle: limits that were reached, and what guards and tags refused.
[[nodiscard]] constexpr EstDiagLimits limits_page(const Counters& c, const LoopHealth& l) {
  return {.overload = c.overload,
          .cmd_rate = c.command_rate,
          .lock_refused = l.lock_refused,
          .save_refused = l.save_refused};
}
[[nodiscard]] constexpr EstDiagGuard guard_page(const Counters& c, std::uint32_t nonce) {
  return {.guard_bad = c.guard_bad, .auth_bad = c.auth_bad, .replayed = c.replayed, .nonce = nonce};
}

/// The likeliest fault of a sensor (trust::LikelyFault), which goes with the origin's pages.
template <class Fault>
[[nodiscard]] constexpr EstOriginFault fault_page(const Fault& fault, sensor::OriginSource source, std::uint8_t tag) {
  const auto row = static_cast<FaultRow>(fault.code);
  const FaultUnit unit = row < FaultRow::kImuAccelX     ? FaultUnit::kRadPerS
                         : row < FaultRow::kGnssEast    ? FaultUnit::kMPerS2
                         : row < FaultRow::kGnssVelEast ? FaultUnit::kM
                         : row < FaultRow::kHeading     ? FaultUnit::kMPerS
                         : row == FaultRow::kHeading    ? FaultUnit::kRad
                                                        : FaultUnit::kNotAvailable;
  return {.source = source,
          .fault_row = row,
          .fault_unit = unit,
          .fault_prob = fault.probability,
          .fault_size = fault.size,
          .fault_std = fault.sigma,
          .fault_epoch = tag};
}

/// State and last failed check of every source.
template <class Put>
void put_sources(const estimators::SourceStates& s, std::uint8_t tag, Put&& put) {
  using sensor::Sensor;
  put(bus::EstStateSources{.epoch = tag,
                           .imu_state = s.of(Sensor::kImu).state,
                           .imu_check = s.of(Sensor::kImu).failed,
                           .position_state = s.of(Sensor::kGnssPosition).state,
                           .position_check = s.of(Sensor::kGnssPosition).failed,
                           .velocity_state = s.of(Sensor::kGnssVelocity).state,
                           .velocity_check = s.of(Sensor::kGnssVelocity).failed,
                           .wheel_state = s.of(Sensor::kWheelSpeed).state,
                           .wheel_check = s.of(Sensor::kWheelSpeed).failed,
                           .speed_state = s.of(Sensor::kBodySpeed).state,
                           .speed_check = s.of(Sensor::kBodySpeed).failed,
                           .heading_state = s.of(Sensor::kHeading).state,
                           .heading_check = s.of(Sensor::kHeading).failed,
                           .mag_state = s.of(Sensor::kMagnetometer).state,
                           .mag_check = s.of(Sensor::kMagnetometer).failed,
                           .baro_state = s.of(Sensor::kBarometer).state,
                           .baro_check = s.of(Sensor::kBarometer).failed});
}

/// Whether this turn is that of the sources.
[[nodiscard]] constexpr bool is_turn_of_sources(std::uint32_t page) { return page % 18 == 4; }

/// One page. A page with a covariance comes with its sigmas and correlations: whole, and of one epoch. Est_Std has
/// those of x, y and yaw. One turn in nine is that of the sources, every other time. One more turn stays free: the bus
/// has no more room (tools/can/generate_messages --load).
template <class Put>
void put_state_page(std::uint32_t page, const estimators::InertialEstimate& e, std::uint8_t tag, Put&& put) {
  const nav::InsState& x = e.state;
  using Block = estimators::InertialEstimate::Block;
  switch (page % 9) {
    case 0: {
      const Block b = e.block(nav::InsState::kPosition);
      put(bus::EstStateHeight{
          .epoch = tag, .height_m = base::metres(x.z.um()), .std_height_m = b.sigma[2], .jump_z_m = e.jump.up_m});
      put(bus::EstStateCorrPos{.epoch = tag,
                               .corr_xz = b.corr_02,
                               .corr_yz = b.corr_12,
                               .height_state = e.gnss_height.state,
                               .height_check = e.gnss_height.failed});
      break;
    }
    case 1: {
      const Block b = e.block(nav::InsState::kAccelBias);
      put(bus::EstStateAccBias{.epoch = tag,
                               .acc_bias_x_mps2 = x.b_a_mps2(0),
                               .acc_bias_y_mps2 = x.b_a_mps2(1),
                               .acc_bias_z_mps2 = x.b_a_mps2(2)});
      put(bus::EstStateStdAccBias{.epoch = tag,
                                  .std_acc_bias_x_mps2 = b.sigma[0],
                                  .std_acc_bias_y_mps2 = b.sigma[1],
                                  .std_acc_bias_z_mps2 = b.sigma[2]});
      put(bus::EstStateCorrAccBias{
          .epoch = tag, .corr_acc_bias_xy = b.corr_01, .corr_acc_bias_xz = b.corr_02, .corr_acc_bias_yz = b.corr_12});
      break;
    }
    case 2:
      put(bus::EstStateJump{
          .epoch = tag, .jump_x_m = e.jump.east_m, .jump_y_m = e.jump.north_m, .jump_yaw_rad = e.jump.yaw_rad});
      break;
    case 3: {
      const Block b = e.block(nav::InsState::kVelocity);
      put(bus::EstStateStdVel{
          .epoch = tag, .std_vel_east_mps = b.sigma[0], .std_vel_north_mps = b.sigma[1], .std_vel_up_mps = b.sigma[2]});
      put(bus::EstStateCorrVel{
          .epoch = tag, .corr_vel_en = b.corr_01, .corr_vel_eu = b.corr_02, .corr_vel_nu = b.corr_12});
      break;
    }
    case 5: {
      const Block b = e.block(nav::InsState::kGyroBias);
      put(bus::EstStateGyroBias{.epoch = tag,
                                .gyro_bias_x_radps = x.b_g_radps(0),
                                .gyro_bias_y_radps = x.b_g_radps(1),
                                .gyro_bias_z_radps = x.b_g_radps(2)});
      put(bus::EstStateStdGyroBias{.epoch = tag,
                                   .std_gyro_bias_x_radps = b.sigma[0],
                                   .std_gyro_bias_y_radps = b.sigma[1],
                                   .std_gyro_bias_z_radps = b.sigma[2]});
      put(bus::EstStateCorrGyroBias{.epoch = tag,
                                    .corr_gyro_bias_xy = b.corr_01,
                                    .corr_gyro_bias_xz = b.corr_02,
                                    .corr_gyro_bias_yz = b.corr_12});
      break;
    }
    case 6:
      put(bus::EstStateImuHealth{.epoch = tag,
                                 .vib_accel_mps2 = e.imu.vibration_mps2,
                                 .vib_gyro_radps = e.imu.vibration_radps,
                                 .clipped = e.imu.clipped});
      break;
    case 7: {
      const Block b = e.block(nav::InsState::kAttitude);
      put(bus::EstStateStdTilt{.epoch = tag, .std_tilt_east_rad = b.sigma[0], .std_tilt_north_rad = b.sigma[1]});
      put(bus::EstStateCorrTilt{
          .epoch = tag, .corr_tilt_en = b.corr_01, .corr_tilt_e_yaw = b.corr_02, .corr_tilt_n_yaw = b.corr_12});
      break;
    }
    default:
      break;
  }
}

}  // namespace tetap::bus
