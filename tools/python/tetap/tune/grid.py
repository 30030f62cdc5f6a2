# SPDX-License-Identifier: Apache-2.0
"""The filter's own optimum of a row: over a grid of factors, the one whose NEES on logs that the numbers were found without is nearest to 1."""
import json
import os
import subprocess
import tempfile

import numpy as np

from tetap import shards
from tetap.can.bus_writer import BadInput

FACTORS = tuple(float(one) for one in np.round(np.geomspace(0.25, 4, 9), 4))
DRAWS = 1000
FLAT = 0.1   # of ln NEES over the whole grid: below it no factor is better than another
SEED = 1     # of the draws of logs


def judge(job):
    """summary.json of one replay against its truth."""
    with tempfile.TemporaryDirectory() as into:
        for command in ([*job["play"], "--out", into], [job["report"], into, "--truth", job["truth"], "--no-pictures"]):
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode != 0:
                raise BadInput(done.stderr.strip())
        with open(os.path.join(into, "summary.json"), encoding="utf-8") as file:
            return json.load(file)


def nees_of_state(summary):
    """NEES per degree of freedom of the last estimator that has one: of a whole state the mean of its blocks, each of three, since a fix hides a
    bad rate from the pose alone; else of the pose."""
    some = [one for one in summary.values() if isinstance(one, dict) and one.get("nees_mean") is not None]
    if not some:
        raise BadInput("--grid: a truth gives no NEES")
    of_blocks = [block["nees_mean"] / 3 for block in some[-1].get("blocks", {}).values()]
    return float(np.mean(of_blocks)) if of_blocks else some[-1]["nees_mean"] / some[-1]["nees_dof"]


def optimum(curves, draws=DRAWS):
    """(factor, low, high) with 95 % by drawing logs anew, of NEES by log and factor; None where it is flat."""
    fine = np.linspace(np.log(FACTORS[0]), np.log(FACTORS[-1]), 1001)

    def best(some):
        mean = np.log(some.mean(axis=0))
        return fine[np.argmin(np.abs(np.interp(fine, np.log(FACTORS), mean)))]

    if np.ptp(np.log(curves.mean(axis=0))) < FLAT:
        return None
    generator = np.random.default_rng(SEED)
    drawn = [best(curves[generator.integers(len(curves), size=len(curves))]) for _ in range(draws)]
    return tuple(float(np.exp(one)) for one in (best(curves), *np.percentile(drawn, [2.5, 97.5])))


def words(name, curves, best):
    mean = curves.mean(axis=0)
    found = "flat" if best is None else "best at {:.2f} ({:.2f} to {:.2f}) of the number".format(*best)
    if best is not None and np.isclose(best[0], (FACTORS[0], FACTORS[-1])).any():
        found += ", which is the grid's end: the best may lie beyond it"
    return (f"NEES held out, {name} times {FACTORS[0]:g} to {FACTORS[-1]:g}: {found}; {mean[len(FACTORS) // 2]:.2f} at the number, "
            f"{mean.min():.2f} to {mean.max():.2f} on the grid")


def play(job_of, result, options, rows):
    """[{row, factors, nees (by log and factor), best, said}]: each log by the numbers of the others, the row's own times a factor.
    job_of(log, truth, {path: value}): a job of judge."""
    paths = {row.name: row.paths for row in rows}
    start = {said.name: said.start for said in result.said}
    jobs = []
    for name in options.grid:
        for log, truth, numbers in zip(options.logs, options.truth, result.others):
            for factor in FACTORS:
                values = {**numbers, **{path: factor * numbers.get(path, start[name]) for path in paths[name]}}
                jobs.append(job_of(log, truth, values))
    with shards.Shards(judge, [*options.logs, *options.truth], options, options.out, shards.Progress("grid", options.quiet)) as plays:
        found = [nees_of_state(one) for one in plays.run(jobs, "NEES held out")]
    nees = np.array(found).reshape(len(options.grid), len(options.logs), len(FACTORS))
    bests = [optimum(curves) for curves in nees]
    return [{"row": name, "factors": FACTORS, "nees": curves.tolist(), "best": best, "said": words(name, curves, best)} for name, curves, best in zip(options.grid, nees, bests)]
