# SPDX-License-Identifier: Apache-2.0
"""Rows of out/bench.json and their table."""

HEAD = ("workload", "implementation", "ns", "spread", "times tetap's")
OWN = "tetap"
NAMES = {"kalman": "Kalman step, 4 states, 2 measured", "ekf": "EKF step, 3 states, range and bearing", "pose_graph": "pose graph M3500",
         "tetap": "tetap", "tetap_gate_guard": "tetap, gate and guards", "textbook": "textbook Eigen", "opencv": "OpenCV", "bfl": "Orocos BFL", "ceres": "Ceres"}
# What issue 36 asks for: (workload, implementation, least ratio to tetap's own), and the most ns of one.
RATIOS = [(workload, name, least) for workload in ("kalman", "ekf") for name, least in (("opencv", 100), ("bfl", 100), ("textbook", 2))]
MOST_NS = [("pose_graph", OWN, 60e6)]


def rows_of(report):
    """Rows from Google Benchmark's report of aggregates; each with the accuracy that was found before the timing."""
    found = {}
    for one in report["benchmarks"]:
        workload, _, name = one["run_name"].partition("/")
        row = found.setdefault((workload, name), {"workload": workload, "implementation": name})
        if one["aggregate_name"] == "median":
            row["ns"] = 1e9 / one["items_per_second"]
            row |= {key: one[key] for key in ("state_sigmas", "covariance", "chi2") if key in one}
        elif one["aggregate_name"] == "cv":
            row["spread"] = one["items_per_second"]
    own = {workload: row["ns"] for (workload, name), row in found.items() if name == OWN}
    for (workload, _), row in found.items():
        row["times"] = row["ns"] / own[workload]
    return ordered(found.values())


def time_text(ns):
    return f"{ns:.1f}" if ns < 1000 else f"{ns:,.0f}".replace(",", " ")


def ordered(rows):
    """By workload and implementation as NAMES has them: the report is in random order."""
    names = list(NAMES)
    return sorted(rows, key=lambda row: (names.index(row["workload"]), names.index(row["implementation"])))


def cells(rows):
    return [[NAMES[row["workload"]], NAMES[row["implementation"]], time_text(row["ns"]), f"{100 * row['spread']:.0f} %", f"{row['times']:.2f}"] for row in ordered(rows)]


def missed(rows):
    """A sentence for each bar that this run does not reach."""
    at = {(row["workload"], row["implementation"]): row for row in rows}
    said = [f"{NAMES[w]}: {NAMES[n]} takes {at[w, n]['times']:.2f} times as long, {least} are asked for" for w, n, least in RATIOS if at[w, n]["times"] < least]
    return said + [f"{NAMES[w]}: {NAMES[n]} takes {at[w, n]['ns'] / 1e6:.1f} ms, at most {most / 1e6:.0f} are asked for" for w, n, most in MOST_NS if at[w, n]["ns"] > most]
