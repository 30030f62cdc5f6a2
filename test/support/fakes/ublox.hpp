// SPDX-License-Identifier: Apache-2.0
// A u-blox receiver at the other end of a UART, for tests. It was written from the manuals by someone who has seen no
// driver, and no earlier fake, of this project. Key IDs and layouts were checked against public tables of them.
//   UBX-18010854  ZED-F9P interface description, R04: a section cited without a document is one of this
//   UBX-22008968  u-blox F9 HPG 1.32 interface description
//   UBX-13003221  u-blox 8 / M8 receiver description including protocol specification (CFG-PRT, CFG-MSG, ...)
//   UBX-18010802  ZED-F9P integration manual
// Open points of the manuals are answered in the way that is hardest on the host, and a comment marks each.
#pragma once

#include "hal/byte_stream.hpp"
#include "support/fakes/ublox_items.hpp"
#include "support/fakes/ublox_output.hpp"
#include "tetap/base/time.hpp"

#include <algorithm>
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
    bool ignores_unknown = false;          ///< no ACK-NAK for what it does not know
    int swallow_acks = 0;                  ///< acknowledgements that are lost on the line
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

  Ublox(Generation generation, std::uint32_t baud) : generation_(generation), host_baud_(baud) { factory_reset(baud); }

  Faults injected;

  // ---- the line
  /// Bytes that the line lost; the test sets them, the model of the receiver loses none.
  hal::SerialFaults line_faults{};
  [[nodiscard]] hal::SerialFaults faults() const { return line_faults; }
  std::size_t read(std::span<std::uint8_t> in) {
    const std::size_t n = std::min(in.size(), to_host_.size());
    const auto end = to_host_.begin() + static_cast<std::ptrdiff_t>(n);
    std::copy(to_host_.begin(), end, in.begin());
    to_host_.erase(to_host_.begin(), end);
    return n;
  }
  std::size_t write(std::span<const std::uint8_t> out) {
    const std::size_t n = std::min(out.size(), injected.write_at_most);
    for (const std::uint8_t byte : out.first(n)) {
      // Each byte for itself: a request may change the rate under those that follow it.
      received_.push_back({in_step() ? byte : garbled(byte), in_step()});
      understand();
    }
    return n;
  }
  /// See hal::SerialPort: what was not read is lost.
  void set_baud(std::uint32_t baud) {
    host_baud_ = baud;
    to_host_.clear();
  }

  // ---- the test's side
  void advance(base::Micros now) {
    for (;;) {
      const base::Micros epoch = next_epoch_ + injected.compute + wait();
      const bool answer_first = !answers_.empty() && answers_.begin()->first <= epoch;
      const base::Micros next = answer_first ? answers_.begin()->first : epoch;
      if (next > now) break;
      now_ = std::max(now_, next);
      if (answer_first) {
        say_answer(answers_.extract(answers_.begin()).mapped());
      } else {
        say_epoch(next_epoch_);
        // Sec. 5.9.19: every navRate-th measurement is a solution. A new rate counts from the epoch that is due.
        const std::int64_t cycles = ram(ublox::key("CFG-RATE-NAV"));
        next_epoch_ += base::Micros{std::int64_t{ram(ublox::key("CFG-RATE-MEAS"))} * cycles * 1000};
      }
    }
    now_ = now;
  }
  void set_solution(const Solution& solution) { solution_ = solution; }
  /// Sets the time of the first epoch, at the beginning of the test; the others follow.
  void set_instant(const Instant& instant) { start_ = instant; }
  /// Sec. 6.6: RAM is built anew from the layers below it. `baud`: what the factory set.
  void power_cycle(std::uint32_t baud) {
    factory_reset(baud);
    for (const auto& [id, value] : bbr_) {
      // Sec. 5.9.27: only RAM is checked when it is set, so something wrong may be stored; it is not taken over.
      if (ublox::in_range(*ublox::find(id), value)) ram_[id] = value;
    }
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
  using Message = std::pair<std::uint8_t, std::uint8_t>;  // class, id
  struct Received {
    std::uint8_t byte;
    bool clear;  // both ends had the same rate
  };
  struct Answer {
    Bytes frame;
    bool acknowledgement;
  };
  /// Outcome of a request; kUnknown: the firmware has no such message.
  enum class Verdict : std::uint8_t { kAck, kNak, kUnknown };

  static constexpr std::uint8_t kAckClass = 0x05, kCfg = 0x06, kMon = 0x0A, kNmea = 0xF0;
  static constexpr Message kCfgPrt{kCfg, 0x00}, kCfgMsg{kCfg, 0x01}, kCfgRate{kCfg, 0x08}, kCfgNav5{kCfg, 0x24},
      kCfgValset{kCfg, 0x8A}, kCfgValget{kCfg, 0x8B}, kMonVer{kMon, 0x04};
  static constexpr std::size_t kLongest = 2048;  // a receiver has no room for the 64 KiB that a length can say
  static constexpr std::size_t kMostItems = 64;  // sec. 5.9.26, 5.9.27

  // ---- the line

  [[nodiscard]] bool in_step() const { return host_baud_ == baud(); }
  static std::uint8_t garbled(std::uint8_t byte) { return static_cast<std::uint8_t>(byte ^ 0x55); }

  void say(std::span<const std::uint8_t> bytes) {
    if (gone_quiet_) return;
    for (const std::uint8_t byte : bytes) to_host_.push_back(in_step() ? byte : garbled(byte));
  }
  void send_ubx(const Bytes& frame) {
    // CFG-UART1OUTPROT: what is not let out is not sent; open for acknowledgements, so they are not either.
    if (ram(ublox::key("CFG-UART1OUTPROT-UBX")) != 0) say(frame);
  }
  void say_nmea(const std::string& text) {
    if (ram(ublox::key("CFG-UART1OUTPROT-NMEA")) == 0) return;
    say(Bytes(text.begin(), text.end()));
  }
  /// Sec. 5.9.17.2: queued messages go out with the parameters of their time. The acknowledgement of a new rate may
  /// come at either; it is the new one here.
  void say_answer(const Answer& answer) {
    if (answer.acknowledgement && injected.swallow_acks > 0) {
      --injected.swallow_acks;
      return;
    }
    send_ubx(answer.frame);
  }
  void answer(Message message, const Bytes& payload) {
    if (injected.mute) return;
    const bool ack = message.first == kAckClass;
    answers_.emplace(now_ + injected.delay, Answer{ublox::frame(message.first, message.second, payload), ack});
  }

  // ---- frames (sec. 5.2)

  /// Takes frames out of what was heard. One that is damaged costs its first byte only, so that a frame hidden in it
  /// is found.
  void understand() {
    while (!received_.empty()) {
      const auto at = [this](std::size_t i) { return received_[i].byte; };
      if (at(0) != 0xB5 || (received_.size() > 1 && at(1) != 0x62)) {
        received_.pop_front();
        continue;
      }
      if (received_.size() < 6) return;
      const auto length = static_cast<std::size_t>(at(4) | at(5) << 8);
      if (length > kLongest) {
        received_.pop_front();
        continue;
      }
      if (received_.size() < length + 8) return;
      take(length);
    }
  }
  void take(std::size_t length) {
    Bytes whole;
    bool clear = true;
    for (std::size_t i = 0; i < length + 8; ++i) {
      whole.push_back(received_[i].byte);
      clear = clear && received_[i].clear;
    }
    const auto sum = ublox::checksum(whole.data() + 2, length + 4);
    if (whole[length + 6] != sum[0] || whole[length + 7] != sum[1]) {
      if (clear) ++damaged_;  // the line's doing is not the host's
      received_.pop_front();
      return;
    }
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(whole.size()));
    // CFG-UART1INPROT: a protocol that is off is not read; there is no way back on this port but the power.
    if (ram(ublox::key("CFG-UART1INPROT-UBX")) == 0) return;
    ++requests_;
    obey({whole[2], whole[3]}, std::span<const std::uint8_t>(whole).subspan(6, length));
  }

  // ---- requests

  void obey(Message message, std::span<const std::uint8_t> payload) {
    const std::uint32_t before = baud();
    if (message == kMonVer && payload.empty()) return answer(kMonVer, version());
    // Sec. 5.8: acknowledged is what is of class CFG; others get no answer at all.
    if (message.first != kCfg) return;
    const Verdict verdict = generation_ == Generation::kKeys ? by_keys(message, payload) : by_fields(message, payload);
    if (verdict == Verdict::kUnknown && injected.ignores_unknown) return;
    const std::uint8_t ack = verdict == Verdict::kAck ? 1 : 0;
    answer({kAckClass, ack}, {message.first, message.second});
    if (baud() != before && injected.deaf_after_baud_change) gone_quiet_ = true;
  }

  Verdict by_keys(Message message, std::span<const std::uint8_t> payload) {
    if (message == kCfgValset) return valset(payload);
    if (message == kCfgValget) return valget(payload);
    return Verdict::kUnknown;
  }

  /// Polls (no payload, or the port or the message for which) are answered with the message, then acknowledged.
  Verdict by_fields(Message message, std::span<const std::uint8_t> payload) {
    if (message == kCfgPrt) return cfg_prt(payload);
    if (message == kCfgMsg) return cfg_msg(payload);
    if (message == kCfgRate) return cfg_rate(payload);
    if (message == kCfgNav5) return cfg_nav5(payload);
    return Verdict::kUnknown;
  }

  [[nodiscard]] const ublox::Item* known(std::uint32_t id) const {
    return injected.unknown_keys.contains(id) ? nullptr : ublox::find(id);
  }

  /// Sec. 5.9.27: all or nothing.
  Verdict valset(std::span<const std::uint8_t> payload) {
    constexpr std::uint32_t kRam = 1, kBbr = 2;
    if (payload.size() < 4 || payload[0] > 1) return Verdict::kNak;
    const std::uint32_t layers = payload[1];
    // Version 1 has the transaction's action in two bits of byte 2; version 0 has two reserved bytes.
    expect_zero(payload[0] == 1 ? static_cast<std::uint8_t>(payload[2] & 0xFC) : payload[2]);
    expect_zero(payload[3]);
    expect_zero(static_cast<std::uint8_t>(layers & 0xF8));
    if (payload[0] == 1 && (payload[2] & 3) != 0) return Verdict::kNak;  // no transactions here
    // Open is a layer that is not there beside one that is: nothing is done. Flash is not there.
    if ((layers & (kRam | kBbr)) == 0 || (layers & ~(kRam | kBbr)) != 0) return Verdict::kNak;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> wanted;
    for (auto rest = payload.subspan(4); !rest.empty();) {
      if (rest.size() < 4) return Verdict::kNak;
      const std::uint32_t id = number(rest, 0, 4);
      const ublox::Item* item = known(id);
      const std::size_t size = ublox::value_bytes(id);
      // Sec. 6.5: pairs follow each other without padding, a value as long as its key says.
      if (item == nullptr || rest.size() < 4 + size) return Verdict::kNak;
      const std::uint32_t value = number(rest, 4, size);
      // The range is looked at only when RAM is to take it.
      if ((layers & kRam) != 0 && !ublox::in_range(*item, value)) return Verdict::kNak;
      wanted.emplace_back(id, value);
      rest = rest.subspan(4 + size);
    }
    if (wanted.size() > kMostItems) return Verdict::kNak;
    for (const auto& [id, value] : wanted) {  // of a key that comes twice the last value stays
      if ((layers & kRam) != 0) ram_[id] = value;
      if ((layers & kBbr) != 0) bbr_[id] = value;
    }
    return Verdict::kAck;
  }

  /// Sec. 5.9.26, with `position` as in UBX-22008968 sec. 3.10.25. No wildcards. The values come before the
  /// acknowledgement.
  Verdict valget(std::span<const std::uint8_t> payload) {
    if (payload.size() < 8 || payload.size() % 4 != 0 || payload[0] != 0) return Verdict::kNak;
    const std::size_t count = payload.size() / 4 - 1, skip = number(payload, 2, 2);
    if (count > kMostItems) return Verdict::kNak;
    ublox::Payload out;
    out.u1(1).u1(payload[1]).u2(number(payload, 2, 2));
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t id = number(payload, 4 + 4 * i, 4);
      const ublox::Item* item = known(id);
      if (item == nullptr) return Verdict::kNak;
      std::uint32_t value = 0;
      if (!in_layer(payload[1], *item, value)) return Verdict::kNak;
      if (i < skip) continue;
      out.u4(id);
      for (std::size_t byte = 0; byte < ublox::value_bytes(id); ++byte) out.u1(value >> 8 * byte & 0xFF);
    }
    answer(kCfgValget, out.bytes());
    return Verdict::kAck;
  }
  /// Open is an item that the layer does not have: the whole request is refused.
  [[nodiscard]] bool in_layer(std::uint32_t layer, const ublox::Item& item, std::uint32_t& value) const {
    switch (layer) {
      case 0:
        return value = ram(item.id), true;
      case 1: {
        const auto found = bbr_.find(item.id);
        return found != bbr_.end() && (value = found->second, true);
      }
      case 7:
        return value = standard(item), true;
      default:
        return false;
    }
  }

  /// Sec. 5.9.17.2. This is UART1; what stands for the other ports is refused.
  Verdict cfg_prt(std::span<const std::uint8_t> payload) {
    constexpr std::uint8_t kUart1 = 1;
    constexpr std::uint32_t kShape = 0x3CC0, k8N1 = 0x08C0;  // charLen 3, parity 10x, nStopBits 0
    if (payload.empty() || (payload.size() == 1 && payload[0] == kUart1)) {
      ublox::Payload p;
      p.u1(kUart1).zeros(3).u4(k8N1).u4(baud()).u2(protocols(kIn)).u2(protocols(kOut)).zeros(4);
      return answer(kCfgPrt, p.bytes()), Verdict::kAck;
    }
    if (payload.size() % 20 != 0) return Verdict::kNak;
    for (auto rest = payload; !rest.empty(); rest = rest.subspan(20)) {
      for (const std::size_t i : {1U, 18U, 19U}) expect_zero(rest[i]);
      const ublox::Item& rate = *ublox::find(ublox::key("CFG-UART1-BAUDRATE"));
      if (rest[0] != kUart1 || !ublox::in_range(rate, number(rest, 8, 4))) return Verdict::kNak;
      if ((number(rest, 4, 4) & kShape) != k8N1) return Verdict::kNak;  // other shapes of a byte are not in this fake
    }
    const auto last = payload.last(20);
    ram_[ublox::key("CFG-UART1-BAUDRATE")] = number(last, 8, 4);
    for (const bool in : {kIn, kOut}) {
      const std::uint32_t mask = number(last, in ? 12 : 14, 2);
      for (const auto& [bit, id] : protocol_items(in)) ram_[id] = mask >> bit & 1U;
    }
    return Verdict::kAck;
  }

  static constexpr bool kIn = true, kOut = false;
  /// Bits of inProtoMask and outProtoMask: UBX 0, NMEA 1, RTCM3 5.
  static std::array<std::pair<unsigned, std::uint32_t>, 3> protocol_items(bool in) {
    if (in) {
      return {{{0, ublox::key("CFG-UART1INPROT-UBX")},
               {1, ublox::key("CFG-UART1INPROT-NMEA")},
               {5, ublox::key("CFG-UART1INPROT-RTCM3X")}}};
    }
    return {{{0, ublox::key("CFG-UART1OUTPROT-UBX")},
             {1, ublox::key("CFG-UART1OUTPROT-NMEA")},
             {5, ublox::key("CFG-UART1OUTPROT-RTCM3X")}}};
  }
  [[nodiscard]] std::uint32_t protocols(bool in) const {
    std::uint32_t mask = 0;
    for (const auto& [bit, id] : protocol_items(in)) mask |= ram(id) << bit;
    return mask;
  }

  /// Sec. 5.9.12: a rate for this port, or for all six of which UART1 is the second.
  Verdict cfg_msg(std::span<const std::uint8_t> payload) {
    if (payload.size() != 2 && payload.size() != 3 && payload.size() != 8) return Verdict::kNak;
    const Message message{payload[0], payload[1]};
    if (!exists(message)) return Verdict::kNak;
    if (payload.size() == 2) {
      ublox::Payload p;
      p.u1(message.first).u1(message.second).u1(0).u1(rate_of(message.first, message.second)).zeros(4);
      return answer(kCfgMsg, p.bytes()), Verdict::kAck;
    }
    const std::uint32_t rate = payload[payload.size() == 3 ? 2 : 3];
    const std::uint32_t id = item_of(message);
    (id != 0 ? ram_[id] : plain_rates_[message]) = rate;
    return Verdict::kAck;
  }

  /// Sec. 5.9.19.
  Verdict cfg_rate(std::span<const std::uint8_t> payload) {
    constexpr std::array kFields{ublox::key("CFG-RATE-MEAS"), ublox::key("CFG-RATE-NAV"),
                                 ublox::key("CFG-RATE-TIMEREF")};
    if (payload.empty()) {
      ublox::Payload p;
      for (const std::uint32_t id : kFields) p.u2(ram(id));
      return answer(kCfgRate, p.bytes()), Verdict::kAck;
    }
    if (payload.size() != 6) return Verdict::kNak;
    for (std::size_t i = 0; i < kFields.size(); ++i) {
      if (!ublox::in_range(*ublox::find(kFields[i]), number(payload, 2 * i, 2))) return Verdict::kNak;
    }
    for (std::size_t i = 0; i < kFields.size(); ++i) {
      // The u-blox 6 manual: navRate cannot be changed, it is 1. It says not that another is refused: so it is taken
      // and nothing comes of it.
      if (i == 1 && generation_ == Generation::kM6) continue;
      ram_[kFields[i]] = number(payload, 2 * i, 2);
    }
    return Verdict::kAck;
  }

  /// Sec. 5.9.13: only what the mask names is taken over. The fields that no test looks at are not kept.
  Verdict cfg_nav5(std::span<const std::uint8_t> payload) {
    constexpr std::uint32_t kModel = ublox::key("CFG-NAVSPG-DYNMODEL"), kMode = ublox::key("CFG-NAVSPG-FIXMODE");
    constexpr std::uint32_t kModelBit = 1, kModeBit = 4;
    if (payload.empty()) {
      ublox::Payload p;
      p.u2(kModelBit | kModeBit).u1(ram(kModel)).u1(ram(kMode)).zeros(32);
      return answer(kCfgNav5, p.bytes()), Verdict::kAck;
    }
    if (payload.size() != 36) return Verdict::kNak;
    // The u-blox 6 has nothing behind byte 23; the M8 reserves 26, 27 and 31 to 35.
    for (std::size_t i = 24; i < 36; ++i) {
      if (generation_ == Generation::kM6 || i == 26 || i == 27 || i > 30) expect_zero(payload[i]);
    }
    const std::uint32_t mask = number(payload, 0, 2), model = payload[2], mode = payload[3];
    if ((mask & kModelBit) != 0 && !ublox::in_range(*ublox::find(kModel), model)) return Verdict::kNak;
    if ((mask & kModeBit) != 0 && !ublox::in_range(*ublox::find(kMode), mode)) return Verdict::kNak;
    if ((mask & kModelBit) != 0) ram_[kModel] = model;
    if ((mask & kModeBit) != 0) ram_[kMode] = mode;
    return Verdict::kAck;
  }

  /// Sec. 2.1.2: versions of software and hardware, 30 and 10 characters, and lines of 30; the u-blox 6 has none.
  [[nodiscard]] Bytes version() const {
    ublox::Payload p;
    switch (generation_) {
      case Generation::kM6:
        return p.chars("7.03 (45969)", 30).chars("00040007", 10).bytes();
      case Generation::kM8:
        p.chars("ROM CORE 3.01 (107888)", 30).chars("00080000", 10).chars("FWVER=SPG 3.01", 30);
        return p.chars("PROTVER=18.00", 30).chars("GPS;GLO;GAL;BDS", 30).bytes();
      default:
        p.chars("ROM SPG 5.10 (7b202e)", 30).chars("000A0000", 10).chars("FWVER=SPG 5.10", 30);
        return p.chars("PROTVER=34.10", 30).chars("GPS;GLO;GAL;BDS", 30).bytes();
    }
  }

  /// `size` bytes from `at`, little endian (sec. 5.3.1); they may lie at any address.
  static std::uint32_t number(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size && i < 4; ++i) value |= static_cast<std::uint32_t>(bytes[at + i]) << 8 * i;
    return value;
  }
  void expect_zero(std::uint8_t reserved) { reserved_ += reserved != 0; }

  // ---- output

  /// The item that holds a message's rate on UART1; 0: there is none.
  static std::uint32_t item_of(Message message) {
    static const std::map<Message, std::uint32_t> kItemOf{
        {{ublox::kNav, ublox::kNavPosLlh}, ublox::key("CFG-MSGOUT-UBX_NAV_POSLLH_UART1")},
        {{ublox::kNav, ublox::kNavDop}, ublox::key("CFG-MSGOUT-UBX_NAV_DOP_UART1")},
        {{ublox::kNav, ublox::kNavPvt}, ublox::key("CFG-MSGOUT-UBX_NAV_PVT_UART1")},
        {{ublox::kNav, ublox::kNavCov}, ublox::key("CFG-MSGOUT-UBX_NAV_COV_UART1")},
        {{ublox::kNav, ublox::kNavHpPosLlh}, ublox::key("CFG-MSGOUT-UBX_NAV_HPPOSLLH_UART1")},
        {{ublox::kNav, ublox::kNavRelPosNed}, ublox::key("CFG-MSGOUT-UBX_NAV_RELPOSNED_UART1")},
        {{kNmea, 0x00}, ublox::key("CFG-MSGOUT-NMEA_ID_GGA_UART1")},
        {{kNmea, 0x01}, ublox::key("CFG-MSGOUT-NMEA_ID_GLL_UART1")},
        {{kNmea, 0x02}, ublox::key("CFG-MSGOUT-NMEA_ID_GSA_UART1")},
        {{kNmea, 0x04}, ublox::key("CFG-MSGOUT-NMEA_ID_RMC_UART1")},
        {{kNmea, 0x05}, ublox::key("CFG-MSGOUT-NMEA_ID_VTG_UART1")},
        {{kNmea, 0x07}, ublox::key("CFG-MSGOUT-NMEA_ID_GST_UART1")},
    };
    const auto found = kItemOf.find(message);
    return found == kItemOf.end() ? 0 : found->second;
  }
  /// Messages that CFG-MSG can name. GRS, GSV, ZDA, GBS and DTM are known, too, but this fake never sends them.
  [[nodiscard]] bool exists(Message message) const {
    static const std::set<Message> kWithoutItem{{ublox::kNav, ublox::kNavSol},
                                                {ublox::kNav, ublox::kNavVelNed},
                                                {ublox::kNav, ublox::kNavTimeUtc},
                                                {kNmea, 0x03},
                                                {kNmea, 0x06},
                                                {kNmea, 0x08},
                                                {kNmea, 0x09},
                                                {kNmea, 0x0A}};
    if (message.first == ublox::kNav && generation_ == Generation::kM6 &&
        (message.second == ublox::kNavPvt || message.second == ublox::kNavCov ||
         message.second == ublox::kNavHpPosLlh || message.second == ublox::kNavRelPosNed)) {
      return false;
    }
    return item_of(message) != 0 || kWithoutItem.contains(message);
  }
  [[nodiscard]] std::uint32_t rate_of(std::uint8_t message_class, std::uint8_t id) const {
    const Message message{message_class, id};
    if (!exists(message)) return 0;
    if (const std::uint32_t item = item_of(message)) return ram(item);
    const auto found = plain_rates_.find(message);
    return found == plain_rates_.end() ? 0 : found->second;
  }

  /// The jitter of the epoch that is due: spread over the whole span, the same in every run.
  [[nodiscard]] base::Micros wait() const {
    const std::uint64_t mixed = (epochs_.size() + 1) * 0x9E3779B97F4A7C15ULL >> 33;
    const auto span = static_cast<std::uint64_t>(std::max(injected.jitter.us, std::int64_t{0}));
    return {static_cast<std::int64_t>(mixed % (span + 1))};
  }

  [[nodiscard]] Instant instant_at(base::Micros at) const {
    constexpr std::int64_t kWeek_ms = 604'800'000;  // IS-GPS-200 sec. 3.3.4
    const std::int64_t ms = start_.itow_ms + (at - kFirstEpoch).us / 1000;
    Instant instant = start_;
    instant.week += static_cast<int>(ms / kWeek_ms);
    instant.itow_ms = static_cast<std::uint32_t>(ms % kWeek_ms);
    return instant;
  }

  /// Open is the order within an epoch: NMEA first, then UBX by id, so NAV-COV comes last.
  void say_epoch(base::Micros at) {
    const Instant instant = instant_at(at);
    const Solution& s = solution_;
    const auto due = [this](std::uint8_t message_class, std::uint8_t id) {
      const std::uint32_t rate = rate_of(message_class, id);
      return rate != 0 && epochs_.size() % rate == 0;
    };
    using Sentence = std::string (*)(const Instant&, const Solution&);
    constexpr std::array<std::pair<std::uint8_t, Sentence>, 6> kSentences{{{0x04, ublox::nmea::rmc},
                                                                           {0x05, ublox::nmea::vtg},
                                                                           {0x00, ublox::nmea::gga},
                                                                           {0x02, ublox::nmea::gsa},
                                                                           {0x01, ublox::nmea::gll},
                                                                           {0x07, ublox::nmea::gst}}};
    for (const auto& [id, sentence] : kSentences) {
      if (due(kNmea, id)) say_nmea(sentence(instant, s));
    }
    using Nav = Bytes (*)(const Instant&, const Solution&);
    constexpr Nav kTimeUtc = [](const Instant& i, const Solution&) { return ublox::nav_timeutc(i); };
    constexpr std::array<std::pair<std::uint8_t, Nav>, 9> kNavs{{{ublox::kNavPosLlh, ublox::nav_posllh},
                                                                 {ublox::kNavDop, ublox::nav_dop},
                                                                 {ublox::kNavSol, ublox::nav_sol},
                                                                 {ublox::kNavPvt, ublox::nav_pvt},
                                                                 {ublox::kNavVelNed, ublox::nav_velned},
                                                                 {ublox::kNavHpPosLlh, ublox::nav_hpposllh},
                                                                 {ublox::kNavTimeUtc, kTimeUtc},
                                                                 {ublox::kNavCov, ublox::nav_cov},
                                                                 {ublox::kNavRelPosNed, ublox::nav_relposned}}};
    for (const auto& [id, payload] : kNavs) {
      if (due(ublox::kNav, id)) send_ubx(ublox::frame(ublox::kNav, id, payload(instant, s)));
    }
    epochs_.push_back({at, instant, s});
  }

  // ---- layers

  [[nodiscard]] std::uint32_t standard(const ublox::Item& item) const {
    return item.id == ublox::key("CFG-UART1-BAUDRATE") ? factory_baud_ : item.standard;
  }
  /// The default layer goes to RAM; what was on its way is lost with the power. BBR stays.
  void factory_reset(std::uint32_t baud) {
    factory_baud_ = baud;
    for (const ublox::Item& item : ublox::kItems) ram_[item.id] = standard(item);
    plain_rates_.clear();
    received_.clear();
    answers_.clear();
    gone_quiet_ = false;
  }

  static constexpr base::Micros kFirstEpoch{1'000'000};

  Generation generation_;
  std::uint32_t host_baud_;
  std::uint32_t factory_baud_ = 0;
  std::map<std::uint32_t, std::uint32_t> ram_, bbr_;
  std::map<Message, std::uint32_t> plain_rates_;  // messages without an item
  std::deque<Received> received_;
  std::deque<std::uint8_t> to_host_;
  std::multimap<base::Micros, Answer> answers_;
  bool gone_quiet_ = false;
  base::Micros now_{}, next_epoch_ = kFirstEpoch;
  Instant start_{};
  Solution solution_{};
  std::vector<Epoch> epochs_;
  int requests_ = 0, reserved_ = 0, damaged_ = 0;
};

}  // namespace tetap::fakes
