# SPDX-License-Identifier: Apache-2.0
"""Likelihood of a filter's innovations (Schweppe 1965, IEEE T-IT 11(1)): a measurement costs (ln det S + rho(NIS)) / 2 nat and a constant.

rho is the NIS up to the gate, and gate * (1 + ln(NIS / gate)) beyond: a power law that touches the Gaussian at the gate, as Huber's functions do. A refused measurement so costs
more than any that is used, and a smaller S makes it dearer, since a gate is larger than the degrees of freedom: no number wins by refusing. A
measurement that another set of numbers used and this one does not even try costs its gate on top of the mean. While the robot stands, what a
sensor says within a second counts as one measurement: it is the same fact again.
"""
import numpy as np

BLOCK_S = 20.0
LN_2PI = float(np.log(2 * np.pi))


def tail(nis, gate):
    """rho."""
    gate = np.asarray(gate, float)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(nis <= gate, nis, gate * (1 + np.log(np.maximum(nis, gate) / gate)))


def influence(nis, gate):
    """d rho / d NIS."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(nis <= gate, 1.0, gate / np.maximum(nis, gate))


class Measurements:
    """A replay's measurements: cost, weight, block and kind of each, and the terms of their components."""

    def __init__(self, replay):
        terms = replay.terms
        self.names = replay.models
        self.first = np.flatnonzero(terms["component"] == 0)
        self.model = terms["model"][self.first]
        self.size = terms["components"][self.first].astype(float)
        self.time_s = terms["time_ms"][self.first] * 1e-3
        self.nis, self.gate = (terms[name][self.first].astype(float) for name in ("nis", "gate"))
        self.verdict = terms["verdict"][self.first]
        self.log_variance, self.innovation = terms["log_variance"].astype(float), terms["innovation"].astype(float)
        nis = np.where(np.isfinite(self.nis), self.nis, 1e30)
        unusable = self.verdict > 1  # singular or not finite
        nis[unusable] = 1e30
        log_variance = np.where(np.isfinite(self.log_variance), self.log_variance, 0.0)
        self.cost = 0.5 * (np.add.reduceat(log_variance, self.first) + self.size * LN_2PI + tail(nis, self.gate)) if len(self.first) else np.zeros(0)
        self.influence = influence(nis, self.gate)
        self.weight = self._weights()
        self.of_term = np.repeat(np.arange(len(self.first)), self.size.astype(int))
        self.key = self._keys()

    def _weights(self):
        """1 each, but while a zero velocity is fused: one a second and kind."""
        weight = np.ones(len(self.first))
        still = [k for k, name in enumerate(self.names) if name.startswith("Zero")]
        second = self.time_s.astype(int)
        rest = np.isin(second, np.unique(second[np.isin(self.model, still)]))
        cell = second * 256 + self.model
        _, place, count = np.unique(cell[rest], return_inverse=True, return_counts=True)
        weight[rest] = 1.0 / count[place]
        return weight

    def _keys(self):
        """The same measurement in another replay has the same key: time, kind, and its number among those."""
        cell = (self.time_s * 1000).astype(np.int64) * 256 + self.model
        begins = np.r_[True, cell[1:] != cell[:-1]] if len(cell) else np.zeros(0, bool)
        run = np.arange(len(cell)) - np.maximum.accumulate(np.where(begins, np.arange(len(cell)), 0))
        return cell * 64 + np.minimum(run, 63)

    def kinds(self):
        """{name: indices}."""
        return {name: np.flatnonzero(self.model == k) for k, name in enumerate(self.names)}


class Blocks:
    """Sums by log, block of time and kind of measurement: {(log, kind): (cost, count, gate) each an array by block}."""

    def __init__(self, measurements):
        self.sums = {}
        for log, one in enumerate(measurements):
            block = (one.time_s / BLOCK_S).astype(int)
            for name, of in one.kinds().items():
                length = int(block[of].max()) + 1 if len(of) else 0
                add = lambda values: np.bincount(block[of], values, minlength=length)  # noqa: E731, B023
                gate = np.where(np.isfinite(one.gate[of]), one.gate[of], 4 * one.size[of] + 8)
                self.sums[log, name] = add(one.weight[of] * one.cost[of]), add(one.weight[of]), float(gate.mean()) if len(of) else 0.0

    def cost(self, reference):
        """[(log, cost by block)] for the counts of `reference`, a Blocks that holds the most measurements of all."""
        total = {}
        for (log, name), (_, wanted, gate) in reference.sums.items():
            cost, count, gate = self.sums.get((log, name), (np.zeros(0), np.zeros(0), gate))
            length = max(len(wanted), len(count))
            cost, count, want = (np.pad(a, (0, length - len(a))) for a in (cost, count, wanted))
            mean = np.where(count > 0, cost / np.maximum(count, 1e-9), cost.sum() / max(count.sum(), 1e-9) if count.sum() > 0 else gate)
            block = want * mean + np.maximum(want - count, 0) * gate / 2
            before = total.get(log, np.zeros(0))
            size = max(len(before), length)
            total[log] = np.pad(before, (0, size - len(before))) + np.pad(block, (0, size - length))
        return total

    def most(self, other):
        """The larger count of each."""
        for key, (cost, count, gate) in other.sums.items():
            mine = self.sums.get(key, (np.zeros(0), np.zeros(0), gate))
            size = max(len(mine[1]), len(count))
            wider = [np.pad(a, (0, size - len(a))) for a in (mine[1], count)]
            self.sums[key] = cost, np.maximum(*wider), max(gate, mine[2])

    def measured_in(self, log, part):
        """Measurements of some blocks of a log, by weight."""
        return float(sum(count[part[part < len(count)]].sum() for (of, _), (_, count, _) in self.sums.items() if of == log))


def paired(base, other):
    """Indices of the components of the same measurements in both."""
    if len(base.key) == len(other.key) and np.array_equal(base.key, other.key):
        every = np.arange(len(base.log_variance))
        return every, every
    _, at, there = np.intersect1d(base.key, other.key, return_indices=True)
    same = base.size[at] == other.size[there]
    at, there = at[same], there[same]
    size = base.size[at].astype(int)
    step = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
    return np.repeat(base.first[at], size) + step, np.repeat(other.first[there], size) + step


def sensitivities(base, others, steps):
    """(columns, weights): information of the rows is columns^T columns (Gupta & Mehra 1974, IEEE T-AC 19(6)): for each component
    d ln d / sqrt(2) and d e / sqrt(d), for a change of the logarithm of each row."""
    columns = np.zeros((2 * len(base.log_variance), len(others)))
    for k, (other, step) in enumerate(zip(others, steps)):
        at, there = paired(base, other)
        root = np.exp(-0.5 * base.log_variance[at])
        columns[at, k] = (other.log_variance[there] - base.log_variance[at]) / (step * np.sqrt(2))
        columns[len(base.log_variance) + at, k] = (other.innovation[there] - base.innovation[at]) * root / step
    weight = np.sqrt(base.weight * base.influence)[base.of_term]
    columns *= np.r_[weight, weight][:, None]
    columns[~np.isfinite(columns)] = 0
    return columns
