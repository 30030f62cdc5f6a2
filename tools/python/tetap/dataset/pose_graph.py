# SPDX-License-Identifier: Apache-2.0
"""Planar pose graphs of a file: g2o's VERTEX_SE2 / EDGE_SE2 (Kuemmerle, Grisetti, Strasdat, Konolige, Burgard, ICRA 2011) and TORO's VERTEX2 /
EDGE2, whose information stands in the order 11 12 22 33 13 23 (Grisetti, Stachniss, Grzonka, Burgard, RSS 2007). An edge's error is
(R_z^T (R_i^T (t_j - t_i) - t_z), yaw_j - yaw_i - yaw_z), so its information holds in axes turned by the measured yaw."""
import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.dataset import common

VERTICES, EDGES = {"VERTEX_SE2": 4, "VERTEX2": 4}, {"EDGE_SE2": 11, "EDGE2": 11}  # numbers behind the tag
IGNORED = {"FIX": "fixed vertex"}  # the first pose is the fixed one
INFORMATION = {"EDGE_SE2": (0, 1, 2, 1, 3, 4, 2, 4, 5), "EDGE2": (0, 1, 4, 1, 2, 5, 4, 5, 3)}  # order of the six numbers, by rows of the matrix


class Graph:
    """Edges in the order of the file: `first`, `second` (0 ... poses - 1), `z` (x, y, yaw of second in first), `covariance` (3 x 3, in first)."""

    def __init__(self, poses, first, second, z, covariance, vertices):
        self.poses, self.first, self.second, self.z, self.covariance, self.vertices = poses, first, second, z, covariance, vertices

    def odometry(self):
        """Index of the edge from each pose to the next; of several the first."""
        found = {}
        for e, (i, j) in enumerate(zip(self.first, self.second)):
            if j == i + 1:
                found.setdefault(int(i), e)
        return [found[i] for i in range(self.poses - 1)]


def identifier(text, where, column):
    try:
        value = int(text)
    except ValueError:
        raise BadInput(f"{where}: column {column} is not an id: {text[:30]!r}") from None
    if value < 0:
        raise BadInput(f"{where}: column {column} is an id below zero: {value}")
    return value


def read(path):
    """The graph of a file; BadInput names the line and what is wrong with it."""
    edges, vertices = [], {}
    for line, text in common.read_lines(path):
        where, (tag, *fields) = f"{path}:{line}", text.split()
        if tag in IGNORED:
            continue
        count = VERTICES.get(tag) or EDGES.get(tag)
        if count is None:
            raise BadInput(f"{where}: {tag[:30]!r} is neither a planar vertex nor a planar edge ({', '.join([*VERTICES, *EDGES])})")
        if len(fields) != count:
            raise BadInput(f"{where}: {tag} with {len(fields)} numbers, expected {count}")
        if tag in VERTICES:
            vertex = identifier(fields[0], where, 2)
            if vertex in vertices:
                raise BadInput(f"{where}: vertex {vertex} is there twice")
            vertices[vertex] = common.numbers(fields[1:], where)
        else:
            edges.append(_edge(tag, fields, where))
    if not edges:
        raise BadInput(f"{path}: no edge in it")
    return _graph(path, edges, vertices)


def _edge(tag, fields, where):
    i, j = identifier(fields[0], where, 2), identifier(fields[1], where, 3)
    if i == j:
        raise BadInput(f"{where}: an edge from pose {i} to itself")
    values = common.numbers(fields[2:], where)
    information = np.array(values[3:])[list(INFORMATION[tag])].reshape(3, 3)
    if np.linalg.eigvalsh(information)[0] <= 0:
        raise BadInput(f"{where}: the information of the edge {i} -> {j} is not positive definite")
    return i, j, values[:3], information, where


def _graph(path, edges, vertices):
    names = sorted(set(vertices) | {k for e in edges for k in e[:2]})
    for name, expected in zip(names, range(len(names))):
        if name != expected:
            raise BadInput(f"{path}: pose {expected} is missing: ids are 0 to {names[-1]} without a gap")
    first, second = (np.array([e[k] for e in edges]) for k in (0, 1))
    backwards = first == second + 1
    linked = set(second[second == first + 1]) | set(first[backwards])
    for pose in range(1, len(names)):
        if pose not in linked:
            raise BadInput(f"{path}: no edge leads from pose {pose - 1} to pose {pose}: the log needs odometry between them")
    z, information = np.array([e[2] for e in edges]), np.array([e[3] for e in edges])
    turn = rotations(z[:, 2])
    covariance = turn @ np.linalg.inv(information) @ turn.transpose(0, 2, 1)
    first, second, z, covariance = _forward(first, second, z, covariance, backwards)
    known = np.array([vertices[k] for k in names]) if len(vertices) == len(names) else None
    return Graph(len(names), first, second, z, covariance, known)


def _forward(first, second, z, covariance, backwards):
    """Odometry that a file states from the later to the earlier pose, the other way round (Smith, Self, Cheeseman 1990, sec. 3)."""
    first, second, z, covariance = first.copy(), second.copy(), z.copy(), covariance.copy()
    has_forward = set(first[second == first + 1])
    for e in np.flatnonzero(backwards):
        if second[e] in has_forward:
            continue
        x, y, yaw = z[e]
        c, s = np.cos(yaw), np.sin(yaw)
        jacobian = np.array([[-c, -s, s * x - c * y], [s, -c, c * x + s * y], [0, 0, -1.0]])
        z[e] = -c * x - s * y, s * x - c * y, -yaw
        covariance[e] = jacobian @ covariance[e] @ jacobian.T
        first[e], second[e] = second[e], first[e]
        has_forward.add(first[e])
    return first, second, z, covariance


def rotations(yaw_rad):
    turn = np.zeros((len(yaw_rad), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw_rad)
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = np.sin(yaw_rad), -np.sin(yaw_rad), 1.0
    return turn


def chained(graph):
    """Poses along the odometry alone, the first at the origin."""
    poses = np.zeros((graph.poses, 3))
    for k, e in enumerate(graph.odometry()):
        c, s = np.cos(poses[k, 2]), np.sin(poses[k, 2])
        x, y, yaw = graph.z[e]
        poses[k + 1] = poses[k] + (c * x - s * y, s * x + c * y, yaw)
    return poses


def false_closures(graph, count, seed):
    """Closures between poses that have nothing to do with each other, as sharp as the graph's first true one: (first, second, z, covariance)."""
    random = np.random.default_rng(seed)
    true = np.flatnonzero(np.abs(graph.second - graph.first) != 1)
    covariance = graph.covariance[true[0] if len(true) else 0]
    if graph.poses < 4:
        raise BadInput("a false closure needs a graph of at least four poses")
    found = []
    while len(found) < count:
        i, j = sorted(int(k) for k in random.integers(0, graph.poses, 2))
        if j - i < 2:
            continue
        found.append((i, j, random.normal(size=3) * (1, 1, 0.3), covariance))
    return found
