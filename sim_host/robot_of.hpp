// SPDX-License-Identifier: Apache-2.0
// What a robot's module is made of. Only the files that CMake writes for modules include this.
#pragma once

#include "sim_host/robot.hpp"
#include "tetap/firmware/firmware.hpp"
#include "tetap/node/bus_protection.hpp"
#include "tetap/param/limits.hpp"
#include "tetap/sensor/sample.hpp"

#include <array>
#include <cstdint>
#include <memory>

namespace tetap::sim {

/// With the sensor's instance or without.
template <class E, class Payload>
concept Takes = requires(E& e, const Payload& payload, base::Micros stamp, const estimators::Context& ctx) {
  e.fuse(payload, stamp, ctx);
}
|| requires(E& e, const Payload& payload, base::Micros stamp, const estimators::Context& ctx) {
  e.fuse(payload, stamp, std::uint8_t{}, ctx);
};

/// An estimator that maps landmarks which its sightings do not name.
template <class E>
concept MapsNameless = requires {
  requires E::kTakesNameless;
};

/// A bit for each kind of sample that one of them takes.
template <class... E>
[[nodiscard]] constexpr std::uint32_t sensors_of(node::Estimators<E...>) {
  std::uint32_t taken = 0;
  for (unsigned kind = 0; kind < static_cast<unsigned>(sensor::Sensor::kNotAvailable); ++kind) {
    sensor::Sample sample;
    sample.sensor = static_cast<sensor::Sensor>(kind);
    sensor::visit(sample,
                  [&]<class Payload>(const Payload&) { taken |= (Takes<E, Payload> || ...) ? 1U << kind : 0U; });
  }
  return taken;
}

template <class... E>
[[nodiscard]] constexpr auto infos_of(node::Estimators<E...>) {
  return std::array<EstimatorInfo, sizeof...(E)>{EstimatorInfo{E::kKind, sizeof(node::EstimatorSlot<E>)}...};
}
template <class Estimators>
inline constexpr auto kEstimatorInfos = infos_of(Estimators{});

template <class... E>
[[nodiscard]] constexpr EstimatorFacts facts_of(node::Estimators<E...> all) {
  using Kind = sensor::EstimatorKind;
  return {.sensors = sensors_of(all),
          .inertial = ((E::kKind == Kind::kInertial) || ...),
          .needs_imu = ((E::kKind == Kind::kInertial || E::kKind == Kind::kAttitude) || ...),
          .imu = (Takes<E, sensor::ImuSample> || ...),
          .sightings = (Takes<E, sensor::LandmarkSighting> || ...),
          .magnetic = (Takes<E, sensor::MagneticFlux> || ...),
          .pressure = (Takes<E, sensor::AirPressure> || ...),
          .closures = (Takes<E, sensor::LoopClosure> || ...),
          .images = (Takes<E, sensor::CameraImage> || ...),
          .scans = (Takes<E, sensor::PlanarScan> || ...),
          .relatives = (Takes<E, sensor::RelativePose> || ...),
          .heading = (Takes<E, sensor::OutsideHeading> || ...),
          .own_map = (estimators::MakesMap<E> || ...),
          .nameless = (MapsNameless<E> || ...)};
}
template <class Estimators>
[[nodiscard]] constexpr EstimatorFacts facts_of_robot() {
  EstimatorFacts facts = facts_of(Estimators{});
  facts.parameters = node::kHasBusParameters<Estimators>;
  facts.given_map = node::kHasField<Estimators>;
  return facts;
}

/// Firmware with these estimators, tags and guards included: a host has room for what parameters may ask for. The board
/// and the parameters outlive it.
template <class Estimators>
[[nodiscard]] std::unique_ptr<RobotFirmware> make_firmware(HostBoard& board, const param::Parameters& parameters,
                                                           const bus::Version& version) {
  class Firmware final : public RobotFirmware {
   public:
    Firmware(HostBoard& board, const param::Parameters& parameters, const bus::Version& version)
        : firmware_(board, parameters, version) {}
    void poll() override { firmware_.poll(); }
    std::uint32_t self_check(std::uint32_t epochs) override { return firmware_.self_check(epochs); }
    bool resume(std::span<const std::byte> state) override { return firmware_.resume(state); }

   private:
    firmware::Firmware<HostBoard, node::WithBusProtection<Estimators>> firmware_;
  };
  return std::make_unique<Firmware>(board, parameters, version);
}

template <class Estimators>
[[nodiscard]] Robot robot_of(const char* name, const param::Parameters& parameters) {
  return {.name = name,
          .parameters = &parameters,
          .takes = facts_of_robot<Estimators>(),
          .estimators = kEstimatorInfos<Estimators>,
          .make_firmware = &make_firmware<Estimators>};
}

}  // namespace tetap::sim
