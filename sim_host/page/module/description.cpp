// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/description.hpp"

#include "sim_host/doctor/codes.hpp"
#include "sim_host/page/module/json.hpp"
#include "sim_host/page/module/robots.hpp"
#include "sim_host/replay/names.hpp"
#include "tetap/param/crc.hpp"
#include "tetap/param/table.hpp"
#include "version.hpp"

namespace tetap::page {

namespace {

void put_robot(Json& json, const sim::Robot& robot) {
  json.begin('{').member("name", robot.name).member("config", param::crc(*robot.parameters));
  json.key("takes").begin('[');
  for (unsigned kind = 0; kind < static_cast<unsigned>(sensor::Sensor::kNotAvailable); ++kind)
    if ((robot.takes.sensors >> kind & 1U) != 0) json.value(sim::name(static_cast<sensor::Sensor>(kind)));
  json.end(']').member("needs_imu", bool{robot.takes.needs_imu}).key("estimators").begin('[');
  for (const sim::EstimatorInfo& one : robot.estimators)
    json.begin('{').member("kind", sim::name(one.kind)).member("bytes", one.bytes).end('}');
  json.end(']').key("values").begin('[');
  for (const param::Row& row : param::kTable) {
    json.begin('[');
    for (std::size_t i = 0; i < row.elements; ++i)
      json.value(param::is_secret(row) ? 0.0 : row.get(*robot.parameters, i));
    json.end(']');
  }
  json.end(']').end('}');
}

void put_row(Json& json, const param::Row& row) {
  const char* const storage = row.storage == param::Storage::kFloat   ? "float"
                              : row.storage == param::Storage::kWhole ? "whole"
                                                                      : "steps";
  json.begin('{')
      .member("path", row.path)
      .member("unit", row.unit)
      .member("minimum", row.minimum)
      .member("maximum", row.maximum)
      .member("live", row.effect == param::Effect::kLive)
      .member("text", row.text)
      .member("storage", storage)
      .member("secret", param::is_secret(row))
      .end('}');
}

}  // namespace

std::string description() {
  Json json;
  sim::Line git;
  git.hex(version().git, 7);
  json.begin('{').member("git", git.view()).member("dirty", bool{version().dirty});
  json.key("robots").begin('[');
  for (const sim::Robot* robot : robots()) put_robot(json, *robot);
  json.end(']').key("parameters").begin('[');
  for (const param::Row& row : param::kTable) put_row(json, row);
  json.end(']').key("codes").begin('[');
  for (const doctor::CodeRow& code : doctor::kCodes)
    json.begin('{').member("name", code.name).member("cause", code.cause).member("change", code.change).end('}');
  return json.end(']').end('}').text();
}

}  // namespace tetap::page
