// SPDX-License-Identifier: Apache-2.0
// A sample as the frames in which it travels: the inverse of bus::Decoder. A wired sensor and the simulator send the
// same integers.
#pragma once

#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/model/camera.hpp"
#include "tetap/sensor/samples.hpp"

#include <cstdint>
#include <span>

namespace tetap::bus {

/// Stamp, sequence and instance that all frames of one sample carry.
struct SampleHead {
  std::uint32_t stamp_us = 0;  ///< low 20 bits of the stamp
  std::uint8_t seq = 0;        ///< low 4 bits of the sample's number
  std::uint8_t inst = 0;

  static constexpr SampleHead of(base::Micros stamp, std::uint8_t sequence, std::uint8_t instance) {
    return {static_cast<std::uint32_t>(static_cast<std::uint64_t>(stamp.us) & 0xFFFFF),
            static_cast<std::uint8_t>(sequence & 0x0F), instance};
  }
};

/// Calls put(message) or put(message, instance of the message) for each frame of the sample.
template <class Put>
constexpr void encode_sample(const sensor::ImuSample& v, const SampleHead& head, Put&& put) {
  put(ImuGyro{.ang_x_rad = v.dangle_b_rad[0],
              .ang_y_rad = v.dangle_b_rad[1],
              .ang_z_rad = v.dangle_b_rad[2],
              .seq = head.seq},
      head.inst);
  put(ImuAccel{.vel_x_mps = v.dvelocity_b_mps[0],
               .vel_y_mps = v.dvelocity_b_mps[1],
               .vel_z_mps = v.dvelocity_b_mps[2],
               .seq = head.seq},
      head.inst);
  put(ImuTime{.stamp_us = head.stamp_us,
              .interval_us = v.interval_us,
              .clip_gyro = v.clipped_gyro,
              .clip_accel = v.clipped_accel,
              .temp_degC = v.temperature_degC,
              .seq = head.seq},
      head.inst);
}

template <class Put>
constexpr void encode_sample(const sensor::WheelCounts& v, const SampleHead& head, Put&& put) {
  put(InWheelCounts{.stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .left = v.left, .right = v.right});
}

template <class Put>
constexpr void encode_sample(const sensor::WheelSpeeds& v, const SampleHead& head, Put&& put) {
  put(InWheelSpeed{
      .stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .left_mps = v.left_mps, .right_mps = v.right_mps});
}

template <class Put>
constexpr void encode_sample(const sensor::BodySpeed& v, const SampleHead& head, Put&& put) {
  put(InBodySpeed{.stamp_us = head.stamp_us,
                  .seq = head.seq,
                  .inst = head.inst,
                  .forward_mps = v.forward_mps,
                  .yaw_rate_radps = v.yaw_rate_radps});
}

template <class Put>
constexpr void encode_sample(const sensor::GnssPosition& v, const SampleHead& head, Put&& put) {
  put(InGnssLat{.stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .lat_raw = v.latitude_2ndeg});
  put(InGnssLon{.stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .lon_raw = v.longitude_2ndeg});
  put(InGnssAlt{.stamp_us = head.stamp_us,
                .seq = head.seq,
                .inst = head.inst,
                .height_m = v.height_m,
                .fix = static_cast<GnssFix>(v.fix),
                .num_sv = v.satellites});
  put(InGnssAcc{.stamp_us = head.stamp_us,
                .seq = head.seq,
                .inst = head.inst,
                .hor_m = v.horizontal_acc_m,
                .ver_m = v.vertical_acc_m});
}

template <class Put>
constexpr void encode_sample(const sensor::GnssVelocity& v, const SampleHead& head, Put&& put) {
  put(InGnssVelEN{.stamp_us = head.stamp_us,
                  .seq = head.seq,
                  .inst = head.inst,
                  .east_mps = v.v_n_mps[0],
                  .north_mps = v.v_n_mps[1]});
  put(InGnssVelU{
      .stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .up_mps = v.v_n_mps[2], .acc_mps = v.acc_mps});
}

template <class Put>
constexpr void encode_sample(const sensor::LandmarkSighting& v, const SampleHead& head, Put&& put) {
  if (base::is_finite(v.range_rate_mps))
    return put(InRadar{.stamp_us = head.stamp_us,
                       .seq = head.seq,
                       .inst = head.inst,
                       .range_m = v.range_m,
                       .bearing_rad = v.bearing_rad,
                       .range_rate_mps = v.range_rate_mps});
  put(InRangeBearing{.stamp_us = head.stamp_us,
                     .seq = head.seq,
                     .inst = head.inst,
                     .id = v.landmark,
                     .range_m = v.range_m,
                     .bearing_rad = v.bearing_rad});
}

template <class Put>
constexpr void encode_sample(const sensor::MagneticFlux& v, const SampleHead& head, Put&& put) {
  put(InMag{.stamp_us = head.stamp_us,
            .seq = head.seq,
            .inst = head.inst,
            .flux_x_uT = v.flux_b_uT[0],
            .flux_y_uT = v.flux_b_uT[1],
            .flux_z_uT = v.flux_b_uT[2]});
}

template <class Put>
constexpr void encode_sample(const sensor::AirPressure& v, const SampleHead& head, Put&& put) {
  put(InBaro{.stamp_us = head.stamp_us,
             .seq = head.seq,
             .inst = head.inst,
             .pressure_Pa = v.pressure_Pa,
             .temp_degC = v.temperature_degC});
}

template <class Put>
constexpr void encode_sample(const sensor::OutsideHeading& v, const SampleHead& head, Put&& put) {
  put(InHeading{
      .stamp_us = head.stamp_us, .seq = head.seq, .inst = head.inst, .angle_rad = v.yaw_rad, .acc_rad = v.acc_rad});
}

template <class Put>
constexpr void encode_sample(const sensor::LoopClosure& v, const SampleHead& head, Put&& put) {
  const auto number = [](std::int32_t steps, std::int64_t per_unit) {
    return static_cast<float>(steps) / static_cast<float>(per_unit);
  };
  put(InClosureFrames{.seq = head.seq, .from_id = v.from, .to_id = v.to, .stamp_us = head.stamp_us});
  put(InClosurePose{.seq = head.seq,
                    .x_m = number(v.x, v.kStepsPerMetre),
                    .y_m = number(v.y, v.kStepsPerMetre),
                    .yaw_rad = number(v.yaw, v.kStepsPerRadian)});
  put(InClosureStd{.seq = head.seq,
                   .std_x_m = number(v.unpack(v.sigmas, 0), v.kStepsPerMetre),
                   .std_y_m = number(v.unpack(v.sigmas, 1), v.kStepsPerMetre),
                   .std_yaw_rad = number(v.unpack(v.sigmas, 2), v.kSigmaStepsPerRadian)});
  put(InClosureCorr{.seq = head.seq,
                    .corr_xy = number(v.unpack(v.correlations, 0), v.kCorrelationSteps),
                    .corr_x_yaw = number(v.unpack(v.correlations, 1), v.kCorrelationSteps),
                    .corr_y_yaw = number(v.unpack(v.correlations, 2), v.kCorrelationSteps)});
}

/// An image and its features; place, number and count in `image` are not used.
template <class Put>
constexpr void encode_image(const sensor::CameraImage& image, std::span<const model::ImageFeature> features,
                            const SampleHead& head, Put&& put) {
  for (const model::ImageFeature& feature : features)
    put(InFeature{.stamp_us = head.stamp_us,
                  .seq = head.seq,
                  .inst = head.inst,
                  .track_id = feature.id,
                  .u = 0.25F * static_cast<float>(feature.u_quarter_px),
                  .v = 0.25F * static_cast<float>(feature.v_quarter_px)});
  const bool exposed = image.exposure_10us != sensor::CameraImage::kNoExposure;
  put(InImage{.stamp_us = head.stamp_us,
              .seq = head.seq,
              .inst = head.inst,
              .count = static_cast<std::uint8_t>(features.size()),
              .exposure_s = exposed ? 1e-5F * static_cast<float>(image.exposure_10us) : base::kNan,
              .tracker_state = static_cast<TrackerState>(image.tracker_state)});
}

}  // namespace tetap::bus
