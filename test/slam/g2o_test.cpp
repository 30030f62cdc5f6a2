// SPDX-License-Identifier: Apache-2.0
#include "slam/g2o.hpp"

#include <gtest/gtest.h>

namespace tetap {
namespace {

test::G2oGraph read(const std::string& text) {
  std::istringstream in(text);
  return test::read_g2o(in);
}
std::string error_of(const std::string& text) {
  try {
    static_cast<void>(read(text));
  } catch (const test::G2oError& error) {
    return error.what();
  }
  return "none";
}

TEST(G2o, ToroHasItsOwnOrderOfTheInformation) {
  const auto g2o = read("EDGE_SE2 0 1 1 2 0.5 11 0.12 0.13 22 0.23 33\n");
  const auto toro = read("VERTEX2 0 0 0 0\nEDGE2 0 1 1 2 0.5 11 0.12 22 33 0.13 0.23\n");
  ASSERT_EQ(g2o.edges.size(), 1U);
  EXPECT_EQ(toro.poses, 2);
  EXPECT_EQ(g2o.edges[0].information, toro.edges[0].information);
  EXPECT_EQ(g2o.edges[0].information(0, 2), 0.13);
  EXPECT_EQ(g2o.edges[0].information(2, 2), 33.0);
}

TEST(G2o, AnErrorNamesLineAndCause) {
  EXPECT_EQ(error_of("EDGE_SE2 0 1 1 2 0.5 11 0 0 22 0 33\nEDGE_SE2 1 2 1 2 0.5 11 0 0 22\n"),
            "line 2: an edge needs two ids, three numbers of displacement and six of information");
  EXPECT_EQ(error_of("# a comment\nEDGE_SE3 0 1\n"), "line 2: neither a planar vertex nor a planar edge: EDGE_SE3");
  EXPECT_EQ(error_of("EDGE_SE2 0 0 1 2 0.5 11 0 0 22 0 33\n"), "line 1: an edge from a pose to itself");
  EXPECT_EQ(error_of("EDGE_SE2 0 1 1 2 0.5 11 0 0 -22 0 33\n"), "line 1: information is not positive definite");
  EXPECT_EQ(error_of("EDGE_SE2 0 1 1 2 0.5 11 0 0 22 0 33 44\n"), "line 1: more than eleven numbers: 44");
  EXPECT_EQ(error_of("VERTEX_SE2 3\n"), "line 1: a vertex needs an id and three numbers");
  EXPECT_EQ(error_of("EDGE_SE2 0 1 1 2 0.5 11 0 0 22 0 33\nEDGE_SE2 0 3 1 2 0.5 11 0 0 22 0 33\n"),
            "line 2: no odometry leads from pose 1 to 2");
  EXPECT_EQ(error_of("EDGE_SE2 0 1 1 nan 0.5 11 0 0 22 0 33\n"),
            "line 1: an edge needs two ids, three numbers of displacement and six of information");
}

}  // namespace
}  // namespace tetap
