// SPDX-License-Identifier: Apache-2.0
// One row of list.hpp in an image: TETAP_COST_ROW is ROW_SIZE, or none for what an image costs without a filter.
#include "board.hpp"
#include "costs/contestants.hpp"
#include "markers.hpp"

#include <cstddef>
#include <new>

namespace tetap::costs::rows {
#define TETAP_COST(name, size, header, takes, grows, ...) using name##_##size = __VA_ARGS__;
#include "costs/list.hpp"
#undef TETAP_COST
/// The scenario and nothing else.
template <class Base>
struct Nothing : Base {
  void start(const PlanePose&) {}
  void start() {}
  template <class Input>
  void step(const Input&) {}
};
using none_0 = Nothing<OfDrive>;
using none_1 = Nothing<OfSway>;
}  // namespace tetap::costs::rows

namespace tetap::costs {

using Contestant = rows::TETAP_COST_ROW;
/// The filter's memory, all of the row's RAM. An image has no constructors at start: run() builds the filter in it.
alignas(Contestant) std::byte contestant[sizeof(Contestant)];
Contestant& filter() { return *std::launder(reinterpret_cast<Contestant*>(contestant)); }

/// One step: its instructions are counted, and the stack below it is the row's.
[[gnu::noipa]] void counted_step(const typename Contestant::Scenario::Input& in) {
  const count::Region<struct TETAP_COST_ROW> region;
  filter().step(in);
}
template <class Filter, class Scenario>
[[gnu::noinline]] void run(Filter& filter, Scenario& scenario) {
  if constexpr (std::is_same_v<Scenario, Drive>) {
    filter.start(scenario.start());
  } else {
    filter.start();
    for (int k = 0; k < 1500; ++k) filter.step(scenario.next());
  }
  for (int k = 0; k < Contestant::kCounted; ++k) counted_step(scenario.next());
}

}  // namespace tetap::costs

int main() {
  static Board board;
  tetap::count::calibrate();
  static tetap::costs::Contestant::Scenario scenario(1, tetap::costs::Contestant::kLandmarks);
  tetap::costs::run(*new (tetap::costs::contestant) tetap::costs::Contestant, scenario);
  board.print("costs: done\n");
  tetap::count::finish();
  return 0;
}
