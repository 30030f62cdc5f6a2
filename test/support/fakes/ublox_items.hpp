// SPDX-License-Identifier: Apache-2.0
// The configuration items of a u-blox receiver that the fake has: names, key IDs and types as the interface description
// lists them (UBX-18010854 R04, sec. 6.7, group by group; CFG-MSGOUT-UBX_NAV_COV is in UBX-22008968 only). Neighbours
// of what a host wants are here on purpose: the same message on another port is another item that exists. Knows no
// driver: what a driver sends is judged against it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tetap::fakes::ublox {

struct Item {
  std::string_view name;
  std::uint32_t id;
  std::string_view type;   ///< sec. 6.2: L one bit, U unsigned, E enumeration, the number of bytes
  std::uint32_t standard;  ///< in the default layer
  std::uint32_t least, most;
};

inline constexpr std::uint32_t kAny = 0xFFFF'FFFF;

/// Ranges: measRate, navRate, timeRef of sec. 5.9.19; dynModel, fixMode of sec. 5.9.13; baud rates of the integration
/// manual (UBX-18010802 R08), sec. 3.6.1.
inline constexpr auto kItems = std::to_array<Item>({
    {"CFG-UART1-BAUDRATE", 0x40520001, "U4", 38'400, 9'600, 921'600},
    {"CFG-UART2-BAUDRATE", 0x40530001, "U4", 38'400, 9'600, 921'600},
    {"CFG-UART1INPROT-UBX", 0x10730001, "L", 1, 0, 1},
    {"CFG-UART1INPROT-NMEA", 0x10730002, "L", 1, 0, 1},
    {"CFG-UART1INPROT-RTCM3X", 0x10730004, "L", 1, 0, 1},
    {"CFG-UART1OUTPROT-UBX", 0x10740001, "L", 1, 0, 1},
    {"CFG-UART1OUTPROT-NMEA", 0x10740002, "L", 1, 0, 1},
    {"CFG-UART1OUTPROT-RTCM3X", 0x10740004, "L", 0, 0, 1},
    {"CFG-UART2INPROT-UBX", 0x10750001, "L", 0, 0, 1},
    {"CFG-UART2OUTPROT-UBX", 0x10760001, "L", 0, 0, 1},
    {"CFG-UART2OUTPROT-NMEA", 0x10760002, "L", 0, 0, 1},
    {"CFG-RATE-MEAS", 0x30210001, "U2", 1'000, 25, 0xFFFF},
    {"CFG-RATE-NAV", 0x30210002, "U2", 1, 1, 127},
    {"CFG-RATE-TIMEREF", 0x20210003, "E1", 1, 0, 4},
    {"CFG-NAVSPG-FIXMODE", 0x20110011, "E1", 3, 1, 3},
    {"CFG-NAVSPG-DYNMODEL", 0x20110021, "E1", 0, 0, 10},
    {"CFG-MSGOUT-UBX_NAV_PVT_I2C", 0x20910006, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_PVT_UART1", 0x20910007, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_PVT_UART2", 0x20910008, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_PVT_USB", 0x20910009, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_PVT_SPI", 0x2091000A, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_POSLLH_UART1", 0x2091002A, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_DOP_UART1", 0x20910039, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_COV_I2C", 0x20910083, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_COV_UART1", 0x20910084, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-UBX_NAV_COV_UART2", 0x20910085, "U1", 0, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_RMC_UART1", 0x209100AC, "U1", 1, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_VTG_UART1", 0x209100B1, "U1", 1, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_GGA_UART1", 0x209100BB, "U1", 1, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_GSA_UART1", 0x209100C0, "U1", 1, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_GLL_UART1", 0x209100CA, "U1", 1, 0, kAny},
    {"CFG-MSGOUT-NMEA_ID_GST_UART1", 0x209100D4, "U1", 0, 0, kAny},
});

/// Sec. 6.2: bits 30 to 28 of the key; 0: a key of no size that there is.
[[nodiscard]] constexpr std::size_t value_bytes(std::uint32_t id) {
  constexpr std::size_t kBytes[8] = {0, 1, 1, 2, 4, 8, 0, 0};
  return kBytes[id >> 28 & 7];
}

/// nullptr: the receiver does not know it.
[[nodiscard]] constexpr const Item* find(std::uint32_t id) {
  const auto* found = std::ranges::find(kItems, id, &Item::id);
  return found == kItems.end() ? nullptr : found;
}

/// The key of a name, at compile time: a name that is not in the table does not compile.
[[nodiscard]] consteval std::uint32_t key(std::string_view name) {
  return std::ranges::find(kItems, name, &Item::name)->id;
}

[[nodiscard]] constexpr bool in_range(const Item& item, std::uint32_t value) {
  if (item.name.ends_with("-BAUDRATE")) {
    constexpr auto kBauds =
        std::to_array<std::uint32_t>({9'600, 19'200, 38'400, 57'600, 115'200, 230'400, 460'800, 921'600});
    return std::ranges::find(kBauds, value) != kBauds.end();
  }
  if (item.name == "CFG-NAVSPG-DYNMODEL" && value == 1) return false;
  return value >= item.least && value <= item.most;
}

}  // namespace tetap::fakes::ublox
