// SPDX-License-Identifier: Apache-2.0
// An image as one sample: In_Feature frames, then In_Image, which ends it and holds their count. An image that
// does not match is dropped whole. The frames of an image come from one sender, and In_Image comes last; the order of
// its features has no effect. Camera 0 is assembled, and for a robot that makes a map camera 3, a recogniser. Others
// are counted as not used.
#pragma once

#include "tetap/base/reinitialise.hpp"
#include "tetap/base/time.hpp"
#include "tetap/bus/codec.hpp"
#include "tetap/bus/counters.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/messages.hpp"
#include "tetap/sensor/image_pool.hpp"
#include "tetap/sensor/sample.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace tetap::bus {

template <bool kRecognises>
class ImageAssemblyOf {
 public:
  using Pool = sensor::ImagePoolOf<kRecognises ? 8 : 4>;

  void power_on() { base::reinitialise(*this); }
  /// At each tick: an image without its end that is older than `patience`, or from a time still to come, is given up
  /// and counted.
  void expire(base::Micros now, base::Micros patience, Counters& counters) {
    if (begun_ && (now - since_ > patience || since_ > now)) give_up(counters);
  }
  /// Time has jumped: a half belongs to another time.
  void discard(Counters& counters) {
    if (begun_) give_up(counters);
  }
  [[nodiscard]] static constexpr bool takes(std::uint8_t offset) {
    return offset == InFeature::kOffset || offset == InImage::kOffset;
  }
  /// `bits` is the frame's CRC, frame_crc(). A whole image goes to out.sample(). out.each_image(f) calls f with each
  /// image that is still to be used: its place is not free.
  template <class Out>
  void on_frame(std::uint8_t offset, const base::CanFrame& frame, std::uint32_t bits, base::Micros reference,
                Counters& counters, Out&& out) {
    const auto bytes = payload(frame);
    if (bytes.size() != 8) return void(++counters.malformed);
    if (offset == InFeature::kOffset) {
      const auto feature = decode<InFeature>(bytes);
      if (!feature) return void(++counters.malformed);
      if (!all_finite(feature->u, feature->v)) return void(++counters.out_of_range);
      return add(*feature, bits, reference, counters, out);
    }
    const auto image = decode<InImage>(bytes);
    if (!image) return void(++counters.malformed);
    end(*image, bits, reference, counters, out);
  }
  [[nodiscard]] const Pool* pool() const { return &pool_; }

 private:
  /// All frames of one image have it.
  struct Head {
    std::uint32_t stamp_us = 0;
    std::uint8_t seq = 0, camera = 0;
    [[nodiscard]] bool operator==(const Head&) const = default;
  };

  [[nodiscard]] static std::uint16_t quarters(float px) { return static_cast<std::uint16_t>(px * 4.0F + 0.5F); }
  void give_up(Counters& counters) {
    begun_ = false;
    ++counters.incomplete;
  }

  /// Whether the frame belongs to the image under way, which it may begin.
  template <class Out>
  [[nodiscard]] bool continues(const Head& head, base::Micros reference, Counters& counters, Out& out) {
    if (head.camera != 0 && !(kRecognises && head.camera == sensor::CameraImage::kRecogniser))
      return ++counters.not_used, false;
    if (begun_ && head == head_) return true;
    const std::size_t kind = head.camera == 0 ? 0 : 1;
    if (ended_[kind] && head == ended_head_[kind] && reference - since_ <= kRepeats) return ++counters.duplicate, false;
    if (begun_) give_up(counters);
    begun_ = true;
    head_ = head;
    since_ = reference;
    seen_ = 0;
    bits_ = 0;
    place_ = free_place(out);
    if (place_ == Pool::kNone) return ++counters.timeline_full, true;
    pool_.clear(place_);
    return true;
  }
  template <class Out>
  [[nodiscard]] static std::uint8_t free_place(Out& out) {
    unsigned used = 0;
    out.each_image([&](const sensor::CameraImage& image) { used |= 1U << image.place; });
    for (std::uint8_t place = 0; place < Pool::kImages; ++place)
      if ((used >> place & 1U) == 0) return place;
    return Pool::kNone;
  }

  template <class Out>
  void add(const InFeature& frame, std::uint32_t bits, base::Micros reference, Counters& counters, Out& out) {
    if (!continues({.stamp_us = frame.stamp_us, .seq = frame.seq, .camera = frame.inst}, reference, counters, out))
      return;
    if (place_ == Pool::kNone) return;
    const model::ImageFeature feature{
        .id = frame.track_id, .u_quarter_px = quarters(frame.u), .v_quarter_px = quarters(frame.v)};
    const auto features = pool_.features(place_);
    const auto same = [&](const model::ImageFeature& f) {
      return f.id == feature.id && f.u_quarter_px == feature.u_quarter_px && f.v_quarter_px == feature.v_quarter_px;
    };
    if (std::any_of(features.begin(), features.end(), same)) return void(++counters.duplicate);
    if (!pool_.add(place_, feature)) {  // more than there is room for: none of them
      ++counters.timeline_full;
      place_ = Pool::kNone;
      return;
    }
    bits_ += bits;
    ++seen_;
  }

  template <class Out>
  void end(const InImage& frame, std::uint32_t bits, base::Micros reference, Counters& counters, Out& out) {
    const Head head{.stamp_us = frame.stamp_us, .seq = frame.seq, .camera = frame.inst};
    if (!continues(head, reference, counters, out)) return;
    begun_ = false;
    const std::size_t kind = head.camera == 0 ? 0 : 1;
    ended_[kind] = true;
    ended_head_[kind] = head;
    if (place_ == Pool::kNone) return;  // counted
    if (frame.count != seen_) return void(++counters.incomplete);
    sensor::Sample sample;
    sample.stamp = base::extend(frame.stamp_us, 20, reference);
    sample.sensor = sensor::Sensor::kFeature;
    sample.instance = frame.inst;
    sample.sequence = frame.seq;
    sample.bits = bits_ + bits;
    sample.payload.image = {.place = place_,
                            .number = frame.seq,
                            .features = seen_,
                            .tracker_state = static_cast<std::uint8_t>(frame.tracker_state),
                            .exposure_10us = exposure(frame.exposure_s)};
    out.sample(sample);
  }
  [[nodiscard]] static std::uint16_t exposure(float exposure_s) {
    return base::is_finite(exposure_s) ? static_cast<std::uint16_t>(exposure_s * 1e5F + 0.5F)
                                       : sensor::CameraImage::kNoExposure;
  }

  static constexpr base::Micros kRepeats{500'000};  ///< a stamp of 20 bits comes again after twice as long

  Pool pool_;
  base::Micros since_;
  Head head_;                         ///< image under way
  std::array<Head, 2> ended_head_{};  ///< the latest that ended, of the camera and of the recogniser
  std::uint32_t bits_ = 0;
  std::uint8_t place_ = Pool::kNone;  ///< kNone: there is no room for the image under way
  std::uint8_t seen_ = 0;
  bool begun_ = false;
  std::array<bool, 2> ended_{};
};

using ImageAssembly = ImageAssemblyOf<false>;

/// For robots none of whose estimators takes images: no memory.
struct NoImages {
  static void power_on() {}
  static void expire(base::Micros, base::Micros, Counters&) {}
  static void discard(Counters&) {}
  [[nodiscard]] static const sensor::ImagePool* pool() { return nullptr; }
};

}  // namespace tetap::bus
