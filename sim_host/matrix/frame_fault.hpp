// SPDX-License-Identifier: Apache-2.0
// One fault put into the frames of a log. The DBC alone gives the fields: recorded and simulated logs are treated
// alike. Frames of other devices stay as they are, bit for bit.
#pragma once

#include "sim_host/matrix/dbc.hpp"
#include "sim_host/replay/log.hpp"

#include <array>
#include <cstddef>
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

/// A sensor that faults act on, and its axes with blanks between; those of stamps and frames are devices.
struct FaultSensor {
  std::string_view name, axes;
};
inline constexpr std::string_view kFaultDevices = "imu wheels gnss magnetometer barometer heading landmarks";
inline constexpr std::array kFaultSensors{FaultSensor{"gyro", "x y z"},
                                          FaultSensor{"accel", "x y z"},
                                          FaultSensor{"wheels", "left right both"},
                                          FaultSensor{"speed", "forward yaw"},
                                          FaultSensor{"gnss_position", "north east up"},
                                          FaultSensor{"gnss_velocity", "north east up"},
                                          FaultSensor{"gnss_both", "north east up"},
                                          FaultSensor{"gnss_accuracy", "horizontal vertical velocity all"},
                                          FaultSensor{"magnetometer", "x y z"},
                                          FaultSensor{"barometer", "pressure"},
                                          FaultSensor{"heading", "angle"},
                                          FaultSensor{"heading_accuracy", "angle"},
                                          FaultSensor{"landmarks", "range bearing"},
                                          FaultSensor{"stamps", kFaultDevices},
                                          FaultSensor{"frames", kFaultDevices}};

/// Kinds that act on values, and those of whole frames.
inline constexpr std::string_view kValueKinds = "offset spike step ramp scale sign dead stuck not_available";
inline constexpr std::string_view kFrameKinds = "delayed repeated lost not_available";

struct FrameFault {
  std::string sensor;  ///< name of kFaultSensors
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

/// Throws std::runtime_error, with the names that there are, where no sensor, axis or kind of this sensor is called so.
void require_known(const FrameFault& fault);

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
  std::vector<TimedFrame> frames;    ///< in the order of their times
  std::vector<std::size_t> origins;  ///< indices of the frames that they come from
  std::uint64_t changed = 0;         ///< frames altered, taken out, put in or delayed
  double largest = 0;                ///< largest change of a value, in the unit of the fault's size
};

/// Throws as require_known does.
[[nodiscard]] Faulted put_fault(std::span<const TimedFrame> frames, const FrameFault& fault,
                                const FrameGeometry& geometry, const BusDatabase& dbc);

/// Offsets of the messages that a device of kFaultDevices sends.
[[nodiscard]] std::vector<std::uint32_t> device_messages(std::string_view device, unsigned imu, const BusDatabase& dbc);

/// Largest size of a value fault that the sensor's frames can carry, in the fault's unit.
[[nodiscard]] double largest_size(const FrameFault& fault, const FrameGeometry& geometry, const BusDatabase& dbc,
                                  double interval_s);

}  // namespace tetap::sim
