// SPDX-License-Identifier: Apache-2.0
// Every form of the Kalman filter, as a list of types for tests that hold for each.
#pragma once

#include "tetap/filter/iterated_ekf.hpp"
#include "tetap/filter/joseph.hpp"
#include "tetap/filter/kalman.hpp"
#include "tetap/filter/sequential.hpp"
#include "tetap/filter/square_root.hpp"
#include "tetap/filter/structured_kalman.hpp"
#include "tetap/filter/ud.hpp"
#include "tetap/filter/ukf.hpp"
#include "tetap/filter/ukf_sqrt.hpp"

#include <gtest/gtest.h>

namespace tetap::test {

struct EkfForm {
  static constexpr const char* kName = "Kalman, Ekf";
  template <class S>
  using Of = filter::Ekf<S>;
};
struct IteratedForm {
  static constexpr const char* kName = "IteratedEkf";
  template <class S>
  using Of = filter::IteratedEkf<S, 2>;
};
struct JosephForm {
  static constexpr const char* kName = "JosephKalman";
  template <class S>
  using Of = filter::JosephKalman<S>;
};
struct SequentialForm {
  static constexpr const char* kName = "SequentialKalman";
  template <class S>
  using Of = filter::SequentialKalman<S>;
};
struct UdForm {
  static constexpr const char* kName = "UdKalman";
  template <class S>
  using Of = filter::UdKalman<S>;
};
struct SquareRootForm {
  static constexpr const char* kName = "SquareRootKalman";
  template <class S>
  using Of = filter::SquareRootKalman<S>;
};
struct StructuredForm {
  static constexpr const char* kName = "StructuredKalman";
  template <class S>
  using Of = filter::StructuredKalman<S, filter::Guard::kConditioned>;
};
struct UnscentedForm {
  static constexpr const char* kName = "Ukf";
  template <class S>
  using Of = filter::Ukf<S>;
};
struct UnscentedRootForm {
  static constexpr const char* kName = "UkfSqrt";
  template <class S>
  using Of = filter::UkfSqrt<S>;
};

using Forms = testing::Types<EkfForm, IteratedForm, JosephForm, SequentialForm, UdForm, SquareRootForm, StructuredForm,
                             UnscentedForm, UnscentedRootForm>;

}  // namespace tetap::test
