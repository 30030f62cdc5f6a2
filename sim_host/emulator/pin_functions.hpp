// SPDX-License-Identifier: Apache-2.0
// Alternate functions of the pins that the boards use: data sheets DS11139 (STM32F412Cx) and DS12288 (STM32G474xE),
// tables "Alternate functions", equal to the pin data that ST publishes for the packages.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <string>

namespace tetap::board {

/// Pin of a port: {'A', 5} is PA5.
struct Pin {
  char port = 'A';
  int number = 0;

  friend constexpr auto operator<=>(const Pin&, const Pin&) = default;
  [[nodiscard]] std::string name() const { return std::string("P") + port + std::to_string(number); }
};

enum class Signal : std::uint8_t {
  kSpi1Sck,
  kSpi1Miso,
  kSpi1Mosi,
  kSpi2Sck,
  kSpi2Miso,
  kSpi2Mosi,
  kUsart1Tx,
  kUsart1Rx,
  kUsart2Tx,
  kUsart2Rx,
  kTim2Ch1,
  kTim2Ch2,
  kTim3Ch1,
  kTim3Ch2,
  kCan1Tx,
  kCan1Rx,
  kFdcan1Tx,
  kFdcan1Rx,
};

[[nodiscard]] inline const char* name_of(Signal signal) {
  constexpr const char* kNames[] = {"SPI1_SCK",  "SPI1_MISO", "SPI1_MOSI", "SPI2_SCK",  "SPI2_MISO", "SPI2_MOSI",
                                    "USART1_TX", "USART1_RX", "USART2_TX", "USART2_RX", "TIM2_CH1",  "TIM2_CH2",
                                    "TIM3_CH1",  "TIM3_CH2",  "CAN1_TX",   "CAN1_RX",   "FDCAN1_TX", "FDCAN1_RX"};
  return kNames[static_cast<int>(signal)];
}

struct PinFunction {
  Signal signal;
  Pin pin;
  int alternate;  ///< AFR value
};

inline constexpr std::array kStm32f412PinFunctions = {
    PinFunction{Signal::kSpi1Sck, {'A', 5}, 5},   PinFunction{Signal::kSpi1Sck, {'B', 3}, 5},
    PinFunction{Signal::kSpi1Miso, {'A', 6}, 5},  PinFunction{Signal::kSpi1Miso, {'B', 4}, 5},
    PinFunction{Signal::kSpi1Mosi, {'A', 7}, 5},  PinFunction{Signal::kSpi1Mosi, {'B', 5}, 5},
    PinFunction{Signal::kSpi2Sck, {'B', 10}, 5},  PinFunction{Signal::kSpi2Sck, {'B', 13}, 5},
    PinFunction{Signal::kSpi2Miso, {'B', 14}, 5}, PinFunction{Signal::kSpi2Mosi, {'B', 15}, 5},
    PinFunction{Signal::kUsart1Tx, {'A', 9}, 7},  PinFunction{Signal::kUsart1Tx, {'A', 15}, 7},
    PinFunction{Signal::kUsart1Tx, {'B', 6}, 7},  PinFunction{Signal::kUsart1Rx, {'A', 10}, 7},
    PinFunction{Signal::kUsart1Rx, {'B', 3}, 7},  PinFunction{Signal::kUsart1Rx, {'B', 7}, 7},
    PinFunction{Signal::kUsart2Tx, {'A', 2}, 7},  PinFunction{Signal::kUsart2Rx, {'A', 3}, 7},
    PinFunction{Signal::kTim2Ch1, {'A', 0}, 1},   PinFunction{Signal::kTim2Ch1, {'A', 5}, 1},
    PinFunction{Signal::kTim2Ch1, {'A', 15}, 1},  PinFunction{Signal::kTim2Ch2, {'A', 1}, 1},
    PinFunction{Signal::kTim2Ch2, {'B', 3}, 1},   PinFunction{Signal::kTim3Ch1, {'A', 6}, 2},
    PinFunction{Signal::kTim3Ch1, {'B', 4}, 2},   PinFunction{Signal::kTim3Ch2, {'A', 7}, 2},
    PinFunction{Signal::kTim3Ch2, {'B', 5}, 2},   PinFunction{Signal::kCan1Tx, {'A', 12}, 9},
    PinFunction{Signal::kCan1Tx, {'B', 9}, 8},    PinFunction{Signal::kCan1Rx, {'A', 11}, 9},
    PinFunction{Signal::kCan1Rx, {'B', 8}, 8},
};

inline constexpr std::array kStm32g474PinFunctions = {
    PinFunction{Signal::kSpi1Sck, {'A', 5}, 5},   PinFunction{Signal::kSpi1Sck, {'B', 3}, 5},
    PinFunction{Signal::kSpi1Miso, {'A', 6}, 5},  PinFunction{Signal::kSpi1Miso, {'B', 4}, 5},
    PinFunction{Signal::kSpi1Mosi, {'A', 7}, 5},  PinFunction{Signal::kSpi1Mosi, {'B', 5}, 5},
    PinFunction{Signal::kUsart1Tx, {'A', 9}, 7},  PinFunction{Signal::kUsart1Tx, {'B', 6}, 7},
    PinFunction{Signal::kUsart1Tx, {'C', 4}, 7},  PinFunction{Signal::kUsart1Rx, {'A', 10}, 7},
    PinFunction{Signal::kUsart1Rx, {'B', 7}, 7},  PinFunction{Signal::kUsart1Rx, {'C', 5}, 7},
    PinFunction{Signal::kUsart2Tx, {'A', 2}, 7},  PinFunction{Signal::kUsart2Tx, {'A', 14}, 7},
    PinFunction{Signal::kUsart2Tx, {'B', 3}, 7},  PinFunction{Signal::kUsart2Rx, {'A', 3}, 7},
    PinFunction{Signal::kUsart2Rx, {'A', 15}, 7}, PinFunction{Signal::kUsart2Rx, {'B', 4}, 7},
    PinFunction{Signal::kTim2Ch1, {'A', 0}, 1},   PinFunction{Signal::kTim2Ch1, {'A', 5}, 1},
    PinFunction{Signal::kTim2Ch1, {'A', 15}, 1},  PinFunction{Signal::kTim2Ch2, {'A', 1}, 1},
    PinFunction{Signal::kTim2Ch2, {'B', 3}, 1},   PinFunction{Signal::kTim3Ch1, {'A', 6}, 2},
    PinFunction{Signal::kTim3Ch1, {'B', 4}, 2},   PinFunction{Signal::kTim3Ch1, {'C', 6}, 2},
    PinFunction{Signal::kTim3Ch2, {'A', 4}, 2},   PinFunction{Signal::kTim3Ch2, {'A', 7}, 2},
    PinFunction{Signal::kTim3Ch2, {'B', 5}, 2},   PinFunction{Signal::kTim3Ch2, {'C', 7}, 2},
    PinFunction{Signal::kFdcan1Tx, {'A', 12}, 9}, PinFunction{Signal::kFdcan1Tx, {'B', 9}, 9},
    PinFunction{Signal::kFdcan1Rx, {'A', 11}, 9}, PinFunction{Signal::kFdcan1Rx, {'B', 8}, 9},
};

}  // namespace tetap::board
