// SPDX-License-Identifier: Apache-2.0
// A sample as the frames in which it travels: the inverse of bus::Decoder.
#pragma once

#include "bus/codec.hpp"
#include "bus/e2e.hpp"
#include "bus/messages.hpp"
#include "sim_host/world/measurement.hpp"

#include <cstdint>
#include <vector>

namespace tetap::sim {

template <class... F>
struct Cases : F... {
  using F::operator()...;
};
template <class... F>
Cases(F...) -> Cases<F...>;

/// Appends the measurement's frames, but not those that are lost on the way.
inline void encode(std::uint32_t base, const Measurement& m, std::vector<base::CanFrame>& out) {
  const auto stamp = static_cast<std::uint32_t>(static_cast<std::uint64_t>(m.stamp.us) & 0xFFFFF);
  const auto seq = static_cast<std::uint8_t>(m.sequence & 0x0F);
  int part = 0;
  const auto put = [&](const auto& message, std::size_t instance = 0) {
    if ((m.lost_parts >> part++ & 1) == 0) out.push_back(bus::frame(base, message, instance));
  };
  const Cases write{
      [&](const sensor::ImuSample& v) {
        put(bus::ImuGyro{.ang_x_rad = v.dangle_b_rad[0],
                         .ang_y_rad = v.dangle_b_rad[1],
                         .ang_z_rad = v.dangle_b_rad[2],
                         .seq = seq},
            m.instance);
        put(bus::ImuAccel{.vel_x_mps = v.dvelocity_b_mps[0],
                          .vel_y_mps = v.dvelocity_b_mps[1],
                          .vel_z_mps = v.dvelocity_b_mps[2],
                          .seq = seq},
            m.instance);
        put(bus::ImuTime{.stamp_us = stamp,
                         .interval_us = v.interval_us,
                         .clip_gyro = v.clipped_gyro,
                         .clip_accel = v.clipped_accel,
                         .temp_degC = v.temperature_degC,
                         .seq = seq},
            m.instance);
      },
      [&](const sensor::WheelCounts& v) {
        put(bus::InWheelCounts{.stamp_us = stamp, .seq = seq, .inst = m.instance, .left = v.left, .right = v.right});
      },
      [&](const sensor::WheelSpeeds& v) {
        put(bus::InWheelSpeed{
            .stamp_us = stamp, .seq = seq, .inst = m.instance, .left_mps = v.left_mps, .right_mps = v.right_mps});
      },
      [&](const sensor::BodySpeed& v) {
        put(bus::InBodySpeed{.stamp_us = stamp,
                             .seq = seq,
                             .inst = m.instance,
                             .forward_mps = v.forward_mps,
                             .yaw_rate_radps = v.yaw_rate_radps});
      },
      [&](const sensor::GnssPosition& v) {
        put(bus::InGnssLat{.stamp_us = stamp, .seq = seq, .inst = m.instance, .lat_raw = v.latitude_2ndeg});
        put(bus::InGnssLon{.stamp_us = stamp, .seq = seq, .inst = m.instance, .lon_raw = v.longitude_2ndeg});
        put(bus::InGnssAlt{.stamp_us = stamp,
                           .seq = seq,
                           .inst = m.instance,
                           .height_m = v.height_m,
                           .fix = static_cast<bus::GnssFix>(v.fix),
                           .num_sv = v.satellites});
        put(bus::InGnssAcc{
            .stamp_us = stamp, .seq = seq, .inst = m.instance, .hor_m = v.horizontal_acc_m, .ver_m = v.vertical_acc_m});
      },
      [&](const sensor::GnssVelocity& v) {
        put(bus::InGnssVelEN{
            .stamp_us = stamp, .seq = seq, .inst = m.instance, .east_mps = v.v_n_mps[0], .north_mps = v.v_n_mps[1]});
        put(bus::InGnssVelU{
            .stamp_us = stamp, .seq = seq, .inst = m.instance, .up_mps = v.v_n_mps[2], .acc_mps = v.acc_mps});
      },
      [&](const sensor::LandmarkSighting& v) {
        put(bus::InRangeBearing{.stamp_us = stamp,
                                .seq = seq,
                                .inst = m.instance,
                                .id = v.landmark,
                                .range_m = v.range_m,
                                .bearing_rad = v.bearing_rad});
      },
      [&](const sensor::MagneticFlux& v) {
        put(bus::InMag{.stamp_us = stamp,
                       .seq = seq,
                       .inst = m.instance,
                       .flux_x_uT = v.flux_b_uT[0],
                       .flux_y_uT = v.flux_b_uT[1],
                       .flux_z_uT = v.flux_b_uT[2]});
      },
      [&](const sensor::AirPressure& v) {
        put(bus::InBaro{.stamp_us = stamp,
                        .seq = seq,
                        .inst = m.instance,
                        .pressure_Pa = v.pressure_Pa,
                        .temp_degC = v.temperature_degC});
      }};
  std::visit(write, m.value);
}

}  // namespace tetap::sim
