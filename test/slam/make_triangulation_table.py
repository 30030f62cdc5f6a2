#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""test/slam/triangulation_table.hpp: points that SciPy's least_squares finds from noisy directions, in coordinates of the world.

  test/slam/make_triangulation_table.py > test/slam/triangulation_table.hpp"""
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

VIEWS, SIGMA = 6, 0.002


def directions(point, turns, places):
    seen = turns.apply(point - places)
    return seen[:, :2] / seen[:, 2:]


def cases():
    generator = np.random.default_rng(7)
    for number in range(12):
        depth = (2.0, 8.0, 20.0, 45.0)[number % 4]
        turns = Rotation.from_rotvec(generator.normal(size=(VIEWS, 3)) * 0.03)
        places = np.column_stack([generator.normal(size=(VIEWS, 2)) * 0.1, np.arange(VIEWS) * 0.2 * (1 + number % 3)])
        point = np.array([0.35 * depth, 0.2 * depth, depth + places[-1, 2]])
        seen = directions(point, turns, places) + generator.normal(size=(VIEWS, 2)) * SIGMA / 2
        best = least_squares(lambda x: ((directions(x, turns, places) - seen) / SIGMA).ravel(), point, xtol=1e-15, ftol=1e-15, gtol=1e-15)
        sigma = np.sqrt(np.linalg.inv(best.jac.T @ best.jac)[2, 2])
        yield turns.as_quat()[:, [3, 0, 1, 2]], places, seen, best.x, sigma


def numbers(values):
    return "{" + ", ".join(f"{value:.9g}" for value in values) + "}"


def run():
    print("// SPDX-License-Identifier: Apache-2.0\n// Made by test/slam/make_triangulation_table.py: SciPy's least_squares on the same directions.\n#pragma once\n")
    print("namespace tetap::test {\n\nstruct TriangulationCase {\n  double q_cn[6][4], place_m[6][3], seen[6][2];  ///< views: rotation into the camera, place, direction")
    print("  double point_m[3];                             ///< SciPy's\n  double sigma_z_m;                              ///< likewise, of its third coordinate\n};")
    print("// clang-format off\ninline constexpr TriangulationCase kTriangulationCases[] = {")
    for turns, places, seen, point, sigma in cases():
        print("  {{" + ", ".join(map(numbers, turns)) + "},\n   {" + ", ".join(map(numbers, places)) + "},\n   {" + ", ".join(map(numbers, seen)) + f"}},\n   {numbers(point)}, {sigma:.9g}}},")
    print("};\n// clang-format on\n\n}  // namespace tetap::test")


run()
