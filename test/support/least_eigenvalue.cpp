// SPDX-License-Identifier: Apache-2.0
#include "support/least_eigenvalue.hpp"

#include <Eigen/Eigenvalues>
#include <limits>

namespace tetap::test {

double least_eigenvalue(const Eigen::MatrixXd& p) {
  if (!p.allFinite() || !(p.diagonal().minCoeff() > 0)) return -std::numeric_limits<double>::infinity();
  const Eigen::VectorXd size = p.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlations = size.asDiagonal() * p * size.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlations, Eigen::EigenvaluesOnly).eigenvalues()(0);
}

}  // namespace tetap::test
