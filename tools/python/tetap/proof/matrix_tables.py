# SPDX-License-Identifier: Apache-2.0
"""Tables, page and picture of the fault matrix: shares of broken promises by kind of fault."""
import re

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tetap.proof import matrix_cells

WORST = 10
KIND_LIMIT, ALL_LIMIT = 0.05, 0.01  # bars of the promise `held`: for one kind, for all cells
KINDS = ("offset", "spike", "step", "ramp", "scale", "sign", "dead", "stuck", "not_available", "delayed", "repeated", "lost")
ORDER = ("0.1g", "1g", "2g", "5g", "30g", "max")


def kind_of(row):
    """Sensor and kind; spikes of each length are one."""
    return row["sensor"], re.sub(r"\d+$", "", row["kind"])


def is_judged(row):
    return row["promise"] != "blind"


def counted(rows):
    """(broken, judged)."""
    rows = [row for row in rows if is_judged(row)]
    return sum(bool(row["broken"]) for row in rows), len(rows)


def share(count):
    return f"{100 * count[0] / count[1]:.1f}" if count[1] else "-"


def grouped(rows, key):
    found = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return found


def magnitude(row):
    """For the order of sizes within a kind."""
    size = row["size"]
    return ORDER.index(size) if size in ORDER else abs(float(size[1:])) if size[0] in "xs" and size[1:] else 0


def smallest(rows):
    """The broken cell with the smallest size; of these one that is held, and the worst."""
    broken = [row for row in rows if row["broken"]]
    return min(broken, key=lambda row: (magnitude(row), row["promise"] != "held", -row["worst_ratio"])) if broken else None


def command(row):
    name = " ".join(str(row[key]) for key in ("robot", "situation", "sensor", "axis", "kind", "size", "seed"))
    return f'tools/proof/run_matrix --cell "{name}"'


def worst_kinds(rows, most=WORST):
    """Kinds by the number of broken cells: ((sensor, kind), rows)."""
    kinds = [(key, mine) for key, mine in grouped(rows, kind_of).items() if counted(mine)[0] > 0]
    return sorted(kinds, key=lambda one: (-counted(one[1])[0], -counted(one[1])[0] / counted(one[1])[1]))[:most]


def kind_rows(rows):
    cells = []
    for (sensor, kind), mine in sorted(grouped(rows, kind_of).items()):
        by = {promise: counted([row for row in mine if row["promise"] == promise]) for promise in ("held", "noticed")}
        words = sorted({word for row in mine for word in row["broken"]})
        worst = max((row["worst_ratio"] for row in mine if is_judged(row)), default=0)
        cells.append([sensor, kind, str(by["held"][1]), str(by["held"][0]), str(by["noticed"][1]), str(by["noticed"][0]),
                      share(counted(mine)), f"{worst:.1f}", " ".join(words) or "-", str(len(mine) - counted(mine)[1])])
    return cells


HEAD = ["sensor", "kind", "held", "broken", "noticed", "broken", "broken [%]", "worst / 3 sigma", "how", "blind"]


def of_whole(rows, names):
    cells = []
    for name, mine in [("all", rows), *sorted(grouped(rows, names).items())]:
        held, noticed = (counted([row for row in mine if row["promise"] == promise]) for promise in ("held", "noticed"))
        cells.append([name, str(held[1]), str(held[0]), share(held), str(noticed[1]), str(noticed[0]), share(noticed), str(len(mine) - held[1] - noticed[1])])
    return cells


WHOLE = ["", "held", "broken", "[%]", "noticed", "broken", "[%]", "blind"]


FLOOR = ["", "held", "broken", "oracle", "both", "position", "90 %", "velocity", "heading"]


def of_floor(rows):
    """Held cells beside their oracle: how many each breaks, and the error over the oracle's, median and (of the position) the 90th of a hundred."""
    held = [row for row in rows if row["promise"] == "held" and "over_oracle" in row]
    cells = []
    for name, mine in [("all", held), *sorted(grouped(held, lambda row: row["robot"]).items())] if held else []:
        def at(quantity, part, mine=mine):
            return f"{sorted(row['over_oracle'][quantity] for row in mine)[int(part * (len(mine) - 1))]:.2f}"
        broken = [bool(row["broken"]) for row in mine]
        oracle = [bool(row["oracle_broken"]) for row in mine]
        cells.append([name, str(len(mine)), str(sum(broken)), str(sum(oracle)), str(sum(map(min, broken, oracle))),
                      at("position", 0.5), at("position", 0.9), at("velocity", 0.5), at("heading", 0.5)])
    return cells


def by_wiring(rows):
    """The rows with the promise that follows from wiring alone."""
    return [{**row, **row["wired"]} for row in rows if "wired" in row]


def left_held(rows):
    """One sentence on the cells whose witness sent nothing."""
    was = [row for row in rows if row["wired"]["promise"] == "held"]
    left = sum(row["promise"] != "held" for row in was)
    return f"{left} of {len(was)} held cells ({share((left, len(was)))} %) are not, because a witness sent nothing usable while the fault lasted."


def columns(head, rows):
    widths = [max(len(row[i]) for row in [head, *rows]) for i in range(len(head))]
    return "\n".join("  ".join(cell.ljust(width) if i < 2 else cell.rjust(width) for i, (cell, width) in enumerate(zip(row, widths))).rstrip() for row in [head, *rows])


def markdown(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *["| " + " | ".join(row) + " |" for row in rows]])


def parts_of(rows):
    """The robots of the matrix, and those with a table of their own."""
    own = [row for row in rows if row["robot"] in matrix_cells.OWN_TABLE]
    return [("The matrix", [row for row in rows if row["robot"] not in matrix_cells.OWN_TABLE])] + ([("rover_landmarks", own)] if own else [])


def text(rows):
    parts = []
    for title, mine in parts_of(rows):
        parts.append(f"{title}\n" + columns(WHOLE, of_whole(mine, lambda row: row["robot"])))
        parts.append(columns(WHOLE, of_whole(mine, lambda row: row["situation"])))
        wired = by_wiring(mine)
        if wired:
            parts.append("By wiring alone. " + left_held(mine) + "\n" + columns(WHOLE, of_whole(wired, lambda row: row["robot"])))
        if of_floor(mine):
            parts.append("Held cells and the oracle\n" + columns(FLOOR, of_floor(mine)))
        parts.append(columns(HEAD, kind_rows(mine)))
    return "\n\n".join(parts)


PAGE = """# The fault matrix

`make matrix CELLS={count}` plays each sensor's fault in each situation and holds the promise of the cell against the run. A cell begins from a shared
clean drive in the simulated world, mismatched. The promise follows from the devices that still see what the fault hurts
(`tools/python/tetap/proof/matrix_promise.py`). Causes of the worst kinds stand in `docs/decisions/trust.md`.

* *held*: two or more other devices see it. The error stays within 1.5 times 3 sigma, but for 2 s and three samples, and is inside 10 s after the fault.
* *noticed*: one other device sees it, or the size is below 1.5 gates. The error stays within 3 times 3 sigma, or a word comes within 10 s.
* *blind*: none sees it; listed, not judged.
* A device sees a fault if it is wired so and sent a usable sample while the fault lasted. A word counts from when a witness's 3-sigma test could speak.
* An error counts only above twice that of the run without the fault. `valid`: a valid flag stays 1 beyond ten times 3 sigma.
* Bars: at most {all:.0f} % of all held cells are broken, and at most {kind:.0f} % of those of one kind.

A size in gates (g) is the smallest change that the sensor's gate refuses. An IMU has no gate; its size is measured by what it does to velocity
or heading (`sim_host/matrix/gates.hpp`). Some kinds have a factor (x), seconds (s), or no size (-); max is the most that a frame can carry.
"""


def bars(rows):
    """One sentence on the two bars of the promise `held`."""
    held = [row for row in rows if row["promise"] == "held"]
    kinds = grouped(held, kind_of)
    over = sum(counted(mine)[0] > KIND_LIMIT * counted(mine)[1] for mine in kinds.values())
    return (f"Held: {share(counted(held))} % of the cells are broken (bar {100 * ALL_LIMIT:.0f} %). {over} of {len(kinds)} kinds have more than "
            f"{100 * KIND_LIMIT:.0f} %.")


def more_tables(rows):
    """The promise by wiring alone, and held cells beside their oracle."""
    parts = []
    if by_wiring(rows):
        parts += ["### By wiring alone\n\n" + left_held(rows), markdown(["robot", *WHOLE[1:]], of_whole(by_wiring(rows), lambda row: row["robot"]))]
    if of_floor(rows):
        parts += ["### Held cells and their floor\n\nThe oracle is the same node without what the faulty device sends meanwhile. Errors are over the oracle's.",
                  markdown(["robot", *FLOOR[1:]], of_floor(rows))]
    return parts


RECORDED = """# Recorded drives with one fault

`tools/proof/run_matrix --recorded` puts one fault into a recorded drive, at ten places that are evenly spread over it. Truth is the data set's
position, and its heading where it has one.
"""


def page(rows, recorded=False):
    """The tables of a run in Markdown: of the matrix, or of recorded drives with one fault."""
    if recorded:
        return "\n\n".join([RECORDED.rstrip("\n"), bars(rows), markdown(["drive", *WHOLE[1:]], of_whole(rows, lambda row: row["robot"])), markdown(HEAD, kind_rows(rows))]) + "\n"
    parts = [PAGE.format(count=len(rows), all=100 * ALL_LIMIT, kind=100 * KIND_LIMIT)]
    for title, mine in parts_of(rows):
        parts += [f"## {title}", bars(mine), markdown(["robot", *WHOLE[1:]], of_whole(mine, lambda row: row["robot"])),
                  markdown(["situation", *WHOLE[1:]], of_whole(mine, lambda row: row["situation"])), *more_tables(mine),
                  markdown(HEAD, kind_rows(mine))]
        worst = []
        for (sensor, kind), cells in worst_kinds(mine):
            row = smallest(cells)
            count = counted(cells)
            worst.append([f"{sensor} {kind}", f"{count[0]} of {count[1]}", row["promise"], ", ".join(row["broken"]),
                          f"{row['worst_ratio']:.1f} ({row['quantity']})", f"`{command(row)}`"])
        parts += [f"### The {len(worst)} worst kinds, each with its smallest example",
                  markdown(["kind", "broken", "promise", "how", "worst / 3 sigma", "command"], worst)]
    return "\n\n".join(part.rstrip("\n") for part in parts) + "\n"


def picture(rows, path):
    """Share of broken promises by sensor and kind, with the number of cells in each field; robots with a table of their own are bars alone."""
    everyone, rows = rows, parts_of(rows)[0][1] or rows
    sensors = [one for one in (*matrix_cells.SENSORS, *matrix_cells.ACCURACIES, "stamps", "frames") if any(row["sensor"] == one for row in rows)]
    kinds = [kind for kind in KINDS if any(kind_of(row)[1] == kind for row in rows)]
    by = grouped(rows, kind_of)
    figure = Figure(figsize=(11, 6.5), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    field, bars = figure.subplots(1, 2, width_ratios=[3, 1])
    shares = [[float("nan")] * len(kinds) for _ in sensors]
    for i, sensor in enumerate(sensors):
        for k, kind in enumerate(kinds):
            count = counted(by.get((sensor, kind), []))
            if count[1] == 0:
                continue
            shares[i][k] = 100 * count[0] / count[1]
            field.text(k, i, f"{count[0]}\nof {count[1]}", ha="center", va="center", fontsize=6.5, linespacing=0.9, color="white" if shares[i][k] > 45 else "#262626")
    image = field.imshow(shares, cmap="OrRd", vmin=0, vmax=70, aspect="auto")
    field.set_xticks(range(len(kinds)), kinds, rotation=35, ha="right")
    field.set_yticks(range(len(sensors)), sensors)
    field.set_title("broken promises of judged cells", fontsize=10)
    figure.colorbar(image, ax=field, label="broken [%]", shrink=0.7)
    groups = [(name, mine) for key in ("robot", "situation", "promise") for name, mine in sorted(grouped(filter(is_judged, everyone if key == "robot" else rows), lambda row: row[key]).items())]
    values = [100 * counted(mine)[0] / max(counted(mine)[1], 1) for _, mine in groups]
    bars.barh(range(len(groups)), values, color="#d55e00")
    bars.set_yticks(range(len(groups)), [name for name, _ in groups])
    bars.invert_yaxis()
    bars.set_xlabel("broken [%]")
    bars.spines[["top", "right"]].set_visible(False)
    figure.savefig(path)
