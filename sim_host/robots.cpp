// SPDX-License-Identifier: Apache-2.0
#include "sim_host/robots.hpp"

#include "configured_robots.hpp"  // made by CMake of what lies in config/
#include "sim_host/matched_rover.hpp"
#include "tetap/param/limits.hpp"

#include <dlfcn.h>
#include <unistd.h>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace tetap::sim {

namespace {

/// A robot of simulation alone: another one with parameters that equal the noise of the world.
struct Matched {
  const char* name;
  const char* of;
  param::Parameters (*parameters)();
};
constexpr std::array<Matched, 2> kMatched{
    {{"rover_landmarks_matched", "rover_landmarks", [] { return matched_landmarks_rover(); }},
     {"rover_matched", "rover", [] { return matched_rover(); }}}};

bool is_configured(const std::string& name) {
  std::istringstream all{kConfiguredRobots};
  for (std::string known; all >> known;)
    if (known == name) return true;
  return false;
}

/// In ../lib/tetap/robots of an installed program; else in the build's folder.
std::string module_of(const std::string& name) {
  static const std::string folder = [] {
    std::error_code error;
    const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
    const auto beside = program.parent_path().parent_path() / "lib/tetap/robots";
    return !error && std::filesystem::is_directory(beside, error) ? beside.string() : std::string(kModules);
  }();
  return folder + "/" + name + ".so";
}

/// The module stays in memory until the program ends.
const Robot* read_module(const std::string& name) {
  static std::map<std::string, const Robot*> read;
  if (const auto found = read.find(name); found != read.end()) return found->second;
  void* const module = dlopen(module_of(name).c_str(), RTLD_NOW | RTLD_LOCAL);
  if (module == nullptr) throw std::runtime_error("robot '" + name + "': " + dlerror());
  using Describe = const Robot*();
  auto* const describe = reinterpret_cast<Describe*>(dlsym(module, ("tetap_robot_" + name).c_str()));
  if (describe == nullptr) throw std::runtime_error("robot '" + name + "': " + dlerror());
  return read[name] = describe();
}

}  // namespace

const std::string& robot_names() {
  static const std::string names = [] {
    std::string all = kConfiguredRobots;
    for (const Matched& robot : kMatched) (all += ' ') += robot.name;
    return all;
  }();
  return names;
}

bool is_built(const std::string& name) {
  for (const Matched& matched : kMatched)
    if (name == matched.name) return is_built(matched.of);
  return is_configured(name) && access(module_of(name).c_str(), R_OK) == 0;
}

const Robot& robot_named(const std::string& name) {
  static std::map<std::string, std::pair<param::Parameters, Robot>> matched_robots;
  for (const Matched& matched : kMatched) {
    if (name != matched.name) continue;
    auto& [parameters, robot] = matched_robots[name];
    if (robot.parameters == nullptr) {
      parameters = matched.parameters();
      robot = robot_named(matched.of);
      robot.name = matched.name;
      robot.parameters = &parameters;
    }
    return robot;
  }
  if (!is_configured(name)) throw std::runtime_error("no robot '" + name + "'; there are: " + robot_names());
  if (!is_built(name)) throw std::runtime_error("robot '" + name + "' is not built: make programs ROBOT=" + name);
  return *read_module(name);
}

void require_map_ids(const Robot& robot, std::uint32_t can_base) {
  if (!robot.takes.needs_map_ids() || param::has_map_ids(can_base)) return;
  std::array<char, 16> hex{};
  std::snprintf(hex.data(), hex.size(), "0x%X", static_cast<unsigned>(can_base));
  throw std::runtime_error(std::string("robot ") + robot.name + ": can_base is " + hex.data() + "; it has to be " +
                           param::kMapIdsRule);
}

param::Parameters parameters_of(const std::string& robot, const ParameterSettings& settings) {
  const Robot& found = robot_named(robot);
  const param::Parameters stated = settings.over(*found.parameters);
  require_map_ids(found, stated.can_base);
  return stated;
}

}  // namespace tetap::sim
