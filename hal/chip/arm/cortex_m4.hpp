// SPDX-License-Identifier: Apache-2.0
// System registers of the Cortex-M4 that a port and the emulated core use. Source: ARMv7-M Architecture Reference
// Manual (ARM DDI 0403E.e) chapter B3 and C1, Cortex-M4 Technical Reference Manual (ARM 100166) chapters 4 to 9; no
// vendor's SVD has them.
#pragma once

#include "hal/chip/support/register_field.hpp"

#include <cstdint>

namespace tetap::hal::cortex_m4 {

/// DWT, C1.8.
inline constexpr std::uint32_t kDwt = 0xE000'1000;
namespace dwt {
inline constexpr std::uint32_t kCtrl = 0x000, kCyccnt = 0x004;
inline constexpr Field kCyccntena{0};
}  // namespace dwt

/// System control space, B3.1.1. Offsets of the blocks below count from here.
inline constexpr std::uint32_t kSystemControlSpace = 0xE000'E000;

/// SysTick, B3.3.
namespace systick {
inline constexpr std::uint32_t kCsr = 0x010, kRvr = 0x014, kCvr = 0x018;
inline constexpr Field kEnable{0}, kTickint{1}, kClksource{2}, kCountflag{16}, kReload{0, 24};
}  // namespace systick

/// NVIC, B3.4: set and clear registers hold 32 interrupts a word, priorities 4 a word.
namespace nvic {
inline constexpr std::uint32_t kIser = 0x100, kIcer = 0x180, kIspr = 0x200, kIcpr = 0x280, kIabr = 0x300, kIpr = 0x400,
                               kStir = 0xF00;
}  // namespace nvic

/// System control block, B3.2.
namespace scb {
inline constexpr std::uint32_t kCpuid = 0xD00, kIcsr = 0xD04, kVtor = 0xD08, kAircr = 0xD0C, kScr = 0xD10, kCcr = 0xD14,
                               kShpr1 = 0xD18, kShpr2 = 0xD1C, kShpr3 = 0xD20, kShcsr = 0xD24, kCfsr = 0xD28,
                               kHfsr = 0xD2C, kMmfar = 0xD34, kBfar = 0xD38, kCpacr = 0xD88, kDemcr = 0xDFC;
inline constexpr Field kVectactive{0, 9}, kRettobase{11}, kVectpending{12, 9}, kIsrpending{22}, kPendstclr{25},
    kPendstset{26}, kPendsvclr{27}, kPendsvset{28}, kNmipendset{31};
inline constexpr Field kVectkey{16, 16}, kPrigroup{8, 3}, kSysresetreq{2};
inline constexpr Field kSleepdeep{2};
inline constexpr Field kUnalignTrp{3}, kDiv0Trp{4}, kStkalign{9};
inline constexpr Field kMemfaultena{16}, kBusfaultena{17}, kUsgfaultena{18};
inline constexpr Field kDaccviol{1}, kMstkerr{4}, kMmarvalid{7};
inline constexpr Field kIbuserr{8}, kPreciserr{9}, kImpreciserr{10}, kStkerr{12}, kBfarvalid{15};
inline constexpr Field kUndefinstr{16}, kInvstate{17}, kInvpc{18}, kNocp{19}, kUnaligned{24}, kDivbyzero{25};
inline constexpr Field kVecttbl{1}, kForced{30};
inline constexpr Field kCp10{20, 2}, kCp11{22, 2};
inline constexpr Field kTrcena{24};
}  // namespace scb

/// MPU, B3.5.
namespace mpu {
inline constexpr std::uint32_t kType = 0xD90, kCtrl = 0xD94, kRnr = 0xD98, kRbar = 0xD9C, kRasr = 0xDA0;
inline constexpr Field kEnable{0}, kHfnmiena{1}, kPrivdefena{2};
inline constexpr Field kRegion{0, 4}, kValid{4}, kAddress{5, 27};
inline constexpr Field kRegionEnable{0}, kSize{1, 5}, kSrd{8, 8}, kAp{24, 3}, kXn{28};
}  // namespace mpu

/// Floating-point context control, B3.2.21.
namespace fpu {
inline constexpr std::uint32_t kFpccr = 0xF34, kFpcar = 0xF38, kFpdscr = 0xF3C;
inline constexpr Field kLspen{30}, kAspen{31};
}  // namespace fpu

}  // namespace tetap::hal::cortex_m4
