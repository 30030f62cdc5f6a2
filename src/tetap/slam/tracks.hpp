// SPDX-License-Identifier: Apache-2.0
// Tracks of an image's features in fixed memory: where each was seen in the latest kClones images. Identities have 12
// bits and wrap: a track that is absent in one image is a new one when its identity comes again.
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/model/camera.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::slam {

using model::ImageFeature;

struct TrackCounters {
  std::uint32_t no_room = 0;     ///< features of new tracks that found the store full
  std::uint32_t duplicates = 0;  ///< identities that came twice in an image: absent in it
  std::uint32_t left = 0;        ///< long tracks that ended, or lost their oldest sighting, without being used
};

/// kFull sightings fill a track: all images, or fewer where a slot is taken before the tracks are used.
template <int kClones, int kTracks, int kFull = kClones>
class TrackStore {
 public:
  static_assert(kFull >= 3 && kFull <= kClones && kClones <= 16 && kTracks >= 1 && kTracks <= 255);
  static constexpr int kUsed = 2;  ///< tracks that are used in an image, at most

  /// Sightings of a track: `count` images in a row from the slot `first` on, slots being used in turn.
  struct Track {
    std::uint16_t id = 0;
    std::uint8_t first = 0, count = 0;
    bool live = false, goes_on = false, chosen = false;
    std::array<std::array<std::uint16_t, 2>, kClones> seen{};

    [[nodiscard]] int slot(int sighting) const { return (first + sighting) % kClones; }
  };

  explicit TrackStore(int least_sightings = 4) : least_(least_sightings < 3 ? 3 : least_sightings) {}

  void clear() {
    for (Track& track : track_) track = {};
    chosen_ = {};
    chosen_count_ = 0;
  }
  [[nodiscard]] const Track& track(int i) const { return track_[at(i)]; }
  [[nodiscard]] const TrackCounters& counters() const { return count_; }
  [[nodiscard]] int live() const {
    int n = 0;
    for (const Track& track : track_) n += track.live ? 1 : 0;
    return n;
  }

  /// Begins an image: sorts its features by identity and chooses up to kUsed tracks, those that ended before those that
  /// fill the window. The order in which features come has no effect.
  void begin(std::span<ImageFeature> image) {
    sort(image);
    for (std::size_t i = 0; i < image.size(); ++i)
      count_.duplicates += repeated(image, i) && first_of(image, i) ? 1U : 0U;
    for (Track& track : track_) {
      track.goes_on = track.live && find(image, track.id) != nullptr;
      track.chosen = false;
    }
    chosen_count_ = 0;
    choose(false);
    choose(true);
  }
  [[nodiscard]] int chosen_count() const { return chosen_count_; }
  [[nodiscard]] const Track& chosen(int i) const { return track(chosen_[at(i)]); }

  /// Ends the image: its features are sightings of slot `slot`, whose oldest sightings are gone. A chosen track that
  /// goes on begins anew.
  void end(std::span<const ImageFeature> image, int slot) {
    for (Track& track : track_) {
      if (!track.live) continue;
      if (track.chosen) track.count = 0;
      const bool lost = !track.goes_on || track.count == kFull;
      if (lost && track.count >= least_) ++count_.left;
      if (!track.goes_on) {
        track = {};
      } else if (track.count == kFull) {
        track.first = static_cast<std::uint8_t>((track.first + 1) % kClones);
        --track.count;
      }
    }
    for (std::size_t i = 0; i < image.size(); ++i) {
      if (repeated(image, i)) continue;
      Track* const track = place_of(image[i].id);
      if (track == nullptr) {
        ++count_.no_room;
        continue;
      }
      if (track->count == 0) track->first = static_cast<std::uint8_t>(slot);
      track->live = true;
      track->id = image[i].id;
      track->seen[at(slot)] = {image[i].u_quarter_px, image[i].v_quarter_px};
      ++track->count;
    }
  }

  static constexpr auto members(auto& self) {
    return base::members(self.track_, self.chosen_, self.chosen_count_, self.least_, self.count_);
  }

 private:
  static constexpr std::size_t at(int i) { return static_cast<std::size_t>(i); }

  static void sort(std::span<ImageFeature> image) {  // at most 255, by insertion
    for (std::size_t i = 1; i < image.size(); ++i) {
      const ImageFeature one = image[i];
      std::size_t k = i;
      for (; k > 0 && image[k - 1].id > one.id; --k) image[k] = image[k - 1];
      image[k] = one;
    }
  }
  static bool first_of(std::span<const ImageFeature> image, std::size_t i) {
    return i == 0 || image[i - 1].id != image[i].id;
  }
  static bool repeated(std::span<const ImageFeature> image, std::size_t i) {
    return !first_of(image, i) || (i + 1 < image.size() && image[i + 1].id == image[i].id);
  }
  /// By bisection; nothing where the identity is absent or came twice.
  static const ImageFeature* find(std::span<const ImageFeature> image, std::uint16_t id) {
    std::size_t low = 0, high = image.size();
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (image[middle].id < id)
        low = middle + 1;
      else
        high = middle;
    }
    return low < image.size() && image[low].id == id && !repeated(image, low) ? &image[low] : nullptr;
  }
  /// The track of an identity, else a free place, else nothing.
  Track* place_of(std::uint16_t id) {
    Track* free = nullptr;
    for (Track& track : track_) {
      if (track.live && track.id == id) return &track;
      if (!track.live && free == nullptr) free = &track;
    }
    return free;
  }
  void choose(bool going_on) {
    for (int i = 0; i < kTracks && chosen_count_ < kUsed; ++i) {
      Track& track = track_[at(i)];
      if (!track.live || track.goes_on != going_on || track.count < (going_on ? kFull : least_)) continue;
      track.chosen = true;
      chosen_[at(chosen_count_++)] = i;
    }
  }

  std::array<Track, static_cast<std::size_t>(kTracks)> track_{};
  std::array<std::int32_t, kUsed> chosen_{};
  std::int32_t chosen_count_ = 0, least_;
  TrackCounters count_;
};

}  // namespace tetap::slam
