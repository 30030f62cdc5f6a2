// SPDX-License-Identifier: Apache-2.0
// Prints one hash over all measurements and truths of some worlds: the same whatever compiler and optimisation built
// it.
#include "sim_host/world/floor_plan.hpp"
#include "test/sim/support.hpp"

#include <cinttypes>
#include <cstdio>

using namespace tetap;
using namespace tetap::sim;

int main() {
  Hash h;
  for (const int which : {0, 1, 2, 3, 4}) {
    World::Options options{.mismatched = which > 0};
    if (which == 2) {
      options.parameters.vehicle.kind = VehicleKind::kMulticopter;
      options.course = flight_course(1);
      options.place = GeodeticOrigin{.latitude_deg = 80, .longitude_deg = 179.95, .height_m = 20};
      options.origin = origin_with(*options.place, 60'000, -30'000);
    }
    if (which == 3) {
      options.parameters.vehicle.kind = VehicleKind::kCar;
      options.parameters.vehicle.turning_radius_m = 5.5;
      options.parameters.wheels.output = WheelOutput::kBodySpeed;
      options.parameters.imu.mounting_bs = {{0, 0, -1, -1, 0, 0, 0, 1, 0}};
    }
    if (which == 4) {
      options.course = lab_course(1);
      options.course.landmarks = {{1, 20, 7}, {2, 31, 15}, {3, 5, 9}};
      options.parameters.lidar.rate_hz = 10;
      options.parameters.features.rate_hz = 10;
      options.parameters.features.recognise = true;
      options.parameters.people.count = 5;
    }
    options.parameters.magnetometer.rate_hz = 20;
    options.parameters.barometer.rate_hz = 10;
    for (const auto& row : fault_table())
      options.faults.push_back({row.fault, seconds_us(row.start_s), seconds_us(row.duration_s)});
    World world{options, 42};
    std::vector<Measurement> arrived;
    for (base::Micros t = world.start(); t < world.start() + world.duration(); t += base::Micros{100'000}) {
      arrived.clear();
      world.advance_to(t, arrived);
      for (const auto& m : arrived) h.add(m);
      h.add(world.truth());
    }
  }
  std::printf("%016" PRIx64 "\n", h.value());
}
