// SPDX-License-Identifier: Apache-2.0
// What a broken sensor may hand over, and the judge of what is left after it: eigenvalues in double.
#pragma once

#include "filter/update.hpp"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <array>
#include <limits>
#include <vector>

namespace tetap::test {

/// NaN, infinities, zeros, the largest and the smallest float, and the largest whose square is still a number.
inline constexpr std::array<float, 11> kHostile{
    base::kNan,
    base::kInfinity,
    -base::kInfinity,
    0.0F,
    -0.0F,
    std::numeric_limits<float>::max(),
    -std::numeric_limits<float>::max(),
    std::numeric_limits<float>::denorm_min(),
    -std::numeric_limits<float>::denorm_min(),
    1.8446742e19F,
    -1.8446742e19F,
};

/// The smallest eigenvalue of the correlations: above zero means positive definite. Below any when something is no
/// number.
template <int N>
double least_eigenvalue(const filter::Symmetric<float, N>& p) {
  using Full = Eigen::Matrix<double, N, N>;
  const Full full = p.dense().template cast<double>();
  if (!full.allFinite() || !(full.diagonal().minCoeff() > 0)) return -std::numeric_limits<double>::infinity();
  const Eigen::Matrix<double, N, 1> size = full.diagonal().cwiseSqrt().cwiseInverse();
  return Eigen::SelfAdjointEigenSolver<Full>(size.asDiagonal() * full * size.asDiagonal(), Eigen::EigenvaluesOnly)
      .eigenvalues()(0);
}

/// The floats of a model, so that each can be broken in turn.
using Fields = std::vector<float*>;

/// Each field in turn, each hostile value: into a copy of the filter.
template <class Filter, class Model, class FieldsOf, class Same>
void break_every_field(const Filter& well, const Model& good, const FieldsOf& fields_of, const Same& same,
                       float gate = 1e9F) {
  ASSERT_EQ(Filter(well).update(good, gate).verdict, filter::Verdict::kAccepted);
  Model counted = good;
  const std::size_t fields = fields_of(counted).size();
  for (std::size_t field = 0; field < fields; ++field)
    for (const float value : kHostile) {
      Model bad = good;
      *fields_of(bad)[field] = value;
      Filter ins = well;
      const auto record = ins.update(bad, gate);
      SCOPED_TRACE(testing::Message() << "field " << field << " = " << value);
      if (!base::is_finite(value)) {
        EXPECT_EQ(record.verdict, filter::Verdict::kNotFinite);
      }
      if (record.verdict != filter::Verdict::kAccepted) {
        EXPECT_TRUE(same(ins.x, well.x));
        EXPECT_EQ(ins.p.packed(), well.p.packed());
      }
      EXPECT_TRUE(ins.x.finite());
      EXPECT_GT(least_eigenvalue(ins.p), 0);
    }
}

}  // namespace tetap::test
