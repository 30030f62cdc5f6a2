// SPDX-License-Identifier: Apache-2.0
// The lesson's filter: position and speed of a cart on a rail, by the library's linear Kalman filter. All numbers of
// the lesson come from here.
#pragma once

#include "tetap/filter/kalman.hpp"
#include "tetap/filter/viewed.hpp"

#include <string>

namespace tetap::page {

struct LessonNumbers {
  float dt_s = 0.1F;
  float p0 = 10;     ///< P = p0 I at the beginning [m2, m2/s2]
  float q = 0.001F;  ///< Q = q I
  float r_m2 = 0.5F;
  float gate = 0;  ///< for the NIS; 0: none
};

class Lesson {
 public:
  explicit Lesson(const LessonNumbers& numbers);
  /// One prediction, and one update by a position; JSON of the update, as UpdateLog has it.
  [[nodiscard]] std::string step(float z_m);

 private:
  LessonNumbers numbers_;
  filter::Viewed<filter::Kalman<float, 2>> filter_;
};

}  // namespace tetap::page
