// SPDX-License-Identifier: Apache-2.0
// Facts that cross sources: one definition and one time-out each.
#pragma once

#include "tetap/estimators/inertial/aiding_sources.hpp"
#include "tetap/estimators/inertial/filter_view.hpp"

namespace tetap::estimators {

inline nav::Vector3 FilterView::axle_mps(const nav::Vector3& v_n_mps) const {
  const param::GnssParameters& n = parameters().gnss;
  const nav::Vector3 antenna_b{n.antenna_x_b_m - parameters().inertial.axle_x_b_m, n.antenna_y_b_m, n.antenna_z_b_m};
  return x().q_nb.conjugate().rotate(v_n_mps) - nav::cross(turn_b_radps(), antenna_b);
}

inline checks::WheelSlip::Slip FilterView::slip() const { return parts_.sources.wheels.slip(); }

inline bool FilterView::wheels_timed_out() const { return parts_.sources.forward.timed_out(stamp()); }

inline bool FilterView::wheels_agree() const {
  const AidingSources& s = parts_.sources;
  if (position_refused_for_long()) return false;
  return checks::recent(s.wheels.turned_at(), stamp(), base::Micros{1'000'000}) && !s.forward.refused().holds() &&
         slip() == checks::WheelSlip::Slip::kNone;
}

inline bool FilterView::wheels_show_turn() const {
  return checks::recent(parts_.sources.wheels.turned_at(), stamp(), base::Micros{200'000}) &&
         slip() == checks::WheelSlip::Slip::kNone;
}

inline float FilterView::recent_forward_mps() const {
  const ForwardSpeedSource& forward = parts_.sources.forward;
  return checks::recent(forward.last(), stamp(), base::Micros{500'000}) ? forward.last_mps() : 0.0F;
}

inline bool FilterView::encoders_count() const { return parts_.sources.wheels.encoders().counts_recently(stamp()); }

inline bool FilterView::encoders_rest() const {
  return parts_.sources.wheels.encoders().at_rest(stamp()) && slip() == checks::WheelSlip::Slip::kNone;
}

inline bool FilterView::position_frozen() const { return parts_.sources.position.frozen(); }

inline bool FilterView::position_refused_for_long() const {
  return parts_.sources.position.refused().persists(stamp(), base::Micros{parameters().recovery.persist_us});
}

inline bool FilterView::position_holds_heading() const {
  return checks::recent(parts_.sources.position.last_fused(), stamp(), base::Micros{parameters().recovery.after_us});
}

inline Vote FilterView::wheels_vote(base::Micros since) const {
  const Vote vote = parts_.sources.forward.witness().of_velocity(since, stamp());
  const bool unsure = slip() != checks::WheelSlip::Slip::kNone || position_refused_for_long();
  return vote == Vote::kFor && unsure ? Vote::kAbstains : vote;
}

inline Vote FilterView::velocity_vote(base::Micros since) const {
  return parts_.sources.velocity.witness().of_velocity(since, stamp());
}

inline Vote FilterView::fixes_vote(base::Micros since, const nav::Vector3& nu_mps) const {
  return parts_.sources.position.vote(since, nu_mps, stamp());
}

inline bool FilterView::speeds_agree() const {
  const float rolled_mps = parts_.sources.forward.last_mps();
  return base::abs(parts_.sources.velocity.ahead_mps() - rolled_mps) < 0.5F + 0.1F * base::abs(rolled_mps);
}

inline bool FilterView::speeds_contradict() const {
  const bool receiver = parts_.sources.velocity.witness().contradicts(stamp());
  const bool wheels = parts_.sources.forward.witness().contradicts(stamp());
  return (receiver || wheels) && !(receiver && wheels && !speeds_agree());
}

inline float FilterView::missing_climb_mps() const { return parts_.sources.velocity.missing_climb_mps(*this); }

inline bool FilterView::barometer_vouches(float climb_mps, base::Micros since) const {
  return !position_refused_for_long() && parts_.sources.barometer.vouches(climb_mps, since, *this);
}

inline bool FilterView::receiver_leapt() const {
  return !position_refused_for_long() && parts_.sources.position.leapt();
}

inline const nav::Vector3& FilterView::velocity_difference_mps() const {
  return parts_.sources.velocity.difference_mps();
}

inline bool FilterView::velocity_recent() const { return parts_.sources.velocity.recent(stamp()); }

inline bool FilterView::magnetometer_is_suspect() const { return parts_.sources.magnetometer.is_suspect(stamp()); }

}  // namespace tetap::estimators
