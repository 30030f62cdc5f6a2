# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report: one idea each, the same colours for the same things everywhere.

Colours: Okabe and Ito, "Color Universal Design" (2008): distinct with every common kind of colour vision.
"""
import os

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.ticker import NullLocator

from tetap.report import ground_truth, metrics, normalised_error, recorded_run

INK, GREY, FAINT = "#262626", "#6b6b6b", "#e3e3e3"
TRUTH, ODOMETRY, FUSED = "#3c3c3c", "#e69f00", "#0072b2"
LANDMARK, REJECTED = "#009e73", "#d55e00"
FAULT_SHADE = "#f6d9c8"
FAULT = "fault of the world"  # faults of the world, beside the faults that the node reports
FIX = "#7d7d7d"
ESTIMATORS = {"odometry": ODOMETRY, "fused": FUSED, "attitude": "#cc79a7"}
OTHER = "#56b4e9"
MODES = {"Boot": "#f2f2f2", "WaitingForPose": "#d9d9d9", "Aligning": "#f0e442", "Nominal": "#9fd3c0", "DeadReckoning": "#e69f00",
         "Degraded": "#cc79a7", "Fault": "#d55e00", "WaitingForImu": "#bdbdbd", "Levelling": "#b3cde3", "FindingHeading": "#8da0cb"}
DPI = 120
MOST_BANDS = 4.0  # an error of more usual bands than this gets an axis with two scales
LARGEST_ELLIPSE = 0.25  # share of the picture's larger side
WIDE_BAND = 10.0  # a band of so many times the RMS error is explained in words
MOST_POINTS = 20_000  # per line; more than a picture has columns


def color_of(run, estimator):
    return ESTIMATORS.get(run.names[estimator], OTHER)


def thinned(count):
    return slice(None, None, max(1, count // MOST_POINTS))


def figure(width, height, title, rows=1, columns=1, **arguments):
    """A figure with its title at the left, and its axes in the house's style, row by row."""
    fig = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    FigureCanvasAgg(fig)
    axes = fig.subplots(rows, columns, squeeze=False, **arguments).ravel()
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.spines[["left", "bottom"]].set_color(GREY)
        one.tick_params(colors=GREY, labelsize=9)
        one.grid(True, color=FAINT, linewidth=0.7)
        one.set_axisbelow(True)
        one.xaxis.label.set_color(INK)
        one.yaxis.label.set_color(INK)
    axes[0].set_title(title, loc="left", fontsize=11.5, color=INK, pad=10)
    return fig, axes


def legend(axes, **arguments):
    arguments = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0), "borderaxespad": 0.0, **arguments}
    axes.legend(frameon=False, fontsize=9, labelcolor=INK, **arguments)


def save(fig, path):
    """Written beside the path first, in a file that was not there: never through a link."""
    temporary = f"{path}.part{os.getpid()}"
    with open(temporary, "xb") as file:
        fig.savefig(file, format=os.path.splitext(path)[1][1:], dpi=DPI, facecolor="white")
    os.replace(temporary, path)


def shade_faults(axes, run):
    """The time of each fault of the world; a line where it was an instant. A handle for the legend, or none."""
    spans = recorded_run.fault_spans(run)
    for _, start, end in spans:
        if end > start:
            axes.axvspan(start, end, color=FAULT_SHADE, linewidth=0, zorder=0)
        else:
            axes.axvline(start, color=REJECTED, linewidth=1.2, linestyle=(0, (4, 2)), zorder=1)
    if not spans:
        return []
    if all(end == start for _, start, end in spans):
        return [Line2D([], [], color=REJECTED, linewidth=1.2, linestyle=(0, (4, 2)), label=FAULT)]
    return [Patch(facecolor=FAULT_SHADE, label=FAULT)]


def two_scales(axes, usual, largest):
    """Linear up to `usual`, logarithmic beyond it, so that a jump does not flatten everything else."""
    axes.set_yscale("symlog", linthresh=usual, linscale=1.6)
    axes.set_ylim(-1.3 * largest, 1.3 * largest)
    near = 10.0 ** np.floor(np.log10(usual))
    near *= max(one for one in (1, 2, 5) if one * near <= usual)
    far = [m * 10.0 ** k for k in range(-4, 6) for m in ((1, 10) if largest > 20 * usual else (1, 3)) if 1.6 * usual < m * 10.0 ** k <= 1.3 * largest]
    ticks = sorted({near, *far})
    axes.set_yticks([-one for one in reversed(ticks)] + [0.0] + ticks)
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_locator(NullLocator())
    for side in (-usual, usual):
        axes.axhline(side, color=GREY, linewidth=0.6, linestyle=(0, (1, 2)))


def broken_at_gaps(time_s, *columns):
    """Copies with a NaN where time jumps, so that no line is drawn across a gap."""
    steps = np.diff(time_s)
    gaps = np.flatnonzero(steps > 20 * max(float(np.median(steps)), 1e-3)) + 1 if len(steps) else []
    return [np.insert(column.astype(float), gaps, np.nan) for column in columns]


def covariance_ellipses(rows, share, count):
    """(centres, widths, heights, angles in degrees) of about `count` ellipses of a run, each holding `share` of the probability."""
    known = np.flatnonzero(np.isfinite(rows["std_x_m"] + rows["std_y_m"] + rows["corr_xy"]) & (rows["pos_valid"] == 1))
    if len(known) == 0:
        return np.empty((0, 2)), [], [], []
    pick = known[np.linspace(0, len(known) - 1, min(count, len(known))).astype(int)]
    sx, sy = rows["std_x_m"][pick], rows["std_y_m"][pick]
    p = np.empty((len(pick), 2, 2))
    p[:, 0, 0], p[:, 1, 1] = sx ** 2, sy ** 2
    p[:, 0, 1] = p[:, 1, 0] = rows["corr_xy"][pick] * sx * sy
    values, vectors = np.linalg.eigh(p)
    axes = 2 * np.sqrt(np.maximum(values, 0) * normalised_error.chi_square(share, 2))
    angle = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    return np.stack([rows["x_m"][pick], rows["y_m"][pick]], axis=1), axes[:, 1], axes[:, 0], angle


def extremes(tracks, truth):
    """The least and the largest x, and y, of all that is drawn of a path; nothing where there is none."""
    found = []
    for rows in tracks:
        valid = rows["pos_valid"] == 1
        if valid.any():
            found.append([[column.min(), column.max()] for column in (rows["x_m"][valid], rows["y_m"][valid])])
    if truth is not None:
        found.append([[column.min(), column.max()] for column in (truth.x_m, truth.y_m)])
    return np.array(found).transpose(1, 0, 2).reshape(2, -1) if found else (np.empty(0), np.empty(0))


def way_in_faults(run, truth, estimator):
    """(name, x, y) of the way driven during each fault of the world: the truth's, or else the estimate's."""
    rows = run.of(estimator)
    valid = rows["pos_valid"] == 1
    time_s, x, y = (truth.time_s, truth.x_m, truth.y_m) if truth is not None else (rows["time_s"][valid], rows["x_m"][valid], rows["y_m"][valid])
    found = []
    for name, start, end in recorded_run.fault_spans(run):
        inside = np.flatnonzero((time_s >= start) & (time_s <= end)) if end > start else np.flatnonzero(time_s >= start)[:1]
        if len(inside):
            found.append((name, x[inside], y[inside]))
    return found


def draw_fixes(axes, fixes):
    """Raw fixes as dots inside of the axes as they are; how many lie outside stands in the corner."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    axes.plot(fixes[0], fixes[1], linestyle="none", marker=".", markersize=4.5, color=FIX, markeredgewidth=0, alpha=0.8, label="GNSS fix", zorder=1.5)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    outside = int(((fixes[0] < left) | (fixes[0] > right) | (fixes[1] < bottom) | (fixes[1] > top)).sum())
    if outside:
        axes.annotate(f"{outside} fixes outside of the picture", (1.0, 0.0), xycoords="axes fraction", xytext=(-4, 4), textcoords="offset points", ha="right", va="bottom",
                      fontsize=9, color=GREY)


def draw_faults(axes, ways):
    """The way driven during each fault, with its name where it began."""
    for number, (name, x, y) in enumerate(ways):
        axes.plot(x, y, color=REJECTED, linewidth=5, alpha=0.45, solid_capstyle="round", label=FAULT if number == 0 else None, zorder=2.5)
        axes.annotate(name, (x[0], y[0]), xytext=(6, 7), textcoords="offset points", fontsize=9, color=REJECTED, zorder=9,
                      path_effects=[withStroke(linewidth=3, foreground="white")])


def path(run, truth, landmarks, title, fixes=None):
    """Truth, odometry and fused estimate in the plane."""
    tracks = {k: run.of(k) for k in run.estimators if run.kinds[k] != "Attitude"}
    x, y = extremes(tracks.values(), truth)
    aspect = (np.ptp(y) + 1e-3) / (np.ptp(x) + 1e-3) if len(x) else 1.0
    fig, (axes,) = figure(8.6, float(np.clip(6.6 * aspect, 3.6, 7.4)), title)
    if landmarks:
        axes.plot([one["x_m"] for one in landmarks], [one["y_m"] for one in landmarks], linestyle="none", marker="^", markersize=7,
                  color=LANDMARK, markeredgecolor="white", markeredgewidth=0.6, label="landmark", zorder=5)
    if truth is not None:
        name = "GPS track" if truth.is_reference else "truth"
        tx, ty = broken_at_gaps(truth.time_s, truth.x_m, truth.y_m)
        style = {"marker": ".", "markersize": 5, "markeredgewidth": 0, "linewidth": 0.5, "alpha": 0.6} if truth.is_reference else {
            "linewidth": 2.6, "alpha": 0.45}
        axes.plot(tx[thinned(len(tx))], ty[thinned(len(ty))], color=TRUTH, label=name, zorder=2,
                  solid_capstyle="round", **style)
    for k, rows in tracks.items():
        valid = rows["pos_valid"] == 1
        if not valid.any():
            continue
        ex, ey = broken_at_gaps(rows["time_s"][valid], rows["x_m"][valid], rows["y_m"][valid])
        axes.plot(ex[thinned(len(ex))], ey[thinned(len(ey))], color=color_of(run, k), linewidth=1.1, label=run.names[k], zorder=3 + k * 0.1)
    best = run.best
    centres, widths, heights, angles = covariance_ellipses(tracks[best], 0.95, 28)
    # One that is as large as the picture, from before the start was known, would hide the rest.
    fit = np.asarray(widths) <= LARGEST_ELLIPSE * max(np.ptp(x), np.ptp(y)) if len(x) else []
    centres, widths, heights, angles = (np.asarray(one)[fit] for one in (centres, widths, heights, angles))
    if len(centres):
        axes.add_collection(EllipseCollection(widths, heights, angles, units="xy", offsets=centres, offset_transform=axes.transData,
                                              facecolor="none", edgecolor=color_of(run, best), linewidth=0.9, zorder=4))
    draw_faults(axes, way_in_faults(run, truth, best))
    if fixes is not None:
        draw_fixes(axes, fixes)
    handles, labels = axes.get_legend_handles_labels()
    if len(centres):
        handles.append(Line2D([], [], marker="o", markersize=8, linestyle="none", markerfacecolor="none", markeredgecolor=color_of(run, best)))
        labels.append(f"95 % ellipse ({run.names[best]})")
    for k, rows in tracks.items():
        valid = np.flatnonzero(rows["pos_valid"] == 1)
        if len(valid):
            last = valid[-1]
            axes.plot(rows["x_m"][last], rows["y_m"][last], marker="s", markersize=7, color=color_of(run, k), markeredgecolor="white", zorder=7)
    if truth is not None:
        axes.plot(truth.x_m[-1], truth.y_m[-1], marker="s", markersize=7, color=TRUTH, markeredgecolor="white", zorder=6)
        first = truth.x_m[0], truth.y_m[0]
    else:
        valid = np.flatnonzero(tracks[best]["pos_valid"] == 1)
        first = (tracks[best]["x_m"][valid[0]], tracks[best]["y_m"][valid[0]]) if len(valid) else None
    if first:
        axes.plot(*first, marker="o", markersize=13, markerfacecolor="none", markeredgecolor=INK, markeredgewidth=1.6, zorder=8)  # an end may lie inside
    handles += [Line2D([], [], marker="o", markersize=9, linestyle="none", markerfacecolor="none", markeredgecolor=INK, markeredgewidth=1.6),
                Line2D([], [], marker="s", markersize=7, linestyle="none", color=GREY)]
    labels += ["start", "end"]
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")
    legend(axes, handles=handles, labels=labels)
    return fig


def errors(run, truth, estimator, title):
    """Errors of one estimator's x, y and yaw inside of three times the sigma published for it."""
    rows = run.of(estimator)
    dx, dy, dyaw = ground_truth.errors(rows, truth)
    parts = [("x [m]", dx, rows["std_x_m"], 1.0), ("y [m]", dy, rows["std_y_m"], 1.0)]
    if truth.has_yaw:
        parts.append(("yaw [deg]", dyaw, rows["std_yaw_rad"], 180.0 / np.pi))
    fig, axes = figure(9.0, 1.9 * len(parts) + 0.7, title, len(parts), sharex=True)
    color = color_of(run, estimator)
    time_s = rows["time_s"]
    for one, (label, error, std, scale) in zip(axes, parts):
        known = np.isfinite(std) & (rows["pos_valid"] == 1)
        band_t, band = time_s[known], 3 * std[known] * scale
        cut = thinned(len(band_t))
        one.fill_between(band_t[cut], -band[cut], band[cut], color=color, alpha=0.16, linewidth=0)
        one.axhline(0.0, color=GREY, linewidth=0.7)
        value = error * scale
        cut = thinned(len(time_s))
        one.plot(time_s[cut], value[cut], color=color, linewidth=0.8)
        both = known & np.isfinite(value)
        if both.any():
            share = np.mean(np.abs(value[both]) <= 3 * std[both] * scale)
            one.annotate(f"{100 * share:.1f} % inside ±3σ", (1.0, 1.0), xycoords="axes fraction", ha="right", va="bottom", fontsize=9, color=GREY)
            # A start with a wide band would flatten all that follows: the axis shows all errors and the usual band.
            usual, largest = 1.15 * float(np.quantile(band, 0.8)), float(np.nanmax(np.abs(value)))
            if largest > MOST_BANDS * usual > 0:
                two_scales(one, usual, largest)
            else:
                limit = 1.15 * max(largest, float(np.quantile(band, 0.95)))
                one.set_ylim(-limit, limit)
        shades = shade_faults(one, run)
        one.set_ylabel(label)
    axes[-1].set_xlabel("time [s]")
    handles = [Line2D([], [], color=color, linewidth=1.2), Patch(color=color, alpha=0.16)]
    kind = "difference" if truth.is_reference else "error"
    axes[0].legend(handles + shades, [f"{run.names[estimator]}: {kind}", "±3σ as published"] + [FAULT] * len(shades), frameon=False, fontsize=9,
                   labelcolor=INK, ncol=3, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0, handlelength=1.6)
    axes[0].set_title(title, loc="left", fontsize=11.5, color=INK, pad=24)
    return fig


def bands(run, truth, estimator):
    """(name, error, published 1 sigma) of x, y and yaw."""
    rows = run.of(estimator)
    dx, dy, dyaw = ground_truth.errors(rows, truth)
    parts = [("x", dx, rows["std_x_m"]), ("y", dy, rows["std_y_m"])]
    return parts + ([("yaw", dyaw, rows["std_yaw_rad"])] if truth.has_yaw else [])


def wide_bands(parts):
    """A sentence on the bands that are ten times the error or more; nothing where there is none."""
    wide = []
    for name, error, sigma in parts:
        known = np.isfinite(error + sigma)
        rms = float(np.sqrt(np.mean(error[known] ** 2))) if known.any() else 0.0
        if rms > 0 and 3 * float(np.median(sigma[known])) >= WIDE_BAND * rms:
            wide.append(f"{name} ({3 * float(np.median(sigma[known])) / rms:.0f} times)")
    if not wide:
        return ""
    return (f" The band is ten times the error or more for {', '.join(wide)}. The estimate is then better than its covariance: its parameters describe worse sensors, "
            "or errors that last longer, than this run had.")


def sensors_with_nis(run, estimator):
    """Numbers of the sensors whose innovations were tested."""
    rows = run.innovations
    tested = (rows["estimator"] == estimator) & np.isfinite(rows["nis"]) & (rows["verdict"] <= 1)
    return [int(one) for one in np.unique(rows["sensor"][tested])]


def counted_by_node(run, estimator, sensor, framed):
    """(time, mean NIS per degree of freedom, accepted, rejected) as the node counts them of a sensor that is too fast for a frame per measurement;
    None of the others."""
    mine = (run.sensors["estimator"] == estimator) & (run.sensors["sensor"] == sensor) & np.isfinite(run.sensors["nis_mean"])
    if not mine.any():
        return None
    accepted, refused = metrics.counted(run.sensors, np.flatnonzero(mine))
    if accepted + refused <= metrics.MOST_FRAMED * framed.sum():
        return None
    return run.sensors["time_s"][mine], run.sensors["nis_mean"][mine], accepted, refused


def nis(run, estimator, names, title):
    """Normalised innovation squared of each sensor over time: how surprising each measurement was."""
    sensors = sensors_with_nis(run, estimator)
    fig, axes = figure(9.0, 2.3 * len(sensors) + 0.7, title, len(sensors), sharex=True)
    rows = run.innovations
    floor, largest = recorded_run.limits("Est_Innov", "Nis")
    any_most, shades = False, []
    for one, sensor in zip(axes, sensors):
        mine = (rows["estimator"] == estimator) & (rows["sensor"] == sensor) & np.isfinite(rows["nis"])
        value = np.maximum(rows["nis"], floor)
        most = mine & (value >= largest - floor / 2)
        accepted, rejected = mine & (rows["verdict"] == 0), mine & (rows["verdict"] == 1)
        shades = shade_faults(one, run)
        for limit in (floor, largest) if most.any() else (floor,):
            one.axhline(limit, color=GREY, linewidth=0.7, linestyle=(0, (1, 2)))
        many = accepted.sum() > 3000
        one.plot(rows["time_s"][accepted], value[accepted], linestyle="none", marker=".", markersize=2.5 if many else 4,
                 color=color_of(run, estimator), alpha=0.5, markeredgewidth=0)
        below_limit = rejected & ~most
        one.plot(rows["time_s"][below_limit], value[below_limit], linestyle="none", marker="x", markersize=5, color=REJECTED,
                 markeredgewidth=1.2, zorder=4)
        one.plot(rows["time_s"][most], value[most], linestyle="none", marker="^", markersize=6, color=REJECTED, markeredgewidth=0, zorder=4)
        any_most |= bool(most.any())
        for dof in np.unique(rows["dof"][mine]):
            bound = normalised_error.chi_square(0.95, max(int(dof), 1))
            one.axhline(bound, color=INK, linewidth=1.0, linestyle=(0, (5, 3)))
        one.set_yscale("log")
        one.set_ylim(floor * 0.7, max(30.0, 1.6 * float(value[mine].max())))
        one.set_ylabel("NIS")
        one.grid(True, which="minor", axis="y", color=FAINT, linewidth=0.3)
        counted = counted_by_node(run, estimator, sensor, mine)
        if counted is not None:
            time_s, mean, accepted, refused = counted
            dof = int(np.median(rows["dof"][mine]))
            one.plot(time_s, np.maximum(mean * dof, floor), color=color_of(run, estimator), linewidth=1.0)
            one.set_ylim(floor * 0.7, max(30.0, 1.6 * float(max(value[mine].max(), np.nanmax(mean * dof)))))
            one.annotate(f"{names['Sensor'].get(sensor, sensor)} ({dof} dof): {accepted} accepted, {refused} rejected; too many for a frame each: "
                         "the line is the node's own mean of the last 50", (0.0, 1.0), xycoords="axes fraction", xytext=(0, 4),
                         textcoords="offset points", ha="left", va="bottom", fontsize=9, color=GREY)
            continue
        below = np.mean(rows["nis"][accepted | rejected] <= normalised_error.chi_square(0.95, max(int(np.median(rows["dof"][mine])), 1)))
        name = names["Sensor"].get(sensor, str(sensor))
        dofs = " and ".join(str(int(dof)) for dof in np.unique(rows["dof"][mine]))
        one.annotate(f"{name} ({dofs} dof): {100 * below:.1f} % below the line, {int(rejected.sum())} rejected", (0.0, 1.0),
                     xycoords="axes fraction", xytext=(0, 4), textcoords="offset points", ha="left", va="bottom", fontsize=9, color=GREY)
    axes[0].set_title(title, loc="left", fontsize=11.5, color=INK, pad=36)
    axes[-1].set_xlabel("time [s]")
    handles = [Line2D([], [], color=color_of(run, estimator), marker=".", markersize=8, linestyle="none"),
               Line2D([], [], color=REJECTED, marker="x", markersize=6, linestyle="none"),
               Line2D([], [], color=INK, linewidth=1.0, linestyle=(0, (5, 3)))]
    labels = ["accepted", "rejected by the gate", "95 % of a right model"]
    if any_most:
        handles.append(Line2D([], [], color=REJECTED, marker="^", markersize=6, linestyle="none"))
        labels.append(f"{largest:.0f} or more")
    legend(axes[0], handles=handles + shades, labels=labels + [FAULT] * len(shades), ncol=len(labels) + len(shades), loc="lower left",
           bbox_to_anchor=(0.0, 1.12), columnspacing=1.4)
    return fig


def _spans(time_s, on, period):
    """(start, length) of the stretches in which `on` holds."""
    edges = np.diff(np.concatenate([[0], on.astype(int), [0]]))
    start, end = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    until = np.append(time_s, time_s[-1] + period)
    return [(time_s[a], until[b] - time_s[a]) for a, b in zip(start, end)]


def rejections(run, names):
    """Sensor to the times at which the best estimate rejected a measurement of it."""
    rows = run.innovations
    refused = (rows["estimator"] == run.best) & (rows["verdict"] == 1)
    return {names["Sensor"].get(int(sensor), str(int(sensor))): rows["time_s"][refused & (rows["sensor"] == sensor)]
            for sensor in np.unique(rows["sensor"][refused])}


def timeline(run, names, title):
    """The node's own status: mode, sensors in use, refused measurements, reported faults, restarts."""
    rows = run.status
    time_s = rows["time_s"]
    period = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.1

    def bits(column, table, skip=()):
        mask = np.nan_to_num(rows[column]).astype(np.int64)
        for bit in range(16):
            on = (mask >> bit) & 1 == 1
            if on.any() and bit not in skip:
                yield names.get(table, {}).get(bit, f"bit {bit}"), on

    used = list(bits("used", "Sensor"))
    refused = rejections(run, names)
    used += [(name, np.zeros(len(time_s), dtype=bool)) for name in refused if name not in [one for one, _ in used]]
    faults = list(bits("faults", "Fault")) + (list(bits("map_faults", "MapFault")) if "map_faults" in rows else [])
    lines = [("mode", None, None)] + [(f"{name} used", on, FUSED) for name, on in used] + [(f"reports {name}", on, REJECTED) for name, on in faults]
    fig, (axes,) = figure(9.0, 1.5 + 0.34 * len(lines), title)
    handles = []
    for code in np.unique(rows["mode"]):
        name = names["Mode"].get(int(code), f"mode {int(code)}")
        color = MODES.get(name, "#bbbbbb")
        axes.broken_barh(_spans(time_s, rows["mode"] == code, period), (-0.38, 0.76), facecolors=color, linewidth=0)
        handles.append(Patch(facecolor=color, edgecolor=GREY, linewidth=0.4, label=name))
    for number, (_, on, color) in enumerate(lines[1:], 1):
        axes.broken_barh(_spans(time_s, on, period), (number - 0.18, 0.36), facecolors=color, linewidth=0.8, edgecolors=color)
    for number, (name, _) in enumerate(used, 1):
        at = refused.get(name, np.empty(0))
        axes.plot(at, np.full(len(at), number - 0.3), linestyle="none", marker="|", markersize=5, color=REJECTED, markeredgewidth=1.0)
    if any(len(at) for at in refused.values()):
        handles.append(Line2D([], [], linestyle="none", marker="|", markersize=8, color=REJECTED, markeredgewidth=1.2, label="rejected"))
    handles += shade_faults(axes, run)
    changes = np.flatnonzero(np.diff(rows["reset_ctr"]) != 0) + 1
    for row in changes:
        axes.axvline(time_s[row], color=INK, linewidth=1.0, linestyle=(0, (2, 2)))
    if len(changes):
        causes = sorted({names["ResetCause"].get(int(rows["reset_cause"][row]), "?") for row in changes})
        handles.append(Line2D([], [], color=INK, linewidth=1.0, linestyle=(0, (2, 2)), label="restart: " + ", ".join(causes)))
    axes.set_yticks(range(len(lines)), [name for name, _, _ in lines], color=INK)
    axes.set_ylim(len(lines) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.set_xlim(time_s[0], time_s[-1] + period)
    axes.set_xlabel("time [s]")
    legend(axes, handles=handles)
    return fig
