// SPDX-License-Identifier: Apache-2.0
// Definition of make_firmware(). Only the files that instantiate it for a robot include this.
#pragma once

#include "node/bus_protection.hpp"
#include "node/firmware.hpp"
#include "sim_host/robot_firmware.hpp"

#include <memory>

namespace tetap::sim {

template <class Estimators>
std::unique_ptr<RobotFirmware> make_firmware(HostBoard& board, const param::Parameters& parameters,
                                             const bus::Version& version) {
  class Firmware final : public RobotFirmware {
   public:
    Firmware(HostBoard& board, const param::Parameters& parameters, const bus::Version& version)
        : firmware_(board, parameters, version) {}
    void poll() override { firmware_.poll(); }
    std::uint32_t self_check(std::uint32_t epochs) override { return firmware_.self_check(epochs); }
    bool resume(std::span<const std::byte> state) override { return firmware_.resume(state); }

   private:
    node::Firmware<HostBoard, node::WithBusProtection<Estimators>> firmware_;
  };
  return std::make_unique<Firmware>(board, parameters, version);
}

}  // namespace tetap::sim
