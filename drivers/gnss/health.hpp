// SPDX-License-Identifier: Apache-2.0
// Refusals of a GNSS receiver's driver, and why: a reason for everything that was not used, a count of each.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::drivers::gnss {

enum class Reason : std::uint8_t {
  kNoise,             ///< bytes that belong to no frame
  kUbxChecksum,       ///< a UBX frame damaged on the line
  kNmeaChecksum,      ///< a sentence whose checksum does not fit
  kNmeaNoChecksum,    ///< a sentence without one, where it is required
  kNmeaBadCharacter,  ///< a character that cannot be in a sentence
  kNmeaCutShort,      ///< a sentence that begins within another
  kRtcmCrc,           ///< an RTCM frame damaged on the line, or bytes that looked like one
  kTooLong,           ///< longer than the buffer: its bytes were searched as noise
  kGap,               ///< the line went quiet within a frame
  kUbxLength,         ///< a message of a length it does not have
  kUbxVersion,        ///< a message in a version that is not known
  kNmeaField,         ///< a field that is not what it should be: the sentence was not used
  kNoEpoch,           ///< data without a time, before any epoch began
  kOutOfRange,        ///< a position or velocity that cannot be
  kBadTime,           ///< a date or time that does not exist
  kSecondProtocol,    ///< an NMEA epoch beside UBX epochs of the same content
  kUnread,            ///< a whole message or sentence of a kind that the driver does not read
  kLate,              ///< a message of an epoch that was handed on already
  kRepeated,          ///< a sentence or an NMEA epoch that came twice, equal to the last character
  kUncertainTime,     ///< an NMEA epoch whose time of day another fix has, too: it is reported with that mark
  kGsaMode,           ///< a GSA whose fix mode another GSA of its epoch betters
  kNoFix,             ///< a place that is no fix: dead reckoning, typed in, simulated or marked as not valid
  kBaseline,          ///< a baseline between two antennas that is no heading
  kCount
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(Reason::kCount)> kReasonNames = {
    "noise",
    "UBX checksum",
    "NMEA checksum",
    "NMEA without checksum",
    "NMEA bad character",
    "NMEA cut short",
    "RTCM CRC",
    "too long",
    "gap in frame",
    "UBX length",
    "UBX version",
    "NMEA bad field",
    "data without epoch",
    "out of range",
    "bad time",
    "second protocol",
    "not read",
    "after its epoch",
    "repeated",
    "doubtful time",
    "GSA of lesser mode",
    "place without fix",
    "baseline without heading"};

[[nodiscard]] constexpr std::string_view name(Reason reason) {
  return reason < Reason::kCount ? kReasonNames[static_cast<std::size_t>(reason)] : std::string_view{"?"};
}

/// Saturating counts: noise in bytes, the rest in frames.
class Health {
 public:
  [[nodiscard]] constexpr std::uint32_t of(Reason reason) const { return counts_[static_cast<std::size_t>(reason)]; }
  constexpr void add(Reason reason, std::uint32_t n = 1) {
    auto& count = counts_[static_cast<std::size_t>(reason)];
    count = n > 0xFFFF'FFFFU - count ? 0xFFFF'FFFFU : count + n;
  }

  /// Frames that were whole, whatever was made of them.
  std::uint32_t ubx_frames = 0;
  std::uint32_t nmea_frames = 0;
  std::uint32_t rtcm_frames = 0;

  friend constexpr bool operator==(const Health&, const Health&) = default;

 private:
  std::array<std::uint32_t, static_cast<std::size_t>(Reason::kCount)> counts_{};
};

}  // namespace tetap::drivers::gnss
