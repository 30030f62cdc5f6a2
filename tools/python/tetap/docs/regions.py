# SPDX-License-Identifier: Apache-2.0
"""Tables of figures: all of them in the ledger out/validation.md, those that a reader decides with in pages of docs/, too. A region stands between
`<!-- figures: NAME -->` and `<!-- end -->`; it is made from the files that its command wrote, with that command and the commit before them.
A region whose files are missing stays as it was."""
import json
import os
import re

from tetap.docs import bench, campaigns, figures, recorded
from tetap.docs.figures import commit_before, spaced, table
from tetap.proof import costs

REGION = re.compile(r"<!-- figures: (\w+) -->\n.*?<!-- end -->\n", re.S)
IMAGES = [("tetap-zynqmp_r5-rover", "Cortex-R5F, rover"), ("tetap-mps2_m7-rover", "Cortex-M7, rover"), ("tetap-mps2_m4f-rover", "Cortex-M4F, rover"),
          ("tetap-zynqmp_r5-mrclam", "Cortex-R5F, mrclam"), ("tetap-ark_cannode-rover", "ARK CANnode (Cortex-M4F), rover with drivers")]
WORKLOADS = ["sincos", "atan2", "exp", "log", "w1_kf", "w1_kf_conditioned", "w2_textbook", "w2_ekf", "w3_ukf", "w3_ukf_sqrt", "w6_pf1000", "pose_grid_work", "fuse_range_bearing", "w4_ahrs6", "w4_ahrs9", "ahrs9", "ins_strapdown",
             "ins_covariance", "w5_ins", "ins_tick", "ins_tick_rover", "ins_tick_car", "ins_tick_iris", "node_tick", "node_tick_faults", "mrclam_tick"]
ESTIMATORS = [("`Inertial`, a tick with an IMU of 200 Hz", "ins_tick_rover"), ("`PoseEkf`, a sighting of a landmark", "fuse_range_bearing"),
              ("`filter::Ekf`, a step with range and bearing", "w2_ekf"), ("`filter::Ukf`, the same", "w3_ukf"), ("`filter::UkfSqrt`, the same", "w3_ukf_sqrt"),
              ("`PoseParticles`, 1000 particles and four landmarks", "w6_pf1000"), ("`PoseGrid`, a tick of a step: 100 of up to 3 840 lines", "pose_grid_work"),
              ("`Attitude`, a step with magnetometer", "ahrs9"),
              ("plain Mahony, a step with magnetometer", "w4_ahrs9"), ("`Odometry`, a sample of wheel counts", "dead_reckoning_counts"),
              ("`Odometry`, a sample with gyroscope", "dead_reckoning_gyro"), ("`filter::Kalman`, an update of 2 in 4 states", "w1_kf_conditioned"),
              ("`filter::StructuredKalman`, the same", "w1_kf"), ("the rover's whole node, a tick of 10 ms", "node_tick")]
WHOLE = "test/replay/inertial_runs.py build/host/sim_host out/inertial_runs --whole"


def loaded(out, name):
    with open(os.path.join(out, name), encoding="utf-8") as file:
        return json.load(file)


def memory(out):
    size, stack = loaded(out, "size.json"), loaded(out, "stack.json")
    rows = []
    for image, name in IMAGES:
        if image in size:
            one, found = size[image], stack.get(image, {})
            rows.append([name, spaced(one["flash"]), spaced(one["ram"]), spaced(found.get("bound", "-")), spaced(found.get("measured") or "-")])
    return table(["image", "flash B", "RAM B, with the stack reserved", "stack bound B", "painted mark B"], rows)


def instructions(out):
    count = loaded(out, "count.json")
    cores = [core for core in ("m7", "m4f", "r5") if core in count]
    rows = []
    for name in WORKLOADS:
        cells = [f"{spaced(count[core][f'{name}_mean'])} / {spaced(count[core][name])}" if name in count[core] else "-" for core in cores]
        rows.append([f"`{name}`", *cells])
    return table(["workload, mean / worst", *[{"m7": "Cortex-M7", "m4f": "Cortex-M4F", "r5": "Cortex-R5F"}[core] for core in cores]], rows)


def campaign(out):
    rows, found = [], loaded(out, "campaign.json")
    if campaigns.plain(found.get("command", campaigns.PROGRAM)) != campaigns.PROGRAM:
        return None  # a file of other seeds or another scenario
    for case in found["cases"]:
        one = case["fused"]
        nees, position, heading, sensors = one["anees"], one["position_rmse_m"], one["heading_rmse_deg"], one["bus"]
        nis = ", ".join(f"{name} {sensors[key]['nis_per_dof']:.3f}" for key, name in (("GnssPosition", "position"), ("GnssVelocity", "velocity"), ("WheelCounts", "wheels"))
                        if key in sensors)
        rows.append([case["setting"], f"{position['median']:.3f} / {position['worst']:.3f} m", f"{heading['median']:.2f} / {heading['worst']:.2f} deg",
                     f"{nees['mean']:.2f} +- {nees['mean_plus_minus']:.2f}", f"{100 * nees['inside']:.1f} %", f"{100 * nees['above']:.1f} / {100 * nees['below']:.1f} %", nis])
    return table(["world, fused", "position RMSE, median / worst", "heading RMSE", "NEES of the pose (3 expected)", "inside its 95 % interval",
                  "above it (too sure) / below (too modest)", "NIS per degree of freedom (1 expected)"], rows)


def of_whole_runs(make):
    """A table of the file with all cuts; None, so that the region stays, where the file has those of 60 s alone."""
    def table_of(out):
        result = loaded(out, "inertial.json")
        return "\n".join(make(result)) if recorded.is_whole(result) else None
    return table_of


def estimators(out):
    """Cost of each estimator alone, on a Cortex-M7."""
    count = loaded(out, "count.json")["m7"]
    return table(["estimator", "workload", "instructions, mean", "worst"],
                 [[name, f"`{workload}`", spaced(count[f"{workload}_mean"]), spaced(count[workload])] for name, workload in ESTIMATORS])


def mrclam(out):
    rows = []
    for robot in range(1, 6):
        one = loaded(out, f"recorded/mrclam{robot}/summary.json")["fused"]
        sightings = one["measurements"]["RangeBearing"]
        rows.append([str(robot), f"{one['position_rmse_m']:.3f} m", f"{one['heading_rmse_deg']:.1f} deg", f"{one['nees_mean']:.1f}", f"{sightings['nis_mean']:.2f}",
                     f"{sightings['accepted']} / {sightings['rejected']}"])
    return table(["robot", "position RMSE", "heading RMSE", "NEES mean (3 expected)", "NIS mean (2 expected)", "sightings accepted / rejected"], rows)


def bounded(file):
    """Each figure of a file of runs on logs, with the bounds that the test holds it between."""
    def made(out):
        rows = [[what, f"{one['value']:.4g}", f"{one['low']:.3g} to {one['high']:.3g}"] for what, one in loaded(out, file).items()]
        return table(["run and figure", "measured", "bounds"], rows)
    return made


def benchmark(out):
    return table(bench.HEAD, bench.cells(loaded(out, "bench.json")))


def of_costs(out):
    """The cost table; a filter's second row has its growth."""
    return table(costs.HEAD, costs.cells(loaded(out, "costs.json")))


def mappers(out):
    """Four ways to make a map; None where not all seeds or no images were run."""
    found, cells = loaded(out, "mappers.json"), []
    if found["seeds"] < 10 or "ram_bytes" not in found["rows"][0]:
        return None
    for one in found["rows"]:
        row = [f"{one['method']}, `{one['robot']}`"]
        for count in ("63", "14"):
            run = one[count]
            row += [f"{run['trajectory_m']:.2f} m", f"{run['map_m']:.2f} m", f"{run['points']:.0f}, {run['astray']:.1f}", f"{run['nees']:.1f}"]
        cells.append([*row, spaced(one["ram_bytes"]), f"{spaced(one['instructions_mean'])} / {spaced(one['instructions_worst'])}", one["needs"], one["fails"]])
    columns = [f"{name}, {count}" for count in (63, 14) for name in ("trajectory", "map", "held, astray", "NEES")]
    return table(["method", *columns, "RAM B", "M7, mean / worst tick", "needs", "fails"], cells)


# region: (command, files that it writes, table)
REGIONS = {"memory": ("make size stack", ["size.json", "stack.json"], memory), "instructions": ("make count", ["count.json"], instructions),
           "campaign": ("tools/proof/run_campaign", ["campaign.json"], campaign),
           "bench": ("make bench", ["bench.json"], benchmark), "costs": ("make costs", ["costs.json"], of_costs),
           "estimators": ("make count", ["count.json"], estimators),
           "drives": (WHOLE, ["inertial.json"], of_whole_runs(recorded.drive_table)),
           "outages": (WHOLE, ["inertial.json"], of_whole_runs(lambda result: recorded.outage_table(result["car"]["outages"]))),
           "nees": (WHOLE, ["inertial.json"], of_whole_runs(recorded.nees_table)),
           "menu": ("test/replay/menu_runs.py build/host/sim_host out/menu", ["menu/menu.json"], bounded("menu/menu.json")),
           "mapping": ("test/replay/mapping_runs.py build/host/sim_host out/mapping --whole", ["mapping/mapping.json"], bounded("mapping/mapping.json")),
           "mappers": ("tools/report/compare_mappers --images build/m7/hal/board", ["mappers.json"], mappers),
           "mrclam": ("make test STEPS=recorded_runs", [f"recorded/mrclam{robot}/summary.json" for robot in range(1, 6)], mrclam), **campaigns.REGIONS}


def fill(text, out, root):
    """The page with each region made anew, where its files lie in out/."""
    def region(match):
        command, files, make = REGIONS[match[1]]
        paths = [os.path.join(out, one) for one in files]
        if not all(os.path.exists(one) for one in paths):
            return match[0]
        made = make(out)
        if made is None:
            return match[0]
        return f"<!-- figures: {match[1]} -->\n`{command}`{commit_before(root, max(paths, key=os.path.getmtime))}:\n\n{made}\n<!-- end -->\n"
    return REGION.sub(region, text)


def ledger(out, before, root):
    """The page out/validation.md: a section a file, then every region. What has no file stays as it was before, and what was never made is left out."""
    old = {match[1]: match[0] for match in REGION.finditer(before)}
    parts = [figures.page(out, before, root)]
    for name in REGIONS:
        empty = f"<!-- figures: {name} -->\n<!-- end -->\n"
        text = fill(old.get(name, empty), out, root)
        if text != empty:
            parts.append(f"## Table {name}\n\n{text}")
    return "\n".join(parts)
