// SPDX-License-Identifier: Apache-2.0
// From frames to samples and commands: decodes, puts samples of several frames together, counts what does not fit.
#pragma once

#include "tetap/base/crc.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/commands.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/bus/reassembly.hpp"
#include "tetap/sensor/sample.hpp"

#include <cstdint>
#include <limits>
#include <type_traits>

namespace tetap::bus {

inline constexpr std::int64_t kNoAngle = std::numeric_limits<std::int64_t>::min();

[[nodiscard]] constexpr bool all_finite(auto... values) { return (base::is_finite(values) && ...); }

/// The receiver's word for the fix; one that has no name is no fix.
[[nodiscard]] constexpr sensor::GnssFix fix_of(bus::GnssFix fix) {
  const auto code = static_cast<std::uint8_t>(fix);
  return code <= static_cast<std::uint8_t>(sensor::GnssFix::kRtkFixed) ? static_cast<sensor::GnssFix>(code)
                                                                       : sensor::GnssFix::kNone;
}

class Decoder {
 public:
  /// Everything of an input frame but what it means: called with the offset within the node's block. Out gets
  /// sample(Sample), map_entry(MapEntry), set_pose(SetPose), reset(bus::ResetWhat). `reference` is the time stamps are
  /// extended around.
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference, Counters& counters,
                Out&& out);
  /// The same where the frame's CRC, frame_crc(), is known already.
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                Counters& counters, Out&& out);

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
  void discard(Counters& counters) {
    assembly_.discard(counters);
    commands_.discard();
  }

 private:
  static constexpr std::uint8_t kImuFrames = 0b111, kPositionFrames = 0b1111, kVelocityFrames = 0b11;

  template <class Out>
  void imu(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
           Counters& counters, Out& out);
  template <class Message, class Fill, class Out>
  void gnss(const base::CanFrame& frame, sensor::Sensor sensor, std::uint8_t frames, std::uint8_t frame_bit,
            std::uint32_t bits, base::Micros reference, Counters& counters, Out& out, Fill&& fill);

  Reassembly assembly_;
  Commands commands_;
};

/// A whole sample from one frame.
template <class Message>
[[nodiscard]] constexpr sensor::Sample stamped(const Message& message, sensor::Sensor sensor, std::uint32_t bits,
                                               base::Micros reference) {
  sensor::Sample sample;
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
void Decoder::imu(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                  Counters& counters, Out& out) {
  const auto instance = static_cast<std::uint8_t>((offset - bus::ImuGyro::kOffset) / bus::ImuGyro::kStride);
  const auto part = static_cast<std::uint8_t>((offset - bus::ImuGyro::kOffset) % bus::ImuGyro::kStride);
  if (part == 0) {
    const auto gyro = bus::decode<bus::ImuGyro>(bus::payload(frame));
    if (!gyro) return void(++counters.malformed);
    if (!all_finite(gyro->ang_x_rad, gyro->ang_y_rad, gyro->ang_z_rad)) return void(++counters.out_of_range);
    Reassembly::Partial& partial =
        assembly_.slot(sensor::Sensor::kImu, instance, gyro->seq, kImuFrames, reference, counters);
    partial.sample.payload.imu.dangle_b_rad = {gyro->ang_x_rad, gyro->ang_y_rad, gyro->ang_z_rad};
    assembly_.complete(partial, 0b001, bits, counters, out);
  } else if (part == 1) {
    const auto accel = bus::decode<bus::ImuAccel>(bus::payload(frame));
    if (!accel) return void(++counters.malformed);
    if (!all_finite(accel->vel_x_mps, accel->vel_y_mps, accel->vel_z_mps)) return void(++counters.out_of_range);
    Reassembly::Partial& partial =
        assembly_.slot(sensor::Sensor::kImu, instance, accel->seq, kImuFrames, reference, counters);
    partial.sample.payload.imu.dvelocity_b_mps = {accel->vel_x_mps, accel->vel_y_mps, accel->vel_z_mps};
    assembly_.complete(partial, 0b010, bits, counters, out);
  } else {
    const auto time = bus::decode<bus::ImuTime>(bus::payload(frame));
    if (!time) return void(++counters.malformed);
    Reassembly::Partial& partial =
        assembly_.slot(sensor::Sensor::kImu, instance, time->seq, kImuFrames, reference, counters);
    if (time->interval_us == 0) {  // increments over no time: the sample is given up
      partial.missing = 0;
      return void(++counters.out_of_range);
    }
    partial.sample.stamp = base::extend(time->stamp_us, 20, reference);
    sensor::ImuSample& imu = partial.sample.payload.imu;
    imu.interval_us = time->interval_us;
    imu.temperature_degC = time->temp_degC;
    imu.clipped_gyro = time->clip_gyro;
    imu.clipped_accel = time->clip_accel;
    assembly_.complete(partial, 0b100, bits, counters, out);
  }
}

template <class Message, class Fill, class Out>
void Decoder::gnss(const base::CanFrame& frame, sensor::Sensor sensor, std::uint8_t frames, std::uint8_t frame_bit,
                   std::uint32_t bits, base::Micros reference, Counters& counters, Out& out, Fill&& fill) {
  const auto message = bus::decode<Message>(bus::payload(frame));
  if (!message) return void(++counters.malformed);
  Reassembly::Partial& partial = assembly_.slot(sensor, message->inst, message->seq, frames, reference, counters);
  const base::Micros stamp = base::extend(message->stamp_us, 20, reference);
  sensor::Sample& sample = partial.sample;
  if (partial.missing == frames) {
    sample.stamp = stamp;
    if (sensor == sensor::Sensor::kGnssPosition) {
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
void Decoder::on_frame(std::uint8_t offset, const base::CanFrame& frame, base::Micros reference, Counters& counters,
                       Out&& out) {
  on_frame(offset, frame, frame_crc(offset, frame), reference, counters, out);
}

template <class Out>
void Decoder::on_frame(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                       Counters& counters, Out&& out) {
  const auto bytes = bus::payload(frame);
  // One frame, one sample: decode, refuse what must be there and is not, stamp, fill.
  const auto single = [&]<class Message>(std::type_identity<Message>, sensor::Sensor sensor, auto&& fill) {
    const auto message = bus::decode<Message>(bytes);
    if (!message) return void(++counters.malformed);
    sensor::Sample sample = stamped(*message, sensor, bits, reference);
    if (!fill(*message, sample)) return void(++counters.out_of_range);
    out.sample(sample);
  };
  using sensor::Sensor;
  if (bytes.size() != 8) return void(++counters.malformed);
  if (offset >= bus::ImuGyro::kOffset && offset < bus::ImuGyro::kOffset + 4 * bus::ImuGyro::kStride)
    return imu(offset, frame, bits, reference, counters, out);

  switch (offset) {
    case bus::CmdReset::kOffset:
    case bus::CmdSetPos::kOffset:
    case bus::CmdSetYaw::kOffset:
      return commands_.on_frame(offset, frame, reference, counters, out);
    case bus::InMapEntry::kOffset: {
      const auto entry = bus::decode<bus::InMapEntry>(bytes);
      if (!entry) return void(++counters.malformed);
      if (entry->x_raw == kNoSteps || entry->y_raw == kNoSteps) return void(++counters.out_of_range);
      out.map_entry(estimators::MapEntry{.x_mm = entry->x_raw, .y_mm = entry->y_raw, .id = entry->id});
      return;
    }
    case bus::InWheelCounts::kOffset:
      return single(std::type_identity<bus::InWheelCounts>{}, sensor::Sensor::kWheelCounts,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.counts = {.left = m.left, .right = m.right};
                      return true;
                    });
    case bus::InWheelSpeed::kOffset:
      return single(std::type_identity<bus::InWheelSpeed>{}, sensor::Sensor::kWheelSpeed,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.wheel_speeds = {.left_mps = m.left_mps, .right_mps = m.right_mps};
                      return all_finite(m.left_mps, m.right_mps);
                    });
    case bus::InBodySpeed::kOffset:
      return single(std::type_identity<bus::InBodySpeed>{}, sensor::Sensor::kBodySpeed,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.body_speed = {.forward_mps = m.forward_mps, .yaw_rate_radps = m.yaw_rate_radps};
                      return base::is_finite(m.forward_mps);  // a speedometer has no yaw rate
                    });
    case bus::InRangeBearing::kOffset:
      return single(std::type_identity<bus::InRangeBearing>{}, sensor::Sensor::kRangeBearing,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.sighting = {.landmark = m.id, .range_m = m.range_m, .bearing_rad = m.bearing_rad};
                      s.detail = m.id;
                      return base::is_finite(m.range_m) || base::is_finite(m.bearing_rad);
                    });
    case bus::InRadar::kOffset:
      return single(std::type_identity<bus::InRadar>{}, sensor::Sensor::kRangeBearing,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.sighting = {.landmark = 0xFF,
                                            .range_m = m.range_m,
                                            .bearing_rad = m.bearing_rad,
                                            .range_rate_mps = m.range_rate_mps};
                      s.detail = 0xFF;
                      return all_finite(m.range_m, m.bearing_rad, m.range_rate_mps);
                    });
    case bus::InMag::kOffset:
      return single(std::type_identity<bus::InMag>{}, sensor::Sensor::kMagnetometer,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.magnetic = {.flux_b_uT = {m.flux_x_uT, m.flux_y_uT, m.flux_z_uT}};
                      return all_finite(m.flux_x_uT, m.flux_y_uT, m.flux_z_uT);
                    });
    case bus::InBaro::kOffset:
      return single(std::type_identity<bus::InBaro>{}, sensor::Sensor::kBarometer,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.pressure = {.pressure_Pa = m.pressure_Pa, .temperature_degC = m.temp_degC};
                      return base::is_finite(m.pressure_Pa);
                    });
    case bus::InHeading::kOffset:
      return single(std::type_identity<bus::InHeading>{}, sensor::Sensor::kHeading,
                    [](const auto& m, sensor::Sample& s) {
                      s.payload.heading = {.yaw_rad = m.angle_rad, .acc_rad = m.acc_rad};
                      return base::is_finite(m.angle_rad);
                    });
    case bus::InGnssLat::kOffset:
      return gnss<bus::InGnssLat>(
          frame, sensor::Sensor::kGnssPosition, kPositionFrames, 0b0001, bits, reference, counters, out,
          [](const auto& m, auto& p) { return p.gnss_position.latitude_2ndeg = m.lat_raw, m.lat_raw != kNoAngle; });
    case bus::InGnssLon::kOffset:
      return gnss<bus::InGnssLon>(
          frame, sensor::Sensor::kGnssPosition, kPositionFrames, 0b0010, bits, reference, counters, out,
          [](const auto& m, auto& p) { return p.gnss_position.longitude_2ndeg = m.lon_raw, m.lon_raw != kNoAngle; });
    case bus::InGnssAlt::kOffset:
      return gnss<bus::InGnssAlt>(frame, sensor::Sensor::kGnssPosition, kPositionFrames, 0b0100, bits, reference,
                                  counters, out, [](const auto& m, auto& p) {
                                    p.gnss_position.height_m = m.height_m;
                                    p.gnss_position.fix = fix_of(m.fix);
                                    p.gnss_position.satellites = m.num_sv;
                                    return true;
                                  });
    case bus::InGnssAcc::kOffset:
      return gnss<bus::InGnssAcc>(frame, sensor::Sensor::kGnssPosition, kPositionFrames, 0b1000, bits, reference,
                                  counters, out, [](const auto& m, auto& p) {
                                    p.gnss_position.horizontal_acc_m = m.hor_m;
                                    p.gnss_position.vertical_acc_m = m.ver_m;
                                    return true;
                                  });
    case bus::InGnssVelEN::kOffset:
      return gnss<bus::InGnssVelEN>(frame, sensor::Sensor::kGnssVelocity, kVelocityFrames, 0b01, bits, reference,
                                    counters, out, [](const auto& m, auto& p) {
                                      p.gnss_velocity.v_n_mps[0] = m.east_mps;
                                      p.gnss_velocity.v_n_mps[1] = m.north_mps;
                                      return all_finite(m.east_mps, m.north_mps);
                                    });
    case bus::InGnssVelU::kOffset:
      return gnss<bus::InGnssVelU>(frame, sensor::Sensor::kGnssVelocity, kVelocityFrames, 0b10, bits, reference,
                                   counters, out, [](const auto& m, auto& p) {
                                     p.gnss_velocity.v_n_mps[2] = m.up_mps;
                                     p.gnss_velocity.acc_mps = m.acc_mps;
                                     return true;
                                   });
    default:
      ++counters.malformed;
  }
}

}  // namespace tetap::bus
