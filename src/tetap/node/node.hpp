// SPDX-License-Identifier: Apache-2.0
// The firmware without board and clock: frames and ticks in, frames out. The same sequence of on_frame() and tick()
// calls gives the same bits on every machine; everything that follows from real time stays outside (Pacer, LoopHealth).
#pragma once

#include "tetap/base/members.hpp"
#include "tetap/base/state_hash.hpp"
#include "tetap/base/state_words.hpp"
#include "tetap/bus/closure_assembly.hpp"
#include "tetap/bus/decoder.hpp"
#include "tetap/bus/image_assembly.hpp"
#include "tetap/bus/input_crc.hpp"
#include "tetap/bus/publisher.hpp"
#include "tetap/bus/relative_pose_assembly.hpp"
#include "tetap/bus/scan_assembly.hpp"
#include "tetap/bus/stamp_wraps.hpp"
#include "tetap/node/bus_parameters.hpp"
#include "tetap/node/bus_protection.hpp"
#include "tetap/node/fusion_window.hpp"
#include "tetap/node/landmarks.hpp"
#include "tetap/node/map_origin.hpp"
#include "tetap/node/without_bus.hpp"
#include "tetap/sensor/calibration.hpp"
#include "tetap/sensor/plausibility.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>

namespace tetap::node {

template <class Estimators, std::size_t TimelineCapacity = Estimators::kSamples>
class Node {
 public:
  Node(const param::Parameters& parameters, const bus::Version& version)
      : parameter_commands_(parameters),
        parameters_(parameter_commands_.active(parameters)),
        protection_(parameters_),
        publisher_(parameters_, version) {
    power_on(base::Micros{});
  }

  /// As after power-on, with the given time: what a Begin frame asks for.
  void power_on(base::Micros t);

  /// An input frame of this node's block (sync frames excepted).
  void on_frame(const base::CanFrame& frame);

  /// Consumes what was true until t, brings every estimator there and sends the epoch's frames.
  template <class Send>
  void tick(base::Micros t, const bus::LoopHealth& loop, Send&& send);

  template <class Send>
  void send_version(Send&& send) {
    publisher_.send_version(send);
  }

  /// Whether a tag vouches for this sync frame.
  [[nodiscard]] bool admits_sync(const base::CanFrame& frame) { return protection_.admits_sync(frame, counters_); }

  /// Whether an estimator makes a map of its own, which a command resets.
  static constexpr bool kMakesMap = Estimators::kMakesMap;
  /// Whether an estimator takes displacements between keyframes.
  static constexpr bool kTakesClosures = Estimators::template kTakes<sensor::LoopClosure>;
  /// Whether an estimator takes scans, and a camera's features.
  static constexpr bool kTakesScans = Estimators::template kTakes<sensor::PlanarScan>;
  static constexpr bool kTakesImages = Estimators::template kTakes<sensor::CameraImage>;
  /// Whether an estimator takes displacements between stamps.
  static constexpr bool kTakesRelatives = Estimators::template kTakes<sensor::RelativePose>;
  /// Whether a frame behind the map's outputs is an input of this robot.
  [[nodiscard]] static constexpr bool takes_map_input(std::uint8_t offset) {
    return (kTakesClosures && bus::ClosureAssembly::takes(offset)) ||
           (kTakesScans && bus::ScanAssembly::takes(offset)) || (kTakesImages && bus::ImageAssembly::takes(offset)) ||
           (kTakesRelatives && bus::RelativePoseAssembly::takes(offset)) || BusParameters<Estimators>::takes(offset);
  }
  /// Called by the inbox.
  void sample(const sensor::Sample& sample) {
    protection_.sample(sample, now_, counters_, [this](const sensor::Sample& vouched) { take(vouched); });
  }
  /// Images that are to be used yet, for whoever fills their pool.
  template <class F>
  void each_image(F&& f) const {
    const auto image = [&f](const sensor::Sample& sample) {
      if (sample.sensor == sensor::Sensor::kFeature) f(sample.payload.image);
    };
    window_.each_sample(image);
    protection_.each_waiting(image);
  }
  void map_entry(const estimators::MapEntry& entry) { landmarks_.add(entry, counters_); }
  /// Start pose; of two within an epoch the one with the later counter stands, whichever came first.
  void set_pose(const estimators::SetPose& pose) {
    if (pending_pose_ && ((pose.counter - pending_pose_->counter) & 0x0F) >= 8) return;
    const std::uint8_t waited = pending_pose_ ? pending_pose_->waited : std::uint8_t{0};
    pending_pose_ = pose;
    pending_pose_->waited = waited;
  }
  void reset(bus::ResetWhat what) {
    if (what == bus::ResetWhat::kWiredOff || what == bus::ResetWhat::kWiredOn)
      return switch_wired(what == bus::ResetWhat::kWiredOff);
    pending_reset_[static_cast<std::size_t>(what)] = 1;
  }

  /// A command has switched the wired sensors off.
  [[nodiscard]] bool wired_off() const { return wired_off_; }
  /// Once for a command that asks for a snapshot.
  [[nodiscard]] bool take_snapshot_request() { return take(bus::ResetWhat::kSnapshot); }
  [[nodiscard]] base::Micros now() const { return now_; }
  /// Number of the last tick since power-on.
  [[nodiscard]] std::uint32_t epoch() const { return publisher_.epoch(); }
  /// Inputs consumed up to the last tick.
  [[nodiscard]] const bus::InputCrc& consumed() const { return input_crc_; }
  [[nodiscard]] const bus::Counters& counters() const { return counters_; }
  /// Parameters as they are compiled, active and staged.
  [[nodiscard]] const param::StagedParameters& parameter_sets() const requires kHasBusParameters<Estimators> {
    return parameter_commands_.sets();
  }
  /// Commands about parameters that the firmware around the node carries out.
  [[nodiscard]] auto& parameter_commands() requires kHasBusParameters<Estimators> { return parameter_commands_; }
  /// Another sender has taken the node's time: it takes no first key until power-on.
  void end_claims() {
    if constexpr (kHasBusParameters<Estimators>) parameter_commands_.end_claims();
  }
  /// The board has been switched on.
  void begin_claims() {
    if constexpr (kHasBusParameters<Estimators>) parameter_commands_.begin_claims();
  }
  [[nodiscard]] const estimators::MapFrame& map_frame() const { return map_frame_; }
  /// Records since the last tick began, of a node without a bus.
  [[nodiscard]] const auto& output() const requires(!kHasBus<Estimators>) { return publisher_; }
  /// Hash of the estimators and of the window that they stand in.
  [[nodiscard]] std::uint32_t window_crc() const {
    base::StateHash hash;
    base::each_word(window_, hash);
    return hash.value();
  }
  /// Goes on from the state of another node of this robot. References and pointers stay its own.
  void resume(const Node& other) {
    base::resume(*this, other);
    if constexpr (kHasBusParameters<Estimators>) publisher_.renew_config();
  }
  /// The intake is not hashed: half-received samples and commands, wraps of stamps. The CRC of the inputs has their
  /// frames, and their places depend on the order of arrival. Nor is the output, which goes out as it is: tallies,
  /// the queue of records, both CRCs.
  static constexpr auto members(auto& self) {
    return base::members(base::kept(self.parameter_commands_), base::reference(self.parameters_),
                         base::kept(self.window_), self.map_frame_, base::in_turns(self.origin_),
                         base::unhashed(self.protection_), base::unhashed(self.inbox_), base::unhashed(self.closures_),
                         base::unhashed(self.scans_), base::unhashed(self.relatives_), base::unhashed(self.images_),
                         base::unhashed(self.wraps_), base::unhashed(self.counters_), base::unhashed(self.publisher_),
                         self.landmarks_, self.pending_reset_, base::kept(self.wired_off_), self.pending_pose_,
                         self.now_, self.ticked_, base::unhashed(self.input_crc_), self.resets_, self.reset_cause_,
                         self.restarted_at_, self.jumps_, self.disagreement_, self.map_faults_);
  }
  /// For a copy that others get: nothing is left from which the key of commands could be computed. Between ticks only.
  void hide_secrets() {
    protection_.hide_secrets();
    parameter_commands_.hide_secrets();
  }

 private:
  [[gnu::cold, gnu::noinline]] void switch_wired(bool off) {
    wired_off_ = off;
    publisher_.show_wired();
  }
  [[nodiscard]] bool take(bus::ResetWhat what) {
    return std::exchange(pending_reset_[static_cast<std::size_t>(what)], std::uint8_t{0}) != 0;
  }
  /// Whether a command that ends the window is obeyed in this tick. What the window holds goes into the estimators
  /// before it, by a share in each tick.
  [[nodiscard]] bool window_ended(std::uint8_t& waited) {
    if (waited < kMostWaited && !window_.drain(now_, context(), noting())) return ++waited, false;
    close_window(now_);
    return true;
  }
  void take(const sensor::Sample& sample);

  using FusionWindow = node::FusionWindow<Estimators, TimelineCapacity>;
  using Estimates = typename FusionWindow::Estimates;
  static constexpr std::size_t kPrimary = FusionWindow::kPrimary;
  static constexpr base::Micros kLongestStep{500'000};
  static constexpr std::uint8_t kMostWaited = 20;  ///< ticks until a command ends the window whatever is in it
  using Closures = std::conditional_t<kTakesClosures, bus::ClosureAssembly, bus::NoClosures>;
  using Scans = std::conditional_t<kTakesScans, bus::ScanAssembly, bus::NoScans>;
  using Relatives = std::conditional_t<kTakesRelatives, bus::RelativePoseAssembly, bus::NoRelativePoses>;
  using Images = std::conditional_t<kTakesImages, bus::ImageAssemblyOf<kMakesMap>, bus::NoImages>;
  using Landmarks = std::conditional_t<Estimators::kUsesMap, node::Landmarks, node::NoLandmarks>;

  /// Sightings, closures, displacements, scans, images, and speeds that are commands.
  [[nodiscard]] bool at_no_fixed_rate(const sensor::Sample& sample) const {
    const bool commanded = parameters_.wheels.hold == param::Hold::kForward;
    if (kTakesClosures && sample.sensor == sensor::Sensor::kClosure) return true;
    if (kTakesScans && sample.sensor == sensor::Sensor::kScan) return true;
    if (kTakesRelatives && sample.sensor == sensor::Sensor::kRelativePose) return true;
    if (kTakesImages && sample.sensor == sensor::Sensor::kFeature) return true;
    return (Estimators::template kTakes<sensor::LandmarkSighting> && sample.sensor == sensor::Sensor::kRangeBearing) ||
           (Estimators::template kTakes<sensor::BodySpeed> && sample.sensor == sensor::Sensor::kBodySpeed && commanded);
  }
  [[nodiscard]] estimators::Context context() const {
    estimators::Context context{.parameters = parameters_, .map_frame = map_frame_};
    if constexpr (kTakesScans) context.scans = &scans_.pool();
    if constexpr (kTakesImages) context.images = images_.pool()->view();
    if constexpr (kHasField<Estimators>) context.field = &Estimators::kField;
    return context;
  }
  void restart(base::Micros t, sensor::ResetCause cause);
  void consume(base::Micros t);
  void close_window(base::Micros t);
  void apply_parameters(base::Micros before);
  void begin();
  void begin_anew();
  void forget_inputs();
  void apply_map(base::Micros before);
  void apply_commands();
  void restart_in_new_map();
  /// Bit of a sensor in Status_Used. A scan that was matched has that of closures: there is no other.
  [[nodiscard]] static constexpr unsigned bit_of(sensor::Sensor sensor) {
    const auto bit = static_cast<unsigned>(sensor);
    return bit < 12 ? bit : static_cast<unsigned>(sensor::Sensor::kClosure);
  }
  [[nodiscard]] bool out_of_range(const estimators::Estimate& estimate) const {
    return origin_.fixes_outside(now_) || !estimators::within_range(estimate.pose.x, estimate.pose.y);
  }
  static void invalidate_beyond_range(Estimates& estimates) {
    for (estimators::Estimate& e : estimates)
      e.position_valid = e.position_valid && estimators::within_range(e.pose.x, e.pose.y);
  }
  [[nodiscard]] estimators::AttitudeEstimate in_map(const estimators::AttitudeEstimate& attitude) const {
    const nav::LocalLevel* const place = window_.primary().level();
    return place != nullptr ? estimators::in_map(attitude, *place) : attitude;
  }
  void note(std::size_t instance, const sensor::Sample& sample, const estimators::Innovation& innovation);
  /// note(), for whoever makes records.
  [[nodiscard]] auto noting() {
    return [this](std::size_t instance, const sensor::Sample& sample, const estimators::Innovation& innovation) {
      note(instance, sample, innovation);
    };
  }
  template <class Due>
  [[nodiscard]] bool healthy(const Due& due, const Estimates& estimates);
  [[nodiscard]] [[gnu::noinline]] estimators::Disagreement judge();
  void note_jump();
  [[nodiscard]] std::uint32_t state_crc() const;
  [[nodiscard]] bus::Summary summary(const estimators::Estimate& estimate) const;

  [[no_unique_address]] BusParameters<Estimators> parameter_commands_;
  const param::Parameters& parameters_;  ///< the active ones
  FusionWindow window_;
  estimators::MapFrame map_frame_;
  MapOrigin origin_;
  BusProtection<Estimators> protection_;
  typename Parts<Estimators>::Decoder inbox_;
  [[no_unique_address]] Closures closures_;
  [[no_unique_address]] Scans scans_;
  [[no_unique_address]] Relatives relatives_;
  [[no_unique_address]] Images images_;
  typename Parts<Estimators>::Wraps wraps_;
  bus::Counters counters_;
  typename Parts<Estimators>::Publisher publisher_;
  [[no_unique_address]] Landmarks landmarks_;
  std::array<std::uint8_t, 7> pending_reset_{};  ///< 0: none; else 1 and the ticks that it has waited
  bool wired_off_ = false;                       ///< by command; a Begin frame leaves it
  std::optional<estimators::SetPose> pending_pose_;

  base::Micros now_;
  bool ticked_ = false;
  bus::InputCrc input_crc_;  ///< running CRC of the input frames
  std::uint8_t resets_ = 0;
  sensor::ResetCause reset_cause_ = sensor::ResetCause::kPowerOn;
  base::Micros restarted_at_;
  std::uint8_t jumps_ = 0;  ///< steps of the primary estimator that resets_ counts
  estimators::AttitudeDisagreement disagreement_;
  using MapFaults = std::conditional_t<Estimators::kMakesMap, bus::MapFaultHold, bus::NoMapFaults>;
  [[no_unique_address]] MapFaults map_faults_;
};

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::power_on(base::Micros t) {
  base::clear(*this);
  if constexpr (kHasBusParameters<Estimators>) {
    parameter_commands_.power_on();
    publisher_.renew_config();
  }
  now_ = t;
  begin();
}

/// Map, origin and estimators as they are at power-on.
template <class Estimators, std::size_t Capacity>
[[gnu::cold]] void Node<Estimators, Capacity>::begin() {
  restarted_at_ = now_;
  landmarks_.power_on(map_frame_);
  origin_.power_on(map_frame_, parameters_.gnss);
  window_.power_on(now_, context());
  disagreement_.restart(now_);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::on_frame(const base::CanFrame& frame) {
  const auto offset = static_cast<std::uint8_t>(frame.id - parameters_.can_base);
  const std::uint32_t bits = bus::frame_crc(offset, frame);
  input_crc_.add(bits);
  if constexpr (kTakesClosures) {
    if (bus::ClosureAssembly::takes(offset)) return closures_.on_frame(frame, now_, counters_, *this);
  }
  if constexpr (kTakesRelatives) {
    if (bus::RelativePoseAssembly::takes(offset))
      return relatives_.on_frame(offset, frame, bits, now_, counters_, *this);
  }
  if constexpr (kTakesScans) {
    if (bus::ScanAssembly::takes(offset)) {
      if (protection_.admits(offset, frame, now_, counters_, [](const sensor::Sample&) {}))
        scans_.on_frame(offset, frame, bits, now_, counters_, *this);
      return;
    }
  }
  if constexpr (kHasBusParameters<Estimators>) {
    if (bus::ParameterCommands::takes(offset))
      return parameter_commands_.on_frame(frame, protection_.admits_parameters(frame, counters_), Estimators::kTakesKey,
                                          counters_);
  }
  const bool admitted =
      protection_.admits(offset, frame, now_, counters_, [this](const sensor::Sample& vouched) { take(vouched); });
  if constexpr (kTakesImages) {
    if (bus::ImageAssembly::takes(offset)) {
      if (admitted) images_.on_frame(offset, frame, bits, now_, counters_, *this);
      return;
    }
  }
  if (admitted) inbox_.on_frame(offset, frame, bits, now_, counters_, *this);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::take(const sensor::Sample& arrived) {
  sensor::Sample sample = arrived;
  if (!ticked_ && now_.us == 0) return void(++counters_.no_time);
  if (!window_.admits_sample()) return void(++counters_.overload);
  if (!plausible(sample, parameters_.wheels.most_mps)) return void(++counters_.out_of_range);
  const bool known = wraps_.two_senders(sample);
  sample.stamp = at_no_fixed_rate(sample) ? wraps_.place_beside(sample, now_) : wraps_.place(sample, now_);
  if (wraps_.two_senders(sample)) {
    ++counters_.two_senders;
    if (!known)
      publisher_.event({.verdict = sensor::Verdict::kStale, .failed = sensor::Check::kTime}, sample, kPrimary, now_,
                       counters_);
  }
  calibrate(sample, parameters_);
  if constexpr (Estimators::template kTakes<sensor::LandmarkSighting>)
    if (sample.sensor == sensor::Sensor::kRangeBearing) calibrate(sample.payload.sighting, parameters_.landmark);
  if (sample.stamp <= window_.closed_until()) {
    ++counters_.too_late;
    publisher_.event({.verdict = sensor::Verdict::kTooLate, .failed = sensor::Check::kTime}, sample, kPrimary, now_,
                     counters_);
    return;
  }
  if (sample.stamp > now_ + base::Micros{parameters_.loop.ahead_us}) return void(++counters_.too_early);
  const Insert result = window_.insert(sample, context(), noting());
  if (result == Insert::kDuplicate) ++counters_.duplicate;
  if (result == Insert::kFull) ++counters_.timeline_full;
  if (result == Insert::kMadeRoom) ++counters_.window_short;
  if (result == Insert::kTooMuch) ++counters_.overload;
}

template <class Estimators, std::size_t Capacity>
template <class Send>
void Node<Estimators, Capacity>::tick(base::Micros t, const bus::LoopHealth& loop, Send&& send) {
  publisher_.tick_begins();
  if (kHasBusParameters<Estimators> && !ticked_) apply_parameters(now_);  // before anything begins with the old ones
  if (!ticked_) {
    restart(t, sensor::ResetCause::kPowerOn);
    ticked_ = true;
  } else if (t <= now_ || t - now_ > kLongestStep) {
    restart(t, sensor::ResetCause::kTimeJump);
  }
  const base::Micros before = now_;
  now_ = t;
  input_crc_.close_epoch();
  protection_.tick(now_, counters_);
  inbox_.expire(now_, base::Micros{parameters_.loop.window_us}, counters_);
  closures_.expire(now_, base::Micros{parameters_.loop.window_us}, counters_);
  scans_.expire(now_, base::Micros{parameters_.loop.window_us}, counters_);
  relatives_.expire(now_, base::Micros{parameters_.loop.window_us}, counters_);
  images_.expire(now_, base::Micros{parameters_.loop.window_us}, counters_);
  apply_parameters(before);
  apply_map(before);
  consume(now_);
  if (origin_.take_replaced()) restart_in_new_map();
  apply_commands();
  window_.advance(now_, context());
  window_.late_records(noting());
  window_.work(static_cast<std::uint32_t>(parameters_.loop.work_units), context());
  publisher_.begin(now_, input_crc_, send);
  Estimates estimates;
  const auto due = [this](std::size_t instance) { return instance == kPrimary || publisher_.publishes(instance); };
  window_.estimate(context(), due, estimates);
  if (!healthy(due, estimates)) window_.estimate(context(), due, estimates);
  invalidate_beyond_range(estimates);
  if constexpr (kHasBusParameters<Estimators>) {
    for (const estimators::Estimate& e : estimates)
      if (e.velocity_valid) parameter_commands_.note_motion(e.forward_mps, e.yaw_rate_radps);
  }

  const estimators::Disagreement apart = publisher_.compares_attitudes() ? judge() : estimators::Disagreement{};
  note_jump();

  std::size_t instance = 0;
  window_.each_slot([&](const auto& slot) {
    using E = typename std::remove_cvref_t<decltype(slot)>::Type;
    const bool primary = instance == kPrimary;
    const estimators::MotionVariance motion =
        publisher_.publishes_sigma(instance, primary) ? slot.motion_variance(context()) : estimators::MotionVariance{};
    publisher_.estimate(instance, E::kKind, primary, estimates[instance], motion, send);
    if constexpr (requires { slot.inertial(context()); })
      publisher_.inertial(
          instance, [&] { return slot.inertial(context()); }, [&] { return slot.sources(context()); }, send);
    if constexpr (requires { slot.attitude(context()); })
      publisher_.attitude(
          instance, [&] { return in_map(slot.attitude(context())); }, apart, send);
    if constexpr (estimators::SeesImages<E>) publisher_.visual(instance, slot.eyes(), context(), send);
    if constexpr (estimators::MakesMap<E>) {
      map_faults_.note(slot.map_maker().own_map(), publisher_.epoch(),
                       static_cast<std::uint32_t>(1'000'000 / parameters_.loop.period_us));
      publisher_.own_map(slot.map_maker(), send);
    }
    if constexpr (estimators::MatchesScans<E>) publisher_.scan_match(slot.scan_match(), now_, send);
    ++instance;
  });
  publisher_.status([&] { return summary(estimates[kPrimary]); }, loop, send);
  publisher_.statistics(window_.slots(), now_, send);
  publisher_.diagnostics(counters_, loop, window_.high_water(), send);
  if constexpr (kHasBusProtection<Estimators>)
    publisher_.refusals(
        counters_, loop, [this] { return bus::guard_page(counters_, protection_.nonce()); }, send);
  else
    publisher_.refusals(counters_, loop, nullptr, send);
  if constexpr (requires { window_.primary().likeliest_fault(); })
    publisher_.identity(
        map_frame_, [this] { return window_.primary().likeliest_fault(); }, send);
  else
    publisher_.identity(map_frame_, nullptr, send);
  if constexpr (kHasBusParameters<Estimators>) publisher_.parameters(parameter_commands_, send);
  publisher_.events(send);
  window_.retire_until(now_ - base::Micros{parameters_.loop.window_us}, context(), noting());
  publisher_.end(kHasBus<Estimators> ? state_crc() : 0, input_crc_, send);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::restart(base::Micros t, sensor::ResetCause cause) {
  if (cause != sensor::ResetCause::kPowerOn) {
    ++resets_;
    reset_cause_ = cause;
    restarted_at_ = t;
  }
  window_.restart(t, context());
  disagreement_.restart(t);
  jumps_ = 0;
  if (cause == sensor::ResetCause::kTimeJump) {
    forget_inputs();
    window_.open_from(t - base::Micros{parameters_.loop.period_us});
  }
  if (cause == sensor::ResetCause::kPowerOn) window_.open_from(t - base::Micros{parameters_.loop.window_us});
}

/// Drops inputs that have arrived and are not consumed.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::forget_inputs() {
  inbox_.discard(counters_);
  closures_.discard(counters_);
  scans_.discard(counters_);
  relatives_.discard(counters_);
  images_.discard(counters_);
  wraps_.power_on();
  window_.clear();
}

/// As after power-on, but for counts, numbers and tags, which go on: a log goes on, and so does its replay.
template <class Estimators, std::size_t Capacity>
[[gnu::cold]] void Node<Estimators, Capacity>::begin_anew() {
  forget_inputs();
  begin();
  window_.open_from(now_ - base::Micros{parameters_.loop.window_us});
  pending_pose_.reset();
  for (const auto what : {bus::ResetWhat::kEstimators, bus::ResetWhat::kLandmarkMap, bus::ResetWhat::kOwnMap})
    static_cast<void>(take(what));
  jumps_ = 0;
  ++resets_;
  reset_cause_ = sensor::ResetCause::kCommand;
}

/// Makes consumed samples and the time up to t final: nothing from before t is fused any more.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::close_window(base::Micros t) {
  window_.close_window(t, context(), noting());
}

/// Sends the record of a compared or refused sample. Records with every tick would crowd out the rest: of accepted
/// wheels, magnetometers and barometers the statistics are enough.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::note(std::size_t instance, const sensor::Sample& sample,
                                      const estimators::Innovation& innovation) {
  if (innovation.verdict == sensor::Verdict::kTooLate) ++counters_.too_late;
  if constexpr (!kHasBus<Estimators>) return publisher_.event(innovation, sample, instance, now_, counters_);
  const bool frequent = sample.sensor <= sensor::Sensor::kBodySpeed || sample.sensor == sensor::Sensor::kMagnetometer ||
                        sample.sensor == sensor::Sensor::kBarometer;
  const bool ordinary = innovation.verdict == sensor::Verdict::kAccepted && frequent;
  const bool impossible =
      innovation.verdict == sensor::Verdict::kRejected && innovation.failed == sensor::Check::kValue;
  if ((innovation.dof > 0 && !ordinary) || innovation.verdict > sensor::Verdict::kNotUsed || impossible)
    publisher_.event(innovation, sample, instance, now_, counters_);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::apply_parameters(base::Micros before) {
  if constexpr (kHasBusParameters<Estimators>) {
    using Change = bus::ParameterCommands::Change;
    const Change change = parameter_commands_.accepts();
    if (change == Change::kNone) return;
    if (ticked_ && change == Change::kLive) {
      consume(before);  // what came late belongs to the parameters as they were
      close_window(before);
    }
    parameter_commands_.take_over(change);
    publisher_.renew_config();
    if (change == Change::kRestart) return begin_anew();
    window_.each_slot([&](auto& slot) { slot.configure(context()); });
  }
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::apply_map(base::Micros before) {
  if (!landmarks_.waiting()) return;
  consume(before);  // what came late belongs to the map as it was
  close_window(before);
  landmarks_.apply(counters_);
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::apply_commands() {
  using What = bus::ResetWhat;
  if (take(What::kLandmarkMap)) landmarks_.clear();
  if constexpr (kMakesMap) {
    if (take(What::kOwnMap)) {
      close_window(now_);
      window_.each_slot([](auto& slot) {
        if constexpr (requires { slot.reset_own_map(); }) slot.reset_own_map();
      });
    }
  }
  if (take(What::kCounters)) {
    counters_ = {};
    window_.each_slot([](auto& slot) { slot.clear_statistics(); });
  }
  std::uint8_t& reset = pending_reset_[static_cast<std::size_t>(What::kEstimators)];
  if (reset != 0) {
    if (!window_ended(reset)) return;
    reset = 0;
    restart(now_, sensor::ResetCause::kCommand);
  }
  if (pending_pose_) {
    if (!window_ended(pending_pose_->waited)) return;
    window_.each_slot([&](auto& slot) { slot.set_pose(now_, *pending_pose_, context()); });
    pending_pose_.reset();
    ++resets_;
    reset_cause_ = sensor::ResetCause::kSetPose;
  }
}

template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::consume(base::Micros t) {
  const std::uint16_t not_used = window_.consume(
      t, context(),
      [this](const sensor::Sample& sample) {
        if (sample.sensor == sensor::Sensor::kGnssPosition)
          origin_.update(sample.payload.gnss_position, sample.stamp, map_frame_, parameters_);
      },
      noting());
  counters_.not_used = static_cast<std::uint16_t>(counters_.not_used + not_used);
}

/// Estimators that fixes place begin anew; odometry, whose frame is its own, goes on.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::restart_in_new_map() {
  close_window(now_);
  window_.each_slot([&](auto& slot) {
    if constexpr (std::remove_cvref_t<decltype(slot)>::template kTakes<sensor::GnssPosition>)
      slot.restart(now_, context());
  });
  jumps_ = 0;
  ++resets_;
  reset_cause_ = sensor::ResetCause::kNewOrigin;
  restarted_at_ = now_;
}

/// A broken invariant (NaN, a covariance that is none) restarts the estimators from their start, with a reset cause. An
/// estimator beside the primary one is looked at in the epochs that publish it.
template <class Estimators, std::size_t Capacity>
template <class Due>
bool Node<Estimators, Capacity>::healthy(const Due& due, const Estimates& estimates) {
  bool finite = true;
  bool positive = true;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    if (!due(i)) continue;
    const estimators::Estimate& e = estimates[i];
    finite = finite && base::is_finite(e.pose.yaw_rad) && base::is_finite(e.pose.x.offset_m) &&
             base::is_finite(e.pose.y.offset_m);
    positive = positive && e.p.positive_definite();
  }
  if (finite && positive) return true;
  close_window(now_);
  restart(now_, finite ? sensor::ResetCause::kNotPositive : sensor::ResetCause::kNotFinite);
  window_.advance(now_, context());
  return false;
}

/// How far the attitude estimator is from the primary one; nothing where one of them has no attitude.
template <class Estimators, std::size_t Capacity>
estimators::Disagreement Node<Estimators, Capacity>::judge() {
  estimators::Disagreement apart;
  if constexpr (requires { window_.primary().inertial_attitude(); }) {
    window_.each_slot([&](const auto& slot) {
      if constexpr (requires { slot.attitude(context()); })
        apart = disagreement(in_map(slot.attitude(context())), window_.primary().inertial_attitude());
    });
    disagreement_.step(apart, now_, parameters_.disagreement);
  }
  return apart;
}

/// A step the primary estimator made of itself counts as a reset, with its cause.
template <class Estimators, std::size_t Capacity>
void Node<Estimators, Capacity>::note_jump() {
  const estimators::Jump jump = window_.primary().jump();
  if (jump.count == jumps_) return;
  resets_ = static_cast<std::uint8_t>(resets_ + static_cast<std::uint8_t>(jump.count - jumps_));
  jumps_ = jump.count;
  reset_cause_ = jump.cause;
  restarted_at_ = now_;
}

template <class Estimators, std::size_t Capacity>
std::uint32_t Node<Estimators, Capacity>::state_crc() const {
  base::StateHash hash;
  constexpr std::uint32_t kApart = 5;  // the longest turns are not in the ticks that send most
  base::each_word_in_turn(*this, (publisher_.epoch() + kApart) % base::kTurns, hash);
  return hash.value();
}

template <class Estimators, std::size_t Capacity>
bus::Summary Node<Estimators, Capacity>::summary(const estimators::Estimate& estimate) const {
  const auto& primary = window_.primary();
  bus::Summary s{.mode = primary.mode(context()),
                 .position_valid = estimate.position_valid,
                 .heading_valid = estimate.heading_valid,
                 .velocity_valid = estimate.velocity_valid,
                 .origin_known = map_frame_.origin != sensor::OriginSource::kNone,
                 .resets = resets_,
                 .cause = reset_cause_,
                 .restarted = resets_ > 0 && now_ - restarted_at_ < base::Micros{1'000'000} &&
                              reset_cause_ != sensor::ResetCause::kSetPose};
  bus::FaultSet faults{primary.faults()};
  const bool far = out_of_range(estimate);
  faults.raise(sensor::Fault::kOriginOutOfRange, far);
  if (far && (s.mode == sensor::Mode::kNominal || s.mode == sensor::Mode::kDeadReckoning))
    s.mode = sensor::Mode::kDegraded;
  faults.raise(sensor::Fault::kAttitudeDisagrees, disagreement_.disagrees());
  window_.each_slot([&](const auto& slot) {
    if constexpr (requires { slot.attitude(context()); })
      faults.raise(sensor::Fault::kMagneticDisturbance, slot.attitude(context()).field_disturbed);
  });
  s.faults = faults.bits;
  s.map_faults = map_faults_.faults(publisher_.epoch());
  for (const estimators::SensorStatistics& stat : primary.statistics()) {
    const bool used = stat.accepted > 0 && now_ - stat.last_accepted < base::Micros{1'000'000};
    if (used) s.used = static_cast<std::uint16_t>(s.used | (1U << bit_of(stat.sensor)));
    s.rejecting = s.rejecting || stat.refused_in_a_row >= 3;
  }
  return s;
}

}  // namespace tetap::node
