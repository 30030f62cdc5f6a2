// SPDX-License-Identifier: Apache-2.0
#include "sim_host/page/module/lesson.hpp"

#include "sim_host/page/module/updates.hpp"

namespace tetap::page {

Lesson::Lesson(const LessonNumbers& numbers) : numbers_(numbers) {
  filter_.p = filter::Symmetric<float, 2>::diagonal({numbers.p0, numbers.p0});
}

std::string Lesson::step(float z_m) {
  filter::LinearMotion<float, 2> motion;
  motion.f(0, 1) = numbers_.dt_s;
  motion.q = filter::Symmetric<float, 2>::diagonal({numbers_.q, numbers_.q});
  static_cast<void>(filter_.predict(motion));
  filter::DirectMeasurement<float, 2, 0> position;
  position.z(0) = z_m;
  position.variance(0) = numbers_.r_m2;
  UpdateLog seen;
  seen.takes = true;
  static_cast<void>(filter_.update(position, numbers_.gate > 0 ? numbers_.gate : 1e30F));
  return seen.json();
}

}  // namespace tetap::page
