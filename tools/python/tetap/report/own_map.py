# SPDX-License-Identifier: Apache-2.0
"""Figures of merit of a mapper: errors of its trajectory and its landmarks after the rigid motion that fits the landmarks (Horn, "Closed-form solution
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
ASTRAY_M = 0.5       # a landmark without identity that is further than this from every true one is none of them
CONFIRMED = 3        # sightings of a landmark that no longer gives way to another one
MOVED_M = 1.0        # no update moves a landmark so far while it is unconfirmed
NO_LANDMARK = 255    # in the truth of a simulated world
MAPPERS = ("EkfSlam", "FastSlam", "Msckf")  # the last with a map or without


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


def at_the_end(rows):
    """Rows of the landmarks that are in the map when it was last published: they take turns, so all of them are among twice as many rows as there
    are landmarks. Landmarks without an identity count only when confirmed."""
    count = 2 * len(np.unique(rows["landmark"]))
    late = np.arange(len(rows["landmark"])) >= len(rows["landmark"]) - count
    return rows.where(late & ((rows["landmark_state"] > 0) | (rows["landmark"] <= 64)))


def begins(rows):
    """{landmark: time from which its number stands for the landmark that has it at the end}. A number is given again after its landmark was removed:
    then the sightings counted by the map begin anew, or an unconfirmed landmark is suddenly elsewhere."""
    begun, last = {}, {}
    for k, time_s, count, place in zip(rows["landmark"], rows["time_s"], rows["hits"], rows["x_m"] + 1j * rows["y_m"]):
        before, there = last.get(k, (np.inf, place))
        if count < before or (before < CONFIRMED and abs(place - there) > MOVED_M):
            begun[int(k)] = float(time_s)
        last[k] = (count, place)
    return begun


def true_landmarks(run, truth):
    """{identity: x + iy}: from the JSON beside the truth, or of a simulated world."""
    about = truth.about.get("landmarks") if truth is not None else None
    return {int(one["id"]): complex(one["x_m"], one["y_m"]) for one in about or (run.about.get("landmarks") or [] if truth is not None else [])}


def sightings_file(truth):
    """File with the true landmark of each sighting; most truths have none."""
    stem = truth.path.removesuffix(".truth.csv") if truth.path.endswith(".truth.csv") else truth.path.removesuffix(".csv")
    return stem + ".sightings.csv"


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


def fitted(found, pairs, true):
    """(counterparts, the rigid motion that fits them). Without identities a landmark of clutter has one, too: the farthest is left out until all
    fit, and those that are far from theirs then have None."""
    names = list(pairs)
    points, places = np.array([found[k] for k in names]), np.array([true[pairs[k]] for k in names])
    fit = Rigid(points, places)
    if set(found) & set(true):
        return pairs, fit
    kept = np.arange(len(names))
    while len(kept) > LEAST and np.abs(fit(points[kept]) - places[kept]).max() > ASTRAY_M:
        kept = np.delete(kept, np.abs(fit(points[kept]) - places[kept]).argmax())
        fit = Rigid(points[kept], places[kept])
    near = np.abs(fit(points) - places) <= ASTRAY_M
    return {k: pairs[k] if one else None for k, one in zip(names, near)}, fit


def associations(innovations, sightings, pairs, true, begun=None):
    """(stamps, landmarks, wrong) of the accepted sightings in the record: wrong is 1 where what stands at the landmark was not among what was
    truly seen at the stamp, and NaN where nothing is known of it. NO_LANDMARK was truly seen: clutter or a moving obstacle. The counterpart of a
    landmark that is none is None; `begun` is that of begins()."""
    accepted = (innovations["verdict"] == 0) & np.isfinite(innovations["landmark"]) & (innovations["nis"] >= 0)
    stamps = (innovations["time_s"] - innovations["age_ms"] * 1e-3)[accepted]
    landmarks = innovations["landmark"][accepted].astype(int)
    at, seen = sightings["time_s"], sightings["landmark"].astype(int)
    wrong = np.full(len(stamps), np.nan)
    for i, (stamp, landmark) in enumerate(zip(stamps, landmarks)):
        first, end = np.searchsorted(at, [stamp - STAMP_S, stamp + STAMP_S])
        places = [true[k] for k in seen[first:end] if k in true]
        clutter = NO_LANDMARK in seen[first:end]
        if landmark not in pairs or not (places or clutter) or (begun is not None and stamp < begun.get(landmark, np.inf)):
            continue
        if pairs[landmark] is None:
            wrong[i] = not clutter
        else:
            wrong[i] = min((abs(place - true[pairs[landmark]]) for place in places), default=np.inf) > SAME_PLACE_M
    return stamps, landmarks, wrong


def wrong_associations(innovations, sightings, pairs, true, begun=None):
    """(wrong, judged) of the accepted sightings."""
    _, _, wrong = associations(innovations, sightings, pairs, true, begun)
    return int(np.nansum(wrong)), int(np.isfinite(wrong).sum())


def landmark_nees(rows, pairs, true):
    """(times, NEES, 2 expected) of the published landmarks that have a counterpart; not aligned, as the pose is not. Rows of a number before it
    stood for its last landmark do not count."""
    begun = begins(rows)
    rows = rows.where(np.array([time_s >= begun.get(int(k), np.inf) for k, time_s in zip(rows["landmark"], rows["time_s"])], dtype=bool))
    known = np.isfinite(rows["landmark"] + rows["std_x_m"] + rows["std_y_m"] + rows["corr_xy"]) & (rows["std_x_m"] > 0) & (rows["std_y_m"] > 0)
    known &= np.isin(rows["landmark"], [k for k, one in pairs.items() if one is not None]) & (np.abs(rows["corr_xy"]) < 0.999)
    place = np.array([true[pairs[int(k)]] for k in rows["landmark"][known]])
    if not len(place):
        return np.zeros(0), np.zeros(0)
    u, v = (rows["x_m"][known] - place.real) / rows["std_x_m"][known], (rows["y_m"][known] - place.imag) / rows["std_y_m"][known]
    corr = rows["corr_xy"][known]
    return rows["time_s"][known], (u * u - 2 * corr * u * v + v * v) / (1 - corr * corr)


def figures(run, estimator, truth, dx_m, dy_m):
    """Figures of a mapper for summary.json where the truth has landmarks; else empty. dx, dy: errors of its rows [m], unaligned."""
    true = true_landmarks(run, truth)
    if run.kinds[estimator] not in MAPPERS or not true or (run.kinds[estimator] == "Msckf" and not len(run.map["time_s"])):
        return {}
    found = last_of_each(at_the_end(run.map))
    pairs = counterparts(found, true)
    result = {"landmarks_in_map": len(found)}
    if len(pairs) < LEAST:
        return result
    pairs, fit = fitted(found, pairs, true)
    if not set(found) & set(true):
        result["landmarks_astray"] = sum(one is None for one in pairs.values())
    near = [k for k, one in pairs.items() if one is not None]
    points, places = np.array([found[k] for k in near]), np.array([true[pairs[k]] for k in near])
    rows = run.of(estimator)
    position = rows["x_m"] + 1j * rows["y_m"]
    error = np.abs(fit(position) - (position - dx_m - 1j * dy_m))
    error = error[np.isfinite(error)]
    result.update(trajectory_rmse_aligned_m=float(np.sqrt(np.mean(error ** 2))) if len(error) else None,
                  map_rmse_m=float(np.sqrt(np.mean(np.abs(fit(points) - places) ** 2))), map_yaw_rad=fit.yaw_rad)
    _, nees = landmark_nees(at_the_end(run.map), pairs, true)
    result["landmark_nees_mean"] = float(np.mean(nees)) if len(nees) else None
    if os.path.exists(sightings_file(truth)):
        mine = run.innovations.where((run.innovations["estimator"] == estimator))
        result["wrong_associations"], result["associations_judged"] = wrong_associations(mine, read_table(sightings_file(truth), SIGHTINGS), pairs, true,
                                                                                             begins(run.map))
    return result
