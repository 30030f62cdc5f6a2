// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/seconds.hpp"

#include <cmath>
#include <cstddef>
#include <optional>

namespace tetap::page {
namespace {

using doctor::Vector3;
using doctor::Window;

std::optional<double> element(const std::optional<Vector3>& vector, std::size_t i) {
  if (!vector) return std::nullopt;
  return (*vector)[i];
}

}  // namespace

void put_seconds(Json& json, const std::vector<Window>& windows, const doctor::RobotFacts& robot) {
  const double track_m = doctor::wheel_scale(robot).track_m;
  const auto column = [&](const char* name, auto&& value) {
    json.key(name).begin('[');
    for (const Window& w : windows) {
      const std::optional<double> one = value(w);
      if (one && std::isfinite(*one))
        json.value(*one);
      else
        json.nothing();
    }
    json.end(']');
  };
  const auto vector = [&](const char* const(&names)[3], auto&& of) {
    for (std::size_t i = 0; i < 3; ++i) column(names[i], [&](const Window& w) { return element(of(w), i); });
  };
  json.key("seconds").begin('{');
  column("t", [](const Window& w) -> std::optional<double> { return w.start_s + 0.5; });
  column("turn", [](const Window& w) -> std::optional<double> {
    if (!w.turn_s_radps) return std::nullopt;
    return doctor::dot(*w.turn_s_radps, w.up_s);
  });
  vector({"turn_x", "turn_y", "turn_z"}, [](const Window& w) { return w.turn_s_radps; });
  vector({"sensor_x", "sensor_y", "sensor_z"}, [](const Window& w) { return w.force_s_mps2; });
  vector({"force_x", "force_y", "force_z"}, [&](const Window& w) -> std::optional<Vector3> {
    if (!w.force_s_mps2 || !robot.mounting) return w.force_s_mps2;
    return doctor::rotated(*robot.mounting, *w.force_s_mps2);
  });
  column("wheel_turn", [&](const Window& w) -> std::optional<double> {
    if (!w.wheels || !w.wheels->difference_mps) return std::nullopt;
    return *w.wheels->difference_mps / track_m;
  });
  column("wheel_speed", [](const Window& w) -> std::optional<double> {
    if (!w.wheels) return std::nullopt;
    return w.wheels->sum_mps / 2;
  });
  column("east", [](const Window& w) { return element(w.velocity_n_mps, 0); });
  column("north", [](const Window& w) { return element(w.velocity_n_mps, 1); });
  json.end('}');
}

}  // namespace tetap::page
