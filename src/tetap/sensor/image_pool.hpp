// SPDX-License-Identifier: Apache-2.0
// Features of the images that the fusion window holds. A sample of the window names a place here: forty features of
// ten images a second would fill the window itself.
#pragma once

#include "tetap/model/camera.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace tetap::sensor {

/// Most features of an image.
inline constexpr std::size_t kImageFeatures = 40;

/// A pool as its readers see it.
struct ImagesInWindow {
  const std::array<model::ImageFeature, kImageFeatures>* images = nullptr;  ///< null: no estimator takes any
  const std::uint8_t* count = nullptr;

  /// In the order in which they came.
  [[nodiscard]] std::span<const model::ImageFeature> features(std::uint8_t place) const {
    return {images[place].data(), count[place]};
  }
};

/// Whoever fills it knows which places the window still needs.
template <std::size_t kImages_>
class ImagePoolOf {
 public:
  static constexpr std::size_t kImages = kImages_, kFeatures = kImageFeatures;
  static constexpr std::uint8_t kNone = 0xFF;

  void clear(std::uint8_t place) { count_[place] = 0; }
  /// False: the image is full.
  [[nodiscard]] bool add(std::uint8_t place, const model::ImageFeature& feature) {
    if (count_[place] == kFeatures) return false;
    features_[place][count_[place]++] = feature;
    return true;
  }
  [[nodiscard]] ImagesInWindow view() const { return {features_.data(), count_.data()}; }
  /// In the order in which they came.
  [[nodiscard]] std::span<const model::ImageFeature> features(std::uint8_t place) const {
    return view().features(place);
  }

 private:
  std::array<std::array<model::ImageFeature, kFeatures>, kImages> features_{};
  std::array<std::uint8_t, kImages> count_{};
};
using ImagePool = ImagePoolOf<4>;

}  // namespace tetap::sensor
