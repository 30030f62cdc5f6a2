# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report that only inertial and attitude estimators have: errors of all fifteen states, biases, and how far two attitudes are
apart. Style and colours are those of pictures."""
import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tetap.report import normalised_error, recorded_run
from tetap.report import pictures

MRAD = 1000.0
DEG = 180.0 / np.pi
PANELS = [("position", ["east [m]", "north [m]", "up [m]"], 1.0), ("velocity", ["v east [m/s]", "v north [m/s]", "v up [m/s]"], 1.0),
          ("attitude", ["tilt about east [deg]", "tilt about north [deg]", "heading [deg]"], DEG)]


def _band(axes, time_s, centre, sigma, color):
    known = np.isfinite(sigma + centre)
    t, middle, three = time_s[known], centre[known], 3 * sigma[known]
    cut = pictures.thinned(len(t))
    axes.fill_between(t[cut], (middle - three)[cut], (middle + three)[cut], color=color, alpha=0.16, linewidth=0)


def _limits(axes, band, value):
    """All of the error and the usual band; two scales where an error is many times the band."""
    usual, most = 1.15 * float(np.quantile(band, 0.8)), float(np.nanmax(np.abs(value)))
    if most > pictures.MOST_BANDS * usual > 0:
        pictures.two_scales(axes, usual, most)
    else:
        limit = 1.15 * max(most, float(np.quantile(band, 0.95)))
        axes.set_ylim(-limit, limit)


def errors(run, truth, estimator, title):
    """Errors of position, velocity and attitude, each inside three times the sigma published for it."""
    found = normalised_error.blocks(run, estimator, truth)
    fig, axes = pictures.figure(10.6, 6.8, title, 3, 3, sharex=True)
    color = pictures.color_of(run, estimator)
    shades = []
    for row, (name, labels, scale) in enumerate(PANELS):
        for column, label in enumerate(labels):
            one = axes[row * 3 + column]
            value, sigma = scale * found.error[name][:, column], scale * found.sigma[name][:, column]
            _band(one, found.time_s, np.zeros(len(sigma)), np.where(np.isfinite(value), sigma, np.nan), color)
            one.axhline(0.0, color=pictures.GREY, linewidth=0.7)
            cut = pictures.thinned(len(value))
            one.plot(found.time_s[cut], value[cut], color=color, linewidth=0.8)
            both = np.isfinite(value + sigma)
            if both.any():
                share = np.mean(np.abs(value[both]) <= 3 * sigma[both])
                one.annotate(f"{100 * share:.1f} % inside", (1.0, 1.0), xycoords="axes fraction", ha="right", va="bottom", fontsize=8.5,
                             color=pictures.GREY)
                _limits(one, 3 * sigma[both], value)
            shades = pictures.shade_faults(one, run)
            one.set_ylabel(label)
            if row == len(PANELS) - 1:
                one.set_xlabel("time [s]")
    handles = [Line2D([], [], color=color, linewidth=1.2), Patch(color=color, alpha=0.16), *shades]
    _above(fig, axes, title, handles, [f"{run.names[estimator]}: error", "±3σ as published"] + [pictures.FAULT] * len(shades))
    return fig


def bands(run, truth, estimator):
    """(name, error, published 1 sigma) of position, velocity and attitude by axis."""
    found = normalised_error.blocks(run, estimator, truth)
    return [(label.split(" [")[0], found.error[name][:, column], found.sigma[name][:, column])
            for name, labels, _ in PANELS for column, label in enumerate(labels)]


def _above(fig, axes, title, handles, labels):
    """Title and legend over all columns: a line of the title's room is the legend's."""
    axes[0].set_title("", loc="left")
    head = fig.suptitle(title + "\n", x=0.012, ha="left", fontsize=11.5, color=pictures.INK)
    fig.canvas.draw()  # gives the room that the title takes
    bottom = head.get_window_extent().transformed(fig.transFigure.inverted()).y0
    words = fig.legend(handles=handles, labels=labels, ncol=len(labels), loc="lower left", bbox_to_anchor=(0.006, bottom - 0.02), frameon=False,
                       fontsize=9, labelcolor=pictures.INK)
    words.set_in_layout(False)


def biases(run, truth, estimator, title):
    """Estimated biases in their bands, and the true ones."""
    states = run.states_of(estimator)
    true = truth.more_of(states["epoch"]) if truth is not None else None
    fig, axes = pictures.figure(11.0, 6.4, title, 3, 2, sharex=True)
    color = pictures.color_of(run, estimator)
    shades = []
    for column, (names, what, scale) in enumerate(((recorded_run.GYRO_BIAS, "gyroscope {} [mrad/s]", MRAD), (recorded_run.ACC_BIAS, "accelerometer {} [m/s²]", 1.0))):
        for row, name in enumerate(names):
            one = axes[row * 2 + column]
            value, sigma = scale * states[name], scale * states[f"std_{name}"]
            valid = states["pos_valid"] == 1
            _band(one, states["time_s"], np.where(valid, value, np.nan), sigma, color)
            cut = pictures.thinned(len(value))
            one.plot(states["time_s"][cut], value[cut], color=color, linewidth=1.0)
            shown = [value[valid & np.isfinite(value)]]
            if true is not None:
                one.plot(states["time_s"][cut], scale * true[name][cut], color=pictures.TRUTH, linewidth=1.6, alpha=0.7)
                shown.append(scale * true[name][np.isfinite(true[name])])
            _around(one, np.concatenate(shown), sigma[valid & np.isfinite(sigma)])
            shades = pictures.shade_faults(one, run)
            one.set_ylabel(what.format(recorded_run.AXES[row]))
            if row == 2:
                one.set_xlabel("time [s]")
    handles = [Line2D([], [], color=color, linewidth=1.2), Patch(color=color, alpha=0.16)]
    labels = [f"{run.names[estimator]}: estimate", "±3σ as published"]
    if true is not None:
        handles.append(Line2D([], [], color=pictures.TRUTH, linewidth=1.6, alpha=0.7))
        labels.append("truth")
    _above(fig, axes, title, handles + shades, labels + [pictures.FAULT] * len(shades))
    return fig


def _around(axes, values, sigma):
    """An axis with all of the values and the usual band: the first one is as wide as what is not known."""
    if len(values) and len(sigma):
        room = 3.3 * float(np.quantile(sigma, 0.7))
        axes.set_ylim(float(values.min()) - room, float(values.max()) + room)


def disagreement(run, title):
    """How far the attitude filter and the best estimate are apart, as computed from the published attitudes."""
    time_s, tilt, heading = normalised_error.disagreement(run)
    fig, axes = pictures.figure(9.0, 4.4, title, 2, sharex=True)
    color = pictures.ESTIMATORS["attitude"]
    for one, value, label in ((axes[0], tilt, "tilt [deg]"), (axes[1], heading, "heading [deg]")):
        cut = pictures.thinned(len(value))
        one.plot(time_s[cut], DEG * value[cut], color=color, linewidth=0.9)
        one.axhline(0.0, color=pictures.GREY, linewidth=0.7)
        shades = pictures.shade_faults(one, run)
        one.set_ylabel(label)
    axes[-1].set_xlabel("time [s]")
    _above(fig, axes, title, [Line2D([], [], color=color, linewidth=1.2), *shades],
           [f"between attitude filter and {run.names[run.best]}"] + [pictures.FAULT] * len(shades))
    return fig
