// SPDX-License-Identifier: Apache-2.0
// Two senders of one identifier: each has a counter of its own, so two chains of rising Seq alternate.
#pragma once

#include "sim_host/doctor/detector.hpp"
#include "sim_host/doctor/header.hpp"

#include <array>
#include <string>

namespace tetap::doctor {

class SequenceDetector : public Detector {
 public:
  void frame(const SeenFrame& seen) override;
  void finish(Findings& findings) override;

 private:
  struct Stream {
    std::string message;
    std::uint8_t instance = 0;
    std::uint64_t last_bits = 0;
    bool begun = false;
    std::array<std::uint32_t, 2> chain{};
    std::size_t chains = 0;
    std::size_t latest = 0;        ///< chain of the frame before
    std::uint64_t frames = 0;      ///< repeats of a whole frame left out
    std::uint64_t switches = 0;    ///< frames that go on with the other chain
    std::uint64_t new_chains = 0;  ///< frames that go on with none
  };
  std::array<Stream, kStreams> streams_;
};

}  // namespace tetap::doctor
