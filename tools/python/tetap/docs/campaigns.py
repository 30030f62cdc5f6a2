# SPDX-License-Identifier: Apache-2.0
"""Tables of the campaigns that tools/proof/run_campaign writes, each to a folder of its own. A file that another command wrote makes no table."""
import json
import os
import re

from tetap.docs.figures import table

PROGRAM = "tools/proof/run_campaign"
BLOCKS = ["position", "velocity", "attitude", "gyro bias", "acc bias"]
BLOCK_NAMES = ["position", "velocity", "attitude", "gyroscope bias", "accelerometer bias"]
ROBOTS = ["rover", "car", "iris", "husky_inertial"]
NONE = "-"


def command(folder, words):
    """The command whose result is the file of that folder of out/campaigns."""
    return f"{PROGRAM} {words} --out out/campaigns/{folder}"


def plain(text):
    """A command without what changes no figure: the number of processes."""
    return re.sub(r" --jobs \S+", "", text).strip()


def campaign_of(out, folder, words):
    """Result of that command; None where another command wrote the file."""
    with open(os.path.join(out, "campaigns", folder, "campaign.json"), encoding="utf-8") as file:
        found = json.load(file)
    return found if plain(found["command"]) == command(folder, words) else None


def share(value):
    return NONE if value is None else f"{100 * value:.0f} %"


def pair(value, digits, unit):
    return NONE if value is None else f"{value['median']:.{digits}f} / {value['worst']:.{digits}f} {unit}"


def mean_of(anees, with_share=True):
    """Mean NEES with Student's interval, and the share of times inside."""
    if anees is None:
        return NONE
    scatter = anees["mean_plus_minus"]
    text = f"{anees['mean']:.2f}" + ("" if scatter is None else f" +- {scatter:.2f}")
    return f"{text}, {share(anees['inside'])}" if with_share else text


def blocks_of(found):
    """NEES by block of the covariance, and below the matched world what chance leaves of the share."""
    rows = []
    for case in found["cases"]:
        blocks = case["fused"]["blocks"]
        rows.append([case["world"], *[mean_of(blocks[name]["anees"]) for name in BLOCKS]])
        if case["world"] == "matched":
            rows.append(["what 19 of 20 campaigns of a right filter are above", *[share((blocks[name]["by_chance"] or {}).get("least")) for name in BLOCKS]])
    return table(["world", *BLOCK_NAMES], rows)


def repeated_of(results):
    """The means of several campaigns with seeds of their own: [(seeds, result)]."""
    rows = []
    for seeds, found in results:
        of_block = {one["block"]: one for one in found["repeated"] if one["estimator"] == "fused"}
        rows.append([f"{found['repeat']} campaigns, seeds {seeds}",
                     *[f"{of_block[name]['mean']:.2f} +- {of_block[name]['mean_plus_minus']:.2f}, {100 * of_block[name]['inside']:.1f} +- "
                       f"{100 * of_block[name]['inside_plus_minus']:.1f} %" for name in BLOCKS]])
    return table(["matched", *BLOCK_NAMES], rows)


def robots_of(results):
    """Mean NEES by block of each robot: matched, then mismatched."""
    rows = []
    for robot, found in results:
        by_world = {case["world"]: case["fused"]["blocks"] for case in found["cases"]}
        rows.append([f"`{robot}`", *[", ".join(NONE if by_world[world][name]["anees"] is None else f"{by_world[world][name]['anees']['mean']:.2f}"
                                               for world in ("matched", "mismatched")) for name in BLOCKS]])
    return table(["robot", *BLOCK_NAMES], rows)


FAULT_COLUMNS = {
    "largest error": lambda one, case: pair(one["largest_error_m"], 2, "m"),
    "of the height": lambda one, case: pair(one["largest_height_error_m"], 2, "m"),
    "error at its end": lambda one, case: pair(one["error_at_end_m"], 1, "m"),
    "of the distance": lambda one, case: pair(one["astray_percent"], 1, "%"),
    "RMSE after it": lambda one, case: pair(one["position_rmse_after_m"], 2, "m"),
    "RMSE": lambda one, case: pair(one["position_rmse_m"], 2, "m"),
    "over 3 sigma, worst": lambda one, case: NONE if one["error_over_3_sigma"] is None else f"{one['error_over_3_sigma']['worst']:.2f}",
    "seeds too sure": lambda one, case: f"{one['too_sure_seeds']} of {case['seeds']}",
    "reported after": lambda one, case: NONE if case["said_after_s"] is None else f"{case['said_after_s']['median']:.1f} s",
    "NEES of the position": lambda one, case: mean_of(one["blocks"]["position"]["anees"], with_share=False),
    "inside 3 sigma": lambda one, case: f"{100 * one['blocks']['position']['inside_3_sigma']:.1f} %",
}


def faults_of(results, names):
    """One row a case with these columns; median / worst over the seeds."""
    rows = [[case["label"], *[FAULT_COLUMNS[name](case["fused"], case) for name in names]] for found in results for case in found["cases"]]
    return table(["world, case", *names], rows)


def rest_of(found):
    """Hours at rest: error in the plane and NEES by block."""
    rows = [[case["label"], pair(case["fused"]["position_rmse_m"], 4, "m"), *[mean_of(case["fused"]["blocks"][name]["anees"], with_share=False) for name in BLOCKS]]
            for case in found["cases"]]
    return table(["world, place", "position RMSE", *[f"NEES of {name}" for name in BLOCK_NAMES]], rows)


def region(words_of_folders, make, shown=None):
    """(command as shown, files, table) for REGIONS: `words_of_folders` is {folder: words}; `make` takes the results in that order."""
    def table_of(out):
        results = [campaign_of(out, folder, words) for folder, words in words_of_folders.items()]
        return None if None in results else make(results)
    commands = [command(folder, words) for folder, words in words_of_folders.items()]
    return shown or " && ".join(commands), [f"campaigns/{folder}/campaign.json" for folder in words_of_folders], table_of


REGIONS = {
    "blocks": region({"blocks": "--scenario consistency --seeds 100"}, lambda found: blocks_of(found[0])),
    "repeated": region({"repeat1": "--scenario consistency --world matched --seeds 100 --repeat 10",
                        "repeat1001": "--scenario consistency --world matched --seeds 100 --repeat 10 --first 1001"},
                       lambda found: repeated_of([("1 to 1000", found[0]), ("1001 to 2000", found[1])])),
    "robots": region({robot: f"--robot {robot} --world both --seeds 10 --duration 160" for robot in ROBOTS},
                     lambda found: robots_of(list(zip(ROBOTS, found))),
                     f"{PROGRAM} --robot R --world both --seeds 10 --duration 160 --out out/campaigns/R"),
    "outage": region({"outage": "--scenario outage --seeds 100"},
                     lambda found: faults_of(found, ["largest error", "error at its end", "of the distance", "over 3 sigma, worst", "seeds too sure"])),
    "slip": region({"slip": "--scenario slip --seeds 100"},
                   lambda found: faults_of(found, ["reported after", "largest error", "RMSE after it", "over 3 sigma, worst", "seeds too sure"])),
    "start": region({"start": "--scenario start --seeds 100"},
                    lambda found: faults_of(found, ["RMSE", "NEES of the position", "inside 3 sigma", "over 3 sigma, worst", "seeds too sure"])),
    "rtk": region({"rtk": "--scenario rtk --seeds 4"}, lambda found: rest_of(found[0])),
    "glitch": region({"glitch": "--scenario glitch --seeds 100"},
                     lambda found: faults_of(found, ["largest error", "of the height", "RMSE after it", "over 3 sigma, worst", "seeds too sure", "reported after"])),
}
