// SPDX-License-Identifier: Apache-2.0
// Values that a broken sensor may hand over, and what has to hold after them.
#pragma once

#include "support/least_eigenvalue.hpp"
#include "tetap/filter/update.hpp"

#include <gtest/gtest.h>
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
