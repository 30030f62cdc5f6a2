// SPDX-License-Identifier: Apache-2.0
// gnss_log FILE: the bytes of a receiver's log through the driver. Every report and every baseline is one line of JSON.
// One line with the counts of refusals follows. logs_test.py and cases_test.py compare it with other decoders.
#include "drivers/gnss/receiver.hpp"

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

namespace tetap::drivers::gnss {
namespace {

void number(const char* key, float value) {
  if (base::is_finite(value)) std::printf(",\"%s\":%.9g", key, static_cast<double>(value));
}

void print(const Report& r) {
  std::printf("{\"protocol\":\"%s\",\"fix\":%d,\"satellites\":%d", r.protocol == Protocol::kUbx ? "UBX" : "NMEA",
              static_cast<int>(r.fix), r.satellites);
  if (r.itow_ms) std::printf(",\"itow\":%" PRIu32, *r.itow_ms);
  const Utc& t = r.utc;
  if (t.date_valid) std::printf(",\"date\":\"%04d-%02d-%02d\"", t.year, t.month, t.day);
  if (t.time_valid) std::printf(",\"tod_s\":%.9f", t.hour * 3600 + t.minute * 60 + t.second + 1e-9 * t.nano);
  if (r.time_uncertain) std::printf(",\"doubtful\":true");
  if (r.has_position) {
    std::printf(",\"lat\":%.9f,\"lon\":%.9f", static_cast<double>(r.latitude_2ndeg) * 2e-9,
                static_cast<double>(r.longitude_2ndeg) * 2e-9);
  }
  number("height", r.height_m);
  number("msl", r.height_msl_m);
  number("hacc", r.horizontal_acc_m);
  number("vacc", r.vertical_acc_m);
  number("east", r.v_n_mps[0]);
  number("north", r.v_n_mps[1]);
  number("up", r.v_n_mps[2]);
  number("speed", r.speed_mps);
  number("course", r.course_rad * 57.29577951F);
  number("sacc", r.speed_acc_mps);
  number("pdop", r.pdop);
  number("hdop", r.hdop);
  number("vdop", r.vdop);
  std::printf("}\n");
}

void print(const Baseline& b) {
  std::printf("{\"baseline\":%s", b.valid ? "true" : "false");
  if (b.itow_ms) std::printf(",\"itow\":%" PRIu32, *b.itow_ms);
  number("east", b.n_m[0]);
  number("north", b.n_m[1]);
  number("up", b.n_m[2]);
  number("length", b.length_m);
  number("length_acc", b.length_acc_m);
  number("course", b.course_rad * 57.29577951F);
  number("course_acc", b.course_acc_rad * 57.29577951F);
  if (const auto heading = heading_of(b)) number("yaw", heading->yaw_rad * 57.29577951F);
  std::printf("}\n");
}

struct Printer {
  void operator()(const Report& r) const { print(r); }
  void operator()(const Baseline& b) const { print(b); }
};

}  // namespace
}  // namespace tetap::drivers::gnss

int main(int argc, char** argv) {
  using namespace tetap::drivers::gnss;
  if (argc != 2) return std::fprintf(stderr, "usage: gnss_log FILE\n"), 2;
  std::ifstream file(argv[1], std::ios::binary);
  if (!file) return std::fprintf(stderr, "%s: cannot read\n", argv[1]), 1;
  const std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  GnssReceiver<> receiver({.nmea_checksum_required = false});
  const Printer printer;
  for (const char c : text) receiver.on_byte(static_cast<std::uint8_t>(c), printer);
  receiver.finish(printer);
  const Health& h = receiver.health();
  std::printf("{\"ubx_frames\":%" PRIu32 ",\"nmea_frames\":%" PRIu32 ",\"rtcm_frames\":%" PRIu32, h.ubx_frames,
              h.nmea_frames, h.rtcm_frames);
  for (std::size_t i = 0; i < kReasonNames.size(); ++i) {
    const std::uint32_t n = h.of(static_cast<Reason>(i));
    if (n > 0) std::printf(",\"%.*s\":%" PRIu32, static_cast<int>(kReasonNames[i].size()), kReasonNames[i].data(), n);
  }
  std::printf("}\n");
  return 0;
}
