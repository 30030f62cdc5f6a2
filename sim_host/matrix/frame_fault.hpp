// SPDX-License-Identifier: Apache-2.0
// One fault put into the frames of a log. The DBC alone gives the fields: recorded and simulated logs are treated
// alike. Frames of other devices stay as they are, bit for bit.
#pragma once

#include "sim_host/matrix/dbc.hpp"
#include "sim_host/play/log.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tetap::sim {

enum class FaultKind : std::uint8_t {
  kOffset,        ///< a constant added
  kSpike,         ///< the same on the first samples only
  kStep,          ///< the same for longer
  kRamp,          ///< grows from 0 to its size
  kScale,         ///< times a factor
  kSign,          ///< times -1
  kDead,          ///< reads 0; a counter stops
  kStuck,         ///< repeats the first value
  kDelayed,       ///< frames arrive late; their stamps stay
  kRepeated,      ///< each frame twice
  kLost,          ///< no frames
  kNotAvailable,  ///< the DBC's code for it
};

/// Names as on a command line. Throws std::runtime_error with the names that there are.
[[nodiscard]] FaultKind fault_kind(std::string_view name);
[[nodiscard]] std::string_view name(FaultKind kind);

struct FrameFault {
  std::string sensor;  ///< gyro accel wheels speed gnss_position gnss_velocity gnss_both gnss_accuracy magnetometer
                       ///< barometer heading heading_accuracy landmarks stamps frames
  std::string axis;    ///< axis of the sensor; the device of stamps and frames
  FaultKind kind = FaultKind::kOffset;
  /// Size of offset, spike, step and ramp: rad/s, m/s2, m/s, m, uT, Pa, rad; for stamps s. Scale: the factor.
  /// Delayed: s. For gnss_both it is that of the position; the velocity's is `velocity_mps`.
  double size = 0;
  double velocity_mps = 0;
  int samples = 0;  ///< length of a spike
  base::Micros start;
  base::Micros duration;
};

/// Numbers of the robot that frames do not carry.
struct FrameGeometry {
  std::uint32_t base = 0x300;  ///< id base of the log
  unsigned imu = 0;            ///< instance
  /// From the IMU's axes into the body's, row by row: axes of a fault are the body's.
  std::array<double, 9> mounting_bs{1, 0, 0, 0, 1, 0, 0, 0, 1};
  double metres_per_count = 0;  ///< step of the wheel counters
  double latitude_deg = 48;     ///< for metres in a degree of longitude
};

struct Faulted {
  std::vector<TimedFrame> frames;  ///< in the order of their times
  std::uint64_t changed = 0;       ///< frames altered, taken out, put in or delayed
  double largest = 0;              ///< largest change of a value, in the unit of the fault's size
};

/// Throws std::runtime_error where the sensor has no such axis.
[[nodiscard]] Faulted put_fault(std::span<const TimedFrame> frames, const FrameFault& fault,
                                const FrameGeometry& geometry, const BusDatabase& dbc);

/// Offsets of the messages that a device sends: imu wheels speed gnss magnetometer barometer heading landmarks.
[[nodiscard]] std::vector<std::uint32_t> device_messages(std::string_view device, unsigned imu, const BusDatabase& dbc);

/// Largest size of a value fault that the sensor's frames can carry, in the fault's unit.
[[nodiscard]] double largest_size(const FrameFault& fault, const FrameGeometry& geometry, const BusDatabase& dbc,
                                  double interval_s);

}  // namespace tetap::sim
