# SPDX-License-Identifier: Apache-2.0
"""Maximum of the likelihood over the logarithms of noise rows, by Fisher scoring on differences of replays.

A step needs one replay a row: ln d and e of every component, against those at the middle, give gradient and information of all rows at once.
"""
import dataclasses

import numpy as np

from tetap.tune.likelihood import BLOCK_S, Blocks, Measurements, sensitivities

DIFFERENCE = 0.1   # of a logarithm, for derivatives
LONGEST = 1.1      # step of a logarithm
ENOUGH = 0.02      # a step of 2 %, or a tenth of the row's own sigma, ends the search
ROUNDS = 12
DAMPING = 1.0      # information that a row is given, so that a flat one stays where it is


@dataclasses.dataclass
class Point:
    x: np.ndarray      # logarithms
    logs: list         # Measurements, one a log
    blocks: Blocks
    crc: tuple


@dataclasses.dataclass
class Slopes:
    """By log: information (rows x rows); by block of each log: score, the derivative of the cost (blocks x rows)."""

    information: list
    scores: list
    inert: np.ndarray       # a row without any effect on the node
    idle_below: np.ndarray  # one whose smaller value has none


class Objective:
    def __init__(self, replays, rows, start, limits):
        self.replays, self.rows, self.start, self.limits = replays, rows, np.log(start), np.log(limits)
        self.reference = Blocks([])
        self.live = np.ones(len(rows), bool)
        self.settled = None
        self._middle, self._played = None, {}

    def settings(self, x):
        values = {}
        for row, value in zip(self.rows, np.exp(x)):
            values.update(dict.fromkeys(row.paths, value))
        return values

    def points(self, places, what):
        """Of each place; those that this round has played are not played again."""
        new = [x for x in places if tuple(x) not in self._played]
        for x, replays in zip(new, self.replays.play([self.settings(x) for x in new], what)):
            logs = [Measurements(one) for one in replays]
            self.settle(logs)
            self._played[tuple(x)] = Point(np.array(x), logs, Blocks(logs), tuple(one.state_crc for one in replays))
        return [self._played[tuple(x)] for x in places]

    def around(self, middle):
        """A round begins: what was played elsewhere is forgotten."""
        if not np.array_equal(middle.x, self._middle):
            self._middle, self._played = middle.x, {tuple(middle.x): middle}

    def settle(self, logs):
        """What comes in the block of the first measurement and in the next has no weight: when a filter begins is no question of noise."""
        if self.settled is None:
            self.settled = [(int(one.time_s[0] / BLOCK_S) + 2) * BLOCK_S if len(one.time_s) else 0.0 for one in logs]
        for one, since in zip(logs, self.settled):
            one.weight[one.time_s < since] = 0

    def costs(self, point):
        return point.blocks.cost(self.reference)

    def cost(self, point):
        return sum(block.sum() for block in self.costs(point).values())

    def clipped(self, x):
        return np.clip(x, self.limits[:, 0], self.limits[:, 1])


def slopes(objective, middle, what, sides=(1,)):
    """Slopes at a point: forward differences with the information's own curvature taken off, or central ones. A row that was found to be
    inert is not looked at again."""
    objective.around(middle)
    n, looked = len(middle.x), np.flatnonzero(objective.live)
    toward = np.where(middle.x + DIFFERENCE <= objective.limits[:, 1], DIFFERENCE, -DIFFERENCE)
    places = [objective.clipped(middle.x + side * toward * (np.arange(n) == k)) for side in sides for k in looked]
    around = objective.points(places, what)
    moved = [place[k] - middle.x[k] for place, k in zip(places, np.tile(looked, len(sides)))]
    inert = ~objective.live
    inert[looked] = [point.crc == middle.crc for point in around[:len(looked)]]
    idle_below = np.zeros(n, bool)
    for k, point in zip(looked, around[len(looked):]):
        idle_below[k] = point.crc == middle.crc and toward[k] > 0
    costs, here = [objective.costs(point) for point in around], objective.costs(middle)
    information, scores = [], []
    for log, base in enumerate(middle.logs):
        columns = sensitivities(base, [point.logs[log] for point in around[:len(looked)]], moved)
        of_log = np.zeros((n, n))
        of_log[np.ix_(looked, looked)] = columns.T @ columns
        size = max(len(cost[log]) for cost in [here, *costs])
        block = lambda cost: np.pad(cost[log], (0, size - len(cost[log])))  # noqa: E731, B023
        score = np.zeros((size, n))
        for i, k in enumerate(looked):
            if len(sides) == 2 and moved[len(looked) + i] != 0:
                score[:, k] = (block(costs[i]) - block(costs[len(looked) + i])) / (moved[i] - moved[len(looked) + i])
            else:
                score[:, k] = (block(costs[i]) - block(here)) / moved[i] - moved[i] / 2 * of_log[k, k] / size
        information.append(of_log)
        scores.append(score)
    return Slopes(information, scores, inert, idle_below)


def step_of(information, gradient):
    """The scoring step s, as ln(1 + 2 s) / 2: a variance that scales all of S is then found in one step from any distance."""
    damped = information + DAMPING * np.eye(len(gradient))
    step = -np.linalg.solve(damped, gradient)
    return np.clip(0.5 * np.log(np.maximum(1 + 2 * step, 1e-3)), -LONGEST, LONGEST)


def maximise(objective, x, rounds=ROUNDS, what="search"):
    """The best point from `x`, and how many rounds it took."""
    point, = objective.points([objective.clipped(x)], what)
    objective.reference.most(point.blocks)
    for done in range(rounds):
        slope = slopes(objective, point, what)
        objective.live &= ~slope.inert
        information = sum(slope.information)
        gradient = sum(score.sum(axis=0) for score in slope.scores)
        step = step_of(information, gradient)
        sigma = 1 / np.sqrt(np.diag(information) + DAMPING)
        small = np.abs(step) < np.maximum(ENOUGH, 0.1 * sigma)
        if small.all():
            return point, done
        tried = None
        for share in (1.0, 0.4, 0.15):
            tried, = objective.points([objective.clipped(point.x + share * step)], what)
            objective.reference.most(tried.blocks)
            if objective.cost(tried) < objective.cost(point):
                break
        else:
            return point, done
        gain = objective.cost(point) - objective.cost(tried)
        point = tried
        if gain < 0.5:
            return point, done + 1
    return point, rounds
