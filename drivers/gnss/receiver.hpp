// SPDX-License-Identifier: Apache-2.0
// A GNSS receiver that speaks UBX, NMEA or both, fed byte by byte. Reports of whole epochs come out, the same ones
// however the bytes are divided. Refused bytes and messages are counted with their reason.
#pragma once

#include "drivers/gnss/framer.hpp"
#include "drivers/gnss/nmea/epoch.hpp"
#include "drivers/gnss/nmea/heading.hpp"
#include "drivers/gnss/ubx/baseline.hpp"
#include "drivers/gnss/ubx/dual_antenna.hpp"
#include "drivers/gnss/ubx/epoch.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::drivers::gnss {

namespace ubx {

/// UBX-ACK-ACK and UBX-ACK-NAK: which message the receiver took, or refused.
struct Acknowledge {
  std::uint8_t message_class = 0;
  std::uint8_t message_id = 0;
  bool accepted = false;
};
/// UBX-MON-VER arrived: a receiver that understands UBX at this baud rate.
struct Identified {};

}  // namespace ubx

struct ReceiverSettings {
  bool nmea_checksum_required = true;  ///< false: for old receivers that send none
  float baseline_m = 0;                ///< between the antennas of a receiver with two; 0: the length is not checked
};

/// A handler is called with a Report and, where it takes them, with a Baseline, ubx::Acknowledge and ubx::Identified.
template <std::size_t Capacity = 1029>
class GnssReceiver {
 public:
  explicit constexpr GnssReceiver(const ReceiverSettings& settings = {}) : settings_(settings) {}

  template <class Handler>
  constexpr void on_byte(std::uint8_t byte, Handler&& handler) {
    Router<Handler> router{*this, handler};
    framer_.on_byte(byte, health_, settings_.nmea_checksum_required, router);
  }
  template <class Handler>
  constexpr void on_bytes(std::span<const std::uint8_t> bytes, Handler&& handler) {
    for (const std::uint8_t byte : bytes) on_byte(byte, handler);
  }

  /// The line was quiet for longer than any pause within a frame: what is incomplete will not be completed.
  template <class Handler>
  constexpr void on_gap(Handler&& handler) {
    Router<Handler> router{*this, handler};
    framer_.on_gap(health_, settings_.nmea_checksum_required, router);
  }

  /// No more bytes: hands on the epochs that could still have grown.
  template <class Handler>
  constexpr void finish(Handler&& handler) {
    Router<Handler> router{*this, handler};
    if (framer_.within_frame()) framer_.on_gap(health_, settings_.nmea_checksum_required, router);
    ubx_.finish(router);
    nmea_.finish(health_, router);
  }

  [[nodiscard]] constexpr const Health& health() const { return health_; }
  [[nodiscard]] constexpr bool within_frame() const { return framer_.within_frame(); }

 private:
  template <class Handler>
  struct Router {
    GnssReceiver& receiver;
    Handler& handler;

    constexpr void ubx(std::uint8_t message_class, std::uint8_t id, std::span<const std::uint8_t> payload) {
      constexpr auto kRelPosNed = ubx::kNavMessages[static_cast<std::size_t>(ubx::Nav::kRelPosNed)];
      if (message_class == ubx::kClassNav && id == kRelPosNed.id) {
        // On its own: it waits for the reference antenna's data, and the place need not wait with it.
        line(ubx::baseline(payload, receiver.settings_.baseline_m, receiver.health_));
      } else if (message_class == ubx::kClassNav && id == ubx::kDualAntennaId) {
        line(ubx::dual_antenna(payload, receiver.settings_.baseline_m, receiver.health_));
      } else if (message_class == ubx::kClassNav) {
        receiver.ubx_.on_nav(id, payload, receiver.health_, *this);
      } else if (message_class == ubx::kClassAck && id <= 1) {
        if (payload.size() != 2) return receiver.health_.add(Reason::kUbxLength);
        publish(ubx::Acknowledge{payload[0], payload[1], id == 1});
      } else if (message_class == ubx::kClassMon && id == 0x04 && payload.size() >= 40) {
        publish(ubx::Identified{});
      } else {
        receiver.health_.add(Reason::kUnread);
      }
    }
    constexpr void nmea(nmea::Text text) {
      nmea::Fields fields(text);
      const auto kind = nmea::heading_kind(fields[0]);
      if (!kind) return receiver.nmea_.on_sentence(text, receiver.health_, *this);
      const auto heading = nmea::heading(fields, *kind, receiver.health_);
      if (!heading) return;
      if (!receiver.headings_.takes(*kind)) return receiver.health_.add(Reason::kSecondProtocol);
      publish(*heading);
    }
    constexpr void line(const std::optional<Baseline>& baseline) {
      if (!baseline) return;
      if (baseline->valid) receiver.headings_.on_ubx();
      publish(*baseline);
    }

    /// UBX is the more exact of two protocols. Only a UBX epoch with a usable place holds NMEA back: NAV-STATUS,
    /// NAV-POSLLH or NAV-VELNED alone is no fix.
    constexpr void operator()(const Report& report) {
      constexpr std::uint8_t kEpochsOfNmeaToWait = 3;
      if (report.has_position && report.fix < sensor::GnssFix::k2d) receiver.health_.add(Reason::kNoFix);
      if (report.usable() && report.protocol == Protocol::kUbx) {
        receiver.nmea_held_back_ = kEpochsOfNmeaToWait;
      } else if (report.protocol == Protocol::kNmea && receiver.nmea_held_back_ > 0) {
        --receiver.nmea_held_back_;
        return receiver.health_.add(Reason::kSecondProtocol);
      }
      handler(report);
    }

    template <class Event>
    constexpr void publish(const Event& event) {
      if constexpr (requires { handler(event); }) handler(event);
    }
  };

  ReceiverSettings settings_;
  Framer<Capacity> framer_{};
  ubx::Epoch ubx_{};
  nmea::Epoch nmea_{};
  Health health_{};
  nmea::HeadingChoice headings_{};
  std::uint8_t nmea_held_back_ = 0;
};

}  // namespace tetap::drivers::gnss
