// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/header.hpp"

namespace tetap::doctor {
namespace {

template <class Message>
std::optional<Header> read(std::uint32_t offset, const base::CanFrame& frame, std::string_view name,
                           std::uint8_t instance = 0) {
  const auto message = bus::decode<Message>(bus::payload(frame));
  if (!message) return std::nullopt;
  Header header{.message = name, .instance = instance, .counter = message->seq, .stamp_us = {}, .interval_us = {}};
  if constexpr (requires { message->inst; }) header.instance = static_cast<std::uint8_t>(message->inst);
  if constexpr (requires { message->stamp_us; }) header.stamp_us = static_cast<std::uint32_t>(message->stamp_us);
  if constexpr (requires { message->interval_us; })
    header.interval_us = static_cast<std::uint32_t>(message->interval_us);
  header.stream = 4 * offset + header.instance % 4U;
  return header;
}

std::optional<Header> imu(std::uint32_t offset, const base::CanFrame& frame) {
  const std::uint32_t at = offset - bus::ImuGyro::kOffset;
  const auto instance = static_cast<std::uint8_t>(at / bus::ImuGyro::kStride);
  switch (at % bus::ImuGyro::kStride) {
    case 0:
      return read<bus::ImuGyro>(offset, frame, "In_Imu*Gyro", instance);
    case 1:
      return read<bus::ImuAccel>(offset, frame, "In_Imu*Accel", instance);
    default:
      return read<bus::ImuTime>(offset, frame, "In_Imu*Time", instance);
  }
}

}  // namespace

std::optional<Header> header_of(std::uint32_t offset, const base::CanFrame& frame) {
  if (offset >= bus::ImuGyro::kOffset && offset < bus::ImuGyro::kOffset + 4 * bus::ImuGyro::kStride)
    return imu(offset, frame);
  switch (offset) {
    case bus::InWheelCounts::kOffset:
      return read<bus::InWheelCounts>(offset, frame, "In_WheelCounts");
    case bus::InWheelSpeed::kOffset:
      return read<bus::InWheelSpeed>(offset, frame, "In_WheelSpeed");
    case bus::InBodySpeed::kOffset:
      return read<bus::InBodySpeed>(offset, frame, "In_BodySpeed");
    case bus::InRangeBearing::kOffset:
      return read<bus::InRangeBearing>(offset, frame, "In_RangeBearing");
    case bus::InGnssLat::kOffset:
      return read<bus::InGnssLat>(offset, frame, "In_GnssLat");
    case bus::InGnssLon::kOffset:
      return read<bus::InGnssLon>(offset, frame, "In_GnssLon");
    case bus::InGnssAlt::kOffset:
      return read<bus::InGnssAlt>(offset, frame, "In_GnssAlt");
    case bus::InGnssAcc::kOffset:
      return read<bus::InGnssAcc>(offset, frame, "In_GnssAcc");
    case bus::InGnssVelEN::kOffset:
      return read<bus::InGnssVelEN>(offset, frame, "In_GnssVelEN");
    case bus::InGnssVelU::kOffset:
      return read<bus::InGnssVelU>(offset, frame, "In_GnssVelU");
    case bus::InMag::kOffset:
      return read<bus::InMag>(offset, frame, "In_Mag");
    case bus::InBaro::kOffset:
      return read<bus::InBaro>(offset, frame, "In_Baro");
    case bus::InHeading::kOffset:
      return read<bus::InHeading>(offset, frame, "In_Heading");
    case bus::InRadar::kOffset:
      return read<bus::InRadar>(offset, frame, "In_Radar");
    default:
      return std::nullopt;
  }
}

}  // namespace tetap::doctor
