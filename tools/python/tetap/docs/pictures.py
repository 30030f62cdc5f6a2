# SPDX-License-Identifier: Apache-2.0
"""Pictures of docs/images that are made from out/*.json, as SVG text; the same figures give the same text. One whose file is missing stays."""
import io
import json
import os

from tetap.docs import bench

# picture: rows of costs_track.json, as (filter, size)
TRACKS = {"kalman_forms": [("kalman", 4), ("ud", 4), ("ekf", 3), ("iterated_ekf", 3)], "unscented": [("ekf", 3), ("ukf", 3), ("ukf_sqrt", 3)],
          "particle_filter": [("ekf", 3), ("particle", 250), ("particle", 1000)], "grid_filter": [("ekf", 3), ("grid", 6400), ("grid", 25600)],
          "static_fusion": [("inverse_variance", 2), ("covariance_intersection", 2), ("kalman", 4)]}
STYLES = ["-", "--", ":", "-."]
STEP_S, MEAN_STEPS = 0.1, 10
PICTURES = ["images/bench.svg", *[f"images/track_{name}.svg" for name in TRACKS]]


def svg(figure):
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def plots():
    import matplotlib
    matplotlib.use("Agg")
    matplotlib.rcParams["svg.hashsalt"] = "tetap"
    from matplotlib import pyplot
    return pyplot


def track(rows, chosen):
    """Error of the position over time, the root mean square of each second."""
    pyplot = plots()
    figure, axis = pyplot.subplots(figsize=(8, 3))
    found = {(row["filter"], row["size"]): row["error_m"] for row in rows}
    for style, (name, size) in zip(STYLES, chosen):
        error = found[name, size]
        parts = [error[i:i + MEAN_STEPS] for i in range(0, len(error) - MEAN_STEPS + 1, MEAN_STEPS)]
        axis.plot([(i + 0.5) * MEAN_STEPS * STEP_S for i in range(len(parts))], [(sum(e * e for e in part) / len(part)) ** 0.5 for part in parts], style,
                  label=f"{name} {size}")
    axis.set_xlabel("time [s]")
    axis.set_ylabel("position error [m]")
    axis.set_ylim(bottom=0)
    axis.legend(fontsize=8, ncols=len(chosen))
    axis.grid(alpha=0.3)
    figure.tight_layout()
    text = svg(figure)
    pyplot.close(figure)
    return text


def bars(rows):
    """Bars of time, one panel a workload."""
    pyplot = plots()
    rows = bench.ordered(rows)
    workloads = list(dict.fromkeys(row["workload"] for row in rows))
    heights = [sum(row["workload"] == workload for row in rows) for workload in workloads]
    figure, axes = pyplot.subplots(len(workloads), 1, figsize=(8, 6), gridspec_kw={"height_ratios": heights})
    for axis, workload in zip(axes, workloads):
        some = [row for row in rows if row["workload"] == workload]
        scale, unit = (1e-6, "ms") if workload == "pose_graph" else (1, "ns")
        axis.barh([bench.NAMES[row["implementation"]] for row in some], [row["ns"] * scale for row in some],
                  color=["#1f6f8b" if row["implementation"].startswith(bench.OWN) else "#b8b8b8" for row in some])
        axis.set_xscale("linear" if workload == "pose_graph" else "log")
        axis.set_xlim(right=(1.3 if workload == "pose_graph" else 6) * max(row["ns"] * scale for row in some))
        for i, row in enumerate(some):
            axis.text(row["ns"] * scale, i, f"  {row['ns'] * scale:.3g} {unit}, x {row['times']:.3g}", va="center", fontsize=8)
        axis.invert_yaxis()
        axis.set_title(f"{bench.NAMES[workload]} [{unit}]", loc="left", fontsize=9)
        axis.tick_params(labelsize=8)
    figure.tight_layout()
    text = svg(figure)
    pyplot.close(figure)
    return text


def drawn(out, before):
    """{page: SVG} of each picture; as before where its file is missing."""
    def loaded(name):
        path = os.path.join(out, name)
        if not os.path.exists(path):
            return None
        with open(path, encoding="utf-8") as file:
            return json.load(file)
    timed, tracks = loaded("bench.json"), loaded("costs_track.json")
    made = {"images/bench.svg": before["images/bench.svg"] if timed is None else bars(timed)}
    return made | {f"images/track_{name}.svg": before[f"images/track_{name}.svg"] if tracks is None else track(tracks, chosen) for name, chosen in TRACKS.items()}
