# SPDX-License-Identifier: Apache-2.0
"""From the maximum to what is said of each row: a number with its interval, or why there is none; and the likelihood held out."""
import dataclasses

import numpy as np
from scipy.stats import norm, t

from tetap.tune.likelihood import BLOCK_S
from tetap.tune.search import step_of

UNKNOWN = 0.35        # 1 sigma of a logarithm beyond which 95 % span more than a factor of two either way: no number
DRAWS = 4000
INERT = "no effect on these logs"
LEAST_BLOCKS = 3      # that move with a row: of fewer no interval can be drawn
FOLD_S = 60.0


@dataclasses.dataclass
class Said:
    """Of one row; `value` is None where there is no number, and `why` says so."""

    name: str
    start: float
    value: float = None
    low: float = None
    high: float = None
    why: str = ""


def conditional(information):
    """1 sigma of each logarithm with all others free, and the row that each resembles most."""
    scale = np.sqrt(np.maximum(np.diag(information), 1e-9))
    correlation = information / np.outer(scale, scale) + 1e-9 * np.eye(len(scale))
    inverse = np.linalg.inv(correlation)
    like = np.abs(inverse) / np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
    np.fill_diagonal(like, 0)
    return np.sqrt(np.diag(inverse)) / scale, like.argmax(axis=1)


def judge(objective, point, slope, rows):
    """{place: why} of the rows that the logs do not show."""
    information = sum(slope.information)
    alone = 1 / np.sqrt(np.maximum(np.diag(information), 1e-9))
    together, like = conditional(information)
    blocks = np.count_nonzero(np.concatenate(slope.scores), axis=0) if slope.scores else np.full(len(rows), LEAST_BLOCKS)
    why = {}
    for k in range(len(rows)):
        if slope.inert[k]:
            why[k] = INERT
        elif blocks[k] < LEAST_BLOCKS:
            why[k] = f"too short: {blocks[k]} blocks of {BLOCK_S:.0f} s show it, {LEAST_BLOCKS} are needed"
        elif alone[k] > UNKNOWN:
            why[k] = "flat likelihood: these logs do not show it"
        elif together[k] > UNKNOWN:
            why[k] = f"cannot be separated from {rows[like[k]].name}"
        elif np.min(np.abs(point.x[k] - objective.limits[k])) < 1e-6:
            why[k] = "runs to its limit: another error passes for it"
    return why


def intervals(scores, information, generator, draws=DRAWS):
    """95 % of each logarithm about the maximum: blocks of time drawn anew, and a Newton step for each draw. Few blocks have Student's width."""
    blocks = np.concatenate(scores)
    blocks = blocks[np.any(blocks != 0, axis=1)]
    blocks = blocks - blocks.mean(axis=0)
    n = len(blocks)
    inverse = np.linalg.inv(information + 1e-6 * np.eye(len(information)))
    counts = generator.multinomial(n, np.full(n, 1 / n), size=draws)
    moved = -(counts @ blocks) @ inverse * np.sqrt(n / max(n - 1, 1)) * t.ppf(0.975, max(n - 1, 1)) / norm.ppf(0.975)
    return np.percentile(moved, [2.5, 97.5], axis=0)


def parts_of(slope, names):
    """[(name, log, its blocks)] that are left out in turn: logs, or of a single one parts of at least FOLD_S, five at most."""
    if len(names) > 1:
        return [(name, log, np.arange(len(slope.scores[log]))) for log, name in enumerate(names)]
    n = len(slope.scores[0])
    count = min(5, int(n * BLOCK_S / FOLD_S))
    folds = np.array_split(np.arange(n), count) if count >= 2 else []
    return [(f"{fold[0] * BLOCK_S:.0f} to {(fold[-1] + 1) * BLOCK_S:.0f} s", 0, fold) for fold in folds]


def without(objective, point, slope, log, part):
    """Logarithms found without a part of a log: a scoring step from those of all, by the scores and the information of the other parts. No score
    of the part is in it but through the point where it begins."""
    share = len(part) / len(slope.scores[log])
    score = sum(one.sum(axis=0) for one in slope.scores) - slope.scores[log][part].sum(axis=0)
    return objective.clipped(point.x + step_of(sum(slope.information) - share * slope.information[log], score))


def held_out(objective, point, slope, names):
    """[(what was left out, cost before, cost after, measurements)]: likelihood of a part by numbers found without it."""
    begun, = objective.points([objective.start], "held out")
    objective.reference.most(begun.blocks)
    before, found = objective.costs(begun), []
    for name, log, part in parts_of(slope, names):
        other, = objective.points([without(objective, point, slope, log, part)], "held out")
        measured = objective.reference.measured_in(log, part)
        take = lambda cost: np.pad(cost, (0, max(0, part[-1] + 1 - len(cost))))[part].sum()  # noqa: E731, B023
        found.append((name, take(before[log]), take(objective.costs(other)[log]), measured))
    return found
