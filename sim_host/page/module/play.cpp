// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/play.hpp"

#include "sim_host/page/module/browser.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/replay/candump.hpp"
#include "sim_host/robot_world.hpp"
#include "version.hpp"

#include <utility>

namespace tetap::page {

namespace {

constexpr base::Micros kTick{10'000};
constexpr base::Micros kEver{86'400'000'000};

constexpr const char* falls_on(sim::FallsOn what) {
  switch (what) {
    case sim::FallsOn::kAny:
      return "any";
    case sim::FallsOn::kImu:
      return "imu";
    case sim::FallsOn::kWheels:
      return "wheels";
    case sim::FallsOn::kGnss:
      return "gnss";
    case sim::FallsOn::kLandmarks:
      return "landmarks";
    case sim::FallsOn::kMagnetometer:
      return "magnetometer";
    case sim::FallsOn::kLidar:
      return "lidar";
    case sim::FallsOn::kFeatures:
      return "features";
  }
  return "";
}

double in_s(base::Micros span) { return static_cast<double>(span.us) * 1e-6; }

}  // namespace

void Play::Bus::line(const base::CanFrame& frame) {
  line_.clear();
  sim::append_log_line(line_, now, "play", frame);
  frames += line_.view();
}

Play::Play(const sim::Robot& robot, std::uint64_t seed)
    : world_(sim::usual_world(robot)),
      parameters_(sim::MemoryNode::for_player(*robot.parameters, param::Parameters{}.can_base)),
      played_{.robot = robot.name, .seed = seed, .duration = {}, .faults = {}},
      node_(robot, parameters_, version()),
      source_(sim::World(world_, seed), parameters_.can_base, kTick, kEver),
      bus_(parameters_.can_base),
      options_{.base = parameters_.can_base},
      lockstep_(node_.link(), bus_, options_, bus_.run.counts),
      truth_("time_s,x_m,y_m,yaw_rad,z_m\n") {
  if (parameters_.bus.guard != 0) source_.send_guards();
  bus_.now = source_.world().start();
  describe();
}

void Play::describe() const {
  const sim::World& world = source_.world();
  Json json;
  json.begin('{')
      .member("robot", played_.robot)
      .member("start_s", in_s(world.start()))
      .member("duration_s", in_s(world.duration()))
      .key("faults")
      .begin('[');
  const auto all = sim::fault_table();
  for (std::size_t i = 0; i < all.size(); ++i)
    if (sim::can_act(all[i].fault, world_))
      json.begin('{')
          .member("number", i)
          .member("name", all[i].name)
          .member("what", all[i].what)
          .member("duration_s", all[i].duration_s)
          .member("on", falls_on(all[i].falls_on))
          .end('}');
  json.end(']').key("landmarks").begin('[');
  for (const sim::Landmark& mark : world.map_given() ? world.map() : std::span<const sim::Landmark>{})
    json.begin('[').value(mark.x_m).value(mark.y_m).end(']');
  write(Channel::kStage, json.end(']').end('}').text());
}

sim::Result<> Play::advance(std::uint32_t ticks) {
  bool over = false;
  for (std::uint32_t i = 0; i < ticks; ++i) {
    sim::Tick tick;
    if (!source_.next(tick)) {
      over = true;
      break;
    }
    played_.duration += kTick;
    bus_.now = source_.truth().time;
    if (!handed_.empty()) {
      inputs_.assign(tick.inputs.begin(), tick.inputs.end());
      inputs_.insert(inputs_.end(), handed_.begin(), handed_.end());
      handed_.clear();
      tick.inputs = inputs_;
    }
    if (auto asked = lockstep_.ask(tick); !asked) return asked;
    while (lockstep_.in_flight() > 0)
      if (auto answered = lockstep_.answers(); !answered) return answered;
    truth_row(tick.time);
  }
  bus_.run.flush();
  write(Channel::kTruth, truth_);
  write(Channel::kFrames, bus_.frames);
  truth_.clear();
  bus_.frames.clear();
  Json json;
  json.begin('{').member("time_s", in_s(played_.duration)).member("over", bool{over});
  put_origin(json, bus_.run.origin());
  write(Channel::kPlayed, json.end('}').text());
  return {};
}

std::optional<sim::GeodeticOrigin> Play::map_origin() const {
  return world_.surveyed ? source_.world().origin() : bus_.origin.from_fix();
}

void Play::truth_row(base::Micros time) {
  if (bus_.origin_stated || !to_map_)
    if (const auto origin = map_origin()) to_map_.emplace(sim::Earth(source_.world().origin()), sim::Earth(*origin));
  bus_.origin_stated = false;
  line_.clear();
  line_.fixed(time.us, 6);
  if (to_map_) {
    const sim::Truth truth = sim::in_frame(source_.truth(), *to_map_);
    for (const double x : {truth.x_m, truth.y_m, truth.yaw_rad, truth.z_m}) line_.put(',').real(x, 6);
  } else {
    line_.text(",,,,");
  }
  truth_ += line_.put('\n').view();
}

sim::Result<> Play::inject(std::uint32_t fault, base::Micros duration) {
  const auto all = sim::fault_table();
  if (fault >= all.size()) return sim::Failure{"no fault of number " + std::to_string(fault)};
  const sim::FaultInfo& row = all[fault];
  if (!sim::can_act(row.fault, world_))
    return sim::Failure{std::string(row.name) + " cannot act on robot " + played_.robot};
  if (row.duration_s > 0 && duration.us <= 0) return sim::Failure{std::string(row.name) + " needs a duration"};
  const sim::FaultSetting setting = source_.inject(row.fault, row.duration_s > 0 ? duration : base::Micros{});
  played_.faults.push_back(setting);
  Json json;
  json.begin('{')
      .member("name", row.name)
      .member("start_s", in_s(setting.start))
      .member("end_s", in_s(setting.start + setting.duration))
      .end('}');
  write(Channel::kInjected, json.text());
  return {};
}

void Play::script() {
  const sim::Tables::Totals totals = bus_.run.so_far();
  sim::Line crc;
  crc.hex(totals.state_crc, 8);
  Json json;
  json.begin('{')
      .member("text", sim::text_of(played_))
      .member("epochs", totals.epochs)
      .member("frames_lost", bus_.run.counts.lost())
      .member("estimates_sha256", totals.estimates_sha256)
      .member("state_crc_last", crc.view())
      .end('}');
  write(Channel::kScript, json.text());
}

}  // namespace tetap::page
