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

/// Whoever fills it knows which places the window still needs.
class ImagePool {
 public:
  static constexpr std::size_t kImages = 4, kFeatures = 40;
  static constexpr std::uint8_t kNone = 0xFF;

  void clear(std::uint8_t place) { count_[place] = 0; }
  /// False: the image is full.
  [[nodiscard]] bool add(std::uint8_t place, const model::ImageFeature& feature) {
    if (count_[place] == kFeatures) return false;
    features_[place][count_[place]++] = feature;
    return true;
  }
  /// In the order in which they came.
  [[nodiscard]] std::span<const model::ImageFeature> features(std::uint8_t place) const {
    return {features_[place].data(), count_[place]};
  }

 private:
  std::array<std::array<model::ImageFeature, kFeatures>, kImages> features_{};
  std::array<std::uint8_t, kImages> count_{};
};

}  // namespace tetap::sensor
