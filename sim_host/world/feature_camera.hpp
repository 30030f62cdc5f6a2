// SPDX-License-Identifier: Apache-2.0
// A pinhole camera that looks at the points of the course, and a front end that follows them from image to image.
// Draws belong to a point and an image, so what is seen beside it has no effect on them.
#pragma once

#include "sim_host/world/chance.hpp"
#include "sim_host/world/faults.hpp"
#include "sim_host/world/measurement.hpp"
#include "sim_host/world/motion.hpp"
#include "sim_host/world/numbers.hpp"
#include "sim_host/world/surroundings.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tetap::sim {

/// Column and row.
struct Pixel {
  double u_px = 0, v_px = 0;
};

class FeatureCamera {
 public:
  struct Image {
    std::vector<ImageFeature> features;
    std::vector<ImageFeature> recognised;  ///< tracks are ids of landmarks
    bool tracking = false;
    bool torn = false;  ///< one of its frames is lost on the way
  };
  /// `surroundings` outlives it.
  FeatureCamera(const FeatureCameraNumbers& parameters, const Surroundings& surroundings, std::uint64_t seed);

  /// The next image; empty: it is lost.
  [[nodiscard]] std::optional<Image> sample(const Truth& truth, base::Micros now, const Faults& faults);
  /// Where an ideal pinhole camera sees a point; empty: behind it, too near, too far, or beside the image.
  [[nodiscard]] std::optional<Pixel> project(const Vector3& point_m, const Truth& truth) const;

 private:
  /// A point in sight: of the map, of the moving body, or of a person.
  struct Candidate {
    std::uint32_t key;
    Pixel at;
  };
  struct Track {
    std::uint32_t key;
    std::uint16_t id;
    base::Micros until;
  };
  struct Eye {
    Vector3 at_m;
    Matrix3 to_camera;
  };
  [[nodiscard]] Eye eye_at(const Truth& truth) const;
  [[nodiscard]] std::optional<Pixel> project(const Vector3& point_m, const Eye& eye) const;
  [[nodiscard]] Chance chance(Stream stream, std::uint32_t key) const;
  void look(const Truth& truth, base::Micros now, bool lorry);
  void look_at_people(const Eye& eye, base::Micros now);
  void look_at_body(const Truth& truth, base::Micros now, double ahead_m);
  void keep_tracks(base::Micros now);
  /// Tracks of the moving body, or of the rest: no more than so many, then as many as there are points in sight.
  void limit_tracks(bool body, std::size_t most);
  void begin_tracks(base::Micros now, bool body, std::size_t most);
  [[nodiscard]] std::optional<ImageFeature> feature(const Candidate& seen, std::uint16_t id, bool recognised) const;
  void recognise(const Truth& truth, base::Micros now, Image& image) const;
  void spoil(Image& image, base::Micros now, const Faults& faults) const;

  FeatureCameraNumbers parameters_;
  const Surroundings* surroundings_;
  std::uint64_t seed_;
  Matrix3 body_to_camera_;
  std::vector<Candidate> seen_;  ///< in this image, keys ascending
  std::vector<Track> tracks_;
  std::uint32_t image_ = 0;
  std::uint16_t next_id_ = 0;
};

}  // namespace tetap::sim
