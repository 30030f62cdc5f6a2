# SPDX-License-Identifier: Apache-2.0
"""The ledger of figures, out/validation.md: one section a file of out/, with the command that writes it. A section whose file is missing stays as it was."""
import glob
import json
import os
import re
import subprocess

HEAD = ("# Figures\n\nEach section is made from one file of `out/`. A file that is "
        "missing leaves its section as it was. Figures of target cores are from emulated cores.\n")
CODE = ("src", "hal", "drivers", "config", "sim_host")
RUN_ROWS = [("position RMSE [m]", "position_rmse_m", 3), ("heading RMSE [deg]", "heading_rmse_deg", 2), ("largest error [m]", "max_error_m", 3),
            ("final error [m]", "final_error_m", 3), ("NEES mean", "nees_mean", 2)]


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "|" + "---|" * len(head), *["| " + " | ".join(row) + " |" for row in rows]])


def spaced(value):
    return f"{value:,.0f}".replace(",", " ") if isinstance(value, (int, float)) else str(value)


def of_run(summary):
    names = [key for key, one in summary.items() if isinstance(one, dict) and "kind" in one and "epochs" in one]
    rows = [[what, *[f"{summary[name][key]:.{digits}f}" if isinstance(summary[name].get(key), (int, float)) else "-" for name in names]]
            for what, key, digits in RUN_ROWS]
    about = [[key.replace("_", " "), str(summary[key])] for key in ("robot", "seed", "fault", "duration_s", "frames_in", "bus_load_percent") if key in summary]
    return table(["", *names], rows) + "\n\n" + table(["run", ""], about)


def of_hashes(hashes):
    return table(["run", "SHA-256 of the estimates"], [[name, f"`{value[:16]}`"] for name, value in sorted(hashes.items()) if isinstance(value, str)])


def of_count(count):
    """core -> workload -> worst, and NAME_mean."""
    cores = [core for core, one in count.items() if isinstance(one, dict)]
    names = sorted({name for core in cores for name, value in count[core].items()
                    if isinstance(value, (int, float)) and not name.endswith("_operations")})
    return table(["workload", *cores], [[name, *[spaced(count[core].get(name, "-")) for core in cores]] for name in names])


def holds_objects(value):
    return isinstance(value, (dict, list)) and any(isinstance(one, dict) for one in (value.values() if isinstance(value, dict) else value))


def shown(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else spaced(value)


def of_flat(rows):
    """A list of objects with the same keys, or an object of numbers and objects. Values beside objects are a table of their own."""
    if isinstance(rows, dict):
        values = {name: value for name, value in rows.items() if not isinstance(value, (dict, list))}
        inner = [(name, value) for name, value in rows.items() if holds_objects(value)]
        if values and inner:
            return "\n\n".join([of_flat(values), *(f"{name}:\n\n{of_flat(value)}" for name, value in inner)])
        rows = [{"": name, **(value if isinstance(value, dict) else {"value": value})} for name, value in rows.items()]
    rows = [one for one in rows if isinstance(one, dict)]
    keys = [key for key in dict.fromkeys(key for one in rows for key in one) if not any(isinstance(one.get(key), (dict, list)) for one in rows)]
    return table(keys, [[shown(one.get(key, "")) for key in keys] for one in rows])


def of_times(text):
    rows = [line.split("\t") for line in text.splitlines() if line]
    width = max((len(row) for row in rows), default=1)
    return table(["step", *(["wall s", "CPU s"] + [""] * width)[:width - 1]], [row + [""] * (width - len(row)) for row in rows])


def of_swarm(swarm):
    """Verdicts and coverage; the rows of the seeds stay in the file."""
    names = ("seeds", "ok", "named", "blind", "silent", "unsafe", "pairs", "pairs_reached", "values", "values_reached")
    return table(["", "number"], [[name.replace("_", " "), str(swarm[name])] for name in names])


def of_mutants(mutants):
    """Constants that no test notices, by the file that holds them."""
    rows = [row for row in mutants["rows"] if not row["noticed"]]
    return f"{len(mutants['rows']) - len(rows)} of {len(mutants['rows'])} mutants are noticed. The others:\n\n" + table(
        ["constant", "value", "factor"], [[f"`{row['file']}:{row['line']}`", f"`{row['literal']}`", f"{row['factor']:g}"] for row in rows])


def of_matrix(rows):
    """Shares by robot; the kinds stand in out/matrix.md."""
    from tetap.proof import matrix_tables  # needs matplotlib, which the other sections do not
    return table(["robot", *matrix_tables.WHOLE[1:]], matrix_tables.of_whole(rows, lambda row: row["robot"]))


SECTIONS = [("make sim", "sim/summary.json", "the simulated rover", of_run), ("make count", "count.json", "instructions", of_count),
            ("make size", "size.json", "flash and RAM", of_flat), ("make stack", "stack.json", "stack", of_flat),
            ("make hashes", "hashes.json", "hashes of the estimates", of_hashes), ("make costs", "costs.json", "costs of the filters", of_flat),
            ("make bench", "bench.json", "time", of_flat), ("make matrix", "matrix.json", "promises", of_matrix), ("make swarm", "swarm.json", "many faults at once", of_swarm),
            ("make mutants", "mutants.json", "constants doubled and halved", of_mutants),
            ("make soak", "soak.json", "long runs", of_flat), ("make fuzz", "fuzz.json", "fuzzing", of_flat), ("make test", "prove/times.tsv", "time of each step", of_times)]


def kept(page):
    """{file: section} of a page made before."""
    return {match[1]: match[0] for match in re.finditer(r"<!-- out/(\S+) -->\n.*?<!-- end -->\n", page, re.S)}


def commit_before(root, path):
    """` at commit X`: the last change of the code before that file was written; nothing outside of a repository."""
    if not root:
        return ""
    done = subprocess.run(["git", "-C", root, "log", "-1", "--format=%h", f"--before=@{int(os.path.getmtime(path))}", "--", *CODE], capture_output=True, text=True)
    return f" at commit {done.stdout.strip()}" if done.stdout.strip() else ""


def page(out, before, root=""):
    """The page, from what lies in out/ and, where a file is missing, from the page before."""
    parts, old = [HEAD], kept(before)
    for command, file, heading, make in SECTIONS:
        path = os.path.join(out, file)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as handle:
                content = handle.read()
            body = make(content if file.endswith(".tsv") else json.loads(content))
            parts.append(f"<!-- out/{file} -->\n## {heading[0].upper() + heading[1:]}\n\n`{command}`{commit_before(root, path)}, `out/{file}`\n\n{body}\n<!-- end -->\n")
        elif file in old:
            parts.append(old[file])
    replays = sorted(glob.glob(os.path.join(out, "replay", "*", "summary.json")))
    for path in replays:
        name = os.path.basename(os.path.dirname(path))
        with open(path, encoding="utf-8") as handle:
            parts.append(f"<!-- out/replay/{name}/summary.json -->\n## Replay of {name}\n\n`make replay`{commit_before(root, path)}\n\n{of_run(json.load(handle))}\n<!-- end -->\n")
    return "\n".join(parts)
