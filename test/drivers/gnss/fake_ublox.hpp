// SPDX-License-Identifier: Apache-2.0
// A u-blox receiver on a serial line, as far as configuration goes, written from the manuals: M8 protocol specification
// (UBX-13003221) sec. 31 and 32.11, F9 interface description (UBX-22008968) sec. 3.10. Bytes take no time; answers come
// after `delay`. It fails as receivers and lines do: see Faults.
#pragma once

#include "base/time.hpp"

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

namespace tetap::test {

enum class Generation { kM6, kM8, kM10 };  ///< no NAV-PVT; NAV-PVT, no keys; keys

class FakeUblox {
 public:
  struct Faults {
    base::Micros delay{20'000};            ///< from request to answer
    bool mute = false;                     ///< never answers
    bool silent_to_unknown = false;        ///< no ACK-NAK for what it does not know
    int swallow_acks = 0;                  ///< so many acknowledgements are lost on the line
    std::set<std::uint32_t> refused_keys;  ///< ACK-NAK for a CFG-VALSET with one of these
    bool deaf_after_baud_change = false;   ///< takes the new rate, then says nothing
    std::size_t write_at_most = 1000;      ///< bytes that the line takes at a time
  };

  FakeUblox(Generation generation, std::uint32_t baud) : generation_(generation), baud_(baud), host_baud_(baud) {}

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
    for (const std::uint8_t byte : out.first(n))
      hear(host_baud_ == baud_ ? byte : static_cast<std::uint8_t>(byte ^ 0x55));
    return n;
  }
  void set_baud(std::uint32_t baud) {
    host_baud_ = baud;
    to_host_.clear();
  }

  // ---- time
  void advance(base::Micros now) {
    now_ = now;
    for (auto it = answers_.begin(); it != answers_.end();) {
      if (it->first > now) {
        ++it;
        continue;
      }
      say(it->second);
      it = answers_.erase(it);
    }
    for (; next_epoch_ <= now; next_epoch_ += base::Micros{std::int64_t{period_ms_} * 1000}) solution(next_epoch_);
  }
  /// Back to what the factory set: the configuration was in RAM.
  void power_cycle(std::uint32_t baud) {
    baud_ = baud;
    period_ms_ = 1000;
    nmea_ = true;
    enabled_.clear();
    answers_.clear();
  }

  [[nodiscard]] std::uint32_t baud() const { return baud_; }
  [[nodiscard]] std::uint16_t period_ms() const { return period_ms_; }
  [[nodiscard]] bool nmea() const { return nmea_; }
  [[nodiscard]] bool enabled(std::uint8_t id) const { return enabled_.contains(id); }
  [[nodiscard]] int model() const { return model_; }
  [[nodiscard]] int requests() const { return requests_; }

 private:
  using Bytes = std::vector<std::uint8_t>;

  static Bytes frame(std::uint8_t message_class, std::uint8_t id, const Bytes& payload) {
    Bytes out{0xB5,
              0x62,
              message_class,
              id,
              static_cast<std::uint8_t>(payload.size()),
              static_cast<std::uint8_t>(payload.size() >> 8)};
    for (const std::uint8_t byte : payload) out.push_back(byte);
    unsigned a = 0, b = 0;
    for (std::size_t i = 2; i < out.size(); ++i) b += a += out[i];
    out.push_back(static_cast<std::uint8_t>(a));
    out.push_back(static_cast<std::uint8_t>(b));
    return out;
  }

  void say(const Bytes& bytes) {
    if (faults.mute || (faults.deaf_after_baud_change && baud_changed_)) return;
    for (const std::uint8_t byte : bytes)
      to_host_.push_back(host_baud_ == baud_ ? byte : static_cast<std::uint8_t>(byte * 5 + 3));
  }
  void answer(const Bytes& bytes) { answers_.emplace_back(now_ + faults.delay, bytes); }
  void acknowledge(std::uint8_t id, bool accepted) {
    if (faults.swallow_acks > 0) {
      --faults.swallow_acks;
      return;
    }
    answer(frame(0x05, accepted ? 1 : 0, {0x06, id}));
  }

  void hear(std::uint8_t byte) {
    in_.push_back(byte);
    for (;;) {
      while (!in_.empty() && (in_[0] != 0xB5 || (in_.size() > 1 && in_[1] != 0x62))) in_.erase(in_.begin());
      if (in_.size() < 6) return;
      const std::size_t length = in_[4] + 256U * in_[5];
      if (length > 500) {
        in_.erase(in_.begin());
        continue;
      }
      if (in_.size() < length + 8) return;
      const Bytes payload(in_.begin() + 6, in_.begin() + 6 + static_cast<std::ptrdiff_t>(length));
      const std::uint8_t message_class = in_[2], id = in_[3];
      const bool good = frame(message_class, id, payload) ==
                        Bytes(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(length) + 8);
      in_.erase(in_.begin(), in_.begin() + (good ? static_cast<std::ptrdiff_t>(length) + 8 : 1));
      if (good) request(message_class, id, payload);
    }
  }

  static std::uint32_t number(const Bytes& p, std::size_t at, std::size_t size) {
    std::uint32_t value = 0;
    for (std::size_t i = size; i-- > 0;) value = value << 8 | p.at(at + i);
    return value;
  }

  void request(std::uint8_t message_class, std::uint8_t id, const Bytes& p) {
    ++requests_;
    if (message_class == 0x0A && id == 0x04 && p.empty()) return answer(frame(0x0A, 0x04, Bytes(100, 'x')));
    if (message_class != 0x06) return;
    if (id == 0x8A && generation_ == Generation::kM10) return valset(p);
    const bool known = generation_ != Generation::kM10 && legacy(id, p);
    if (known || !faults.silent_to_unknown) acknowledge(id, known);
  }

  void valset(const Bytes& p) {
    static const std::map<std::uint32_t, std::size_t> kSizes{{1, 1}, {2, 1}, {3, 2}, {4, 4}};
    if (p.size() < 4 || p[0] != 0 || (p[1] & 1) == 0) return acknowledge(0x8A, false);
    std::map<std::uint32_t, std::uint32_t> values;
    for (std::size_t at = 4; at < p.size();) {
      const std::uint32_t key = number(p, at, 4);
      const std::size_t size = kSizes.at(key >> 28 & 7);
      values[key] = number(p, at + 4, size);
      at += 4 + size;
    }
    for (const auto& [key, value] : values)
      if (faults.refused_keys.contains(key)) return acknowledge(0x8A, false);
    for (const auto& [key, value] : values) {
      if (key == 0x40520001) change_baud(value);
      if (key == 0x10740002) nmea_ = value != 0;
      if (key == 0x30210001) period_ms_ = static_cast<std::uint16_t>(value);
      if (key == 0x20110021) model_ = static_cast<int>(value);
      if (key == 0x20910007 && value == 1) enabled_.insert(0x07);
      if (key == 0x20910084 && value == 1) enabled_.insert(0x36);
    }
    acknowledge(0x8A, true);
  }

  bool legacy(std::uint8_t id, const Bytes& p) {
    if (id == 0x00 && p.size() == 20 && p[0] == 1) {
      nmea_ = (p[14] & 2) != 0;
      if (number(p, 8, 4) != baud_) change_baud(number(p, 8, 4));
      return true;
    }
    if (id == 0x01 && p.size() == 3) {
      if (p[0] != 0x01 || (p[1] == 0x07 && generation_ == Generation::kM6)) return false;
      if (p[2] > 0) enabled_.insert(p[1]);
      return true;
    }
    if (id == 0x08 && p.size() == 6) return period_ms_ = static_cast<std::uint16_t>(number(p, 0, 2)), true;
    if (id == 0x24 && p.size() == 36) return model_ = (p[0] & 1) != 0 ? p[2] : model_, true;
    return false;
  }

  void change_baud(std::uint32_t baud) {
    baud_ = baud;
    baud_changed_ = true;
  }

  void solution(base::Micros at) {
    const auto itow = static_cast<std::uint32_t>(at.us / 1000);
    const auto put = [&](Bytes& p, std::size_t offset, std::uint32_t v) {
      for (std::size_t i = 0; i < 4; ++i) p[offset + i] = static_cast<std::uint8_t>(v >> (8 * i));
    };
    const auto message = [&](std::uint8_t id, std::size_t size) {
      Bytes p(size, 0);
      put(p, 0, itow);
      if (id == 0x06) p[10] = 3, p[11] = 1;
      if (id == 0x07) p[20] = 3, p[21] = 1;
      if (enabled(id)) say(frame(0x01, id, p));
    };
    if (nmea_) {
      const std::string text = "$GPGLL,,,,,,V,N*64\r\n";
      say({text.begin(), text.end()});
    }
    message(0x02, 28);
    message(0x04, 18);
    message(0x06, 52);
    message(0x07, 92);
    message(0x12, 36);
    message(0x21, 20);
    message(0x36, 64);
  }

  Generation generation_;
  std::uint32_t baud_, host_baud_;
  base::Micros now_{}, next_epoch_{1'000'000};
  std::deque<std::uint8_t> to_host_;
  std::vector<std::pair<base::Micros, Bytes>> answers_;
  Bytes in_;
  std::set<std::uint8_t> enabled_;
  std::uint16_t period_ms_ = 1000;
  int model_ = 0;
  int requests_ = 0;
  bool nmea_ = true;
  bool baud_changed_ = false;
};

}  // namespace tetap::test
