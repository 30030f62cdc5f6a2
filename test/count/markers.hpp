// SPDX-License-Identifier: Apache-2.0
// Marks workloads in an image so that tools/proof/count_instructions can count their instructions in QEMU. Between
// begin and end stands only what is counted: input arrays and calls of public headers that the firmware instantiates
// too. A workload is named where it stands. One that is used in two places is declared above both.
//
//   tetap::count::calibrate();                                // once, first: the cost of the markers themselves
//   for (const auto& z : kInput) {                            // any number of times: worst and mean are reported
//     const tetap::count::Region<struct ekf_update> region;   // name in the table: ekf_update
//     filter.fuse(z);
//   }
//   tetap::count::opaque(filter);                             // the result is used, so nothing is optimised away
//   tetap::count::finish();                                   // ends the emulator; a run without it counts as crashed
#pragma once

namespace tetap::count {

/// The plugin recognises these functions by their addresses; the name is read from the symbol. noipa: the compiler may
/// neither inline nor merge them. It does not know what they do to memory, so no work on objects in memory moves across
/// a marker.
template <class Name>
[[gnu::noipa]] void begin() {
  asm volatile("" : : : "memory");
}
template <class Name>
[[gnu::noipa]] void end() {
  asm volatile("" : : : "memory");
}

/// Counts the instructions from here to the end of the scope. Regions may lie in one another.
template <class Name>
class [[nodiscard]] Region {
 public:
  [[gnu::always_inline]] Region() { begin<Name>(); }
  [[gnu::always_inline]] ~Region() { end<Name>(); }
  Region(const Region&) = delete;
  Region& operator=(const Region&) = delete;
};

/// Makes the compiler forget what it knows of an object: it was written, it is read. For inputs before and results
/// after a region.
template <class T>
[[gnu::always_inline]] inline void opaque(T& object) {
  asm volatile("" : "+m"(object) : : "memory");
}

/// An empty region, and one inside another: what tools/proof/count_instructions subtracts from all others.
[[gnu::noipa]] inline void calibrate() {
  const Region<struct calibration_outer> outer;
  const Region<struct calibration_empty> empty;
}

/// All is counted. On a board, where nobody listens, it just returns.
[[gnu::noipa]] inline void finish() { asm volatile("" : : : "memory"); }

}  // namespace tetap::count
