// SPDX-License-Identifier: Apache-2.0
// Finds UBX, NMEA 0183 and RTCM 3 frames in one stream of bytes. A frame counts only when its checksum fits. Otherwise
// the search goes on one byte after its start, within the buffered bytes, so damage costs only the damaged frame.
// Frames: u-blox F9 HPG 1.32 interface description, sec. 3.2 to 3.4; NMEA 0183 v4.1 sec. 5.3; RTCM 10403.3, sec. 4.
#pragma once

#include "drivers/gnss/health.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::gnss {

inline constexpr std::uint8_t kUbxSync1 = 0xB5, kUbxSync2 = 0x62, kRtcmPreamble = 0xD3;
inline constexpr std::size_t kUbxOverhead = 8, kRtcmOverhead = 6;
inline constexpr std::size_t kLongestSentence = 160;  ///< the standard allows 82; receivers send more

/// Fletcher's sum of 8 bits over class, id, length and payload.
struct UbxChecksum {
  std::uint8_t a = 0, b = 0;
  constexpr void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      a = static_cast<std::uint8_t>(a + byte);
      b = static_cast<std::uint8_t>(b + a);
    }
  }
};

/// CRC-24Q: polynomial 0x1864CFB, not reflected, from 0.
[[nodiscard]] constexpr std::uint32_t crc24q(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc ^= std::uint32_t{byte} << 16;
    for (int bit = 0; bit < 8; ++bit) {
      crc <<= 1;
      if ((crc & 0x100'0000U) != 0) crc ^= 0x186'4CFBU;
    }
  }
  return crc;
}

/// Value of a hexadecimal digit; -1: it is none.
[[nodiscard]] constexpr int hex_digit(std::uint8_t c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

/// Capacity: the longest frame that is recognised; 1029 holds every RTCM frame.
template <std::size_t Capacity>
class Framer {
 public:
  static_assert(Capacity >= kLongestSentence && Capacity <= 0xFFFF);

  /// `sink` has ubx(class, id, payload) and nmea(text between '$' and '*').
  template <class Sink>
  constexpr void on_byte(std::uint8_t byte, Health& health, bool checksum_required, Sink& sink) {
    buffer_[size_] = byte;
    ++size_;
    search(health, checksum_required, sink);
  }

  /// The line was quiet for longer than a frame takes: what is incomplete stays so, and what came after its first byte
  /// is searched.
  template <class Sink>
  constexpr void on_gap(Health& health, bool checksum_required, Sink& sink) {
    if (size_ == 0) return;
    health.add(Reason::kGap);
    for (std::size_t n = size_; size_ > 0 && n > 0; --n) {
      drop_first(health);
      search(health, checksum_required, sink);
    }
  }

  [[nodiscard]] constexpr bool within_frame() const { return size_ > 0; }

 private:
  enum class Verdict : std::uint8_t { kMore, kNot, kFrame };

  /// Each turn but the last makes the buffer shorter.
  template <class Sink>
  constexpr void search(Health& health, bool checksum_required, Sink& sink) {
    while (size_ > 0) {
      const Verdict verdict = judge(health, checksum_required);
      if (verdict == Verdict::kMore) return;
      if (verdict == Verdict::kNot) {
        drop_first(health);
        continue;
      }
      hand_over(health, sink);
      remove(length_);
    }
  }

  constexpr Verdict judge(Health& health, bool checksum_required) {
    if (buffer_[0] == kUbxSync1) return judge_ubx(health);
    if (buffer_[0] == kRtcmPreamble) return judge_rtcm(health);
    if (buffer_[0] == '$') return judge_nmea(health, checksum_required);
    return Verdict::kNot;
  }

  constexpr Verdict judge_ubx(Health& health) {
    if (size_ < 2) return Verdict::kMore;
    if (buffer_[1] != kUbxSync2) return Verdict::kNot;
    if (size_ < 6) return Verdict::kMore;
    length_ = kUbxOverhead + buffer_[4] + std::size_t{256} * buffer_[5];
    if (length_ > Capacity) return refuse(Reason::kTooLong, health);
    if (size_ < length_) return Verdict::kMore;
    UbxChecksum sum;
    sum.add(std::span(buffer_).subspan(2, length_ - 4));
    if (sum.a != buffer_[length_ - 2] || sum.b != buffer_[length_ - 1]) return refuse(Reason::kUbxChecksum, health);
    return Verdict::kFrame;
  }

  constexpr Verdict judge_rtcm(Health& health) {
    if (size_ < 2) return Verdict::kMore;
    if ((buffer_[1] & 0xFC) != 0) return Verdict::kNot;  // six reserved bits
    if (size_ < 3) return Verdict::kMore;
    length_ = kRtcmOverhead + std::size_t{256} * buffer_[1] + buffer_[2];
    if (length_ > Capacity) return refuse(Reason::kTooLong, health);
    if (size_ < length_) return Verdict::kMore;
    if (crc24q(std::span(buffer_).first(length_)) != 0) return refuse(Reason::kRtcmCrc, health);
    return Verdict::kFrame;
  }

  /// A sentence ends with the second digit of its checksum, or with the line.
  constexpr Verdict judge_nmea(Health& health, bool checksum_required) {
    for (; seen_ < size_; ++seen_) {
      const std::uint8_t c = buffer_[seen_];
      if (seen_ == 0) {
        sum_ = 0;
        star_ = 0;
      } else if (star_ == 0) {
        if (c == '*') {
          star_ = seen_;
        } else if (c == '\r' || c == '\n') {
          if (checksum_required) return refuse(Reason::kNmeaNoChecksum, health);
          text_ = seen_ - 1;
          length_ = seen_ + 1;
          return Verdict::kFrame;
        } else if (c == '$') {
          return refuse(Reason::kNmeaCutShort, health);
        } else if (c < 0x20 || c > 0x7E) {
          return refuse(Reason::kNmeaBadCharacter, health);
        } else {
          sum_ = static_cast<std::uint8_t>(sum_ ^ c);
        }
      } else {
        const int digit = hex_digit(c);
        if (digit < 0) return refuse(Reason::kNmeaChecksum, health);
        if (seen_ == star_ + 2) {
          if (hex_digit(buffer_[star_ + 1]) * 16 + digit != sum_) return refuse(Reason::kNmeaChecksum, health);
          text_ = star_ - 1;
          length_ = seen_ + 1;
          return Verdict::kFrame;
        }
      }
      if (seen_ + 1 == kLongestSentence) return refuse(Reason::kTooLong, health);
    }
    return Verdict::kMore;
  }

  static constexpr Verdict refuse(Reason reason, Health& health) {
    health.add(reason);
    return Verdict::kNot;
  }

  template <class Sink>
  constexpr void hand_over(Health& health, Sink& sink) {
    const std::span<const std::uint8_t> bytes(buffer_);
    if (buffer_[0] == kUbxSync1) {
      ++health.ubx_frames;
      sink.ubx(buffer_[2], buffer_[3], bytes.subspan(6, length_ - kUbxOverhead));
    } else if (buffer_[0] == '$') {
      ++health.nmea_frames;
      sink.nmea(bytes.subspan(1, text_));
    } else {
      ++health.rtcm_frames;
    }
  }

  /// To the next byte that may start a frame.
  constexpr void drop_first(Health& health) {
    std::size_t n = 1;
    while (n < size_ && buffer_[n] != kUbxSync1 && buffer_[n] != '$' && buffer_[n] != kRtcmPreamble) ++n;
    // Ends of lines after a sentence are no noise.
    std::uint32_t noise = 0;
    for (std::size_t i = 0; i < n; ++i) noise += buffer_[i] != '\r' && buffer_[i] != '\n' ? 1U : 0U;
    if (noise > 0) health.add(Reason::kNoise, noise);
    remove(n);
  }

  constexpr void remove(std::size_t n) {
    std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(n), buffer_.begin() + static_cast<std::ptrdiff_t>(size_),
              buffer_.begin());
    size_ -= n;
    seen_ = 0;
  }

  std::array<std::uint8_t, Capacity> buffer_{};
  std::size_t size_ = 0;
  std::size_t length_ = 0;  ///< length of the frame at the start, bytes; 0: not known yet
  std::size_t seen_ = 0;    ///< bytes of a sentence that were looked at
  std::size_t star_ = 0;
  std::size_t text_ = 0;  ///< characters between '$' and the end
  std::uint8_t sum_ = 0;
};

}  // namespace tetap::drivers::gnss
