// SPDX-License-Identifier: Apache-2.0
#include "tetap/estimators/mapping/graph_mapper.hpp"

#include "tetap/base/reinitialise.hpp"
#include "tetap/estimators/mapping/map_pose.hpp"
#include "tetap/estimators/mapping/pose_covariance.hpp"
#include "tetap/estimators/planar/window_motion.hpp"

namespace tetap::estimators {

namespace {

template <class Scalar>
Scalar trace_of(const filter::Symmetric<Scalar, 3>& c) {
  return c(0, 0) + c(1, 1) + c(2, 2);
}

constexpr sensor::Verdict word_of(slam::ClosureFate fate) {
  using slam::ClosureFate, sensor::Verdict;
  switch (fate) {
    case ClosureFate::kTaken:
    case ClosureFate::kNothingNew:
      return Verdict::kAccepted;
    case ClosureFate::kInvalid:
      return Verdict::kSingular;
    case ClosureFate::kUnknown:
      return Verdict::kUnknownLandmark;
    case ClosureFate::kContradicted:
      return Verdict::kRejected;
    case ClosureFate::kNoRoom:
      break;
  }
  return Verdict::kNoRoom;
}

}  // namespace

template <class Graph>
void GraphMapper<Graph>::restart(base::Micros t, const Context& ctx) {
  base::reinitialise(*this);
  now_ = before_ = stepped_ = last_closure_ = t;
  motion_.start(t, {}, 0.0F, 0.0F);
  const MapStart start(ctx.parameters.start);
  place(t, start.pose, start.p);
  present_ = motion_;
}

template <class Graph>
void GraphMapper<Graph>::place(base::Micros t, const model::PlanarPose& pose, const filter::Symmetric<float, 3>& p) {
  // The robot is a displacement d beyond the latest step: the step is at pose - d.
  const slam::Displacement<Scalar> d = displaced(motion_).mean;
  Pose step = graph_pose<Scalar>(pose);
  step.yaw = step.yaw - d.yaw;
  const auto turn = step.yaw.direction();
  step.x = step.x.plus(-(turn.cos * d.x_m - turn.sin * d.y_m));
  step.y = step.y.plus(-(turn.sin * d.x_m + turn.cos * d.y_m));
  graph_.set_pose(step);
  placed_ = cast<Scalar>(p);
  placed_pose_ = step;
  since_ = {};
  graph_then_ = graph_.covariance();
  placed_at_ = t;
  motion_.relocate(motion_.filter.x, 0.0F, 0.0F);
}

template <class Graph>
void GraphMapper<Graph>::set_pose(base::Micros t, const SetPose& given, const Context& ctx) {
  graph_.cancel_job();
  motion_.propagate(t, ctx.parameters);
  model::PlanarPose pose = given.pose;
  if (!(given.sigma_yaw_rad < 3.14F)) pose.yaw_rad = planar_pose(graph_.pose().plus(displaced(motion_).mean)).yaw_rad;
  pose.yaw_rad = base::wrap_angle(pose.yaw_rad);
  const filter::Symmetric<float, 3> p = covariance_of_pose(given.sigma_position_m, given.sigma_yaw_rad);
  place(t, pose, p);
  digest_.update(pose.x.um(), pose.y.um(), pose.yaw_rad, p(0, 0), p(2, 2));
  present_ = motion_;
}

template <class Graph>
void GraphMapper<Graph>::reset_own_map() {
  const Pose step = graph_.pose();
  const filter::Symmetric<Scalar, 3> p = covariance();
  graph_.reset();
  graph_.set_pose(step);
  placed_ = p;
  placed_pose_ = step;
  since_ = graph_then_ = {};
  placed_at_ = now_;
  announced_ = 0;
  digest_.update(kMapReset);
}

template <class Graph>
void GraphMapper<Graph>::advance(base::Micros t, const Context& ctx, const sensor::Window& window) {
  advance(t);
  present_ = motion_;
  move_through(window, present_, ctx.parameters);
}

template <class Graph>
void GraphMapper<Graph>::advance(base::Micros t) {
  before_ = now_;
  now_ = t;
  motion_.advance(t);
  digest_.scan(elements(), kScanned, [this](std::size_t i, auto& sink) { this->hash_element(i, sink); });
}

template <class Graph>
void GraphMapper<Graph>::work(std::uint32_t units, const Context& ctx) {
  static_cast<void>(ctx);
  graph_.work(static_cast<int>(units));
  note_refused();
  const std::uint32_t jobs = graph_.counters().jobs;
  if (jobs == jobs_) return;
  jobs_ = jobs;
  digest_.update(jobs, static_cast<std::uint32_t>(graph_.graph().status()), static_cast<float>(graph_.graph().chi2()));
}

template <class Graph>
bool GraphMapper<Graph>::keyframe_due(base::Micros stamp, const Context& ctx) const {
  const param::MappingParameters& m = ctx.parameters.mapping;
  const model::PlanarPose& d = motion_.filter.x;
  const float x_m = d.x.minus({}), y_m = d.y.minus({});
  const bool far = x_m * x_m + y_m * y_m >= m.keyframe_distance_m * m.keyframe_distance_m;
  const bool turned = d.yaw_rad >= m.keyframe_turn_rad || d.yaw_rad <= -m.keyframe_turn_rad;
  const bool late =
      m.keyframe_time_ms > 0 && stamp - stepped_ >= base::Micros{std::int64_t{1'000} * m.keyframe_time_ms};
  return far || turned || late;
}

template <class Graph>
typename GraphMapper<Graph>::Displaced GraphMapper<Graph>::displaced(const DeadReckoning& motion) {
  const model::PlanarPose& d = motion.filter.x;
  return {.mean = {static_cast<Scalar>(d.x.minus({})), static_cast<Scalar>(d.y.minus({})),
                   slam::Heading<Scalar>::from_radians(static_cast<Scalar>(d.yaw_rad))},
          .covariance = cast<Scalar>(covariance_of(motion.filter))};
}

template <class Graph>
void GraphMapper<Graph>::make_keyframe(base::Micros stamp) {
  static_cast<void>(append(displaced(motion_), stamp));
  motion_.relocate({}, 0.0F, 0.0F);
}

template <class Graph>
bool GraphMapper<Graph>::append(const Displaced& step, base::Micros stamp) {
  const Pose from = graph_.pose();
  if (!graph_.odometry(step)) return false;
  since_ = Graph::carried(since_, from, step);
  stepped_ = stamp;
  announcement_[next_announcement_] = {.id = graph_.step(), .stamp = stamp, .tick = now_};
  next_announcement_ = (next_announcement_ + 1) % kAnnounced;
  if (announced_ < kAnnounced) ++announced_;
  digest_.update(graph_.step(), static_cast<float>(step.mean.x_m), static_cast<float>(step.mean.y_m),
                 static_cast<float>(step.mean.yaw.radians()), static_cast<float>(step.covariance(0, 0)),
                 static_cast<float>(step.covariance(1, 1)), static_cast<float>(step.covariance(2, 2)));
  return true;
}

template <class Graph>
typename GraphMapper<Graph>::Displaced GraphMapper<Graph>::displaced(const sensor::LoopClosure& z) {
  using Z = sensor::LoopClosure;
  const auto number = [](std::int32_t steps, std::int64_t per_unit) {
    return static_cast<Scalar>(steps) / static_cast<Scalar>(per_unit);
  };
  const std::array<Scalar, 3> sigma{number(Z::unpack(z.sigmas, 0), Z::kStepsPerMetre),
                                    number(Z::unpack(z.sigmas, 1), Z::kStepsPerMetre),
                                    number(Z::unpack(z.sigmas, 2), Z::kSigmaStepsPerRadian)};
  const auto shared = [&](int i, std::size_t a, std::size_t b) {
    return number(Z::unpack(z.correlations, i), Z::kCorrelationSteps) * sigma[a] * sigma[b];
  };
  Displaced d;
  d.mean = {number(z.x, Z::kStepsPerMetre), number(z.y, Z::kStepsPerMetre),
            slam::Heading<Scalar>::from_radians(number(z.yaw, Z::kStepsPerRadian))};
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    d.covariance(i, i) = sigma[k] * sigma[k];
  }
  d.covariance(0, 1) = shared(0, 0, 1);
  d.covariance(0, 2) = shared(1, 0, 2);
  d.covariance(1, 2) = shared(2, 1, 2);
  return d;
}

template <class Graph>
bool GraphMapper<Graph>::step(const Displaced& displacement, base::Micros stamp) {
  if (!append(displacement, stamp)) return false;
  motion_.relocate({}, 0.0F, 0.0F);
  return true;
}

template <class Graph>
Innovation GraphMapper<Graph>::odometry(const sensor::LoopClosure& closure, base::Micros stamp) {
  if (!step(displaced(closure), stamp)) return {.verdict = sensor::Verdict::kSingular, .failed = sensor::Check::kValue};
  return input_record(sensor::Verdict::kAccepted);
}

template <class Graph>
Innovation GraphMapper<Graph>::fuse(const sensor::LoopClosure& closure, base::Micros stamp, const Context& ctx) {
  const bool next = closure.to == ((graph_.step() + 1) & (kIds - 1)) && closure.from == (graph_.step() & (kIds - 1));
  if (ctx.parameters.mapping.keyframes != kByWheels && next) return odometry(closure, stamp);
  const slam::ClosureRecord<Scalar> found =
      graph_.closure(step_of(closure.from), step_of(closure.to), displaced(closure));
  note_refused();
  const auto squared = static_cast<float>(found.contradiction);
  const bool compared = squared >= 0.0F;
  const sensor::Verdict verdict = word_of(found.fate);
  if (verdict == sensor::Verdict::kAccepted) last_closure_ = stamp;
  digest_.update(static_cast<std::uint32_t>(closure.from) << 16 | closure.to, static_cast<std::uint32_t>(verdict),
                 squared);
  return {.verdict = verdict,
          .dof = compared ? std::uint8_t{3} : std::uint8_t{0},
          .nis = compared ? squared : 0.0F,
          .gate = slam::KeyframeOptions{}.contradiction,
          .failed = verdict == sensor::Verdict::kRejected   ? sensor::Check::kGate
                    : verdict == sensor::Verdict::kSingular ? sensor::Check::kValue
                                                            : sensor::Check::kNone};
}

template <class Graph>
void GraphMapper<Graph>::note_refused() {
  const std::uint32_t refused = graph_.counters().refused;
  if (refused != refused_) last_refused_ = now_;
  refused_ = refused;
}

template <class Graph>
filter::Symmetric<typename GraphMapper<Graph>::Scalar, 3> GraphMapper<Graph>::covariance() const {
  const Pose step = graph_.pose();
  const Scalar x = step.x.minus(placed_pose_.x), y = step.y.minus(placed_pose_.y);
  const auto moved = slam::detail::turned(placed_, Scalar{1}, Scalar{0}, -y, x, Scalar{1}, {});
  // Two bounds of the error since: odometry alone, and the graph's errors of then and now as independent.
  const auto by_graph = sum_of(graph_.covariance(), graph_then_);
  return sum_of(moved, trace_of(since_) < trace_of(by_graph) ? since_ : by_graph);
}

template <class Graph>
Estimate GraphMapper<Graph>::estimate(const Context& ctx) const {
  Estimate estimate = present_.estimate(ctx.parameters);
  const model::PlanarPose ahead = estimate.pose;
  const Displaced d{.mean = {static_cast<Scalar>(ahead.x.minus({})), static_cast<Scalar>(ahead.y.minus({})),
                             slam::Heading<Scalar>::from_radians(static_cast<Scalar>(ahead.yaw_rad))},
                    .covariance = cast<Scalar>(estimate.p)};
  const Pose step = graph_.pose();
  estimate.pose = planar_pose(step.plus(d.mean));
  estimate.p = cast<float>(Graph::carried(covariance(), step, d));
  estimate.heading_valid = !(estimate.p(2, 2) > 1.0F);
  return estimate;
}

template <class Graph>
sensor::Mode GraphMapper<Graph>::mode(const Context&) const {
  const slam::GraphStatus status = graph_.graph().status();
  if (status != slam::GraphStatus::kNone && status != slam::GraphStatus::kConverged) return sensor::Mode::kDegraded;
  return now_ - last_closure_ > base::Micros{5'000'000} ? sensor::Mode::kDeadReckoning : sensor::Mode::kNominal;
}

template <class Graph>
MapReport GraphMapper<Graph>::own_map() const {
  const slam::KeyframeCounters& count = graph_.counters();
  return {.size = static_cast<std::uint32_t>(graph_.graph().poses()),
          .refused = count.refused,
          .ambiguous = count.contradicted,
          .work_left = graph_.optimising() ? static_cast<std::uint32_t>(graph_.graph().rows_left()) : 0U,
          .jobs_aborted = count.jobs_aborted};
}

template <class Graph>
GraphReport GraphMapper<Graph>::graph() const {
  const auto& graph = graph_.graph();
  const auto end = [](slam::GraphStatus status) { return static_cast<GraphEnd>(status); };
  static_assert(static_cast<int>(slam::GraphStatus::kNoRoom) == static_cast<int>(GraphEnd::kNoRoom) &&
                static_cast<int>(slam::GraphStatus::kConverged) == static_cast<int>(GraphEnd::kConverged));
  return {.chi2 = static_cast<double>(graph.chi2()),
          .end = end(graph.status()),
          .closures = static_cast<std::uint32_t>(graph.closures()),
          .jobs = graph_.counters().jobs};
}

template <class Graph>
GraphKeyframe GraphMapper<Graph>::own_keyframe(std::size_t i) const {
  const int k = static_cast<int>(i);
  return {.id = graph_.keyframe_step(k), .pose = planar_pose(graph_.keyframe(k))};
}

template class GraphMapper<Graph4096>;
template class GraphMapper<Graph256>;
template class GraphMapper<Graph128>;
template class GraphMapper<Graph192>;

}  // namespace tetap::estimators
