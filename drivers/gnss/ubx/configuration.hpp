// SPDX-License-Identifier: Apache-2.0
// Configuration steps of a u-blox receiver, in both languages of configuration (sources in message.hpp), and the states
// and reasons that the driver reports about them.
#pragma once

#include "drivers/gnss/ubx/message.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::drivers::gnss::ubx {

struct Settings {
  std::uint32_t baud = 115'200;
  std::uint16_t period_ms = 200;
  DynamicModel model = DynamicModel::kAutomotive;
  bool covariance = true;
  bool high_precision = false;          ///< NAV-HPPOSLLH: the place to 0.1 mm, of receivers with RTK
  bool baseline = false;                ///< NAV-RELPOSNED: the heading of two antennas
  base::Micros reply_timeout{300'000};  ///< on top of the time that a long reply takes on the line
  std::uint8_t tries = 3;               ///< attempts with each message
  std::uint8_t rounds = 4;              ///< through all baud rates
  base::Micros lost_after{3'000'000};   ///< time without an epoch after which the search starts again
  base::Micros rest{10'000'000};        ///< after giving up, before the next attempt
};

enum class ConfigState : std::uint8_t { kSearch, kApply, kChangeBaud, kRunning, kGaveUp, kMisconfigured };

inline constexpr std::array<std::string_view, 6> kConfigStateNames = {"searching", "applying", "changing baud rate",
                                                                      "running",   "gave up",  "misconfigured"};
[[nodiscard]] constexpr std::string_view name(ConfigState state) {
  return kConfigStateNames[static_cast<std::size_t>(state)];
}

enum class ConfigReason : std::uint8_t {
  kNoResponse,    ///< a round through all baud rates without a receiver
  kTimeout,       ///< a message without acknowledgement in time
  kRefused,       ///< a message that the receiver did not take
  kLegacy,        ///< no CFG-VALSET: the older messages
  kNoPvt,         ///< no NAV-PVT: the older messages instead
  kBaudKept,      ///< silent after the change of baud rate: the one found stays
  kLost,          ///< silent while running: configured again
  kLateResponse,  ///< an acknowledgement that nothing waited for
  kCount
};

inline constexpr std::array<std::string_view, static_cast<std::size_t>(ConfigReason::kCount)> kConfigReasonNames = {
    "no answer",  "timeout",        "refused",       "older messages",
    "no NAV-PVT", "baud rate kept", "receiver lost", "late answer"};
[[nodiscard]] constexpr std::string_view name(ConfigReason reason) {
  return reason < ConfigReason::kCount ? kConfigReasonNames[static_cast<std::size_t>(reason)] : std::string_view{"?"};
}

/// Requests to the receiver, in this order; the last five only where there is no NAV-PVT.
enum class Step : std::uint8_t {
  kPorts,
  kBaud,
  kRate,
  kPvt,
  kCov,
  kHpPosLlh,
  kRelPosNed,
  kModel,
  kPosLlh,
  kVelNed,
  kSol,
  kDop,
  kTimeUtc,
  kDone
};

[[nodiscard]] constexpr bool valid(const Settings& s) {
  // An epoch of NAV-PVT and the messages that are wanted besides, ten bits a byte, within half the period.
  const std::uint32_t bits =
      1000U + (s.covariance ? 720U : 0U) + (s.high_precision ? 440U : 0U) + (s.baseline ? 720U : 0U);
  return s.baud >= 9600 && s.baud <= 921'600 && s.period_ms >= 25 && s.period_ms <= 10'000 && s.tries > 0 &&
         s.rounds > 0 && s.reply_timeout.us > 0 && bits * 2000 <= s.baud * s.period_ms &&
         s.lost_after.us > 2000 * std::int64_t{s.period_ms} && s.rest.us >= 0;
}

/// `baud`: of the line as it is; the older port message sets it along with the protocols.
[[nodiscard]] constexpr Message request(Step step, const Settings& settings, bool legacy, std::uint32_t baud) {
  switch (step) {
    case Step::kPorts:
      return legacy ? legacy_port(baud)
                    : ValSet().set(Key::kUart1InUbx, 1).set(Key::kUart1OutUbx, 1).set(Key::kUart1OutNmea, 0).finish();
    case Step::kBaud:
      return legacy ? legacy_port(settings.baud) : ValSet().set(Key::kUart1BaudRate, settings.baud).finish();
    case Step::kRate:
      return legacy ? legacy_rate(settings.period_ms)
                    : ValSet().set(Key::kRateMeasurement_ms, settings.period_ms).set(Key::kRateNavigation, 1).finish();
    case Step::kPvt:
      return legacy ? legacy_enable(Nav::kPvt) : ValSet().set(Key::kNavPvtUart1, 1).finish();
    case Step::kCov:
      return ValSet().set(Key::kNavCovUart1, 1).finish();
    case Step::kHpPosLlh:
      return legacy ? legacy_enable(Nav::kHpPosLlh) : ValSet().set(Key::kNavHpPosLlhUart1, 1).finish();
    case Step::kRelPosNed:
      return legacy ? legacy_enable(Nav::kRelPosNed) : ValSet().set(Key::kNavRelPosNedUart1, 1).finish();
    case Step::kModel:
      return legacy ? legacy_model(settings.model)
                    : ValSet().set(Key::kDynamicModel, static_cast<std::uint32_t>(settings.model)).finish();
    case Step::kPosLlh:
      return legacy_enable(Nav::kPosLlh);
    case Step::kVelNed:
      return legacy_enable(Nav::kVelNed);
    case Step::kSol:
      return legacy_enable(Nav::kSol);
    case Step::kDop:
      return legacy_enable(Nav::kDop);
    default:
      return legacy_enable(Nav::kTimeUtc);
  }
}

}  // namespace tetap::drivers::gnss::ubx
