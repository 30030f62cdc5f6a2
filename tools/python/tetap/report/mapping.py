# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report that only robots with a map of their own have: the map with its ellipses, which landmark each sighting was given, and
the NEES of pose and landmarks over time. Style and colours are those of pictures."""
import os

import numpy as np
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.lines import Line2D

from tetap.report import ground_truth, normalised_error, own_map, pictures

AMBIGUOUS = 9         # sensor::Verdict
SHARE = 0.95          # probability of an ellipse, and of the dashed lines
BINS = 120            # number of bins of the NEES over time
MOST_LINES = 4000     # most associations in the picture


class Mapped:
    """Shared data of the pictures: the map at the end, its counterparts, and the estimator's poses by time."""

    def __init__(self, run, estimator, truth):
        self.rows = run.of(estimator)
        self.end = own_map.at_the_end(run.map)
        self.found = own_map.last_of_each(self.end)
        self.true = own_map.true_landmarks(run, truth)
        self.pairs = own_map.counterparts(self.found, self.true) if self.true and self.found else {}
        if len(self.pairs) >= own_map.LEAST:
            self.pairs, _ = own_map.fitted(self.found, self.pairs, self.true)
        self.innovations = run.innovations.where(run.innovations["estimator"] == estimator)
        known = truth is not None and os.path.exists(own_map.sightings_file(truth))
        self.sightings = own_map.read_table(own_map.sightings_file(truth), own_map.SIGHTINGS).since(run.start_s) if known else None
        self.begun = own_map.begins(run.map)

    def pose_at(self, time_s):
        return np.stack([np.interp(time_s, self.rows["time_s"], self.rows[name]) for name in ("x_m", "y_m")], axis=1)

    def associations(self):
        """(stamps, landmarks, wrong); wrong is NaN throughout without a truth of the sightings."""
        sightings = self.sightings if self.sightings is not None else {"time_s": np.zeros(0), "landmark": np.zeros(0)}
        return own_map.associations(self.innovations, sightings, self.pairs, self.true, self.begun)

    def ambiguous(self):
        rows = self.innovations["verdict"] == AMBIGUOUS
        return (self.innovations["time_s"] - self.innovations["age_ms"] * 1e-3)[rows]


def ellipses(rows):
    """Centres, widths, heights and angles [deg] of the landmarks as last published."""
    scale = np.sqrt(normalised_error.chi_square(SHARE, 2))
    last = {int(k): i for i, k in enumerate(rows["landmark"])}
    centres, widths, heights, angles = [], [], [], []
    for i in last.values():
        sx, sy, corr = rows["std_x_m"][i], rows["std_y_m"][i], rows["corr_xy"][i]
        if not np.isfinite(sx + sy + corr):
            continue
        values, vectors = np.linalg.eigh([[sx * sx, corr * sx * sy], [corr * sx * sy, sy * sy]])
        centres.append((rows["x_m"][i], rows["y_m"][i]))
        heights.append(2 * scale * np.sqrt(max(values[0], 0.0)))
        widths.append(2 * scale * np.sqrt(max(values[1], 0.0)))
        angles.append(np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])))
    return centres, widths, heights, angles


def own_map_picture(run, estimator, truth, title):
    """The robot's map and path, each accepted sighting as a line to the landmark that it was given."""
    mapped = Mapped(run, estimator, truth)
    color = pictures.color_of(run, estimator)
    fig, (axes,) = pictures.figure(8.6, 6.6, title)
    handles, labels = [], []

    def named(handle, label):
        handles.append(handle)
        labels.append(label)

    stamps, landmarks, wrong = mapped.associations()
    drawn = np.isin(landmarks, list(mapped.found))
    stamps, landmarks, wrong = stamps[drawn], landmarks[drawn], wrong[drawn]
    robot = mapped.pose_at(stamps)
    ends = np.array([[mapped.found[k].real, mapped.found[k].imag] for k in landmarks]).reshape(-1, 2)
    is_wrong = wrong == 1
    thin = np.flatnonzero(~is_wrong)[::max(1, int(np.ceil((~is_wrong).sum() / MOST_LINES)))]
    for which, line, width, label in ((thin, pictures.FAINT, 0.5, "sighting given to a landmark"), (np.flatnonzero(is_wrong), pictures.REJECTED, 0.9, "given to a wrong one")):
        axes.add_collection(LineCollection(np.stack([robot[which], ends[which]], axis=1), colors=line, linewidths=width, zorder=1 + width))
        if len(which):
            named(Line2D([], [], color=line, linewidth=1.5), label)
    if truth is not None:
        named(axes.plot(truth.x_m, truth.y_m, color=pictures.TRUTH, linewidth=2.6, alpha=0.45, zorder=2)[0], "truth")
    valid = mapped.rows["pos_valid"] == 1
    cut = pictures.thinned(int(valid.sum()))
    named(axes.plot(mapped.rows["x_m"][valid][cut], mapped.rows["y_m"][valid][cut], color=color, linewidth=1.1, zorder=3)[0], run.names[estimator])
    if mapped.true:
        places = np.array(list(mapped.true.values()))
        named(axes.plot(places.real, places.imag, linestyle="none", marker="^", markersize=7, color=pictures.LANDMARK, markeredgecolor="white",
                        markeredgewidth=0.6, zorder=5)[0], "true landmark")
    points = np.array(list(mapped.found.values()))
    if len(points):
        named(axes.plot(points.real, points.imag, linestyle="none", marker="+", markersize=8, color=pictures.INK, zorder=6)[0], "landmark in the map")
    centres, widths, heights, angles = ellipses(mapped.end)
    if centres:
        axes.add_collection(EllipseCollection(widths, heights, angles, units="xy", offsets=centres, offset_transform=axes.transData, facecolor="none",
                                              edgecolor=color, linewidth=0.9, zorder=4))
        named(Line2D([], [], marker="o", markersize=8, linestyle="none", markerfacecolor="none", markeredgecolor=color), "95 % ellipse")
    doubtful = mapped.pose_at(mapped.ambiguous())
    if len(doubtful):
        named(axes.plot(doubtful[:, 0], doubtful[:, 1], linestyle="none", marker="x", markersize=4, color=pictures.REJECTED, zorder=7)[0], "ambiguous sighting from here")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, east [m]")
    axes.set_ylabel("y, north [m]")
    pictures.legend(axes, handles=handles, labels=labels)
    return fig


def _binned(time_s, values, edges):
    """Mean in each bin; NaN where it is empty."""
    which = np.digitize(time_s, edges) - 1
    inside = (which >= 0) & (which < len(edges) - 1) & np.isfinite(values)
    sums = np.bincount(which[inside], weights=values[inside], minlength=len(edges) - 1)
    counts = np.bincount(which[inside], minlength=len(edges) - 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(counts > 0, sums / counts, np.nan)


def consistency(run, estimator, truth, title):
    """NEES of pose and landmarks over time, means of short spans, with the share of a single value that is to lie below the dashed line."""
    mapped = Mapped(run, estimator, truth)
    dx, dy, dyaw = ground_truth.errors(mapped.rows, truth)
    of_pose, _ = normalised_error.nees_by_row(mapped.rows, dx, dy, dyaw, 3)
    time_s, of_landmarks = own_map.landmark_nees(run.map, mapped.pairs, mapped.true)
    edges = np.linspace(mapped.rows["time_s"][0], mapped.rows["time_s"][-1] + 1e-9, BINS + 1)
    fig, axes = pictures.figure(8.6, 4.6, title, 2, 1, sharex=True)
    for one, label, dof, at, values in ((axes[0], "pose", 3, mapped.rows["time_s"], of_pose), (axes[1], "landmarks", 2, time_s, of_landmarks)):
        one.plot(0.5 * (edges[1:] + edges[:-1]), _binned(at, values, edges), color=pictures.color_of(run, estimator), linewidth=1.2)
        one.axhline(dof, color=pictures.GREY, linewidth=0.8)
        one.axhline(normalised_error.chi_square(SHARE, dof), color=pictures.GREY, linewidth=0.8, linestyle="--")
        one.set_ylabel(f"NEES, {label} ({dof})")
        one.set_yscale("log")
    axes[1].set_xlabel("time [s]")
    pictures.shade_faults(axes[0], run)
    pictures.shade_faults(axes[1], run)
    return fig
