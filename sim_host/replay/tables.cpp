// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/tables.hpp"

#include "sim_host/replay/candump.hpp"
#include "sim_host/replay/names.hpp"

#include <limits>

namespace tetap::sim {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// The name of a code of the bus, or its number where this program does not know it.
template <class Code>
void put_name(Line& line, Code code) {
  if (name(code) == "?")
    line.integer(static_cast<std::int64_t>(code));
  else
    line.text(name(code));
}

constexpr double millimetres(std::int32_t raw) {
  return raw == bus::EstPos::kXNotAvailable ? kNone : raw * bus::EstPos::kXScale;
}

}  // namespace

Tables::Tables(std::uint32_t base, TableSink& sink) : base_(base), sink_(sink) {
  sink_.write(
      Table::kEstimates,
      "epoch,time_s,estimator,kind,x_m,y_m,yaw_rad,speed_mps,yaw_rate_radps,std_x_m,std_y_m,std_yaw_rad,corr_xy,corr_x_"
      "yaw,corr_y_yaw,"
      "pos_valid,hdg_valid,std_speed_mps,std_yaw_rate_radps\n");
  sink_.write(
      Table::kStates,
      "epoch,time_s,estimator,q_w,q_x,q_y,q_z,v_east_mps,v_north_mps,v_up_mps,height_m,std_height_m,acc_bias_x_mps2,"
      "acc_bias_y_mps2,acc_bias_z_mps2,gyro_bias_x_radps,gyro_bias_y_radps,gyro_bias_z_radps,std_v_east_mps,"
      "std_v_north_mps,std_v_up_mps,std_tilt_east_rad,std_tilt_north_rad,std_acc_bias_x_mps2,std_acc_bias_y_mps2,"
      "std_acc_bias_z_mps2,std_gyro_bias_x_radps,std_gyro_bias_y_radps,std_gyro_bias_z_radps,jump_x_m,jump_y_m,"
      "jump_yaw_rad,disagree_tilt_rad,disagree_yaw_rad,vib_accel_mps2,vib_gyro_radps,clipped,jump_z_m,corr_xz,corr_yz,"
      "corr_v_en,corr_v_eu,corr_v_nu,corr_tilt_en,corr_tilt_e_yaw,corr_tilt_n_yaw,corr_acc_bias_xy,corr_acc_bias_xz,"
      "corr_acc_bias_yz,corr_gyro_bias_xy,corr_gyro_bias_xz,corr_gyro_bias_yz\n");
  sink_.write(Table::kInnovations, "epoch,time_s,estimator,sensor,inst,verdict,dof,nis,ratio,age_ms,landmark,failed\n");
  sink_.write(Table::kSensors, "epoch,time_s,estimator,sensor,inst,accepted,rejected,nis_mean,age_s\n");
  sink_.write(Table::kStatus, "epoch,time_s,mode,used,faults,reset_ctr,reset_cause,map_faults\n");
  sink_.write(Table::kSources, "epoch,time_s,estimator,source,state,failed\n");
  sink_.write(Table::kKeyframes, "epoch,time_s,keyframe,x_m,y_m,yaw_rad\n");
  sink_.write(
      Table::kGraph,
      "epoch,time_s,chi2,graph_status,closures,jobs,map_size,map_refused,contradicted,work_left,jobs_aborted\n");
  sink_.write(Table::kMap, "epoch,time_s,landmark,x_m,y_m,std_x_m,std_y_m,corr_xy,hits,age_s,landmark_state\n");
}

Line& Tables::row(base::Micros time) {
  line_.clear();
  return line_.integer(static_cast<std::int64_t>(number_)).put(',').fixed(time.us, 6).put(',');
}

void Tables::epoch(const NodeEpoch& epoch, base::Micros time) {
  number_ += restarted_ ? 1U : static_cast<std::uint8_t>(epoch.tail.epoch - last_epoch_);
  restarted_ = false;
  last_epoch_ = epoch.tail.epoch;
  time_ = time;
  if (totals_.epochs++ == 0) totals_.first = time;
  totals_.last = time;
  totals_.state_crc = epoch.tail.crc;
  const base::Micros bus_time{static_cast<std::int64_t>(static_cast<std::uint64_t>(time.us) & kTimeMask)};
  instances_ = {};
  states_now_ = {};
  for (const base::CanFrame& f : epoch.frames) {
    frame(f);
    if (!is_deterministic(f, base_)) continue;
    line_.clear();
    append_log_line(line_, bus_time, "vcan0", f);  // the same name everywhere, so that files can be compared
    estimates_.add(line_.view());
    write(Table::kEstimatesLog);
  }
  for (std::size_t k = 0; k < instances_.size(); ++k)
    if (instances_[k].position) estimate_row(k, instances_[k]);
  for (std::size_t k = 0; k < states_now_.size(); ++k)
    if (states_now_[k].reported) state_row(k, states_now_[k]);
}

void Tables::frame(const base::CanFrame& f) {
  const std::uint32_t offset = f.id - base_;
  const auto payload = bus::payload(f);
  if (offset == bus::EstInnov::kOffset) {
    if (const auto innovation = bus::decode<bus::EstInnov>(payload)) innovation_row(*innovation);
  } else if (offset == bus::EstSensorStat::kOffset) {
    if (const auto statistics = bus::decode<bus::EstSensorStat>(payload)) sensor_row(*statistics);
  } else if (offset == bus::EstStatus::kOffset) {
    if (const auto status = bus::decode<bus::EstStatus>(payload)) status_row(*status);
  } else if (offset == bus::EstLandmark::kOffset) {
    landmark_ = bus::decode<bus::EstLandmark>(payload);
  } else if (offset == bus::EstLandmarkStd::kOffset) {
    if (const auto deviation = bus::decode<bus::EstLandmarkStd>(payload)) landmark_row(*deviation);
  } else if (offset == bus::EstKeyframePose::kOffset) {
    if (const auto keyframe = bus::decode<bus::EstKeyframePose>(payload)) keyframe_row(*keyframe);
  } else if (offset == bus::EstGraph::kOffset) {
    if (const auto graph = bus::decode<bus::EstGraph>(payload)) graph_row(*graph);
  } else if (offset == bus::EstOriginFault::kOffset) {
    const auto page = bus::decode<bus::EstOriginFault>(payload);
    if (!page || page->fault_row == bus::FaultRow::kNone) return;
    if (totals_.fault && !(page->fault_prob > totals_.fault->fault_prob)) return;
    totals_.fault = page;
    totals_.fault_time = time_;
  } else if (offset == bus::EstDiagMapper::kOffset) {
    if (const auto mapper = bus::decode<bus::EstDiagMapper>(payload)) mapper_ = *mapper;
  } else if (offset >= bus::EstPos::kOffset) {
    const std::size_t k = (offset - bus::EstPos::kOffset) / bus::EstPos::kStride;
    if (k >= instances_.size()) return;
    Instance& instance = instances_[k];
    if (offset == bus::offset_of<bus::EstPos>(k)) {
      instance.position = bus::decode<bus::EstPos>(payload);
      totals_.estimates += instance.position ? 1 : 0;
    } else if (offset == bus::offset_of<bus::EstMotion>(k)) {
      instance.motion = bus::decode<bus::EstMotion>(payload);
    } else if (offset == bus::offset_of<bus::EstStdPose>(k)) {
      if (const auto pose = bus::decode<bus::EstStdPose>(payload)) instance.deviation = pose;
      if (const auto more = bus::decode<bus::EstStdMore>(payload)) instance.correlation = more;
    } else {
      if (offset == bus::offset_of<bus::EstStateSources>(k))
        if (const auto sources = bus::decode<bus::EstStateSources>(payload)) source_rows(k, *sources);
      if (offset == bus::offset_of<bus::EstStateCorrPos>(k))
        if (const auto height = bus::decode<bus::EstStateCorrPos>(payload))
          source_row(k, "GnssHeight", height->height_state, height->height_check);
      state(states_now_[k], offset - static_cast<std::uint32_t>(k * bus::EstPos::kStride), payload);
    }
  }
}

void Tables::state(State& state, std::uint32_t offset, std::span<const std::uint8_t> payload) {
  if (!state.reported) state.values.fill(kNone);
  const auto put = [&state](std::size_t column, auto... values) {
    for (const double value : {static_cast<double>(values)...}) state.values[column++] = value;
    state.reported = true;
  };
  const auto page = [&]<class Page>(std::size_t column, auto Page::*... fields) {
    if (const auto found = bus::decode<Page>(payload)) put(column, (*found).*fields...);
  };
  if (offset == bus::EstAtt::kOffset)
    page(0, &bus::EstAtt::w, &bus::EstAtt::x, &bus::EstAtt::y, &bus::EstAtt::z);
  else if (offset == bus::EstVel::kOffset)
    page(4, &bus::EstVel::east_mps, &bus::EstVel::north_mps, &bus::EstVel::up_mps);
  if (offset != bus::EstStateHeight::kOffset) return;
  page(7, &bus::EstStateHeight::height_m, &bus::EstStateHeight::std_height_m);
  page(34, &bus::EstStateHeight::jump_z_m);
  using bus::EstStateAccBias, bus::EstStateGyroBias, bus::EstStateStdVel, bus::EstStateStdTilt;
  using bus::EstStateDisagreement, bus::EstStateImuHealth;
  using bus::EstStateStdAccBias, bus::EstStateStdGyroBias, bus::EstStateJump;
  page(9, &EstStateAccBias::acc_bias_x_mps2, &EstStateAccBias::acc_bias_y_mps2, &EstStateAccBias::acc_bias_z_mps2);
  page(12, &EstStateGyroBias::gyro_bias_x_radps, &EstStateGyroBias::gyro_bias_y_radps,
       &EstStateGyroBias::gyro_bias_z_radps);
  page(15, &EstStateStdVel::std_vel_east_mps, &EstStateStdVel::std_vel_north_mps, &EstStateStdVel::std_vel_up_mps);
  page(18, &EstStateStdTilt::std_tilt_east_rad, &EstStateStdTilt::std_tilt_north_rad);
  page(20, &EstStateStdAccBias::std_acc_bias_x_mps2, &EstStateStdAccBias::std_acc_bias_y_mps2,
       &EstStateStdAccBias::std_acc_bias_z_mps2);
  page(23, &EstStateStdGyroBias::std_gyro_bias_x_radps, &EstStateStdGyroBias::std_gyro_bias_y_radps,
       &EstStateStdGyroBias::std_gyro_bias_z_radps);
  page(26, &EstStateJump::jump_x_m, &EstStateJump::jump_y_m, &EstStateJump::jump_yaw_rad);
  page(29, &EstStateDisagreement::disagree_tilt_rad, &EstStateDisagreement::disagree_yaw_rad);
  page(31, &EstStateImuHealth::vib_accel_mps2, &EstStateImuHealth::vib_gyro_radps, &EstStateImuHealth::clipped);
  using bus::EstStateCorrAccBias, bus::EstStateCorrGyroBias;
  using bus::EstStateCorrPos, bus::EstStateCorrVel, bus::EstStateCorrTilt;
  page(35, &EstStateCorrPos::corr_xz, &EstStateCorrPos::corr_yz);
  page(37, &EstStateCorrVel::corr_vel_en, &EstStateCorrVel::corr_vel_eu, &EstStateCorrVel::corr_vel_nu);
  page(40, &EstStateCorrTilt::corr_tilt_en, &EstStateCorrTilt::corr_tilt_e_yaw, &EstStateCorrTilt::corr_tilt_n_yaw);
  page(43, &EstStateCorrAccBias::corr_acc_bias_xy, &EstStateCorrAccBias::corr_acc_bias_xz,
       &EstStateCorrAccBias::corr_acc_bias_yz);
  page(46, &EstStateCorrGyroBias::corr_gyro_bias_xy, &EstStateCorrGyroBias::corr_gyro_bias_xz,
       &EstStateCorrGyroBias::corr_gyro_bias_yz);
}

void Tables::state_row(std::size_t k, const State& state) {
  row(time_).integer(static_cast<std::int64_t>(k));
  for (const double value : state.values) line_.put(',').real(value, 7);
  line_.put('\n');
  write(Table::kStates);
}

void Tables::keyframe_row(const bus::EstKeyframePose& k) {
  row(time_).integer(k.id);
  for (const float value : {k.x_m, k.y_m, k.yaw_rad}) line_.put(',').real(static_cast<double>(value), 4);
  line_.put('\n');
  write(Table::kKeyframes);
}

/// With the numbers of the last page about the map.
void Tables::graph_row(const bus::EstGraph& g) {
  if (g.chi2_raw == bus::EstGraph::kChi2NotAvailable) {
    row(time_);
  } else {
    row(time_).real(static_cast<double>(g.chi2_raw) * bus::EstGraph::kChi2Scale, 6);
  }
  line_.put(',');
  put_name(line_, g.status);
  for (const int value : {int{g.closures}, int{g.jobs}, int{mapper_.map_size}, int{mapper_.map_refused},
                          int{mapper_.ambiguous}, int{mapper_.work_left}, int{mapper_.jobs_aborted}})
    line_.put(',').integer(value);
  line_.put('\n');
  write(Table::kGraph);
}

void Tables::landmark_row(const bus::EstLandmarkStd& s) {
  if (!landmark_ || landmark_->id != s.id) return;
  row(time_).integer(s.id);
  line_.put(',').real(millimetres(landmark_->x_raw), 3).put(',').real(millimetres(landmark_->y_raw), 3);
  for (const float value : {s.std_x_m, s.std_y_m}) line_.put(',').real(static_cast<double>(value), 3);
  line_.put(',').real(static_cast<double>(s.corr_xy), 2).put(',').integer(s.hits).put(',').integer(s.age_s).put(',');
  put_name(line_, s.state);
  line_.put('\n');
  write(Table::kMap);
  landmark_.reset();
}

void Tables::sensor_row(const bus::EstSensorStat& s) {
  row(time_).integer(s.estimator).put(',');
  put_name(line_, s.sensor);
  line_.put(',').integer(s.inst).put(',').integer(s.accepted).put(',').integer(s.rejected).put(',');
  line_.real(static_cast<double>(s.nis_mean), 2).put(',').real(static_cast<double>(s.age_s), 2);
  line_.put('\n');
  write(Table::kSensors);
}

void Tables::estimate_row(std::size_t k, const Instance& e) {
  const auto motion = [&](float bus::EstMotion::*field) {
    return e.motion ? static_cast<double>((*e.motion).*field) : kNone;
  };
  const auto deviation = [&](float bus::EstStdPose::*field) {
    return e.deviation ? static_cast<double>((*e.deviation).*field) : kNone;
  };
  const auto correlation = [&](float bus::EstStdMore::*field) {
    return e.correlation ? static_cast<double>((*e.correlation).*field) : kNone;
  };
  row(time_).integer(static_cast<std::int64_t>(k)).put(',');
  put_name(line_, e.position->kind);
  line_.put(',').real(millimetres(e.position->x_raw), 3).put(',').real(millimetres(e.position->y_raw), 3);
  line_.put(',').real(motion(&bus::EstMotion::yaw_rad), 4).put(',').real(motion(&bus::EstMotion::speed_mps), 3);
  line_.put(',').real(motion(&bus::EstMotion::yaw_rate_radps), 4);
  for (const auto field :
       {&bus::EstStdPose::std_x_m, &bus::EstStdPose::std_y_m, &bus::EstStdPose::std_yaw_rad, &bus::EstStdPose::corr_xy})
    line_.put(',').real(deviation(field), 4);
  for (const auto field : {&bus::EstStdMore::corr_x_yaw, &bus::EstStdMore::corr_y_yaw})
    line_.put(',').real(correlation(field), 4);
  line_.put(',');
  if (e.motion)
    line_.put(e.motion->pos_valid ? '1' : '0').put(',').put(e.motion->hdg_valid ? '1' : '0');
  else
    line_.put(',');
  for (const auto field : {&bus::EstStdMore::std_speed_mps, &bus::EstStdMore::std_yaw_rate_radps})
    line_.put(',').real(correlation(field), 4);
  line_.put('\n');
  write(Table::kEstimates);
}

void Tables::innovation_row(const bus::EstInnov& i) {
  row(time_).integer(i.estimator).put(',');
  put_name(line_, i.sensor);
  line_.put(',').integer(i.inst).put(',');
  put_name(line_, i.verdict);
  line_.put(',')
      .integer(i.dof)
      .put(',')
      .real(static_cast<double>(i.nis), 2)
      .put(',')
      .real(static_cast<double>(i.ratio), 2)
      .put(',')
      .real(static_cast<double>(i.age_s) * 1e3, 0)
      .put(',');
  if (i.id != bus::EstInnov::kIdNotAvailable) line_.integer(i.id);
  line_.put(',');
  put_name(line_, i.check);
  line_.put('\n');
  write(Table::kInnovations);
}

void Tables::status_row(const bus::EstStatus& s) {
  row(time_);
  put_name(line_, s.mode);
  line_.put(',').integer(s.used).put(',').integer(s.faults).put(',').integer(s.reset_ctr).put(',');
  put_name(line_, s.reset_cause);
  line_.put(',').integer(s.map_faults);
  line_.put('\n');
  write(Table::kStatus);
}

void Tables::source_row(std::size_t k, std::string_view source, sensor::SourceState state, sensor::Check failed) {
  row(time_).integer(static_cast<std::int64_t>(k)).put(',').text(source).put(',');
  put_name(line_, state);
  line_.put(',');
  put_name(line_, failed);
  line_.put('\n');
  write(Table::kSources);
}

void Tables::source_rows(std::size_t k, const bus::EstStateSources& s) {
  source_row(k, "Imu", s.imu_state, s.imu_check);
  source_row(k, "GnssPosition", s.position_state, s.position_check);
  source_row(k, "GnssVelocity", s.velocity_state, s.velocity_check);
  source_row(k, "Wheels", s.wheel_state, s.wheel_check);
  source_row(k, "ForwardSpeed", s.speed_state, s.speed_check);
  source_row(k, "Heading", s.heading_state, s.heading_check);
  source_row(k, "Magnetometer", s.mag_state, s.mag_check);
  source_row(k, "Barometer", s.baro_state, s.baro_check);
}

}  // namespace tetap::sim
