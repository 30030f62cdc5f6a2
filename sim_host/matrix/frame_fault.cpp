// SPDX-License-Identifier: Apache-2.0
#include "sim_host/matrix/frame_fault.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

namespace tetap::sim {

namespace {

constexpr std::array<std::string_view, 12> kNames{"offset", "spike", "step",    "ramp",     "scale", "sign",
                                                  "dead",   "stuck", "delayed", "repeated", "lost",  "not_available"};
constexpr double kMetresPerDegree = 111'320;  ///< degree of latitude; good to 0.6 %
constexpr std::int64_t kStampPeriod = 1 << 20;
constexpr std::int64_t kCounterPeriod = 1 << 16;
constexpr std::size_t kSearch = 12;  ///< frames between the first and the last of one IMU sample, at most

enum class Form : std::uint8_t { kValue, kIncrement, kCounter, kStamp };

/// A signal that a fault changes.
struct Channel {
  const DbcMessage* message = nullptr;
  const DbcSignal* signal = nullptr;
  Form form = Form::kValue;
  double per_unit = 1;    ///< physical value of the DBC in one unit of the fault's size; negative: the other way
  bool velocity = false;  ///< its size is that of the velocity
};

/// Memory of a channel from frame to frame.
struct Memory {
  std::optional<std::int64_t> first;     ///< raw value of the first sample of the fault
  std::optional<std::int64_t> last_raw;  ///< raw value of the frame before
  std::int64_t last_stamp = 0;
  int samples = 0;     ///< within the fault
  double counted = 0;  ///< counts that the fault has added for good
};

class Channels {
 public:
  Channels(const FrameFault& fault, const FrameGeometry& geometry, const BusDatabase& dbc)
      : fault_(fault), geometry_(geometry), dbc_(dbc) {
    if (!imu() && !wheels() && !gnss() && !others()) refuse();
  }
  [[nodiscard]] const std::vector<Channel>& all() const { return all_; }

 private:
  [[noreturn]] void refuse() const {
    throw std::runtime_error("fault: sensor '" + fault_.sensor + "' has no axis '" + fault_.axis + "'");
  }
  void add(std::string_view message, std::string_view signal, Form form = Form::kValue, double per_unit = 1,
           bool velocity = false) {
    all_.push_back({&dbc_.message(message), &dbc_.signal(message, signal), form, per_unit, velocity});
  }
  [[nodiscard]] bool on(std::string_view axis) const { return fault_.axis == axis; }

  /// The IMU's own axis that lies nearest to the body's.
  bool imu() {
    const bool gyro = fault_.sensor == "gyro";
    if (!gyro && fault_.sensor != "accel") return false;
    const std::size_t axis = std::string_view("xyz").find(fault_.axis);
    if (fault_.axis.size() != 1 || axis > 2) refuse();
    const auto row = geometry_.mounting_bs.begin() + static_cast<std::ptrdiff_t>(3 * axis);
    const auto largest = std::max_element(row, row + 3, [](double a, double b) { return std::fabs(a) < std::fabs(b); });
    const std::string number = std::to_string(geometry_.imu);
    const std::string letter(1, "XYZ"[largest - row]);
    const std::string message = "Imu" + number + (gyro ? "Gyro" : "Accel");
    add("In_" + message, message + (gyro ? "_Ang" : "_Vel") + letter, Form::kIncrement, *largest < 0 ? -1 : 1);
    return true;
  }
  bool wheels() {
    if (fault_.sensor == "speed") {
      if (on("forward")) add("In_BodySpeed", "BodySpeed_Forward");
      if (on("yaw")) add("In_BodySpeed", "BodySpeed_YawRate");
    } else if (fault_.sensor == "wheels") {
      const double counts = geometry_.metres_per_count > 0 ? 1 / geometry_.metres_per_count : 0;
      for (const char* side : {"Left", "Right"}) {
        if (!on("both") && !on(side[0] == 'L' ? "left" : "right")) continue;
        add("In_WheelCounts", std::string("WheelCounts_") + side, Form::kCounter, counts);
        add("In_WheelSpeed", std::string("WheelSpeed_") + side);
      }
    } else {
      return false;
    }
    return !all_.empty();
  }
  bool gnss() {
    if (!fault_.sensor.starts_with("gnss_")) return false;
    const std::string_view what = std::string_view(fault_.sensor).substr(5);
    if (what == "position" || what == "both") {
      const double east = 1 / (kMetresPerDegree * std::cos(geometry_.latitude_deg * 3.14159265358979 / 180));
      if (on("north")) add("In_GnssLat", "GnssLat_Lat", Form::kValue, 1 / kMetresPerDegree);
      if (on("east")) add("In_GnssLon", "GnssLon_Lon", Form::kValue, east);
      if (on("up")) add("In_GnssAlt", "GnssAlt_Height");
    }
    if (what == "velocity" || what == "both") {
      if (on("east")) add("In_GnssVelEN", "GnssVelEN_East", Form::kValue, 1, true);
      if (on("north")) add("In_GnssVelEN", "GnssVelEN_North", Form::kValue, 1, true);
      if (on("up")) add("In_GnssVelU", "GnssVelU_Up", Form::kValue, 1, true);
    }
    if (what == "accuracy") {
      if (on("horizontal") || on("all")) add("In_GnssAcc", "GnssAcc_Hor");
      if (on("vertical") || on("all")) add("In_GnssAcc", "GnssAcc_Ver");
      if (on("velocity") || on("all")) add("In_GnssVelU", "GnssVelU_Acc");
    }
    return !all_.empty();
  }
  bool others() {
    if (fault_.sensor == "magnetometer" && fault_.axis.size() == 1)
      for (const char letter : {'X', 'Y', 'Z'})
        if (on(std::string(1, static_cast<char>(letter + 32)))) add("In_Mag", std::string("Mag_Flux") + letter);
    if (fault_.sensor == "barometer" && on("pressure")) add("In_Baro", "Baro_Pressure");
    if (fault_.sensor == "heading" && on("angle")) add("In_Heading", "Heading_Angle");
    if (fault_.sensor == "heading_accuracy" && on("angle")) add("In_Heading", "Heading_Acc");
    if (fault_.sensor == "landmarks" && on("range")) add("In_RangeBearing", "RangeBearing_Range");
    if (fault_.sensor == "landmarks" && on("bearing")) add("In_RangeBearing", "RangeBearing_Bearing");
    if (fault_.sensor == "stamps") {
      for (const std::uint32_t offset : device_messages(fault_.axis, geometry_.imu, dbc_))
        for (const DbcSignal& signal : dbc_.at(offset)->signals)
          if (signal.name.ends_with("_Stamp")) all_.push_back({dbc_.at(offset), &signal, Form::kStamp, 1e6, false});
    }
    return !all_.empty();
  }

  const FrameFault& fault_;
  const FrameGeometry& geometry_;
  const BusDatabase& dbc_;
  std::vector<Channel> all_;
};

/// The difference of two numbers of a counter that wraps.
std::int64_t wrapped(std::int64_t difference, std::int64_t period) {
  const std::int64_t rest = ((difference % period) + period) % period;
  return rest >= period / 2 ? rest - period : rest;
}

/// Puts one fault into the frames, one after another.
class Injector {
 public:
  Injector(std::span<const TimedFrame> frames, const FrameFault& fault, const FrameGeometry& geometry,
           const BusDatabase& dbc)
      : frames_(frames), fault_(fault), geometry_(geometry), dbc_(dbc) {
    if (fault.sensor == "frames") {
      whole_ = device_messages(fault.axis, geometry.imu, dbc);
    } else {
      channels_ = Channels(fault, geometry, dbc).all();
      memory_.resize(channels_.size());
    }
  }

  Faulted run() {
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const TimedFrame& f = frames_[i];
      if (f.frame.extended || f.frame.id < geometry_.base)
        put(f, i);
      else if (fault_.sensor == "frames")
        whole_frame(f, i);
      else
        values(i);
    }
    sort();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool during(base::Micros t) const { return t >= fault_.start && t < fault_.start + fault_.duration; }

  void put(const TimedFrame& frame, std::size_t origin) {
    result_.frames.push_back(frame);
    result_.origins.push_back(origin);
  }
  void sort() {
    const std::vector<TimedFrame> frames = std::move(result_.frames);
    const std::vector<std::size_t> origins = std::move(result_.origins);
    std::vector<std::size_t> order(frames.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return frames[a].time < frames[b].time; });
    result_.frames.clear();
    result_.origins.clear();
    for (const std::size_t i : order) put(frames[i], origins[i]);
  }

  void whole_frame(TimedFrame f, std::size_t i) {
    const std::uint32_t offset = f.frame.id - geometry_.base;
    const bool hit = during(f.time) && std::find(whole_.begin(), whole_.end(), offset) != whole_.end();
    bool changed = hit;
    if (hit && fault_.kind == FaultKind::kDelayed) f.time = f.time + base::Micros{std::llround(fault_.size * 1e6)};
    if (hit && fault_.kind == FaultKind::kNotAvailable) {
      for (const DbcSignal& signal : dbc_.at(offset)->signals)
        if (signal.has_not_available()) signal.set_raw(f.frame, signal.not_available());
      changed = f.frame.data != frames_[i].frame.data;
    }
    result_.changed += changed ? 1 : 0;
    if (hit && fault_.kind == FaultKind::kLost) return;
    put(f, i);
    if (hit && fault_.kind == FaultKind::kRepeated) put(f, i);
  }

  void values(std::size_t i) {
    TimedFrame f = frames_[i];
    const std::uint32_t offset = f.frame.id - geometry_.base;
    bool changed = false;
    for (std::size_t k = 0; k < channels_.size(); ++k)
      if (channels_[k].message->offset == offset)
        changed = (channels_[k].form == Form::kCounter ? counter(channels_[k], memory_[k], f)
                                                       : value(channels_[k], memory_[k], f, i)) ||
                  changed;
    result_.changed += changed ? 1 : 0;
    put(f, i);
  }

  /// Whether this sample has the fault; counts it.
  bool hit(Memory& memory, base::Micros t) const {
    if (fault_.kind == FaultKind::kSpike) return t >= fault_.start && memory.samples++ < fault_.samples;
    return during(t);
  }
  [[nodiscard]] double size(const Channel& channel) const {
    return channel.velocity && fault_.sensor == "gnss_both" ? fault_.velocity_mps : fault_.size;
  }
  /// Share of its size that a fault has at that time.
  [[nodiscard]] double grown(base::Micros t) const {
    if (fault_.kind != FaultKind::kRamp) return 1;
    return static_cast<double>((t - fault_.start).us) / static_cast<double>(fault_.duration.us);
  }

  /// Interval of the IMU sample that the frame at `i` belongs to; its frame comes with or behind it.
  [[nodiscard]] double interval_s(std::size_t i) const {
    const DbcMessage* const own = dbc_.at(frames_[i].frame.id - geometry_.base);
    const std::string number = std::to_string(geometry_.imu);
    const DbcMessage& times = dbc_.message("In_Imu" + number + "Time");
    const DbcSignal& seq = *times.find("Imu" + number + "Time_Seq");
    const DbcSignal* const own_seq = own->find(own->name.substr(3) + "_Seq");
    for (std::size_t k = i; k < frames_.size() && k < i + kSearch; ++k)
      if (frames_[k].frame.id == geometry_.base + times.offset &&
          seq.raw(frames_[k].frame) == own_seq->raw(frames_[i].frame))
        return times.find("Imu" + number + "Time_Interval")->value(frames_[k].frame) * 1e-6;
    return 0.01;
  }

  bool value(const Channel& channel, Memory& memory, TimedFrame& f, std::size_t i) {
    if (!hit(memory, f.time)) return false;
    const DbcSignal& s = *channel.signal;
    const std::int64_t raw = s.raw(f.frame);
    if (!memory.first) memory.first = raw;
    if (s.has_not_available() && raw == s.not_available()) return false;
    const double per_unit = channel.per_unit * (channel.form == Form::kIncrement ? interval_s(i) : 1);
    const std::int64_t wrong = wrong_value(channel, raw, *memory.first, per_unit * size(channel) * grown(f.time));
    if (wrong == raw) return false;
    const bool is_code = s.has_not_available() && wrong == s.not_available();
    const std::int64_t difference = channel.form == Form::kStamp ? wrapped(wrong - raw, kStampPeriod) : wrong - raw;
    if (!is_code && !(channel.velocity && fault_.sensor == "gnss_both"))
      result_.largest = std::max(result_.largest, std::fabs(static_cast<double>(difference) * s.factor / per_unit));
    s.set_raw(f.frame, wrong);
    return true;
  }

  /// `added`: in the DBC's unit.
  [[nodiscard]] std::int64_t wrong_value(const Channel& channel, std::int64_t raw, std::int64_t first,
                                         double added) const {
    const DbcSignal& s = *channel.signal;
    const double value = static_cast<double>(raw) * s.factor + s.offset;
    switch (fault_.kind) {
      case FaultKind::kScale:
        return s.nearest(value * fault_.size);
      case FaultKind::kSign:
        return s.nearest(-value);
      case FaultKind::kDead:
        return s.nearest(0);
      case FaultKind::kStuck:
        return first;
      case FaultKind::kNotAvailable:
        return s.has_not_available() ? s.not_available() : raw;
      default:
        break;
    }
    if (channel.form == Form::kStamp) return (raw + std::llround(added) + 16 * kStampPeriod) % kStampPeriod;
    return s.nearest(value + added);
  }

  /// A counter that wraps: a speed that is off adds counts for good, a spike is a reading that is off.
  bool counter(const Channel& channel, Memory& memory, TimedFrame& f) {
    const DbcSignal& s = *channel.signal;
    const std::int64_t raw = s.raw(f.frame);
    const std::int64_t stamp = channel.message->find(channel.message->name.substr(3) + "_Stamp")->raw(f.frame);
    const std::int64_t way = memory.last_raw ? wrapped(raw - *memory.last_raw, kCounterPeriod) : 0;
    const double dt_s =
        memory.last_raw ? static_cast<double>(wrapped(stamp - memory.last_stamp, kStampPeriod)) * 1e-6 : 0.01;
    memory.last_raw = raw;
    memory.last_stamp = stamp;
    double reading = 0;
    if (hit(memory, f.time)) {
      const double added = more_counts(way, channel.per_unit * size(channel) * grown(f.time) * dt_s);
      (fault_.kind == FaultKind::kSpike ? reading : memory.counted) += added;
      if (channel.per_unit > 0 && dt_s > 0)
        result_.largest = std::max(result_.largest, std::fabs(added) / (channel.per_unit * dt_s));
    }
    const std::int64_t off = std::llround(memory.counted + reading);
    if (off == 0) return false;
    s.set_raw(f.frame, (raw + off % kCounterPeriod + kCounterPeriod) % kCounterPeriod);
    return true;
  }
  [[nodiscard]] double more_counts(std::int64_t way, double added) const {
    const auto counts = static_cast<double>(way);
    if (fault_.kind == FaultKind::kScale) return counts * (fault_.size - 1);
    if (fault_.kind == FaultKind::kSign) return -2 * counts;
    if (fault_.kind == FaultKind::kDead || fault_.kind == FaultKind::kStuck) return -counts;
    if (fault_.kind == FaultKind::kNotAvailable) return 0;
    return std::clamp(added, -32'767.0, 32'767.0);
  }

  std::span<const TimedFrame> frames_;
  FrameFault fault_;
  FrameGeometry geometry_;
  const BusDatabase& dbc_;
  std::vector<std::uint32_t> whole_;
  std::vector<Channel> channels_;
  std::vector<Memory> memory_;
  Faulted result_;
};

}  // namespace

FaultKind fault_kind(std::string_view name) {
  const auto found = std::find(kNames.begin(), kNames.end(), name);
  if (found != kNames.end()) return static_cast<FaultKind>(found - kNames.begin());
  std::string all;
  for (const auto one : kNames) all += " " + std::string(one);
  throw std::runtime_error("no kind of fault '" + std::string(name) + "'; there are:" + all);
}

std::string_view name(FaultKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

void require_known(const FrameFault& fault) {
  const auto named = [](std::string_view words, std::string_view word) {
    return !word.empty() && (" " + std::string(words) + " ").find(" " + std::string(word) + " ") != std::string::npos;
  };
  const auto sensor = std::find_if(kFaultSensors.begin(), kFaultSensors.end(),
                                   [&](const FaultSensor& one) { return one.name == fault.sensor; });
  if (sensor == kFaultSensors.end()) {
    std::string all;
    for (const FaultSensor& one : kFaultSensors) all += (all.empty() ? "" : " ") + std::string(one.name);
    throw std::runtime_error("no sensor '" + fault.sensor + "'; there are: " + all);
  }
  const bool frames = fault.sensor == "frames", device = frames || fault.sensor == "stamps";
  if (!named(sensor->axes, fault.axis))
    throw std::runtime_error(fault.sensor + ": no " + (device ? "device '" : "axis '") + fault.axis +
                             "'; there are: " + std::string(sensor->axes));
  const std::string_view kinds = frames ? kFrameKinds : kValueKinds;
  if (!named(kinds, name(fault.kind)))
    throw std::runtime_error(fault.sensor + ": no kind '" + std::string(name(fault.kind)) +
                             "'; there are: " + std::string(kinds));
}

std::vector<std::uint32_t> device_messages(std::string_view device, unsigned imu, const BusDatabase& dbc) {
  const std::string number = "In_Imu" + std::to_string(imu);
  const std::vector<std::pair<std::string_view, std::vector<std::string>>> devices{
      {"imu", {number + "Gyro", number + "Accel", number + "Time"}},
      {"wheels", {"In_WheelCounts", "In_WheelSpeed", "In_BodySpeed"}},
      {"gnss", {"In_GnssLat", "In_GnssLon", "In_GnssAlt", "In_GnssAcc", "In_GnssVelEN", "In_GnssVelU"}},
      {"magnetometer", {"In_Mag"}},
      {"barometer", {"In_Baro"}},
      {"heading", {"In_Heading"}},
      {"landmarks", {"In_RangeBearing"}}};
  std::vector<std::uint32_t> offsets;
  for (const auto& [name, messages] : devices)
    if (name == device)
      for (const std::string& message : messages) offsets.push_back(dbc.message(message).offset);
  if (offsets.empty())
    throw std::runtime_error("no device '" + std::string(device) + "'; there are: " + std::string(kFaultDevices));
  return offsets;
}

Faulted put_fault(std::span<const TimedFrame> frames, const FrameFault& fault, const FrameGeometry& geometry,
                  const BusDatabase& dbc) {
  require_known(fault);
  return Injector(frames, fault, geometry, dbc).run();
}

double largest_size(const FrameFault& fault, const FrameGeometry& geometry, const BusDatabase& dbc, double interval_s) {
  require_known(fault);
  double largest = 0;
  const Channels channels(fault, geometry, dbc);
  for (const Channel& channel : channels.all()) {
    const double unit = std::fabs(channel.per_unit);
    if (channel.velocity && fault.sensor == "gnss_both") continue;
    if (channel.form == Form::kCounter && unit > 0) largest = std::max(largest, 32'767 / (unit * interval_s));
    if (channel.form == Form::kStamp) largest = 0.524;
    if (channel.form == Form::kIncrement) largest = channel.signal->most / interval_s;
    const bool counted = fault.sensor == "wheels" && geometry.metres_per_count > 0;
    if (channel.form == Form::kValue && !counted) largest = std::max(largest, channel.signal->most / unit);
  }
  return largest;
}

}  // namespace tetap::sim
