// SPDX-License-Identifier: Apache-2.0
// A fake u-blox receiver on UART1: takes configuration in both languages, answers, and says a solution it is given in
// UBX and NMEA; fails as receivers and lines do (Faults). Written from the manuals, the section beside each behaviour:
// ZED-F9P interface description UBX-18010854 R04 ("sec." alone is of it) and u-blox 8 / M8 protocol specification
// UBX-13003221; includes nothing of a driver. What the manuals leave open is answered in the way that is hardest on the
// host, and says so. Bytes take no time.
//
//   Ublox receiver(Generation::kKeys, 9600);         // satisfies hal::SerialPort
//   receiver.set_solution({.latitude_deg = -33.9});
//   receiver.write(out); receiver.read(in);          // the driver's side
//   receiver.advance(base::Micros{200'000});         // the test's side: time moves on
//   receiver.ram(ublox::key("CFG-RATE-MEAS"));       // what it took
//   receiver.broken_rules();                         // did the host keep to what the manual asks of it?
#pragma once

#include "base/time.hpp"
#include "support/fakes/ublox_items.hpp"
#include "support/fakes/ublox_output.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace tetap::fakes {

enum class Generation : std::uint8_t {
  kM6,   ///< older messages, no NAV-PVT
  kM8,   ///< older messages, NAV-PVT from protocol 15 on
  kKeys  ///< CFG-VALSET; of the older messages it knows none, as M10 does
};

class Ublox {
 public:
  using Bytes = ublox::Bytes;
  using Solution = ublox::Solution;
  using Instant = ublox::Instant;

  struct Faults {
    base::Micros delay{20'000};            ///< from request to answer; sec. 5.8 promises a second
    base::Micros compute{0};               ///< from the epoch to its first byte
    base::Micros jitter{0};                ///< on top, another for each epoch
    bool mute = false;                     ///< never answers
    bool silent_to_unknown = false;        ///< no ACK-NAK for what it does not know
    int swallow_acks = 0;                  ///< so many acknowledgements are lost on the line
    std::set<std::uint32_t> unknown_keys;  ///< firmware without these items
    bool deaf_after_baud_change = false;   ///< takes the new rate, then says nothing
    std::size_t write_at_most = 1000;      ///< bytes that the line takes at a time
  };
  /// One epoch as it went out: when it was, and what was said of it.
  struct Epoch {
    base::Micros at{};
    Instant instant{};
    Solution solution{};
  };

  Ublox(Generation generation, std::uint32_t baud) : generation_(generation) {
    factory_reset(baud);
    host_baud_ = baud;
  }

  Faults faults;

  // ---- the line
  std::size_t read(std::span<std::uint8_t> in) {
    std::size_t n = 0;
    while (n < in.size() && !to_host_.empty()) {
      in[n++] = to_host_.front();
      to_host_.pop_front();
    }
    return n;
  }
  std::size_t write(std::span<const std::uint8_t> out) {
    const std::size_t n = std::min(out.size(), faults.write_at_most);
    for (const std::uint8_t byte : out.first(n)) hear(in_step() ? byte : static_cast<std::uint8_t>(byte ^ 0x55));
    return n;
  }
  void set_baud(std::uint32_t baud) {
    host_baud_ = baud;
    to_host_.clear();
  }

  // ---- the test's side
  void advance(base::Micros now) {
    now_ = now;
    for (auto it = answers_.begin(); it != answers_.end();) {
      if (it->first > now) {
        ++it;
        continue;
      }
      say_ubx(it->second);
      it = answers_.erase(it);
    }
    while (next_epoch_ + faults.compute + wait() <= now) {
      say_epoch(next_epoch_);
      // Sec. 5.9.19: every navRate-th measurement is a solution.
      const std::int64_t cycles = ram(ublox::key("CFG-RATE-NAV"));
      next_epoch_ += base::Micros{ram(ublox::key("CFG-RATE-MEAS")) * cycles * 1000};
    }
  }
  void set_solution(const Solution& solution) { solution_ = solution; }
  /// When the first epoch, at the beginning of the test, is; what the others are follows.
  void set_instant(const Instant& instant) { start_ = instant; }
  /// Sec. 6.6: RAM is built anew from the layers below it. `baud`: what the factory set.
  void power_cycle(std::uint32_t baud) {
    factory_reset(baud);
    for (const auto& [id, value] : bbr_) ram_[id] = value;
  }
  void set(std::uint32_t id, std::uint32_t value) { ram_[id] = value; }

  /// The current configuration (sec. 6.3, RAM layer); older messages set the items that stand for their fields.
  [[nodiscard]] std::uint32_t ram(std::uint32_t id) const { return ram_.at(id); }
  /// Items that outlive the power.
  [[nodiscard]] std::size_t stored() const { return bbr_.size(); }
  [[nodiscard]] std::uint32_t baud() const { return ram(ublox::key("CFG-UART1-BAUDRATE")); }
  /// Whether this message of class NAV goes out with every solution.
  [[nodiscard]] bool enabled(std::uint8_t id) const { return rate_of(ublox::kNav, id) == 1; }
  /// Frames that were whole and understood to be UBX.
  [[nodiscard]] int requests() const { return requests_; }
  /// Reserved elements that were not 0 (sec. 5.3.2), frames whose checksum does not fit (sec. 5.4).
  [[nodiscard]] int broken_rules() const { return reserved_ + damaged_; }
  [[nodiscard]] const std::vector<Epoch>& epochs() const { return epochs_; }

 private:
  static constexpr std::uint8_t kAck = 0x05, kCfg = 0x06, kMon = 0x0A;
  static constexpr std::uint8_t kPrt = 0x00, kMsg = 0x01, kRate = 0x08, kNav5 = 0x24, kValSet = 0x8A, kValGet = 0x8B;
  static constexpr std::size_t kMostItems = 64;

  struct Output {
    std::uint8_t message_class, id;
    std::uint32_t item;  ///< 0: there is none, in receivers with keys the message does not exist
    Bytes (*bytes)(const Solution&, const Instant&);
  };
  template <Bytes (*Sentence)(const Solution&, const Instant&, const char*)>
  static Bytes of_all_gnss(const Solution& s, const Instant& t) {
    return Sentence(s, t, "GN");  // sec. 4.1.7
  }
  /// In the order in which they go out; sec. 5.14, and 0xF0: the standard sentences (sec. 4.2, "ID for CFG-MSG").
  static const std::vector<Output>& outputs() {
    using namespace ublox;
    static const std::vector<Output> kOutputs{
        {0xF0, 0x04, key("CFG-MSGOUT-NMEA_ID_RMC_UART1"), of_all_gnss<rmc>},
        {0xF0, 0x05, key("CFG-MSGOUT-NMEA_ID_VTG_UART1"), of_all_gnss<vtg>},
        {0xF0, 0x00, key("CFG-MSGOUT-NMEA_ID_GGA_UART1"), of_all_gnss<gga>},
        {0xF0, 0x02, key("CFG-MSGOUT-NMEA_ID_GSA_UART1"), of_all_gnss<gsa>},
        {0xF0, 0x01, key("CFG-MSGOUT-NMEA_ID_GLL_UART1"), of_all_gnss<gll>},
        {0xF0, 0x07, key("CFG-MSGOUT-NMEA_ID_GST_UART1"), of_all_gnss<gst>},
        {kNav, kNavPosLlh, key("CFG-MSGOUT-UBX_NAV_POSLLH_UART1"), nav_posllh},
        {kNav, kNavDop, key("CFG-MSGOUT-UBX_NAV_DOP_UART1"), nav_dop},
        {kNav, kNavSol, 0, nav_sol},
        {kNav, kNavPvt, key("CFG-MSGOUT-UBX_NAV_PVT_UART1"), nav_pvt},
        {kNav, kNavVelNed, 0, nav_velned},
        {kNav, kNavTimeUtc, 0, nav_timeutc},
        {kNav, kNavCov, key("CFG-MSGOUT-UBX_NAV_COV_UART1"), nav_cov},
    };
    return kOutputs;
  }
  [[nodiscard]] const Output* output(std::uint8_t message_class, std::uint8_t id) const {
    for (const Output& out : outputs())
      if (out.message_class == message_class && out.id == id) return &out;
    return nullptr;
  }
  [[nodiscard]] std::uint32_t rate_of(std::uint8_t message_class, std::uint8_t id) const {
    const Output* out = output(message_class, id);
    if (out == nullptr) return 0;
    if (out->item != 0) return ram(out->item);
    const auto found = rates_.find(id);
    return found == rates_.end() ? 0 : found->second;
  }

  void factory_reset(std::uint32_t baud) {
    ram_.clear();
    for (const ublox::Item& item : ublox::kItems) ram_[item.id] = item.standard;
    ram_[ublox::key("CFG-UART1-BAUDRATE")] = baud;
    rates_.clear();
    answers_.clear();
    in_.clear();
    framing_ = k8N1;
  }

  // ---- saying
  [[nodiscard]] bool in_step() const { return host_baud_ == baud() && framing_ == k8N1; }
  void say(const Bytes& bytes) {
    if (faults.mute || (faults.deaf_after_baud_change && baud_changed_)) return;
    for (const std::uint8_t byte : bytes)
      to_host_.push_back(in_step() ? byte : static_cast<std::uint8_t>(byte * 5 + 3));
  }
  void say_ubx(const Bytes& bytes) {
    if (ram(ublox::key("CFG-UART1OUTPROT-UBX")) != 0) say(bytes);
  }
  /// At the baud rate of its time: after a change an acknowledgement may come at either rate (sec. 5.9.17.2). Here it
  /// comes at the new one, where a host that did not follow cannot hear it.
  void answer(const Bytes& bytes) { answers_.emplace_back(now_ + faults.delay, bytes); }
  /// Sec. 5.5.1, 5.8: class and ID of the message, by ACK-ACK (0x01) or ACK-NAK (0x00).
  void acknowledge(std::uint8_t id, bool accepted) {
    if (faults.swallow_acks > 0) {
      --faults.swallow_acks;
      return;
    }
    answer(ublox::frame(kAck, accepted ? 1 : 0, {kCfg, id}));
  }
  [[nodiscard]] base::Micros wait() const {
    const std::int64_t span = faults.jitter.us + 1;
    return base::Micros{static_cast<std::int64_t>(epochs_.size()) * 24'721 % span};
  }
  void say_epoch(base::Micros at) {
    constexpr std::int64_t kWeek_ms = 604'800'000;
    Instant t = start_;
    const std::int64_t ms = t.itow_ms + at.us / 1000;
    t.week += static_cast<int>(ms / kWeek_ms);
    t.itow_ms = static_cast<std::uint32_t>(ms % kWeek_ms);
    epochs_.push_back({at, t, solution_});
    for (const Output& out : outputs()) {
      // Sec. 5.9.12.2: 2 is with every second solution.
      const std::uint32_t rate = rate_of(out.message_class, out.id);
      if (rate == 0 || epochs_.size() % rate != 0) continue;
      const Bytes bytes = out.bytes(solution_, t);
      if (out.message_class != 0xF0) {
        say_ubx(ublox::frame(out.message_class, out.id, bytes));
      } else if (ram(ublox::key("CFG-UART1OUTPROT-NMEA")) != 0) {
        say(bytes);
      }
    }
  }

  // ---- hearing
  void hear(std::uint8_t byte) {
    in_.push_back(byte);
    for (;;) {
      while (!in_.empty() && (in_[0] != 0xB5 || (in_.size() > 1 && in_[1] != 0x62))) in_.erase(in_.begin());
      if (in_.size() < 6) return;
      const std::size_t length = in_[4] + 256U * in_[5];
      if (length > 1000) {
        in_.erase(in_.begin());
        continue;
      }
      if (in_.size() < length + 8) return;
      const auto at = [&](std::size_t i) { return in_.begin() + static_cast<std::ptrdiff_t>(i); };
      const Bytes payload(at(6), at(6 + length));
      const std::uint8_t message_class = in_[2], id = in_[3];
      const bool good = ublox::frame(message_class, id, payload) == Bytes(at(0), at(length + 8));
      in_.erase(at(0), at(good ? length + 8 : 1));
      damaged_ += good ? 0 : 1;
      if (good && ram(ublox::key("CFG-UART1INPROT-UBX")) != 0) request(message_class, id, payload);
    }
  }

  static std::uint32_t number(const Bytes& p, std::size_t at, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t i = size; i-- > 0;) value = value << 8 | p.at(at + i);
    return value;
  }
  /// Sec. 5.3.2.
  void reserved(const Bytes& p, std::size_t at, std::size_t size) {
    for (std::size_t i = at; i < at + size; ++i) reserved_ += p.at(i) != 0 ? 1 : 0;
  }

  void request(std::uint8_t message_class, std::uint8_t id, const Bytes& p) {
    ++requests_;
    if (message_class == kMon && id == 0x04 && p.empty()) return version();
    if (message_class != kCfg) return;
    bool known = true, accepted = false;
    if (generation_ == Generation::kKeys) {
      if (id == kValSet) {
        accepted = valset(p);
      } else if (id == kValGet) {
        accepted = valget(p);
      } else {
        known = false;
      }
    } else if (id == kPrt) {
      accepted = prt(p);
    } else if (id == kMsg) {
      accepted = msg(p);
    } else if (id == kRate) {
      accepted = rate(p);
    } else if (id == kNav5) {
      accepted = nav5(p);
    } else {
      known = false;
    }
    if (known || !faults.silent_to_unknown) acknowledge(id, accepted);
  }

  /// Sec. 5.13.13: 30 and 10 characters, then extensions of 30; an answer to a poll is not acknowledged as well.
  void version() {
    Bytes p(40 + 2 * 30, 0);
    const auto put = [&](std::ptrdiff_t at, const std::string& s) { std::copy(s.begin(), s.end(), p.begin() + at); };
    put(0, generation_ == Generation::kKeys ? "ROM SPG 5.10 (7b202e)" : "ROM CORE 3.01 (107888)");
    put(30, "00080000");
    put(40, generation_ == Generation::kKeys ? "PROTVER=34.10" : "PROTVER=18.00");
    answer(ublox::frame(kMon, 0x04, p));
  }

  /// Sec. 5.9.27: all or nothing. Refused: no layer, a layer that is not there (6.3: flash only where there is one;
  /// here there is none), more than 64 items, an item that is unknown, a value out of its range for RAM, bytes that are
  /// no item with its value (6.2, 6.5: unaligned, as long as the key says), a transaction (of version 1, not played
  /// here).
  bool valset(const Bytes& p) {
    if (p.size() < 4 || p[0] > 1 || (p[0] == 1 && p[2] != 0)) return false;
    const std::uint8_t layers = p[1];
    if ((layers & 7) == 0 || (layers & 4) != 0) return false;
    reserved(p, p[0] == 1 ? 3 : 2, p[0] == 1 ? 1 : 2);
    reserved_ += (layers & ~7) != 0 ? 1 : 0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> values;
    for (std::size_t at = 4; at < p.size();) {
      if (p.size() - at < 4) return false;
      const std::uint32_t id = number(p, at, 4);
      const std::size_t size = ublox::value_bytes(id);
      const ublox::Item* item = faults.unknown_keys.contains(id) ? nullptr : ublox::find(id);
      if (item == nullptr || p.size() - at - 4 < size) return false;
      // 6.2: of a bit stored in a byte only the lowest is used.
      const std::uint32_t value = number(p, at + 4, size) & (item->type == "L" ? 1 : ublox::kAny);
      if ((layers & 1) != 0 && !ublox::in_range(*item, value)) return false;
      values.emplace_back(id, value);
      at += 4 + size;
    }
    if (values.size() > kMostItems) return false;
    for (const auto& [id, value] : values) {  // the last of the same key is what counts
      if ((layers & 2) != 0) bbr_[id] = value;
      if ((layers & 1) != 0) change(id, value);
    }
    return true;
  }

  /// Sec. 5.9.26: layer 0 RAM, 1 BBR, 2 flash, 7 default; the answer is of version 1 and comes before the ACK.
  bool valget(const Bytes& p) {
    if (p.size() < 4 || p.size() % 4 != 0 || p[0] != 0 || p.size() / 4 - 1 > kMostItems) return false;
    Bytes out{1, p[1], p[2], p[3]};
    for (std::size_t at = 4; at < p.size(); at += 4) {
      const std::uint32_t id = number(p, at, 4);
      const ublox::Item* item = faults.unknown_keys.contains(id) ? nullptr : ublox::find(id);
      if (item == nullptr) return false;
      std::uint32_t value = item->standard;
      if (p[1] != 7) {
        const auto& layer = p[1] == 0 ? ram_ : bbr_;
        if (p[1] > 1 || !layer.contains(id)) return false;
        value = layer.at(id);
      }
      out.insert(out.end(), p.begin() + static_cast<std::ptrdiff_t>(at),
                 p.begin() + static_cast<std::ptrdiff_t>(at + 4));
      for (std::size_t i = 0; i < ublox::value_bytes(id); ++i)
        out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    }
    answer(ublox::frame(kCfg, kValGet, out));
    return true;
  }

  bool change(std::uint32_t id, std::uint32_t value) {
    if (!ublox::in_range(*ublox::find(id), value)) return false;
    if (id == ublox::key("CFG-UART1-BAUDRATE") && value != baud()) baud_changed_ = true;
    ram_[id] = value;
    return true;
  }

  /// Sec. 5.9.17.2, port 1: mode at 4 (bits 7 and 6 length, 11 to 9 parity, 13 and 12 stop bits), baud rate at 8, masks
  /// of protocols at 12 and 14 (bit 0 UBX, 1 NMEA).
  bool prt(const Bytes& p) {
    if (p.size() != 20 || p[0] != 1) return false;
    if (!change(ublox::key("CFG-UART1-BAUDRATE"), number(p, 8, 4))) return false;
    reserved(p, 1, 1);
    reserved(p, 18, 2);
    framing_ = number(p, 4, 4) & kFramingBits;
    change(ublox::key("CFG-UART1INPROT-UBX"), p[12] & 1);
    change(ublox::key("CFG-UART1INPROT-NMEA"), p[12] >> 1 & 1);
    change(ublox::key("CFG-UART1OUTPROT-UBX"), p[14] & 1);
    change(ublox::key("CFG-UART1OUTPROT-NMEA"), p[14] >> 1 & 1);
    return true;
  }
  /// Sec. 5.9.12: three bytes are for the port that they come in at, eight for six ports, of which the second is UART1.
  bool msg(const Bytes& p) {
    if (p.size() != 3 && p.size() != 8) return false;
    const Output* out = output(p[0], p[1]);
    const bool newer = p[0] == ublox::kNav && (p[1] == ublox::kNavPvt || p[1] == ublox::kNavCov);
    if (out == nullptr || (newer && generation_ == Generation::kM6)) return false;
    const std::uint8_t rate = p.size() == 3 ? p[2] : p[3];
    if (out->item != 0) return change(out->item, rate);
    rates_[p[1]] = rate;
    return true;
  }
  /// Sec. 5.9.19.
  bool rate(const Bytes& p) {
    if (p.size() != 6 || number(p, 0, 2) < 25 || number(p, 2, 2) == 0 || number(p, 2, 2) > 127) return false;
    return number(p, 4, 2) <= 4 && change(ublox::key("CFG-RATE-MEAS"), number(p, 0, 2)) &&
           change(ublox::key("CFG-RATE-NAV"), number(p, 2, 2)) &&
           change(ublox::key("CFG-RATE-TIMEREF"), number(p, 4, 2));
  }
  /// Sec. 5.9.13: only what the mask names is applied (bit 0 dynModel, 2 fixMode).
  bool nav5(const Bytes& p) {
    if (p.size() != 36) return false;
    const std::uint32_t mask = number(p, 0, 2);
    reserved(p, 31, 5);
    if ((mask & 1) != 0 && !change(ublox::key("CFG-NAVSPG-DYNMODEL"), p[2])) return false;
    return (mask & 4) == 0 || change(ublox::key("CFG-NAVSPG-FIXMODE"), p[3]);
  }

  static constexpr std::uint32_t kFramingBits = 0x3EC0, k8N1 = 0x08C0;

  Generation generation_;
  std::uint32_t host_baud_ = 0;
  std::uint32_t framing_ = k8N1;
  base::Micros now_{}, next_epoch_{1'000'000};
  std::deque<std::uint8_t> to_host_;
  std::vector<std::pair<base::Micros, Bytes>> answers_;
  Bytes in_;
  std::map<std::uint32_t, std::uint32_t> ram_, bbr_;
  std::map<std::uint8_t, std::uint32_t> rates_;  ///< of NAV messages without an item
  Solution solution_{};
  Instant start_{.itow_ms = 100'000'000};
  std::vector<Epoch> epochs_;
  int requests_ = 0, reserved_ = 0, damaged_ = 0;
  bool baud_changed_ = false;
};

}  // namespace tetap::fakes
