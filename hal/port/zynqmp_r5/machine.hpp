// SPDX-License-Identifier: Apache-2.0
// Silicon or emulator: the one named seam of this port. The data sheets (UG1085, UG1087) are what kSilicon means. kEmulated is
// QEMU 7.2's xlnx-zcu102, which differs in three places: identifier word and data words of the CAN controller (can_encoding.hpp),
// width and clock of the timer (ttc.hpp). One image runs on both; Ttc::probe() tells them apart at boot.
#pragma once

namespace tetap::hal::zynqmp_r5 {

enum class Machine : unsigned char { kSilicon, kEmulated };

[[nodiscard]] constexpr const char* name(Machine machine) { return machine == Machine::kSilicon ? "silicon" : "emulated"; }

}  // namespace tetap::hal::zynqmp_r5
