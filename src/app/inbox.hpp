// SPDX-License-Identifier: Apache-2.0
// From frames to samples and commands: decodes, puts samples of several frames together, counts what does not fit.
#pragma once

#include "app/assembly.hpp"
#include "app/commands.hpp"
#include "app/health.hpp"
#include "app/sample.hpp"
#include "base/crc.hpp"
#include "can/codec.hpp"
#include "config/messages.hpp"

#include <cstdint>
#include <limits>
#include <type_traits>

namespace tetap::app {

inline constexpr std::int64_t kNoAngle = std::numeric_limits<std::int64_t>::min();

[[nodiscard]] constexpr bool all_finite(auto... values) { return (base::is_finite(values) && ...); }

/// The receiver's word for the fix; one that has no name is no fix.
[[nodiscard]] constexpr GnssFix fix_of(can::GnssFix fix) {
  const auto code = static_cast<std::uint8_t>(fix);
  return code <= static_cast<std::uint8_t>(GnssFix::kRtkFixed) ? static_cast<GnssFix>(code) : GnssFix::kNone;
}

class Inbox {
 public:
  /// Everything of an input frame but what it means: called with the offset within the node's block. Out gets
  /// sample(Sample), map_entry(MapEntry), set_pose(SetPose), reset(can::ResetWhat). `reference` is the time stamps are
  /// extended around.
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference, Counters& counters,
                Out&& out);

  void power_on() {
    assembly_.power_on();
    commands_.power_on();
  }
  /// At each tick: halves older than `patience`, or from a time still to come, are given up and counted.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    assembly_.expire(now, patience, counters);
    commands_.expire(now, patience, counters);
  }
  /// Time has jumped: whatever is half belongs to another time.
  void forget(Counters& counters) {
    assembly_.forget(counters);
    commands_.forget();
  }

 private:
  static constexpr std::uint8_t kImuFrames = 0b111, kPositionFrames = 0b1111, kVelocityFrames = 0b11;

  template <class Out>
  void imu(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
           Counters& counters, Out& out);
  template <class Message, class Fill, class Out>
  void gnss(const base::CanFrame& frame, can::Sensor sensor, std::uint8_t frames, std::uint8_t frame_bit,
            std::uint32_t bits, base::Micros reference, Counters& counters, Out& out, Fill&& fill);

  Assembly assembly_;
  Commands commands_;
};

/// A whole sample from one frame.
template <class Message>
[[nodiscard]] constexpr Sample stamped(const Message& message, can::Sensor sensor, std::uint32_t bits,
                                       base::Micros reference) {
  Sample sample;
  sample.stamp = base::extend(message.stamp_us, 20, reference);
  sample.sensor = sensor;
  sample.instance = message.inst;
  sample.sequence = message.seq;
  sample.bits = bits;
  return sample;
}

/// CRC-32 of a frame's meaning: offset, length, data.
[[nodiscard]] constexpr std::uint32_t frame_crc(std::uint8_t offset, const base::CanFrame& frame) {
  base::Crc32 crc;
  crc.add(offset);
  crc.add(frame.size);
  for (std::size_t i = 0; i < frame.size && i < frame.data.size(); ++i) crc.add(frame.data[i]);
  return crc.value();
}

template <class Out>
void Inbox::imu(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                Counters& counters, Out& out) {
  const auto instance = static_cast<std::uint8_t>((offset - can::ImuGyro::kOffset) / can::ImuGyro::kStride);
  const auto part = static_cast<std::uint8_t>((offset - can::ImuGyro::kOffset) % can::ImuGyro::kStride);
  if (part == 0) {
    const auto gyro = can::decode<can::ImuGyro>(can::payload(frame));
    if (!gyro) return void(++counters.malformed);
    if (!all_finite(gyro->ang_x_rad, gyro->ang_y_rad, gyro->ang_z_rad)) return void(++counters.out_of_range);
    Assembly::Partial& partial =
        assembly_.slot(can::Sensor::kImu, instance, gyro->seq, kImuFrames, reference, counters);
    partial.sample.payload.imu.dangle_b_rad = {gyro->ang_x_rad, gyro->ang_y_rad, gyro->ang_z_rad};
    assembly_.complete(partial, 0b001, bits, counters, out);
  } else if (part == 1) {
    const auto accel = can::decode<can::ImuAccel>(can::payload(frame));
    if (!accel) return void(++counters.malformed);
    if (!all_finite(accel->vel_x_mps, accel->vel_y_mps, accel->vel_z_mps)) return void(++counters.out_of_range);
    Assembly::Partial& partial =
        assembly_.slot(can::Sensor::kImu, instance, accel->seq, kImuFrames, reference, counters);
    partial.sample.payload.imu.dvelocity_b_mps = {accel->vel_x_mps, accel->vel_y_mps, accel->vel_z_mps};
    assembly_.complete(partial, 0b010, bits, counters, out);
  } else {
    const auto time = can::decode<can::ImuTime>(can::payload(frame));
    if (!time) return void(++counters.malformed);
    Assembly::Partial& partial =
        assembly_.slot(can::Sensor::kImu, instance, time->seq, kImuFrames, reference, counters);
    partial.sample.stamp = base::extend(time->stamp_us, 20, reference);
    ImuSample& imu = partial.sample.payload.imu;
    imu.interval_us = time->interval_us;
    imu.temperature_degC = time->temp_degC;
    imu.clipped_gyro = time->clip_gyro;
    imu.clipped_accel = time->clip_accel;
    assembly_.complete(partial, 0b100, bits, counters, out);
  }
}

template <class Message, class Fill, class Out>
void Inbox::gnss(const base::CanFrame& frame, can::Sensor sensor, std::uint8_t frames, std::uint8_t frame_bit,
                 std::uint32_t bits, base::Micros reference, Counters& counters, Out& out, Fill&& fill) {
  const auto message = can::decode<Message>(can::payload(frame));
  if (!message) return void(++counters.malformed);
  Assembly::Partial& partial = assembly_.slot(sensor, message->inst, message->seq, frames, reference, counters);
  const base::Micros stamp = base::extend(message->stamp_us, 20, reference);
  Sample& sample = partial.sample;
  if (partial.missing == frames) {
    sample.stamp = stamp;
    if (sensor == can::Sensor::kGnssPosition) {
      sample.payload.gnss_position = {};
    } else {
      sample.payload.gnss_velocity = {};
    }
  } else if (sample.stamp != stamp) {  // frames of two samples under one sequence number: never mixed
    ++counters.incomplete;
    partial.missing = frames;
    sample.stamp = stamp;
    sample.bits = 0;
  }
  if (!fill(*message, sample.payload)) {
    ++counters.out_of_range;
    partial.missing = 0;
    return;
  }
  assembly_.complete(partial, frame_bit, bits, counters, out);
}

template <class Out>
void Inbox::on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference, Counters& counters,
                     Out&& out) {
  const auto bytes = can::payload(frame);
  const std::uint32_t bits = frame_crc(offset, frame);
  // One frame, one sample: decode, refuse what must be there and is not, stamp, fill.
  const auto single = [&]<class Message>(std::type_identity<Message>, can::Sensor sensor, auto&& fill) {
    const auto message = can::decode<Message>(bytes);
    if (!message) return void(++counters.malformed);
    Sample sample = stamped(*message, sensor, bits, reference);
    if (!fill(*message, sample)) return void(++counters.out_of_range);
    out.sample(sample);
  };
  using can::Sensor;
  if (bytes.size() != 8) return void(++counters.malformed);
  if (offset >= can::ImuGyro::kOffset && offset < can::ImuGyro::kOffset + 4 * can::ImuGyro::kStride)
    return imu(offset, frame, bits, reference, counters, out);

  switch (offset) {
    case can::CmdReset::kOffset:
    case can::CmdSetPos::kOffset:
    case can::CmdSetYaw::kOffset:
      return commands_.on_frame(offset, frame, reference, counters, out);
    case can::InMapEntry::kOffset: {
      const auto entry = can::decode<can::InMapEntry>(bytes);
      if (!entry) return void(++counters.malformed);
      if (entry->x_raw == kNoSteps || entry->y_raw == kNoSteps) return void(++counters.out_of_range);
      out.map_entry(MapEntry{.x_mm = entry->x_raw, .y_mm = entry->y_raw, .id = entry->id});
      return;
    }
    case can::InWheelCounts::kOffset:
      return single(std::type_identity<can::InWheelCounts>{}, Sensor::kWheelCounts, [](const auto& m, Sample& s) {
        s.payload.counts = {.left = m.left, .right = m.right};
        return true;
      });
    case can::InWheelSpeed::kOffset:
      return single(std::type_identity<can::InWheelSpeed>{}, Sensor::kWheelSpeed, [](const auto& m, Sample& s) {
        s.payload.wheel_speeds = {.left_mps = m.left_mps, .right_mps = m.right_mps};
        return all_finite(m.left_mps, m.right_mps);
      });
    case can::InBodySpeed::kOffset:
      return single(std::type_identity<can::InBodySpeed>{}, Sensor::kBodySpeed, [](const auto& m, Sample& s) {
        s.payload.body_speed = {.forward_mps = m.forward_mps, .yaw_rate_radps = m.yaw_rate_radps};
        return base::is_finite(m.forward_mps);  // a speedometer has no yaw rate
      });
    case can::InRangeBearing::kOffset:
      return single(std::type_identity<can::InRangeBearing>{}, Sensor::kRangeBearing, [](const auto& m, Sample& s) {
        s.payload.sighting = {.landmark = m.id, .range_m = m.range_m, .bearing_rad = m.bearing_rad};
        s.detail = m.id;
        return base::is_finite(m.range_m) || base::is_finite(m.bearing_rad);
      });
    case can::InMag::kOffset:
      return single(std::type_identity<can::InMag>{}, Sensor::kMagnetometer, [](const auto& m, Sample& s) {
        s.payload.magnetic = {.flux_b_uT = {m.flux_x_uT, m.flux_y_uT, m.flux_z_uT}};
        return all_finite(m.flux_x_uT, m.flux_y_uT, m.flux_z_uT);
      });
    case can::InBaro::kOffset:
      return single(std::type_identity<can::InBaro>{}, Sensor::kBarometer, [](const auto& m, Sample& s) {
        s.payload.pressure = {.pressure_Pa = m.pressure_Pa, .temperature_degC = m.temp_degC};
        return base::is_finite(m.pressure_Pa);
      });
    case can::InHeading::kOffset:
      return single(std::type_identity<can::InHeading>{}, Sensor::kHeading, [](const auto& m, Sample& s) {
        s.payload.heading = {.yaw_rad = m.angle_rad, .acc_rad = m.acc_rad};
        return base::is_finite(m.angle_rad);
      });
    case can::InGnssLat::kOffset:
      return gnss<can::InGnssLat>(
          frame, Sensor::kGnssPosition, kPositionFrames, 0b0001, bits, reference, counters, out,
          [](const auto& m, auto& p) { return p.gnss_position.latitude_2ndeg = m.lat_raw, m.lat_raw != kNoAngle; });
    case can::InGnssLon::kOffset:
      return gnss<can::InGnssLon>(
          frame, Sensor::kGnssPosition, kPositionFrames, 0b0010, bits, reference, counters, out,
          [](const auto& m, auto& p) { return p.gnss_position.longitude_2ndeg = m.lon_raw, m.lon_raw != kNoAngle; });
    case can::InGnssAlt::kOffset:
      return gnss<can::InGnssAlt>(frame, Sensor::kGnssPosition, kPositionFrames, 0b0100, bits, reference, counters, out,
                                  [](const auto& m, auto& p) {
                                    p.gnss_position.height_m = m.height_m;
                                    p.gnss_position.fix = fix_of(m.fix);
                                    p.gnss_position.satellites = m.num_sv;
                                    return true;
                                  });
    case can::InGnssAcc::kOffset:
      return gnss<can::InGnssAcc>(frame, Sensor::kGnssPosition, kPositionFrames, 0b1000, bits, reference, counters, out,
                                  [](const auto& m, auto& p) {
                                    p.gnss_position.horizontal_acc_m = m.hor_m;
                                    p.gnss_position.vertical_acc_m = m.ver_m;
                                    return true;
                                  });
    case can::InGnssVelEN::kOffset:
      return gnss<can::InGnssVelEN>(frame, Sensor::kGnssVelocity, kVelocityFrames, 0b01, bits, reference, counters, out,
                                    [](const auto& m, auto& p) {
                                      p.gnss_velocity.v_n_mps[0] = m.east_mps;
                                      p.gnss_velocity.v_n_mps[1] = m.north_mps;
                                      return all_finite(m.east_mps, m.north_mps);
                                    });
    case can::InGnssVelU::kOffset:
      return gnss<can::InGnssVelU>(frame, Sensor::kGnssVelocity, kVelocityFrames, 0b10, bits, reference, counters, out,
                                   [](const auto& m, auto& p) {
                                     p.gnss_velocity.v_n_mps[2] = m.up_mps;
                                     p.gnss_velocity.acc_mps = m.acc_mps;
                                     return true;
                                   });
    default:
      ++counters.malformed;
  }
}

}  // namespace tetap::app
