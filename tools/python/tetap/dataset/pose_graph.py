# SPDX-License-Identifier: Apache-2.0
"""Planar pose graphs of a file: g2o's VERTEX_SE2 / EDGE_SE2 (Kuemmerle, Grisetti, Strasdat, Konolige, Burgard, ICRA 2011) and TORO's VERTEX2 /
EDGE2, whose information stands in the order 11 12 22 33 13 23 (Grisetti, Stachniss, Grzonka, Burgard, RSS 2007). Tools write either order under
either tag. An edge's error is (R_z^T (R_i^T (t_j - t_i) - t_z), yaw_j - yaw_i - yaw_z), so its information holds in axes turned by the measured yaw."""
import collections

import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.dataset import common

G2O, TORO = (0, 1, 2, 1, 3, 4, 2, 4, 5), (0, 1, 4, 1, 2, 5, 4, 5, 3)  # order of the six numbers, by rows of the matrix
VERTICES = ("VERTEX_SE2", "VERTEX2", "VERTEX")
EDGES = {"EDGE_SE2": G2O, "EDGE2": TORO, "EDGE": TORO, "ODOMETRY": TORO, "EDGE_SE2_SWITCHABLE": G2O, "EDGE_SE2_MAXMIX": G2O, "EDGE_SE2_OFFSET": G2O}
ONE_MORE = ("EDGE_SE2_SWITCHABLE", "EDGE_SE2_MAXMIX")  # a switch's id or a weight behind the two ids (Suenderhauf, Protzel, IROS 2012)
OFFSET, OFFSETS = "EDGE_SE2_OFFSET", "PARAMS_SE2OFFSET"  # an edge between sensors, with the ids of their places on the two poses behind the two ids


class Graph:
    """Edges in the order of the file: `first`, `second` (0 ... poses - 1), `z` (x, y, yaw of second in first), `covariance` (3 x 3, in first).
    `names`: the ids of the poses in the file. `others`: how many lines of each tag were not taken."""

    def __init__(self, poses, first, second, z, covariance, vertices, names=None, others=None):
        self.poses, self.first, self.second, self.z, self.covariance, self.vertices = poses, first, second, z, covariance, vertices
        self.names, self.others = list(range(poses)) if names is None else names, others or {}

    def odometry(self):
        """Index of the edge from each pose to the next; of several the first."""
        found = {}
        for e, (i, j) in enumerate(zip(self.first, self.second)):
            if j == i + 1:
                found.setdefault(int(i), e)
        return [found[i] for i in range(self.poses - 1)]

    def edge(self, e):
        return f"the edge {self.names[self.first[e]]} -> {self.names[self.second[e]]}"


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
    edges, vertices, offsets, others = [], {}, {}, collections.Counter()
    for line, text in common.read_lines(path):
        where, (tag, *fields) = f"{path}:{line}", text.split()
        if tag in EDGES:
            edges.append(_edge(tag, fields, where))
        elif tag in VERTICES:
            _count(tag, fields, 4, where)
            vertex = identifier(fields[0], where, 2)
            if vertex in vertices:
                raise BadInput(f"{where}: vertex {vertex} is there twice")
            vertices[vertex] = common.numbers(fields[1:], where, 3)
        elif tag == OFFSETS:
            _count(tag, fields, 4, where)
            offsets[identifier(fields[0], where, 2)] = common.numbers(fields[1:], where, 3)
            others[tag] += 1
        elif tag[0].isalpha():
            others[tag[:30]] += 1
        else:
            raise BadInput(f"{where}: {tag[:30]!r} is no tag of a graph file ({', '.join((*VERTICES, *EDGES))} and others)")
    if not edges:
        rest = ", ".join(f"{count} of {tag}" for tag, count in others.most_common(4))
        raise BadInput(f"{path}: no planar edge in it ({', '.join(EDGES)}){'; other lines: ' + rest if rest else ''}")
    return _graph(path, [_with_offsets(edge, offsets) for edge in edges], vertices, dict(others))


def _count(tag, fields, expected, where):
    if len(fields) != expected:
        raise BadInput(f"{where}: {tag} with {len(fields)} numbers, expected {expected}")


def _edge(tag, fields, where):
    more = 2 if tag == OFFSET else int(tag in ONE_MORE)
    _count(tag, fields, 11 + more, where)
    i, j = identifier(fields[0], where, 2), identifier(fields[1], where, 3)
    if i == j:
        raise BadInput(f"{where}: an edge from pose {i} to itself")
    values = common.numbers(fields[2 + more:], where, 4 + more)
    places = tuple(identifier(fields[k], where, k + 2) for k in (2, 3)) if tag == OFFSET else ()
    return i, j, values[:3], values[3:], tag, where, places


def _with_offsets(edge, offsets):
    """Places of the two sensors in place of their ids; the lines that state them may follow the edge."""
    for place in edge[6]:
        if place not in offsets:
            raise BadInput(f"{edge[5]}: no {OFFSETS} line states the offset {place}")
    return *edge[:6], tuple(np.array(offsets[place]) for place in edge[6])


def _between_poses(z, covariance, first_place, second_place):
    """What two sensors measure of each other as an edge between their poses: T_ij = O_i Z O_j^-1, and its covariance in the first pose."""
    turn, sensor = rotations(np.array([first_place[2], z[2] - second_place[2]]))[:, :2, :2]
    arm = -sensor @ second_place[:2]
    jacobian = np.eye(3)
    jacobian[:2, :2], jacobian[:2, 2] = turn, turn @ (-arm[1], arm[0])
    xy = first_place[:2] + turn @ (z[:2] + arm)
    return np.array([*xy, np.remainder(first_place[2] + z[2] - second_place[2] + np.pi, 2 * np.pi) - np.pi]), jacobian @ covariance @ jacobian.T


def _informations(edges):
    """Of each edge. A tag's own order holds, unless only the other one makes all its edges positive definite."""
    information = np.empty((len(edges), 3, 3))
    for tag in {edge[4] for edge in edges}:
        of_tag = [e for e, edge in enumerate(edges) if edge[4] == tag]
        six = np.array([edges[e][3] for e in of_tag])
        own = EDGES[tag]
        tried = [six[:, order].reshape(-1, 3, 3) for order in (own, TORO if own == G2O else G2O)]
        bad = [np.flatnonzero(np.linalg.eigvalsh(one)[:, 0] <= 0) for one in tried]
        if len(bad[0]) and len(bad[1]):
            i, j, _, _, _, where, _ = edges[of_tag[bad[0][0]]]
            raise BadInput(f"{where}: the information of the edge {i} -> {j} is not positive definite")
        information[of_tag] = tried[1] if len(bad[0]) else tried[0]
    return information


def _chain(edges):
    """Ids so that an edge leads from each to the next: by number, else as the edges name them. And the first gap of the order by number."""
    linked = {frozenset(edge[:2]) for edge in edges}
    by_number = sorted({k for edge in edges for k in edge[:2]})
    gap = None
    for names in (by_number, list(dict.fromkeys(k for edge in edges for k in edge[:2]))):
        gaps = [pair for pair in zip(names, names[1:]) if frozenset(pair) not in linked]
        if not gaps:
            return names, None
        gap = gap or gaps[0]
    return by_number, gap


def _graph(path, edges, vertices, others):
    names, gap = _chain(edges)
    if gap:
        raise BadInput(f"{path}: no edge leads from pose {gap[0]} to pose {gap[1]}: the log needs odometry between them")
    information = _informations(edges)
    pose = {name: k for k, name in enumerate(names)}
    first, second = (np.array([pose[e[k]] for e in edges]) for k in (0, 1))
    z = np.array([e[2] for e in edges])
    turn = rotations(z[:, 2])
    covariance = turn @ np.linalg.inv(information) @ turn.transpose(0, 2, 1)
    for e, edge in enumerate(edges):
        if edge[6]:
            z[e], covariance[e] = _between_poses(z[e], covariance[e], *edge[6])
    first, second, z, covariance = _forward(first, second, z, covariance, first == second + 1)
    known = np.array([vertices[k] for k in names]) if all(k in vertices for k in names) else None
    return Graph(len(names), first, second, z, covariance, known, names, others)


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
