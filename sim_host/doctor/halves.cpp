// SPDX-License-Identifier: Apache-2.0
#include "sim_host/doctor/halves.hpp"

#include "tetap/bus/messages.hpp"

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::doctor {
namespace {

constexpr double kMissing = 0.1;  ///< a part with fewer frames than that share of the others is missing
constexpr std::uint64_t kLeastFrames = 10;

struct Part {
  std::uint32_t offset;
  std::string message;
};

/// `whole`: samples that were put together of these parts.
void judge(std::span<const Part> parts, const std::array<std::uint64_t, 0x20>& frames, std::uint64_t whole,
           Devices spoils, Findings& findings) {
  const auto count = [&](const Part& part) { return frames[part.offset]; };
  const Part& most =
      *std::max_element(parts.begin(), parts.end(), [&](const Part& a, const Part& b) { return count(a) < count(b); });
  const auto expected = static_cast<double>(count(most));
  if (count(most) < kLeastFrames) return;
  bool named = false;
  for (const Part& part : parts) {
    if (static_cast<double>(count(part)) >= kMissing * expected) continue;
    named = true;
    findings.push_back({.code = Code::kMessageMissing,
                        .evidence = text("The log has %llu frames of %s and %llu of %s, which belongs to the same "
                                         "sample.",
                                         static_cast<unsigned long long>(count(most)), most.message.c_str(),
                                         static_cast<unsigned long long>(count(part)), part.message.c_str()),
                        .change = "Send " + part.message + " with each " + most.message + ", with the same Seq.",
                        .spoils = spoils});
  }
  if (named || static_cast<double>(whole) >= kMissing * expected) return;
  findings.push_back({.code = Code::kMessageMissing,
                      .evidence = text("Of %llu frames of %s and as many of its partners, %llu whole samples come out: "
                                       "Seq or Stamp of the parts differ.",
                                       static_cast<unsigned long long>(count(most)), most.message.c_str(),
                                       static_cast<unsigned long long>(whole)),
                      .change = "Send all messages of a sample with one Seq and, for GNSS, one Stamp.",
                      .spoils = spoils});
}

}  // namespace

void HalvesDetector::sample(base::Micros, const sensor::Sample& sample) {
  if (sample.sensor == sensor::Sensor::kImu) ++imus_[sample.instance % 4];
  if (sample.sensor == sensor::Sensor::kGnssPosition) ++positions_;
  if (sample.sensor == sensor::Sensor::kGnssVelocity) ++velocities_;
}

void HalvesDetector::finish(Findings& findings) {
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::string imu = "In_Imu" + std::to_string(i);
    const std::uint32_t offset = bus::ImuGyro::kOffset + bus::ImuGyro::kStride * i;
    const std::vector<Part> parts{{offset, imu + "Gyro"}, {offset + 1, imu + "Accel"}, {offset + 2, imu + "Time"}};
    judge(parts, frames_, imus_[i], kGyroscope | kAccelerometer | kMounting, findings);
  }
  const std::vector<Part> position{{bus::InGnssLat::kOffset, "In_GnssLat"},
                                   {bus::InGnssLon::kOffset, "In_GnssLon"},
                                   {bus::InGnssAlt::kOffset, "In_GnssAlt"},
                                   {bus::InGnssAcc::kOffset, "In_GnssAcc"}};
  judge(position, frames_, positions_, kFixes, findings);
  const std::vector<Part> velocity{{bus::InGnssVelEN::kOffset, "In_GnssVelEN"},
                                   {bus::InGnssVelU::kOffset, "In_GnssVelU"}};
  judge(velocity, frames_, velocities_, kGnssVelocity, findings);
}

}  // namespace tetap::doctor
