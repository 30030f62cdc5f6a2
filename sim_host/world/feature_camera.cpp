// SPDX-License-Identifier: Apache-2.0
#include "sim_host/world/feature_camera.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tetap::sim {
namespace {

// Keys of what is followed: points of the map from 0, then those of people, then those of the moving body.
constexpr std::uint32_t kPeopleKeys = 3'072, kBodyKeys = 3'584, kKeys = 4'096;
constexpr int kPerPerson = 10;
constexpr int kBodyRows = 8;
constexpr std::uint32_t kBodyColumns = (kKeys - kBodyKeys) / kBodyRows;
constexpr double kBodySpacing_m = 0.35, kBodyLow_m = 0.1;
constexpr std::uint16_t kIds = 4'096;
constexpr std::uint32_t kImages = 1U << 20;  // after so many, draws come again

bool on_body(std::uint32_t key) { return key >= kBodyKeys; }

}  // namespace

FeatureCamera::FeatureCamera(const FeatureCameraNumbers& parameters, const Surroundings& surroundings,
                             std::uint64_t seed)
    : parameters_{parameters}, surroundings_{&surroundings}, seed_{seed} {
  Chance mount{seed, Stream::kFeatureMount};
  const double roll = mount.normal(parameters.mount_sigma_rad);
  const double pitch = mount.normal(parameters.mount_sigma_rad);
  const double yaw = mount.normal(parameters.mount_sigma_rad);
  body_to_camera_ = parameters.mounting_bc.transposed() * rotation({roll, pitch, yaw}).transposed();
}

FeatureCamera::Eye FeatureCamera::eye_at(const Truth& truth) const {
  const Matrix3 to_n = rotation({truth.roll_rad, truth.pitch_rad, truth.yaw_rad});
  return {.at_m = Vector3{truth.x_m, truth.y_m, truth.z_m} +
                  to_n * Vector3{parameters_.x_b_m, parameters_.y_b_m, parameters_.z_b_m},
          .to_camera = body_to_camera_ * to_n.transposed()};
}

std::optional<Pixel> FeatureCamera::project(const Vector3& point_m, const Truth& truth) const {
  return project(point_m, eye_at(truth));
}

std::optional<Pixel> FeatureCamera::project(const Vector3& point_m, const Eye& eye) const {
  const Vector3 p = eye.to_camera * (point_m - eye.at_m);
  if (p[2] < parameters_.near_m || p[2] > parameters_.far_m) return std::nullopt;
  const Pixel at{parameters_.cu_px + parameters_.fu_px * p[0] / p[2],
                 parameters_.cv_px + parameters_.fv_px * p[1] / p[2]};
  if (at.u_px < 0 || at.u_px > parameters_.width_px - 1 || at.v_px < 0 || at.v_px > parameters_.height_px - 1)
    return std::nullopt;
  return at;
}

Chance FeatureCamera::chance(Stream stream, std::uint32_t key) const {
  return {seed_, stream, image_ % kImages * kKeys + key};
}

/// Points of the map and of people in sight; nothing of them behind a lorry.
void FeatureCamera::look(const Truth& truth, base::Micros now, bool lorry) {
  seen_.clear();
  if (lorry) return;
  const Eye eye = eye_at(truth);
  const auto points = surroundings_->points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (parameters_.landmarks_only && points[i].landmark == 0) break;
    const auto at = project(points[i].at_m, eye);
    if (at && surroundings_->sees(eye.at_m, points[i].at_m, now)) seen_.push_back({static_cast<std::uint32_t>(i), *at});
  }
  if (!parameters_.landmarks_only) look_at_people(eye, now);
}

/// Points on the front and on the back of each, 1 cm before the skin.
void FeatureCamera::look_at_people(const Eye& eye, base::Micros now) {
  for (std::size_t person = 0; person < surroundings_->people(); ++person) {
    const Vector3 foot = surroundings_->person_at(person, now);
    for (int k = 0; k < kPerPerson; ++k) {
      const Direction d = direction(2.4 * k);  // the golden angle spreads them
      const auto key = kPeopleKeys + static_cast<std::uint32_t>(person) * kPerPerson + static_cast<std::uint32_t>(k);
      if (key >= kBodyKeys) return;
      const Vector3 point = foot + Vector3{0.21 * d.cos, 0.21 * d.sin, 0.3 + 0.13 * k};
      const auto at = project(point, eye);
      if (at && surroundings_->sees(eye.at_m, point, now)) seen_.push_back({key, *at});
    }
  }
}

/// A plane that is carried ahead of the vehicle, upright and across, with a grid of points that moves along it to the
/// right.
void FeatureCamera::look_at_body(const Truth& truth, base::Micros now, double ahead_m) {
  const Direction d = direction(truth.yaw_rad);
  const Eye eye = eye_at(truth);
  const double way_m = FaultNumbers::kLorry_mps * static_cast<double>(now.us) * 1e-6;
  const double round_m = kBodySpacing_m * kBodyColumns;
  for (std::uint32_t column = 0; column < kBodyColumns; ++column)
    for (int row = 0; row < kBodyRows; ++row) {
      const std::uint32_t key = kBodyKeys + column * kBodyRows + static_cast<std::uint32_t>(row);
      Chance texture{0, Stream::kMapPoints, key};
      const double on_m = way_m + kBodySpacing_m * (column + 0.8 * texture.uniform());
      const double right_m = on_m - round_m * sim::floor(on_m / round_m) - 0.5 * round_m;
      const Vector3 point{truth.x_m + ahead_m * d.cos + right_m * d.sin, truth.y_m + ahead_m * d.sin - right_m * d.cos,
                          truth.z_m + kBodyLow_m + kBodySpacing_m * (row + 0.8 * texture.uniform())};
      if (const auto at = project(point, eye)) seen_.push_back({key, *at});
    }
}

/// Ends those that are old, lost or out of sight.
void FeatureCamera::keep_tracks(base::Micros now) {
  std::erase_if(tracks_, [&](const Track& track) {
    const auto at = std::lower_bound(seen_.begin(), seen_.end(), track.key,
                                     [](const Candidate& c, std::uint32_t key) { return c.key < key; });
    if (at == seen_.end() || at->key != track.key || now >= track.until) return true;
    return chance(Stream::kFeatureTrack, track.key).happens(parameters_.loss_probability);
  });
}

void FeatureCamera::limit_tracks(bool body, std::size_t most) {
  std::size_t count = 0;
  std::erase_if(tracks_, [&](const Track& track) { return on_body(track.key) == body && ++count > most; });
}

/// Points in sight that nobody follows, the draw's favourites first.
void FeatureCamera::begin_tracks(base::Micros now, bool body, std::size_t most) {
  const auto count = [&] {
    return static_cast<std::size_t>(
        std::count_if(tracks_.begin(), tracks_.end(), [&](const Track& t) { return on_body(t.key) == body; }));
  };
  if (count() >= most) return;
  std::vector<std::pair<double, std::uint32_t>> wanted;
  for (const Candidate& c : seen_) {
    const bool followed =
        std::any_of(tracks_.begin(), tracks_.end(), [&c](const Track& track) { return track.key == c.key; });
    if (on_body(c.key) != body || followed) continue;
    Chance draw = chance(Stream::kFeatureTrack, c.key);
    (void)draw.uniform();  // that of its loss
    wanted.emplace_back(draw.uniform(), c.key);
  }
  std::sort(wanted.begin(), wanted.end());
  wanted.resize(std::min(wanted.size(), most - count()));
  for (const auto& [preference, key] : wanted) {
    Chance draw = chance(Stream::kFeatureTrack, key);
    (void)draw.uniform(), (void)draw.uniform();
    const double life_s = draw.uniform(parameters_.life_min_s, parameters_.life_max_s);
    tracks_.push_back({key, next_id_, now + base::Micros{static_cast<std::int64_t>(life_s * 1e6)}});
    next_id_ = static_cast<std::uint16_t>((next_id_ + 1) % kIds);
  }
}

/// With noise, in the steps of the bus; empty: noise has carried it out of the image.
std::optional<ImageFeature> FeatureCamera::feature(const Candidate& seen, std::uint16_t id, bool recognised) const {
  Chance draw = chance(Stream::kFeatureNoise, recognised ? kKeys - 1 - seen.key : seen.key);
  const double noise_u = draw.normal(parameters_.noise_px);
  const double noise_v = draw.normal(parameters_.noise_px);
  const bool wrong = draw.happens(parameters_.wrong_probability);
  const double wrong_u = draw.uniform(-parameters_.wrong_px, parameters_.wrong_px);
  const double wrong_v = draw.uniform(-parameters_.wrong_px, parameters_.wrong_px);
  const auto quarters = [](double px) { return sim::floor(px * ImageFeature::kStepsPerPixel + 0.5); };
  const double u = quarters(seen.at.u_px + noise_u + (wrong && !recognised ? wrong_u : 0));
  const double v = quarters(seen.at.v_px + noise_v + (wrong && !recognised ? wrong_v : 0));
  if (u < 0 || u > ImageFeature::kStepsPerPixel * (parameters_.width_px - 1) || v < 0 ||
      v > ImageFeature::kStepsPerPixel * (parameters_.height_px - 1))
    return std::nullopt;
  return ImageFeature{id, static_cast<std::uint16_t>(u), static_cast<std::uint16_t>(v)};
}

/// Landmarks come first among the points.
void FeatureCamera::recognise(const Truth& truth, base::Micros now, Image& image) const {
  const Eye eye = eye_at(truth);
  const auto points = surroundings_->points();
  std::size_t landmarks = 0;
  while (landmarks < points.size() && points[landmarks].landmark != 0) ++landmarks;
  for (std::size_t i = 0; i < landmarks; ++i) {
    const Vector3 way = points[i].at_m - eye.at_m;
    if (way[0] * way[0] + way[1] * way[1] + way[2] * way[2] > parameters_.recognise_m * parameters_.recognise_m)
      continue;
    const auto at = project(points[i].at_m, eye);
    if (!at || !surroundings_->sees(eye.at_m, points[i].at_m, now)) continue;
    Chance draw = chance(Stream::kFeatureTrack, kKeys - 1 - static_cast<std::uint32_t>(i));
    const bool missed = draw.happens(parameters_.miss_probability);
    const bool mistaken = draw.happens(parameters_.wrong_id_probability);
    const auto other = static_cast<std::size_t>(draw.uniform() * static_cast<double>(landmarks));
    const std::uint8_t id = points[mistaken ? other : i].landmark;
    const auto found = feature({static_cast<std::uint32_t>(i), *at}, id, true);
    if (found && !missed) image.recognised.push_back(*found);
  }
}

/// Faults of the image, after it was seen.
void FeatureCamera::spoil(Image& image, base::Micros now, const Faults& faults) const {
  const bool mirrored = faults.active(Fault::kImagesMirrored, now), turned = faults.active(Fault::kImagesTurned, now);
  const bool longer = faults.active(Fault::kFocalLength, now);
  if (mirrored || turned || longer)
    for (auto* list : {&image.features, &image.recognised})
      std::erase_if(*list, [&](ImageFeature& f) {
        double u = f.u / static_cast<double>(ImageFeature::kStepsPerPixel) - parameters_.cu_px;
        double v = f.v / static_cast<double>(ImageFeature::kStepsPerPixel) - parameters_.cv_px;
        if (mirrored) u = -u;
        if (turned) u = -std::exchange(v, u);
        if (longer) u *= FaultNumbers::kFocalScale, v *= FaultNumbers::kFocalScale;
        u += parameters_.cu_px, v += parameters_.cv_px;
        if (u < 0 || u > parameters_.width_px - 1 || v < 0 || v > parameters_.height_px - 1) return true;
        f.u = static_cast<std::uint16_t>(sim::floor(u * ImageFeature::kStepsPerPixel + 0.5));
        f.v = static_cast<std::uint16_t>(sim::floor(v * ImageFeature::kStepsPerPixel + 0.5));
        return false;
      });
  if (faults.active(Fault::kTracksSwapped, now) && image_ % 2 == 0)
    for (std::size_t i = 1; i < image.features.size(); i += 2)
      std::swap(image.features[i - 1].track, image.features[i].track);
}

std::optional<FeatureCamera::Image> FeatureCamera::sample(const Truth& truth, base::Micros now, const Faults& faults) {
  const bool lorry = faults.active(Fault::kLorry, now), moving = faults.active(Fault::kMovingFeatures, now);
  look(truth, now, lorry);
  if (lorry || moving) look_at_body(truth, now, lorry ? FaultNumbers::kLorry_m : FaultNumbers::kMovingAhead_m);
  keep_tracks(now);
  const auto all = static_cast<std::size_t>(parameters_.features);
  const std::size_t body =
      lorry    ? all
      : moving ? static_cast<std::size_t>(std::lround(FaultNumbers::kMovingShare * parameters_.features))
               : 0;
  limit_tracks(false, all - body);
  begin_tracks(now, true, body);
  begin_tracks(now, false, all - body);

  Image image{.features = {}, .recognised = {}, .tracking = !tracks_.empty()};
  for (const Track& track : tracks_) {
    const auto at = std::lower_bound(seen_.begin(), seen_.end(), track.key,
                                     [](const Candidate& c, std::uint32_t key) { return c.key < key; });
    if (const auto found = feature(*at, track.id, false)) image.features.push_back(*found);
  }
  if (parameters_.recognise && !lorry) recognise(truth, now, image);
  spoil(image, now, faults);
  const bool fails = faults.active(Fault::kImagesLost, now);
  const std::uint32_t number = image_++;
  if (fails && number % 2 == 0) return std::nullopt;
  image.torn = fails && number % 4 == 1;
  return image;
}

}  // namespace tetap::sim
