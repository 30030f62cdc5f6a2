// SPDX-License-Identifier: Apache-2.0
// The configuration items that the fake receiver knows. Manuals: UBX-18010854 (R04) sec. 6.2 and 6.7,
// UBX-22008968 (HPG 1.32), configuration reference, for key IDs, defaults and ranges.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string_view>

namespace tetap::fakes::ublox {

/// The types of the items that are used here (sec. 5.3.3 and 6.2).
enum class Type : std::uint8_t { kL, kE1, kU1, kU2, kU4 };

struct Item {
  std::string_view name;
  std::uint32_t id;
  Type type;
  std::uint32_t standard;         ///< the default layer of a ZED-F9P
  std::uint32_t lowest, highest;  ///< allowed in the RAM layer; see also in_range
};

namespace detail {
// Sec. 6.2: an item of type L holds 0 or 1.
constexpr Item flag(std::string_view name, std::uint32_t id, bool on) { return {name, id, Type::kL, on, 0, 1}; }
// Sec. 6.7, CFG-MSGOUT: any U1; 0 is off, n is every n-th epoch.
constexpr Item rate(std::string_view name, std::uint32_t id, std::uint32_t n) {
  return {name, id, Type::kU1, n, 0, 255};
}
}  // namespace detail

inline constexpr std::array kItems{
    Item{"CFG-UART1-BAUDRATE", 0x40520001, Type::kU4, 38400, 4800, 921600},
    Item{"CFG-UART2-BAUDRATE", 0x40530001, Type::kU4, 38400, 4800, 921600},
    detail::flag("CFG-UART1INPROT-UBX", 0x10730001, true),
    detail::flag("CFG-UART1INPROT-NMEA", 0x10730002, true),
    detail::flag("CFG-UART1INPROT-RTCM3X", 0x10730004, true),
    detail::flag("CFG-UART1OUTPROT-UBX", 0x10740001, true),
    detail::flag("CFG-UART1OUTPROT-NMEA", 0x10740002, true),
    detail::flag("CFG-UART1OUTPROT-RTCM3X", 0x10740004, true),
    // UART2 of the F9P is set up for corrections only.
    detail::flag("CFG-UART2INPROT-UBX", 0x10750001, false),
    detail::flag("CFG-UART2OUTPROT-UBX", 0x10760001, false),
    detail::flag("CFG-UART2OUTPROT-NMEA", 0x10760002, false),
    // Sec. 5.9.19: not below 25 ms, at most 127 measurements for a solution; times 0 to 4.
    Item{"CFG-RATE-MEAS", 0x30210001, Type::kU2, 1000, 25, 65535},
    Item{"CFG-RATE-NAV", 0x30210002, Type::kU2, 1, 1, 127},
    Item{"CFG-RATE-TIMEREF", 0x20210003, Type::kE1, 1, 0, 4},
    Item{"CFG-NAVSPG-FIXMODE", 0x20110011, Type::kE1, 3, 1, 3},
    // Models above 9 are not in every product, so this one has none of them.
    Item{"CFG-NAVSPG-DYNMODEL", 0x20110021, Type::kE1, 0, 0, 9},
    detail::rate("CFG-MSGOUT-UBX_NAV_PVT_I2C", 0x20910006, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_PVT_UART1", 0x20910007, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_PVT_UART2", 0x20910008, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_PVT_USB", 0x20910009, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_PVT_SPI", 0x2091000A, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_POSLLH_UART1", 0x2091002A, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_HPPOSLLH_I2C", 0x20910033, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_HPPOSLLH_UART1", 0x20910034, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_DOP_UART1", 0x20910039, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_COV_I2C", 0x20910083, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_COV_UART1", 0x20910084, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_COV_UART2", 0x20910085, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_RELPOSNED_I2C", 0x2091008D, 0),
    detail::rate("CFG-MSGOUT-UBX_NAV_RELPOSNED_UART1", 0x2091008E, 0),
    // Without being asked a receiver talks NMEA.
    detail::rate("CFG-MSGOUT-NMEA_ID_RMC_UART1", 0x209100AC, 1),
    detail::rate("CFG-MSGOUT-NMEA_ID_VTG_UART1", 0x209100B1, 1),
    detail::rate("CFG-MSGOUT-NMEA_ID_GGA_UART1", 0x209100BB, 1),
    detail::rate("CFG-MSGOUT-NMEA_ID_GSA_UART1", 0x209100C0, 1),
    detail::rate("CFG-MSGOUT-NMEA_ID_GLL_UART1", 0x209100CA, 1),
    detail::rate("CFG-MSGOUT-NMEA_ID_GST_UART1", 0x209100D4, 0),
};

/// Bytes of a value on the wire, from bits 30 to 28 of the key (sec. 6.2); 0: no such size.
constexpr std::size_t value_bytes(std::uint32_t id) {
  switch (id >> 28 & 7U) {
    case 1:  // one bit, sent as a byte
    case 2:
      return 1;
    case 3:
      return 2;
    case 4:
      return 4;
    case 5:
      return 8;
    default:
      return 0;
  }
}

/// nullptr: the firmware does not know it.
constexpr const Item* find(std::uint32_t id) {
  for (const Item& item : kItems) {
    if (item.id == id) return &item;
  }
  return nullptr;
}

/// The key ID of an item; an unknown name does not compile.
consteval std::uint32_t key(std::string_view name) {
  for (const Item& item : kItems) {
    if (item.name == name) return item.id;
  }
  throw std::invalid_argument("no such configuration item");
}

/// The rates of a UART (UBX-18010802, UART interface; 4800 is from UBX-13003221).
inline constexpr std::array<std::uint32_t, 9> kBauds{4800, 9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};

constexpr bool in_range(const Item& item, std::uint32_t value) {
  if (value < item.lowest || value > item.highest) return false;
  if (item.id == key("CFG-NAVSPG-DYNMODEL")) return value != 1;  // the enumeration leaves it out
  if (item.id != key("CFG-UART1-BAUDRATE") && item.id != key("CFG-UART2-BAUDRATE")) return true;
  for (const std::uint32_t baud : kBauds) {
    if (baud == value) return true;
  }
  return false;
}

}  // namespace tetap::fakes::ublox
