// SPDX-License-Identifier: Apache-2.0
// Configures a u-blox receiver to send NAV-PVT and the other wanted messages at the wanted rate and baud rate, without
// NMEA. It finds the baud rate and tries CFG-VALSET (M9, F9, M10), then the older CFG messages (M6 to M8). Each is
// acknowledged, with time-outs and bounded retries. It runs on with the receiver: one that lost its power is configured
// again.
#pragma once

#include "drivers/gnss/receiver.hpp"
#include "drivers/gnss/ubx/configuration.hpp"
#include "hal/byte_stream.hpp"
#include "tetap/base/time.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::drivers::gnss::ubx {

template <hal::ByteStream Port>
class Configurator {
 public:
  /// Those that receivers are found at, the factory's first. Lines without a baud rate (USB, DDC) have one try.
  static constexpr std::array<std::uint32_t, 7> kBauds{38'400, 9600, 115'200, 57'600, 230'400, 460'800, 921'600};

  constexpr Configurator(Port& port, const Settings& settings) : port_(&port), settings_(settings) {
    if (!valid(settings_)) state_ = ConfigState::kMisconfigured;
  }

  /// Advances by what time it is; called at the pace of the loop.
  constexpr void poll(base::Micros now) {
    if (state_ == ConfigState::kMisconfigured) return;
    if (!started_) {
      started_ = true;
      begin_search(now);
    }
    write(now);
    if (!sent_ && now < deadline_) return;
    switch (state_) {
      case ConfigState::kSearch:
        if (now >= deadline_) next_baud(now);
        return;
      case ConfigState::kApply:
        if (now >= deadline_) on_silence(now);
        return;
      case ConfigState::kChangeBaud:
        if (now >= deadline_) verify_baud(now);
        return;
      case ConfigState::kRunning:
        if (now - last_report_ >= settings_.lost_after) {
          add(ConfigReason::kLost);
          begin_search(now);
        }
        return;
      case ConfigState::kGaveUp:
        if (now >= deadline_) begin_search(now);
        return;
      case ConfigState::kMisconfigured:
        return;
    }
  }

  constexpr void on_identified(base::Micros now) {
    if (state_ == ConfigState::kSearch) {
      apply(Step::kPorts, now);
    } else if (state_ == ConfigState::kChangeBaud && changed_) {
      baud_ = settings_.baud;
      apply(Step::kRate, now);
    }
  }

  /// Acknowledgements name a message, not one of its kind. After a retry an old one may still be on its way, so the
  /// step waits for silence before the next goes out.
  constexpr void on_acknowledge(const Acknowledge& ack, base::Micros now) {
    const bool ours = state_ == ConfigState::kApply && !settling_ && ack.message_class == message_.message_class() &&
                      ack.message_id == message_.id();
    if (!ours) {
      if (ack.message_class == kClassCfg && state_ != ConfigState::kChangeBaud) add(ConfigReason::kLateResponse);
      return;
    }
    if (ack.accepted) {
      if (step_ == Step::kPvt) has_pvt_ = true;
    } else if (!refused(now)) {
      return;
    }
    if (tries_ > 1) {
      settling_ = true;  // the tries were a wait() apart, and so are their answers
      deadline_ = now + base::Micros{wait().us * tries_};
    } else {
      apply(next(step_), now);
    }
  }

  constexpr void on_report(base::Micros now) { last_report_ = now; }

  [[nodiscard]] constexpr ConfigState state() const { return state_; }
  [[nodiscard]] constexpr std::uint32_t baud() const { return baud_; }
  [[nodiscard]] constexpr bool legacy() const { return legacy_; }
  [[nodiscard]] constexpr std::uint16_t of(ConfigReason reason) const {
    return counts_[static_cast<std::size_t>(reason)];
  }
  /// True: the receiver refused this step since it was found.
  [[nodiscard]] constexpr bool was_refused(Step step) const {
    return (refused_ >> static_cast<unsigned>(step) & 1) != 0;
  }

 private:
  static constexpr bool kHasBaud = hal::SerialPort<Port>;

  constexpr void begin_search(base::Micros now) {
    state_ = ConfigState::kSearch;
    round_ = 0;
    candidate_ = 0;
    keep_baud_ = !kHasBaud;
    listen(settings_.baud, now);
  }

  /// At this baud rate, who is there?
  constexpr void listen(std::uint32_t baud, base::Micros now) {
    baud_ = baud;
    if constexpr (kHasBaud) port_->set_baud(baud);
    legacy_ = has_pvt_ = settling_ = changed_ = false;
    refused_ = 0;
    send(poll_version(), now);
  }

  /// First the wanted one, then the list.
  constexpr void next_baud(base::Micros now) {
    if (candidate_ < kBauds.size() && kHasBaud) return listen(kBauds[candidate_++], now);
    add(ConfigReason::kNoResponse);
    end_round(now);
  }

  constexpr void end_round(base::Micros now) {
    ++round_;
    if (round_ >= settings_.rounds) {
      state_ = ConfigState::kGaveUp;
      sent_ = true;
      deadline_ = now + settings_.rest;
      return;
    }
    candidate_ = 0;
    listen(settings_.baud, now);
  }

  constexpr void apply(Step step, base::Micros now) {
    step_ = step;
    tries_ = 1;
    settling_ = false;
    if (step == Step::kDone) {
      state_ = ConfigState::kRunning;
      last_report_ = now;
      return;
    }
    state_ = step == Step::kBaud ? ConfigState::kChangeBaud : ConfigState::kApply;
    changed_ = false;
    send(request(step, settings_, legacy_, baud_), now);
  }

  constexpr void on_silence(base::Micros now) {
    if (settling_) return apply(next(step_), now);
    add(ConfigReason::kTimeout);
    if (tries_ < settings_.tries) {
      ++tries_;
      return send(message_, now);
    }
    // Receivers of the older generation do not answer requests that they do not know.
    if (step_ == Step::kPorts && !legacy_) return fall_back(now);
    next_attempt(now);
  }

  /// From the beginning, but a bounded number of times.
  constexpr void next_attempt(base::Micros now) {
    state_ = ConfigState::kSearch;
    end_round(now);
  }

  constexpr void fall_back(base::Micros now) {
    legacy_ = true;
    add(ConfigReason::kLegacy);
    apply(Step::kPorts, now);
  }

  /// False: this step is done with in another way.
  constexpr bool refused(base::Micros now) {
    if (step_ == Step::kPorts && !legacy_) return fall_back(now), false;
    add(ConfigReason::kRefused);
    refused_ = static_cast<std::uint16_t>(refused_ | 1U << static_cast<unsigned>(step_));
    if (step_ == Step::kPorts || (step_ == Step::kPvt && !legacy_)) return next_attempt(now), false;
    if (step_ == Step::kPvt) add(ConfigReason::kNoPvt);
    return true;
  }

  /// The request was sent at the old rate and may be answered at either; only an answer at the new one counts.
  constexpr void verify_baud(base::Micros now) {
    if (!changed_) {
      changed_ = true;
      tries_ = 1;
      if constexpr (kHasBaud) port_->set_baud(settings_.baud);
      return send(poll_version(), now);
    }
    if (tries_ < settings_.tries) {
      ++tries_;
      return send(message_, now);
    }
    add(ConfigReason::kBaudKept);
    keep_baud_ = true;
    next_attempt(now);
  }

  [[nodiscard]] constexpr Step next(Step step) const {
    switch (step) {
      case Step::kPorts:
        return baud_ != settings_.baud && !keep_baud_ ? Step::kBaud : Step::kRate;
      case Step::kBaud:
        return Step::kRate;
      case Step::kRate:
        return Step::kPvt;
      case Step::kPvt:
        if (settings_.covariance && !legacy_) return Step::kCov;
        [[fallthrough]];
      case Step::kCov:
        if (settings_.high_precision) return Step::kHpPosLlh;
        [[fallthrough]];
      case Step::kHpPosLlh:
        return settings_.baseline ? Step::kRelPosNed : Step::kModel;
      case Step::kRelPosNed:
        return Step::kModel;
      case Step::kModel:
        return has_pvt_ ? Step::kDone : Step::kPosLlh;
      default:
        return static_cast<Step>(static_cast<std::uint8_t>(step) + 1);
    }
  }

  constexpr void send(const Message& message, base::Micros now) {
    message_ = message;
    written_ = 0;
    sent_ = false;
    deadline_ = now + wait();
    write(now);
  }

  /// As much as the line takes; time runs from the last byte on.
  constexpr void write(base::Micros now) {
    if (sent_) return;
    const auto rest = message_.bytes().subspan(written_);
    const std::size_t taken = port_->write(rest);
    written_ += taken < rest.size() ? taken : rest.size();
    sent_ = written_ == message_.bytes().size();
    if (taken > 0) deadline_ = now + wait();
  }

  /// A reply queues behind what the receiver sends anyway: a thousand bytes of ten bits.
  [[nodiscard]] constexpr base::Micros wait() const {
    constexpr std::int64_t kQueue_bits = 10'000;
    return settings_.reply_timeout + base::Micros{kQueue_bits * 1'000'000 / baud_};
  }

  constexpr void add(ConfigReason reason) {
    auto& count = counts_[static_cast<std::size_t>(reason)];
    if (count < 0xFFFF) ++count;
  }

  Port* port_;
  Settings settings_;
  Message message_{};
  base::Micros deadline_{};
  base::Micros last_report_{};
  std::size_t written_ = 0;
  std::size_t candidate_ = 0;
  std::uint32_t baud_ = 9600;
  std::array<std::uint16_t, static_cast<std::size_t>(ConfigReason::kCount)> counts_{};
  std::uint16_t refused_ = 0;
  std::uint8_t tries_ = 0;
  std::uint8_t round_ = 0;
  ConfigState state_ = ConfigState::kSearch;
  Step step_ = Step::kPorts;
  bool started_ = false;
  bool sent_ = true;
  bool legacy_ = false;
  bool has_pvt_ = false;
  bool keep_baud_ = false;
  bool changed_ = false;   ///< this side listens at the new baud rate
  bool settling_ = false;  ///< answered, waiting for answers to earlier tries
};

}  // namespace tetap::drivers::gnss::ubx
