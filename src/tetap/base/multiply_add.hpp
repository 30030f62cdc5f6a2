// SPDX-License-Identifier: Apache-2.0
// Sums of products, rounded after the product and after the sum, as every target does without contraction. The compiler
// writes two instructions where both roundings are kept. The Cortex-M7 has one that rounds twice (ARMv7-M Architecture
// Reference Manual, VMLA, VMLS), with the same bits.
#pragma once

namespace tetap::base {

#if defined(__GNUC__) && !defined(__clang__) && defined(__ARM_ARCH_7EM__) && defined(__ARM_FP) && (__ARM_FP & 8)
/// sum + a b
[[nodiscard]] inline float add_product(float sum, float a, float b) {
  asm("vmla.f32 %0, %1, %2" : "+t"(sum) : "t"(a), "t"(b));
  return sum;
}
/// sum - a b
[[nodiscard]] inline float subtract_product(float sum, float a, float b) {
  asm("vmls.f32 %0, %1, %2" : "+t"(sum) : "t"(a), "t"(b));
  return sum;
}
#endif

/// sum + a b
template <class Scalar>
[[nodiscard]] constexpr Scalar add_product(Scalar sum, Scalar a, Scalar b) {
  return sum + a * b;
}
/// sum - a b
template <class Scalar>
[[nodiscard]] constexpr Scalar subtract_product(Scalar sum, Scalar a, Scalar b) {
  return sum - a * b;
}

}  // namespace tetap::base
