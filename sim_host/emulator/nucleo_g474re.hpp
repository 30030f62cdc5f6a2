// SPDX-License-Identifier: Apache-2.0
// The wiring of a Nucleo-G474RE (MB1367, UM2505) with IMU, encoders, receiver and CAN transceiver at its headers.
// USART2 (PA2) is the console on ST-LINK's virtual port; the transceiver is always on.
#pragma once

#include "sim_host/emulator/board.hpp"
#include "sim_host/emulator/stm32g474.hpp"

namespace tetap::board {

class NucleoG474re : public Board {
 public:
  explicit NucleoG474re(const BoardOptions& options = {}, SensorWorld world = {});

  static constexpr std::int64_t kCrystal_hz = 24'000'000;  ///< X3
  static constexpr Pin kImuSelect{'A', 4}, kImuReady{'B', 0}, kLed{'C', 8};
  static constexpr Stm32g474Pins kPins{.usart1_tx = {'C', 4},
                                       .usart1_rx = {'C', 5},
                                       .usart2_tx = {'A', 2},
                                       .usart2_rx = {'A', 3},
                                       .spi1_sck = {'A', 5},
                                       .spi1_miso = {'A', 6},
                                       .spi1_mosi = {'A', 7},
                                       .tim2_ch1 = {'A', 0},
                                       .tim2_ch2 = {'A', 1},
                                       .tim3_ch1 = {'B', 4},
                                       .tim3_ch2 = {'B', 5},
                                       .fdcan1 = {.tx = {'A', 12}, .rx = {'A', 11}}};

  Stm32g474& chip;

 private:
  NucleoG474re(std::unique_ptr<Stm32g474> stm32g474, const BoardOptions& options, SensorWorld world);
};

}  // namespace tetap::board
