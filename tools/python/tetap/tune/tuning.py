# SPDX-License-Identifier: Apache-2.0
"""The course of a tuning: rows that do nothing put aside, search, rows that the logs do not show put back, intervals, held-out likelihood."""
import dataclasses
import os

import numpy as np

from tetap.can.bus_writer import BadInput
from tetap.tune import outcome
from tetap.tune.replays import Replays
from tetap.tune.search import Objective, maximise, slopes

SEED = 1  # of the draws of blocks


@dataclasses.dataclass
class Result:
    said: list
    held_out: list       # (what, cost before, cost after, measurements)
    refused: tuple       # share of refused measurements before and after
    replays: int
    others: list         # by log the numbers found without it, {path: value}; of several logs alone
    nees: tuple = None   # before, after: a list by log
    grid: list = dataclasses.field(default_factory=list)  # by row the NEES held out, its best factor, and the words for it


def refused_share(point):
    refused = sum((one.verdict == 1).sum() for one in point.logs)
    return refused / max(1, sum(len(one.verdict) for one in point.logs))


def tune(program, logs, robot, given, chosen, options):
    all_rows = [row for row, _, _ in chosen]
    said = {row.name: outcome.Said(row.name, start) for row, start, _ in chosen}
    with Replays(program, logs, robot, given, options, options.out, options.quiet) as replays:
        replays.progress.more(6 * len(chosen) + 12)
        kept, begin, why = list(range(len(chosen))), None, None
        while kept and why != {}:
            objective = Objective(replays, [all_rows[k] for k in kept], *([chosen[k][i] for k in kept] for i in (1, 2)))
            if begin is None:
                begun, = objective.points([objective.start], "start")
                if not any(len(one.first) for one in begun.logs):
                    raise BadInput(f"{' '.join(logs)}: robot {robot} fuses no measurement of it, or by a filter that shows none")
                begin = objective.start
            point, _ = maximise(objective, begin)
            slope = slopes(objective, point, "intervals", sides=(1, -1))
            why = outcome.judge(objective, point, slope, objective.rows)
            for place, text in why.items():
                said[objective.rows[place].name].why = text
            staying = [place for place in range(len(kept)) if place not in why]
            kept, begin = [kept[place] for place in staying], point.x[staying]
        if not kept:
            return Result(list(said.values()), [], (refused_share(begun),) * 2, replays.progress.done, [{} for _ in logs])
        low, high = outcome.intervals(slope.scores, sum(slope.information), np.random.default_rng(SEED))
        for place, row in enumerate(objective.rows):
            one = said[row.name]
            one.value, one.low, one.high = np.exp(point.x[place] + np.array([0, low[place], high[place]]))
            if slope.idle_below[place]:
                one.low, one.why = 0.0, "an upper bound: a smaller one changes nothing"
        names = [os.path.basename(log) for log in logs]
        held = outcome.held_out(objective, point, slope, names)
        parts = outcome.parts_of(slope, names) if len(logs) > 1 else []
        others = [objective.settings(outcome.without(objective, point, slope, log, part)) for _, log, part in parts]
        return Result(list(said.values()), held, (refused_share(begun), refused_share(point)), replays.progress.done, others)
