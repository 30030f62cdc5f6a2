// SPDX-License-Identifier: Apache-2.0
// Silicon or emulator: the one named seam of this port. The data sheets (UG1085, UG1087) define kSilicon. kEmulated is
// QEMU 7.2's xlnx-zcu102. It differs in identifier word and data words of the CAN controller (can_encoding.hpp). It
// differs in width and clock of the timer (ttc.hpp), and in the cost of an idle poll (rest(), here). One image runs on
// both; Ttc::probe() distinguishes them at boot.
#pragma once

namespace tetap::hal::zynqmp_r5 {

enum class Machine : unsigned char { kSilicon, kEmulated };

[[nodiscard]] constexpr const char* name(Machine machine) {
  return machine == Machine::kSilicon ? "silicon" : "emulated";
}

/// Called when a poll found nothing to do. In the emulator every register access takes the lock under which its event
/// loop delivers frames. Every look at the timer is a system call of the host. Polling without a break halves its
/// frames per second or worse.
inline void rest(Machine machine) {
  constexpr int kEmulatedRest = 10'000;  // about 50 us there; nothing on silicon
  if (machine == Machine::kSilicon) return;
  for (int i = 0; i < kEmulatedRest; ++i) asm volatile("nop");
}

}  // namespace tetap::hal::zynqmp_r5
