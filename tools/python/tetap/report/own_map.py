# SPDX-License-Identifier: Apache-2.0
"""What a mapper is worth: errors of its trajectory and its landmarks after the rigid motion that fits the landmarks (Horn, "Closed-form solution
of absolute orientation using unit quaternions", JOSA A 4(4), 1987, in the plane), and sightings that it gave to a wrong landmark."""
import os

import numpy as np

from tetap.report.tables import read_table

MAP = ["epoch", "time_s", "landmark", "x_m", "y_m", "std_x_m", "std_y_m", "corr_xy", "hits", "age_s", "landmark_state"]
SIGHTINGS = ["time_s", "landmark"]
SAME_PLACE_M = 0.5   # landmarks of one post: MRCLAM's barcodes are 0.25 m apart at the most, its posts 1.8 m at the least
FITS = 20            # rounds of nearest neighbours and a fit, for landmarks without identity
STAMP_S = 0.0015     # half a step of the age on the bus, and its rounding
LEAST = 2            # landmarks that fix a rigid motion of the plane
MAPPERS = ("EkfSlam", "FastSlam")


class Rigid:
    """A turn and a shift of the plane."""

    def __init__(self, source, target):
        """The one that takes points nearest to their counterparts, in the sense of least squares."""
        self._from, self._to = source.mean(), target.mean()
        self._turn = np.exp(1j * np.angle(np.sum((target - self._to) * np.conj(source - self._from))))

    def __call__(self, points):
        return self._to + self._turn * (points - self._from)

    @property
    def yaw_rad(self):
        return float(np.angle(self._turn))


def last_of_each(rows):
    """{landmark: (x + iy)} as last published."""
    return {int(k): complex(x, y) for k, x, y in zip(rows["landmark"], rows["x_m"], rows["y_m"]) if np.isfinite(k + x + y)}


def counterparts(found, true):
    """{landmark found: true landmark}: by identity, else nearest after a fit."""
    if set(found) & set(true):
        return {k: k for k in found if k in true}
    names, places = list(true), np.array(list(true.values()))
    points = np.array(list(found.values()))
    moved = points
    for _ in range(FITS):
        nearest = np.abs(moved[:, None] - places[None, :]).argmin(axis=1)
        moved = Rigid(points, places[nearest])(points)
    return {k: names[int(i)] for k, i in zip(found, nearest)}


def wrong_associations(innovations, sightings, pairs, true):
    """(wrong, judged) of the accepted sightings in the record, by what was truly seen at the stamp."""
    accepted = (innovations["verdict"] == 0) & np.isfinite(innovations["landmark"]) & (innovations["nis"] >= 0)
    stamps = (innovations["time_s"] - innovations["age_ms"] * 1e-3)[accepted]
    landmarks = innovations["landmark"][accepted].astype(int)
    at, seen = sightings["time_s"], sightings["landmark"].astype(int)
    wrong = judged = 0
    for stamp, landmark in zip(stamps, landmarks):
        first, end = np.searchsorted(at, [stamp - STAMP_S, stamp + STAMP_S])
        places = [true[k] for k in seen[first:end] if k in true]
        if landmark not in pairs or not places:
            continue
        judged += 1
        wrong += min(abs(place - true[pairs[landmark]]) for place in places) > SAME_PLACE_M
    return wrong, judged


def figures(run, estimator, truth, dx_m, dy_m):
    """Of summary.json, for a mapper with a truth that has landmarks; else nothing. dx, dy: errors of its rows, unaligned."""
    true = {int(one["id"]): complex(one["x_m"], one["y_m"]) for one in truth.about.get("landmarks", [])} if truth is not None else {}
    if run.kinds[estimator] not in MAPPERS or not true:
        return {}
    found = last_of_each(run.map)
    pairs = counterparts(found, true)
    result = {"landmarks_in_map": len(found)}
    if len(pairs) < LEAST:
        return result
    points = np.array([found[k] for k in pairs])
    places = np.array([true[k] for k in pairs.values()])
    fit = Rigid(points, places)
    rows = run.of(estimator)
    position = rows["x_m"] + 1j * rows["y_m"]
    error = np.abs(fit(position) - (position - dx_m - 1j * dy_m))
    error = error[np.isfinite(error)]
    result.update(trajectory_rmse_aligned_m=float(np.sqrt(np.mean(error ** 2))) if len(error) else None,
                  map_rmse_m=float(np.sqrt(np.mean(np.abs(fit(points) - places) ** 2))), map_yaw_rad=fit.yaw_rad)
    path = truth.path.removesuffix(".truth.csv") + ".sightings.csv"
    if os.path.exists(path):
        mine = run.innovations.where((run.innovations["estimator"] == estimator))
        result["wrong_associations"], result["associations_judged"] = wrong_associations(mine, read_table(path, SIGHTINGS), pairs, true)
    return result
