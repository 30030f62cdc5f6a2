// SPDX-License-Identifier: Apache-2.0
// Sensors wired to the node's own board. Each sample becomes the frames of config/tetap.dbc. Whoever takes these both
// sends and consumes them: wire and bus have the same integers, and the log of the bus is the record.
#pragma once

#include "tetap/bus/counters.hpp"
#include "tetap/firmware/wired_lidar.hpp"
#include "tetap/firmware/wired_sensors.hpp"

#include <array>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace tetap::firmware {

/// Kinds of sensors that an image has drivers for: a template argument, so that the other drivers are not linked.
struct WiredParts {
  bool imu = false;
  bool encoders = false;
  bool gnss = false;
  bool lidar = false;  ///< on the receiver's line

  [[nodiscard]] static constexpr WiredParts of(const param::Parameters& p) {
    return {.imu = p.wired.imu != 0,
            .encoders = p.wired.encoders != 0,
            .gnss = p.wired.gnss != 0,
            .lidar = p.wired.lidar != 0};
  }
  [[nodiscard]] constexpr bool any() const { return imu || encoders || gnss || lidar; }
};

/// Bus time minus board time as stamps use it. Sync frames come with jitter, which is followed slowly; a correction too
/// large for jitter is taken at once.
class StampOffset {
 public:
  /// Takes the offset as it is at board time `now`. True: it jumped, and stamps do not go on from the last ones.
  [[nodiscard]] constexpr bool follow(base::Micros offset, base::Micros now) {
    const std::int64_t error_us = (offset - used_).us;
    const std::int64_t elapsed_us = (now - followed_).us;
    if (!known_ || error_us > kJump_us || error_us < -kJump_us) {
      const bool jumped = known_;
      known_ = true;
      used_ = offset;
      followed_ = now;
      return jumped;
    }
    const std::int64_t most_us = elapsed_us / kElapsedPerStep;
    if (most_us <= 0) return false;
    followed_ = now;
    used_ += base::Micros{error_us > most_us ? most_us : error_us < -most_us ? -most_us : error_us};
    return false;
  }
  [[nodiscard]] constexpr base::Micros used() const { return used_; }

 private:
  static constexpr std::int64_t kJump_us = 2'000;         ///< more than the jitter of a sync frame on a full bus
  static constexpr std::int64_t kElapsedPerStep = 1'000;  ///< 1000 ppm, ten times what two crystals differ by

  base::Micros used_{};
  base::Micros followed_{};
  bool known_ = false;
};

/// Holds the drivers of what `kParts` asks for and the board has.
template <hal::Board Board, WiredParts kParts>
class WiredInputs {
  static_assert(!(kParts.gnss && kParts.lidar), "one line for both");

 public:
  static constexpr bool kImu = kParts.imu && hal::ImuBoard<Board>;
  static constexpr bool kEncoders = kParts.encoders && hal::EncoderBoard<Board>;
  static constexpr bool kGnss = kParts.gnss && hal::GnssBoard<Board>;
  static constexpr bool kLidar = kParts.lidar && hal::GnssBoard<Board>;
  static constexpr bool kAny = kImu || kEncoders || kGnss || kLidar;

  WiredInputs(Board& board, const param::Parameters& parameters)
      : can_base_(parameters.can_base),
        imu_(make<kImu>(board, [&](auto& b) { return Imu(b.imu, parameters); })),
        encoders_(make<kEncoders>(
            board, [&](auto& b) { return Encoders(b.left_encoder, b.right_encoder, parameters.wired); })),
        gnss_(make<kGnss>(board, [&](auto& b) { return Gnss(b.gnss, parameters.wired); })),
        lidar_(make<kLidar>(board, [&](auto& b) { return Lidar(b.gnss); })) {}

  /// put(frame) for each frame of a new sample. `on` false: the drivers run, and their samples are given up.
  template <class Put>
  void poll(base::Micros now, base::Micros offset, bool on, Put&& put) {
    if (on && (offset_.follow(offset, now) || !was_on_)) {
      if constexpr (kImu) imu_.restart();
    }
    was_on_ = on;
    const auto switched = [&](const base::CanFrame& frame) {
      if (on) put(frame);
    };
    const SampleFrames frames(can_base_, switched);
    if constexpr (kImu) imu_.poll(now, offset_.used(), frames);
    if constexpr (kEncoders) encoders_.poll(now, offset_.used(), frames);
    if constexpr (kGnss) gnss_.poll(now, offset_.used(), frames);
    if constexpr (kLidar)
      lidar_.poll(now, offset_.used(), [&](const auto& message) { switched(bus::frame(can_base_, message)); });
  }

  /// Whether frames with this offset in the node's block are made here.
  [[nodiscard]] bool owns(std::uint32_t offset) const {
    bool own = false;
    if constexpr (kImu) own = own || imu_.owns(offset);
    if constexpr (kEncoders) own = own || Encoders::owns(offset);
    if constexpr (kGnss) own = own || Gnss::owns(offset);
    if constexpr (kLidar) own = own || Lidar::owns(offset);
    return own;
  }

  [[nodiscard]] bus::EstDiagImu imu_page() const {
    if constexpr (kImu) return imu_.page();
    return {};
  }
  [[nodiscard]] bus::EstDiagWired wired_page(bool on) const {
    bus::EstDiagWired page{.wired_imu = kImu, .wired_encoders = kEncoders, .wired_gnss = kGnss, .wired_off = !on};
    if constexpr (kImu) page.wired_inst = imu_.instance();
    if constexpr (kEncoders) encoders_.note(page);
    if constexpr (kGnss) gnss_.note(page);
    if constexpr (kLidar) lidar_.note(page);
    return page;
  }

 private:
  struct Nothing {};
  /// maker(board), compiled only where the part is there: neither board nor robot need have every part.
  template <bool kThere, class Make>
  [[nodiscard]] static auto make(Board& board, Make&& maker) {
    if constexpr (kThere)
      return maker(board);
    else
      return Nothing{};
  }
  template <class B>
  using ImuOf = WiredImu<std::remove_reference_t<decltype(std::declval<B&>().imu)>>;
  template <class B>
  using EncodersOf = WiredEncoders<std::remove_reference_t<decltype(std::declval<B&>().left_encoder)>,
                                   std::remove_reference_t<decltype(std::declval<B&>().right_encoder)>>;
  template <class B>
  using GnssOf = WiredGnss<std::remove_reference_t<decltype(std::declval<B&>().gnss)>>;
  template <class B>
  using LidarOf = WiredLidar<std::remove_reference_t<decltype(std::declval<B&>().gnss)>>;
  /// Part of the board, named only where it is there.
  template <bool kThere, template <class> class Of>
  struct Part {
    using Type = Nothing;
  };
  template <template <class> class Of>
  struct Part<true, Of> {
    using Type = Of<Board>;
  };
  using Imu = typename Part<kImu, ImuOf>::Type;
  using Encoders = typename Part<kEncoders, EncodersOf>::Type;
  using Gnss = typename Part<kGnss, GnssOf>::Type;
  using Lidar = typename Part<kLidar, LidarOf>::Type;

  std::uint32_t can_base_;
  StampOffset offset_;
  bool was_on_ = false;
  [[no_unique_address]] Imu imu_;
  [[no_unique_address]] Encoders encoders_;
  [[no_unique_address]] Gnss gnss_;
  [[no_unique_address]] Lidar lidar_;
};

}  // namespace tetap::firmware
