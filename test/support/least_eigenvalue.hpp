// SPDX-License-Identifier: Apache-2.0
// Judge of a covariance: its correlations' smallest eigenvalue, in double. Compiled once, for it is most of what a test
// that includes Eigen's solver takes to compile.
#pragma once

#include "tetap/filter/symmetric.hpp"

namespace tetap::test {

/// Least eigenvalue of diag(p)^-1/2 p diag(p)^-1/2: above zero means positive definite. Minus infinity when something
/// is no number or a variance is not above zero.
double least_eigenvalue(const Eigen::MatrixXd& p);

template <int N>
double least_eigenvalue(const filter::Symmetric<float, N>& p) {
  return least_eigenvalue(Eigen::MatrixXd(p.dense().template cast<double>()));
}

}  // namespace tetap::test
