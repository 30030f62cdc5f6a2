// SPDX-License-Identifier: Apache-2.0
// Prints candump lines of every message with random values, many of them out of range, for a judge that knows only the
// DBC:
//   (time) vcan0 ID#DATA ; START=GIVEN:DECODED ...
// START is the signal's first bit, GIVEN what was encoded and DECODED what our decoder reads back; integers of scaled
// signals are steps.
#include "tetap/bus/codec.hpp"
#include "tetap/bus/messages.hpp"

#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>
#include <type_traits>

namespace {

using namespace tetap;

std::mt19937_64 random_bits(20240229);
int printed = 0;

float uniform(float low, float high) { return std::uniform_real_distribution<float>(low, high)(random_bits); }

template <bus::Signal kSignal, class Field>
Field random_value() {
  using Limits = std::numeric_limits<float>;
  const std::uint64_t dice = random_bits() % 16;
  if constexpr (std::is_same_v<Field, float>) {
    const float high = static_cast<float>(kSignal.highest()) / static_cast<float>(kSignal.per_unit);
    if (dice == 0) return Limits::quiet_NaN();
    if (dice == 1) return random_bits() % 2 != 0 ? Limits::infinity() : -Limits::infinity();
    if (dice == 2) return uniform(-1.0F, 1.0F) * Limits::max();
    if (dice < 6) return uniform(-1.2F, 1.2F) * high;
    return uniform(kSignal.is_signed ? -1.0F : 0.0F, 1.0F) * high;
  } else if constexpr (std::is_same_v<Field, bool>) {
    return dice % 2 != 0;
  } else if constexpr (std::is_enum_v<Field>) {
    return static_cast<Field>(random_bits() & kSignal.mask());
  } else {
    if (dice == 0) return std::numeric_limits<Field>::max();
    if (dice == 1) return std::numeric_limits<Field>::min();
    if (dice < 4) return static_cast<Field>(random_bits());
    return bus::from_steps<kSignal, Field>(kSignal.get(random_bits()));
  }
}

template <class Field>
void print(Field value) {
  if constexpr (std::is_same_v<Field, float>) {
    std::printf("%.9g", static_cast<double>(value));
  } else if constexpr (std::is_unsigned_v<Field> || std::is_enum_v<Field>) {
    std::printf("%" PRIu64, static_cast<std::uint64_t>(value));
  } else {
    std::printf("%" PRId64, static_cast<std::int64_t>(value));
  }
}

template <class M>
void print_one(std::uint32_t base, std::size_t instance) {
  M message;
  M::each(message, []<bus::Signal kSignal>(bus::At<kSignal>, auto& field) {
    field = random_value<kSignal, std::remove_cvref_t<decltype(field)>>();
  });
  const base::CanFrame frame = bus::frame(base, message, instance);
  ++printed;
  std::printf("(%d.%06d) vcan0 %03X#", 1700000000 + printed / 1000, printed % 1000 * 1000, frame.id);
  for (const unsigned byte : frame.data) std::printf("%02X", byte);
  std::printf(" ;");
  const auto back = bus::decode<M>(bus::payload(frame));
  if (!back) std::abort();
  M::each(message, [&back]<bus::Signal kSignal>(bus::At<kSignal>, const auto& given) {
    std::printf(" %d=", int{kSignal.start});
    print(given);
    std::printf(":");
    M::each(*back, []<bus::Signal kOther>(bus::At<kOther>, const auto& decoded) {
      if constexpr (kOther.start == kSignal.start) print(decoded);
    });
  });
  std::printf("\n");
}

template <class... Ms>
struct Print {
  template <class M>
  static void instances(std::uint32_t base) {
    if constexpr (bus::Repeated<M>) {
      for (std::size_t i = 0; i < M::kCount; ++i) print_one<M>(base, i);
    } else {
      print_one<M>(base, 0);
    }
  }
  static void all(std::uint32_t base) { (instances<Ms>(base), ...); }
};

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 20;
  for (int i = 0; i < rounds; ++i) bus::AllMessages<Print>::all(i % 2 == 0 ? 0x300 : 0x380);
}
