// SPDX-License-Identifier: Apache-2.0
#include "sim_host/emulator/ublox_receiver.hpp"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>

namespace tetap::board {

namespace {

constexpr std::uint8_t kNav = 0x01, kAck = 0x05, kCfg = 0x06, kMon = 0x0A;
constexpr std::uint8_t kCfgPrt = 0x00, kCfgMsg = 0x01, kCfgRate = 0x08, kCfgNav5 = 0x24, kCfgValset = 0x8A;
constexpr std::size_t kLongest = 1024;  // payload that is still read
constexpr std::int64_t kGpsEpoch_s = 315'964'800, kLeap_s = 18, kWeek_s = 604'800;
constexpr std::uint32_t kUnknown_mm = 0xFFFF'FFFF;
constexpr double kGeoid_m = 47;  // undulation where the default course lies

/// Little-endian fields of a payload, one after the other.
class Payload {
 public:
  template <class T>
  Payload& add(T value) {
    const auto bits = static_cast<std::uint64_t>(value);
    for (std::size_t i = 0; i < sizeof(T); ++i) bytes_.push_back(static_cast<std::uint8_t>(bits >> 8 * i));
    return *this;
  }
  Payload& add_real(double value) { return add(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  Payload& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

std::uint64_t little_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

std::int32_t thousandths(double value) { return static_cast<std::int32_t>(std::lround(1000 * value)); }
std::uint32_t accuracy_mm(bool known, double sigma_m) {
  return known ? static_cast<std::uint32_t>(std::lround(1000 * sigma_m)) : kUnknown_mm;
}

/// Size of a value by its key: chapter 6.2.
std::size_t size_of(std::uint32_t key) {
  constexpr std::size_t kSizes[8] = {0, 1, 1, 2, 4, 8, 0, 0};
  return kSizes[key >> 28 & 7];
}

}  // namespace

UbloxReceiver::UbloxReceiver(const UbloxOptions& options) : options_(options) { power_on(0); }

void UbloxReceiver::power_on(Picoseconds now) {
  reset_items();
  out_.clear();
  in_.clear();
  awake_ = now + options_.boot_time;
  last_period_ = -1;
}

// Defaults of chapter 6: both protocols in and out, NMEA once a second, no UBX message.
void UbloxReceiver::reset_items() {
  items_ = {{kBaud, static_cast<std::uint64_t>(options_.baud)},
            {kStopBits, 1},
            {kDataBits, 0},
            {kParity, 0},
            {kEnabled, 1},
            {kUbxIn, 1},
            {kNmeaIn, 1},
            {kUbxOut, 1},
            {kNmeaOut, 1},
            {kMeasurement_ms, 1000},
            {kNavigation, 1},
            {kDynamicModel, 0},
            {kPvt, 0},
            {kPosLlh, 0},
            {kStatus, 0},
            {kVelNed, 0},
            {kTimeUtc, 0},
            {kDop, 0},
            {kCov, 0},
            {kGga, 1},
            {kGll, 1},
            {kGsa, 1},
            {kRmc, 1},
            {kVtg, 1}};
  if (options_.generation < 9) items_.erase(kCov);
}

// A UART samples 10 bits in their places while both rates agree to some 5 %.
void UbloxReceiver::on_byte(Picoseconds now, std::uint8_t byte, std::int64_t baud) {
  if (now < awake_) return;
  if (std::abs(baud - this->baud()) * 20 > this->baud()) {
    ++garbage;
    in_.clear();
    return;
  }
  in_.push_back(byte);
  constexpr std::array<std::uint8_t, 2> kSync{0xB5, 0x62};
  if (in_.size() <= 2 && in_.back() != kSync[in_.size() - 1]) return in_.clear();
  if (in_.size() < 6) return;
  const auto size = static_cast<std::size_t>(in_[4] | in_[5] << 8);
  if (size > kLongest) return in_.clear();
  if (in_.size() < size + 8) return;
  std::uint8_t a = 0, b = 0;
  for (std::size_t i = 2; i < size + 6; ++i)
    b = static_cast<std::uint8_t>(b + (a = static_cast<std::uint8_t>(a + in_[i])));
  const std::vector<std::uint8_t> frame = std::exchange(in_, {});
  if (frame[size + 6] != a || frame[size + 7] != b) {
    ++garbage;
    return;
  }
  if (items_.at(kUbxIn) != 0) on_message(frame[2], frame[3], std::span(frame).subspan(6, size));
}

void UbloxReceiver::on_message(std::uint8_t message_class, std::uint8_t id, std::span<const std::uint8_t> payload) {
  if (message_class == kMon && id == 0x04 && payload.empty()) return send_version();
  if (message_class != kCfg) return;
  const bool taken = configure(id, payload);
  ++(taken ? accepted : refused);
  send(kAck, taken ? 1 : 0, std::array<std::uint8_t, 2>{message_class, id});
}

bool UbloxReceiver::configure(std::uint8_t id, std::span<const std::uint8_t> payload) {
  switch (id) {
    case kCfgValset:
      return options_.generation >= 9 && set_values(payload);
    case kCfgPrt:
      return set_port(payload);
    case kCfgMsg:
      return set_message_rate(payload);
    case kCfgRate:
      if (payload.size() != 6 || little_endian(payload.first(2)) < 25) return false;
      items_[kMeasurement_ms] = little_endian(payload.first(2));
      items_[kNavigation] = little_endian(payload.subspan(2, 2));
      return true;
    case kCfgNav5:
      if (payload.size() != 36) return false;
      if ((payload[0] & 1) != 0) items_[kDynamicModel] = payload[2];
      return true;
    default:
      return false;
  }
}

// CFG-VALSET: refused as a whole where a key is unknown, a value is cut off, or no layer is named.
bool UbloxReceiver::set_values(std::span<const std::uint8_t> payload) {
  if (payload.size() < 4 || payload[0] > 1 || (payload[1] & 7) == 0) return false;
  Items wanted = items_;
  int count = 0;
  for (auto left = payload.subspan(4); !left.empty(); ++count) {
    if (left.size() < 4 || count == 64) return false;
    const auto key = static_cast<std::uint32_t>(little_endian(left.first(4)));
    const std::size_t size = size_of(key);
    if (!wanted.contains(key) || left.size() < 4 + size) return false;
    wanted[key] = little_endian(left.subspan(4, size));
    left = left.subspan(4 + size);
  }
  if (wanted[kMeasurement_ms] < 25 || wanted[kNavigation] == 0 || wanted[kBaud] < 4800 || wanted[kBaud] > 921'600)
    return false;
  if ((payload[1] & 1) != 0) items_ = wanted;  // the other layers count from the next start on, when RAM is read anew
  return true;
}

// CFG-PRT of a UART: 8 bits, no parity, one stop bit alone.
bool UbloxReceiver::set_port(std::span<const std::uint8_t> payload) {
  if (payload.size() != 20 || payload[0] != 1) return false;
  const auto mode = little_endian(payload.subspan(4, 4));
  if ((mode >> 6 & 3) != 3 || (mode >> 9 & 7) < 4 || (mode >> 12 & 3) != 0) return false;
  const auto in = little_endian(payload.subspan(12, 2)), out = little_endian(payload.subspan(14, 2));
  items_[kBaud] = little_endian(payload.subspan(8, 4));
  items_[kUbxIn] = in & 1;
  items_[kNmeaIn] = in >> 1 & 1;
  items_[kUbxOut] = out & 1;
  items_[kNmeaOut] = out >> 1 & 1;
  return true;
}

// CFG-MSG with one rate for this port, or with those of all six ports (UART1 is the second).
bool UbloxReceiver::set_message_rate(std::span<const std::uint8_t> payload) {
  if (payload.size() != 3 && payload.size() != 8) return false;
  const std::uint8_t rate = payload[payload.size() == 3 ? 2 : 3];
  const int which = payload[0] << 8 | payload[1];
  const std::map<int, std::uint32_t> keys = {
      {0x0107, kPvt}, {0x0102, kPosLlh}, {0x0103, kStatus}, {0x0112, kVelNed}, {0x0121, kTimeUtc}, {0x0104, kDop},
      {0x0136, kCov}, {0xF000, kGga},    {0xF001, kGll},    {0xF002, kGsa},    {0xF004, kRmc},     {0xF005, kVtg}};
  const auto found = keys.find(which);
  if (found == keys.end() || !items_.contains(found->second)) return false;
  items_[found->second] = rate;
  return true;
}

void UbloxReceiver::on_solution(Picoseconds now, const GnssSolution& solution) {
  if (now < awake_) return;
  const auto period_ms = static_cast<std::int64_t>(items_.at(kMeasurement_ms) * items_.at(kNavigation));
  const std::int64_t period = solution.epoch_ms / period_ms;
  if (period == last_period_) return;
  last_period_ = period;
  ++epochs;
  const auto due = [&](std::uint32_t key) {
    const auto item = items_.find(key);
    return item != items_.end() && item->second != 0 && period % static_cast<std::int64_t>(item->second) == 0;
  };
  if (items_.at(kUbxOut) != 0) {
    if (due(kPvt)) send_pvt(solution);
    if (due(kCov)) send_cov(solution);
  }
  if (items_.at(kNmeaOut) != 0) send_nmea(solution);
}

void UbloxReceiver::send_version() {
  Payload version;
  const auto text = [&version](std::string_view words, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) version.add(static_cast<std::uint8_t>(i < words.size() ? words[i] : 0));
  };
  text(options_.generation >= 9 ? "EXT CORE 1.00 (000000)" : "EXT CORE 3.01 (000000)", 30);
  text(options_.generation >= 9 ? "00190000" : "00080000", 10);
  text(options_.generation >= 9 ? "PROTVER=27.12" : "PROTVER=18.00", 30);
  send(kMon, 0x04, version.bytes());
}

// 3.15 UBX-NAV-PVT. hAcc is the root of both axes' variances.
void UbloxReceiver::send_pvt(const GnssSolution& s) {
  using namespace std::chrono;
  const std::int64_t utc_ms = options_.first_second * 1000 + s.epoch_ms;
  const std::int64_t gps_ms = utc_ms + (kLeap_s - kGpsEpoch_s) * 1000;
  const sys_time<milliseconds> time{milliseconds{utc_ms}};
  const year_month_day date{floor<days>(time)};
  const hh_mm_ss clock{time - floor<days>(time)};
  const auto& v = s.velocity_ned_mps;
  const double over_ground = std::hypot(v[0], v[1]);
  const double course_deg = std::fmod(std::atan2(v[1], v[0]) * 57.29577951308232 + 360, 360);
  Payload p;
  p.add(static_cast<std::uint32_t>(gps_ms % (kWeek_s * 1000)));
  p.add(static_cast<std::uint16_t>(static_cast<int>(date.year())));
  p.add(static_cast<std::uint8_t>(static_cast<unsigned>(date.month())));
  p.add(static_cast<std::uint8_t>(static_cast<unsigned>(date.day())));
  p.add(static_cast<std::uint8_t>(clock.hours().count())).add(static_cast<std::uint8_t>(clock.minutes().count()));
  p.add(static_cast<std::uint8_t>(clock.seconds().count()));
  p.add(std::uint8_t{0x07}).add(std::uint32_t{25});  // date, time, fully resolved; tAcc
  p.add(static_cast<std::int32_t>(clock.subseconds().count() * 1'000'000));
  p.add(static_cast<std::uint8_t>(s.fix ? 3 : 0));
  p.add(static_cast<std::uint8_t>((s.fix ? 1 : 0) | (s.fix && s.differential ? 2 : 0))).add(std::uint8_t{0xEA});
  p.add(s.satellites);
  p.add(static_cast<std::int32_t>(s.longitude_1e7deg)).add(static_cast<std::int32_t>(s.latitude_1e7deg));
  p.add(thousandths(s.height_m)).add(thousandths(s.height_m - kGeoid_m));
  p.add(accuracy_mm(s.fix, s.horizontal_sigma_m * std::sqrt(2.0))).add(accuracy_mm(s.fix, s.vertical_sigma_m));
  p.add(thousandths(v[0])).add(thousandths(v[1])).add(thousandths(v[2])).add(thousandths(over_ground));
  p.add(static_cast<std::int32_t>(std::lround(course_deg * 1e5)));
  p.add(accuracy_mm(s.fix, s.velocity_sigma_mps * std::sqrt(3.0)));
  p.add(static_cast<std::uint32_t>(s.fix ? 500'000 : 18'000'000));  // headAcc
  p.add(static_cast<std::uint16_t>(s.fix ? 120 : 9999));            // pDOP
  p.zeros(14);                                                      // flags3, headVeh, magDec, magAcc
  send(kNav, 0x07, p.bytes());
}

void UbloxReceiver::send_cov(const GnssSolution& s) {
  const std::int64_t gps_ms = (options_.first_second + kLeap_s - kGpsEpoch_s) * 1000 + s.epoch_ms;
  Payload p;
  p.add(static_cast<std::uint32_t>(gps_ms % (kWeek_s * 1000))).add(std::uint8_t{0});
  p.add(static_cast<std::uint8_t>(s.fix)).add(static_cast<std::uint8_t>(s.fix)).zeros(9);
  const auto diagonal = [&p](double horizontal, double vertical) {
    p.add_real(horizontal * horizontal).add_real(0).add_real(0).add_real(horizontal * horizontal);
    p.add_real(0).add_real(vertical * vertical);
  };
  diagonal(s.fix ? s.horizontal_sigma_m : 0, s.fix ? s.vertical_sigma_m : 0);
  diagonal(s.fix ? s.velocity_sigma_mps : 0, s.fix ? s.velocity_sigma_mps : 0);
  send(kNav, 0x36, p.bytes());
}

void UbloxReceiver::send_sentence(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  char end[8];
  std::snprintf(end, sizeof end, "*%02X\r\n", sum);
  const std::string all = "$" + body + end;
  put(std::span(reinterpret_cast<const std::uint8_t*>(all.data()), all.size()));
}

// 2.7: the standard sentences that are on, with five decimals of minutes.
void UbloxReceiver::send_nmea(const GnssSolution& s) {
  const auto angle = [](std::int64_t value_1e7, int digits, const char* names) {
    const double degrees = std::fabs(static_cast<double>(value_1e7)) * 1e-7;
    char text[40];
    std::snprintf(text, sizeof text, "%0*d%08.5f,%c", digits, static_cast<int>(degrees),
                  60 * (degrees - std::floor(degrees)), names[value_1e7 < 0 ? 1 : 0]);
    return std::string(text);
  };
  const std::int64_t day_ms = (options_.first_second * 1000 + s.epoch_ms) % 86'400'000;
  char time[24], text[160];
  std::snprintf(time, sizeof time, "%02d%02d%05.2f", static_cast<int>(day_ms / 3'600'000),
                static_cast<int>(day_ms / 60'000 % 60), static_cast<double>(day_ms % 60'000) * 1e-3);
  const std::string place = angle(s.latitude_1e7deg, 2, "NS") + "," + angle(s.longitude_1e7deg, 3, "EW");
  const double knots = std::hypot(s.velocity_ned_mps[0], s.velocity_ned_mps[1]) / 0.514444;
  const char state = s.fix ? 'A' : 'V', mode = s.fix ? 'A' : 'N';
  if (items_.at(kRmc) != 0) {
    std::snprintf(text, sizeof text, "GNRMC,%s,%c,%s,%.3f,,251126,,,%c,V", time, state, place.c_str(), knots, mode);
    send_sentence(text);
  }
  if (items_.at(kVtg) != 0) {
    std::snprintf(text, sizeof text, "GNVTG,,T,,M,%.3f,N,%.3f,K,%c", knots, knots * 1.852, mode);
    send_sentence(text);
  }
  if (items_.at(kGga) != 0) {
    std::snprintf(text, sizeof text, "GNGGA,%s,%s,%d,%02d,0.80,%.1f,M,%.1f,M,,", time, place.c_str(), s.fix ? 1 : 0,
                  std::min<int>(s.satellites, 12), s.height_m - kGeoid_m, kGeoid_m);
    send_sentence(text);
  }
  if (items_.at(kGsa) != 0)
    send_sentence(s.fix ? "GNGSA,A,3,02,05,07,09,13,14,,,,,,,1.20,0.80,0.90,1"
                        : "GNGSA,A,1,,,,,,,,,,,,,99.99,99.99,99.99,1");
  if (items_.at(kGll) != 0) {
    std::snprintf(text, sizeof text, "GNGLL,%s,%s,%c,%c", place.c_str(), time, state, mode);
    send_sentence(text);
  }
}

void UbloxReceiver::send(std::uint8_t message_class, std::uint8_t id, std::span<const std::uint8_t> payload) {
  if (items_.at(kUbxOut) == 0) return;
  std::vector<std::uint8_t> frame{0xB5,
                                  0x62,
                                  message_class,
                                  id,
                                  static_cast<std::uint8_t>(payload.size()),
                                  static_cast<std::uint8_t>(payload.size() >> 8)};
  frame.insert(frame.end(), payload.begin(), payload.end());
  std::uint8_t a = 0, b = 0;
  for (std::size_t i = 2; i < frame.size(); ++i)
    b = static_cast<std::uint8_t>(b + (a = static_cast<std::uint8_t>(a + frame[i])));
  frame.push_back(a);
  frame.push_back(b);
  put(frame);
}

void UbloxReceiver::put(std::span<const std::uint8_t> bytes) {
  if (out_.size() + bytes.size() > options_.output_buffer) return;
  out_.insert(out_.end(), bytes.begin(), bytes.end());
}

SensorWorld::GnssByte UbloxReceiver::next_byte(Picoseconds now) {
  if (out_.empty()) return {.begin = kNever, .again = now + kMillisecond};
  const std::uint8_t byte = out_.front();
  out_.pop_front();
  return {.begin = now, .byte = byte, .baud = baud()};
}

}  // namespace tetap::board
