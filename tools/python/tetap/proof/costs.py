# SPDX-License-Identifier: Apache-2.0
"""Rows of out/costs.json from what was measured of each row, and their table."""
import re

EMPTY = {"drive": "none_0", "sway": "none_1"}  # images without a filter, by scenario
HEAD = ("filter", "takes", "size", "RMSE", "NEES, of", "RAM B", "flash B", "stack B", "M7", "M4F", "R5F", "grows with")
LIST = re.compile(r'^TETAP_COST\((\w+), (\d+), "([^"]+)", "([^"]+)", "([^"]+)", .*\)$', re.M)


def listed(text):
    """[(filter, size, header)] of test/costs/list.hpp."""
    return [(name, int(size), header) for name, size, header, _, _ in LIST.findall(text)]


def growth(small, large, counted):
    """`states 3 to 5: M7 x 1.8, RAM x 1.5`, from the two sizes of one filter."""
    a, b = (counted["m7"][f"{one['filter']}_{one['size']}"] for one in (small, large))
    return f"{small['grows']} {small['size']} to {large['size']}: M7 x {b / a:.2g}"


def rows_of(accuracy, ram, flash, stack, counted):
    rows = []
    sizes = {}
    for one in accuracy:
        sizes.setdefault(one["filter"], []).append(one)
    for one in accuracy:
        name = f"{one['filter']}_{one['size']}"
        scenario = "sway" if "rmse_deg" in one else "drive"
        of_filter = sizes[one["filter"]]
        grows = growth(of_filter[0], of_filter[-1], counted) + f", RAM x {ram_of(of_filter[-1], ram) / ram_of(of_filter[0], ram):.2g}" if len(of_filter) > 1 else "one size"
        rows.append({"filter": one["filter"], "size": one["size"], "header": one["header"], "scenario": one["scenario"], "rmse_m": one.get("rmse_m"),
                     "rmse_deg": one.get("rmse_deg"), "nees": one.get("nees"), "nees_dof": one.get("nees_dof"), "seeds": one["seeds"], "ram_b": ram[name],
                     "flash_b": flash[name] - flash[EMPTY[scenario]], "stack_b": stack[name], "m7": counted["m7"][name], "m4f": counted["m4f"][name],
                     "r5": counted["r5"][name], "grows_with": grows})
    return rows


def ram_of(one, ram):
    return ram[f"{one['filter']}_{one['size']}"]


def spaced(value):
    return f"{value:,}".replace(",", " ")


def cells(rows):
    """One line a row of the table; NEES beside what is expected of it."""
    out = []
    for row in rows:
        rmse = f"{row['rmse_m']:.3f} m" if row["rmse_m"] is not None else f"{row['rmse_deg']:.2f} deg"
        nees = f"{row['nees']:.1f}, {row['nees_dof']}" if row["nees"] is not None else "-"
        out.append([row["filter"], row["scenario"], f"{spaced(row['size'])} {row['grows_with'].split(' ')[0] if row['grows_with'] != 'one size' else ''}".strip(), rmse, nees,
                    *[spaced(row[key]) for key in ("ram_b", "flash_b", "stack_b", "m7", "m4f", "r5")], row["grows_with"]])
    return out
