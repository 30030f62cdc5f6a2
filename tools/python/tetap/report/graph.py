# SPDX-License-Identifier: Apache-2.0
"""Published figures of a pose graph: its sum of squares, whether the last optimisation converged, and the closures that are not in it."""
import numpy as np

GRAPH = ["epoch", "time_s", "chi2", "graph_status", "closures", "jobs", "map_size", "map_refused", "contradicted", "work_left", "jobs_aborted"]
WRAPS = {"jobs": 256, "map_refused": 2048, "contradicted": 2048, "jobs_aborted": 256}  # counters of the bus that go round
NOT_IN_THE_GRAPH = ("Singular", "UnknownLandmark", "NotFinite")  # verdicts with a record, and no counter of their own


def counted(column, wrap):
    """The last value of a counter that goes round, as if it did not."""
    if len(column) == 0:
        return 0
    return int(column[0]) + int(np.mod(np.diff(column), wrap).sum())


def figures(run, estimator, names):
    """Figures of a pose graph for summary.json; empty for other estimators."""
    rows = run.graph
    if run.kinds[estimator] != "PoseGraph" or len(rows["time_s"]) == 0:
        return {}
    status = names["GraphStatus"].get(int(rows["graph_status"][-1]), "?")
    count = {name: counted(rows[name], wrap) for name, wrap in WRAPS.items()}
    codes = {name: code for code, name in names["Verdict"].items()}
    closure = next(code for code, name in names["Sensor"].items() if name == "Closure")
    mine = (run.innovations["estimator"] == estimator) & (run.innovations["sensor"] == closure)
    other = int(sum((mine & (run.innovations["verdict"] == codes[name])).sum() for name in NOT_IN_THE_GRAPH))
    chi2, waits = rows["chi2"][-1], rows["work_left"][-1] > 0
    return {"chi2": float(chi2) if np.isfinite(chi2) else None, "converged": bool(status == "Converged" and not waits), "poses": int(rows["map_size"][-1]),
            "edges_refused": count["map_refused"] + count["contradicted"] + other,
            "graph": {"status": status, "optimisation_under_way": bool(waits), "closures": int(rows["closures"][-1]), "without_room": count["map_refused"],
                      "contradicted": count["contradicted"], "bad_or_unknown": other, "optimisations": count["jobs"], "aborted": count["jobs_aborted"]}}
