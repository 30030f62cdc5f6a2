// SPDX-License-Identifier: Apache-2.0
// INT (^C) and TERM ask a run to end: the files of that run are finished, and run.json has the reason.
#pragma once

#include <csignal>
#include <string>

namespace tetap::sim {

class Interruption {
 public:
  /// From now on the first INT or TERM is noted; a second one ends the program at once.
  static void expect() {
    struct sigaction action {};
    action.sa_handler = [](int signal) { signal_ = signal; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  }
  /// Number of the signal; 0: none came.
  [[nodiscard]] static int signal() { return signal_; }
  /// Empty while none came (sim::Interrupted).
  [[nodiscard]] static std::string text() {
    return signal_ == 0 ? "" : signal_ == SIGINT ? "interrupted (INT)" : "ended from outside (TERM)";
  }

 private:
  static inline volatile std::sig_atomic_t signal_ = 0;
};

}  // namespace tetap::sim
