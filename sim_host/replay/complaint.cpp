// SPDX-License-Identifier: Apache-2.0
#include "sim_host/replay/complaint.hpp"

namespace tetap::sim {

namespace {

std::string about_record(const Comparison& seen) {
  const auto count = [](std::uint64_t n) { return std::to_string(n); };
  const Recording& recording = seen.recording();
  if (seen.different() > 0)
    return (seen.other_numbers()
                ? "the recorded node was another robot or ran with other numbers (Est_Version.Config): "
                : std::string()) +
           count(seen.different()) + " of " + count(seen.compared()) + " epochs differ from the recording; first " +
           seen.first_difference() +
           (seen.other_numbers() ? "; --lockstep plays its inputs alone (make replay PLAY=--lockstep)" : "");
  if (seen.missing() > 0) return count(seen.missing()) + " recorded epochs were not repeated";
  if (recording.hole)
    return recording.hole->why + "; " + count(seen.compared()) + " epochs up to there are equal, " +
           count(recording.unlogged) + " behind it cannot be repeated";
  if (recording.missing_outputs > 0)
    return "the recording itself lacks " + count(recording.missing_outputs) + " frames of the node";
  return {};
}

}  // namespace

std::string complaint(const Counts& counts, const Comparison* comparison) {
  const auto count = [](std::uint64_t n) { return std::to_string(n); };
  if (counts.lost() > 0)
    return count(counts.lost()) + " frames lost (" + count(counts.lost_inputs) + " to the node, " +
           count(counts.lost_outputs) + " from it, of these " + count(counts.overflows) + " in our own socket)";
  if (counts.extra() > 0)
    return count(counts.extra()) + " frames too many (" + count(counts.extra_inputs) + " to the node, " +
           count(counts.extra_outputs) + " from it): is there another sender on this bus?";
  return comparison == nullptr ? std::string() : about_record(*comparison);
}

}  // namespace tetap::sim
