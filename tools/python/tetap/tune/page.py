# SPDX-License-Identifier: Apache-2.0
"""What a tuning says: as text, as a parameter file, as a page with a picture."""
import base64
import html
import io
import json
import os

import numpy as np

from tetap.tune import outcome, rows

STYLE = """body { font: 16px/1.5 system-ui, sans-serif; color: #262626; max-width: 1080px; margin: 2rem auto; padding: 0 1.2rem; }
table { border-collapse: collapse; margin: .6rem 0; } th, td { padding: .28rem .9rem .28rem 0; text-align: left; border-bottom: 1px solid #e3e3e3; }
img { max-width: 100%; } p { max-width: 46rem; }"""


def held_lines(result):
    """(what, nat per measurement before, after, gain)."""
    lines = [(what, before / count, after / count) for what, before, after, count in result.held_out if count > 0]
    return [(what, -before, -after, before - after) for what, before, after in lines]


def number_text(said):
    if said.value is None:
        return "-"
    return f"at most {said.value:.3g}" if said.low <= 0 else f"{said.value:.3g} ({said.low:.3g} to {said.high:.3g})"


def next_measurement(result):
    """[(row, why, what to record)] of what the node uses and the logs do not show."""
    record = {row.name: row.record for row in rows.ROWS}
    return [(said.name, said.why, record[said.name]) for said in result.said if said.value is None and said.why != outcome.INERT]


def verdict(result):
    """One sentence on whether the new numbers are to be used."""
    gains = [gain for *_, gain in held_lines(result)]
    if not gains:
        return "One log shorter than two minutes: nothing could be held out, so nothing says that these numbers are better. Record more."
    if np.median(gains) > 0 and min(gains) >= -0.01:
        return f"Data held out are likelier by {np.median(gains):.4f} nat a measurement in the median, and none by 0.01 less: the numbers may be used."
    return f"Data held out change by {min(gains):.4f} to {max(gains):.4f} nat a measurement: do not use these numbers."


def text(result, options):
    lines = [f"tune: robot {options.robot}, {len(options.logs)} log{'s' if len(options.logs) > 1 else ''}, {result.replays} replays", ""]
    width = max(len(said.name) for said in result.said)
    for said in result.said:
        lines.append(f"  {said.name:{width}}  {said.start:<9.3g} {number_text(said)}{'  ' + said.why if said.why else ''}")
    lines += ["", f"  refused measurements: {100 * result.refused[0]:.2f} % before, {100 * result.refused[1]:.2f} % after", ""]
    lines += [f"  held out {what}: {after:.4f} nat a measurement, before {before:.4f}" for what, before, after, _ in held_lines(result)]
    if result.nees:
        lines += [f"  NEES {name}: {before[name]:.2f} before, {after[name]:.2f} after" for before, after in zip(*result.nees) for name in before]
    lines += ["  " + one["said"] for one in result.grid]
    return "\n".join([*lines, "", verdict(result)])


def params_text(result, options, chosen):
    """For --params and PARAMS=: rows with a number alone."""
    paths = {row.name: row.paths for row, _, _ in chosen}
    lines = [f"# Noise rows by the likelihood of {', '.join(os.path.basename(log) for log in options.logs)} (tools/calibrate/tune_robot)."]
    for said in result.said:
        for path in paths[said.name]:
            lines.append(f"{path} = {said.value:.5g}  # 95 %: {said.low:.3g} to {said.high:.3g}" if said.value is not None else f"# {path}: {said.why}")
    return "\n".join(lines) + "\n"


def nees_of(summary):
    """{estimator: mean NEES per degree of freedom} of a summary.json."""
    return {name: one["nees_mean"] / one["nees_dof"] for name, one in summary.items() if isinstance(one, dict) and one.get("nees_mean") is not None}


def picture(result):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    found = [said for said in result.said if said.value is not None]
    held = held_lines(result)
    figure, axes = pyplot.subplots(1, 2, figsize=(11, 0.8 + 0.42 * max(len(found), len(held), 3)), width_ratios=(3, 2))
    for place, said in enumerate(found):
        axes[0].plot([max(said.low / said.start, 0.1 * said.value / said.start), said.high / said.start], [place] * 2, color="#2b6cb0", linewidth=2)
        axes[0].plot(said.value / said.start, place, "o", color="#2b6cb0")
    axes[0].axvline(1, color="#6b6b6b", linewidth=1)
    axes[0].set(xscale="log", xlabel="found / begun with, and 95 %", yticks=range(len(found)), yticklabels=[said.name for said in found], ylim=(len(found) - 0.5, -0.5))
    axes[0].xaxis.set_major_formatter("{x:g}")
    axes[0].xaxis.set_minor_formatter("{x:g}")
    axes[0].tick_params(axis="x", which="minor", labelsize=7)
    axes[1].barh(range(len(held)), [gain for *_, gain in held], color=["#2f855a" if gain > 0 else "#c53030" for *_, gain in held])
    axes[1].axvline(0, color="#6b6b6b", linewidth=1)
    axes[1].set(xlabel="gain held out [nat a measurement]", yticks=range(len(held)), yticklabels=[what for what, *_ in held], ylim=(max(len(held), 1) - 0.5, -0.5))
    figure.tight_layout()
    data = io.BytesIO()
    figure.savefig(data, dpi=110)
    pyplot.close(figure)
    return data.getvalue()


def table(head, body):
    cells = lambda kind, row: "".join(f"<{kind}>{html.escape(str(cell))}</{kind}>" for cell in row)  # noqa: E731
    return "<table><tr>" + cells("th", head) + "</tr>" + "".join(f"<tr>{cells('td', row)}</tr>" for row in body) + "</table>"


def write(folder, result, options):
    """tune.html and tune.json."""
    parts = [f"<p>{html.escape(verdict(result))}</p>", '<img alt="rows and held-out gain" src="data:image/png;base64,'
             + base64.b64encode(picture(result)).decode() + '">',
             "<h2>Rows</h2>", table(("row", "begun with", "found, 95 %", ""), [(s.name, f"{s.start:.3g}", number_text(s), s.why) for s in result.said]),
             f"<p>Refused measurements: {100 * result.refused[0]:.2f} % before, {100 * result.refused[1]:.2f} % after.</p>",
             "<h2>Held out</h2>", table(("left out", "nat a measurement before", "after", "gain"),
                                        [(what, f"{before:.4f}", f"{after:.4f}", f"{gain:+.4f}") for what, before, after, gain in held_lines(result)])]
    if result.nees:
        parts += ["<h2>NEES per degree of freedom (1 expected)</h2>", table(("log", "estimator", "before", "after"), [
            (os.path.basename(log), name, f"{before[name]:.2f}", f"{after[name]:.2f}") for log, before, after in zip(options.logs, *result.nees) for name in before])]
    parts += [f"<p>{html.escape(one['said'])}.</p>" for one in result.grid]
    if next_measurement(result):
        parts += ["<h2>What to record next</h2>", table(("row", "why it has no number", "record"), next_measurement(result))]
    title = f"Noise of robot {html.escape(options.robot)}"
    with open(os.path.join(folder, "tune.html"), "w", encoding="utf-8") as file:
        file.write(f"<!DOCTYPE html><html lang=en><meta charset=utf-8><title>{title}</title><style>{STYLE}</style><h1>{title}</h1>{''.join(parts)}</html>\n")
    with open(os.path.join(folder, "tune.json"), "w", encoding="utf-8") as file:
        json.dump({"robot": options.robot, "logs": options.logs, "rows": {s.name: {"start": s.start, "value": s.value, "low": s.low, "high": s.high, "why": s.why} for s in result.said},
                   "held_out": [dict(zip(("left_out", "before", "after", "measurements"), one)) for one in result.held_out],
                   "refused": result.refused, "nees": result.nees, "grid": result.grid, "replays": result.replays}, file, indent=1)
