# SPDX-License-Identifier: Apache-2.0
"""What a recorded run says about its estimators: reading the recorder's tables, comparing with truth.

NEES and its bounds: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4. The covariance is the
published one (1-sigma and correlations of Est<k>_Std), so what is judged is what a user of the bus gets.
"""
import json
import os
import warnings

import numpy as np
from scipy.special import chdtri

import bus_writer
from bus_writer import BadInput

NAMES = {0: "odometry", 1: "fused", 2: "estimator2", 3: "estimator3"}
TICK_S = 0.01  # of the simulated world
MOST_NEES = 100.0  # above this mean, or with more than this share of a sensor rejected, the report warns: no tuning is so far off
MOST_REJECTED, LEAST_TESTED = 1.0 / 3.0, 10
LEAST_GAP_S = 0.2  # truth rows further apart than this, or than 2.5 times their usual distance, are not interpolated between

ESTIMATES = ["epoch", "time_s", "estimator", "kind", "x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "std_x_m", "std_y_m",
             "std_yaw_rad", "corr_xy", "corr_x_yaw", "corr_y_yaw", "pos_valid", "hdg_valid"]
INNOVATIONS = ["epoch", "time_s", "estimator", "sensor", "inst", "verdict", "dof", "nis", "ratio", "age_ms", "landmark"]
STATUS = ["epoch", "time_s", "mode", "used", "faults", "reset_ctr", "reset_cause"]
TRUTH = ["time_s", "x_m", "y_m", "yaw_rad"]  # and perhaps "epoch"

ENUMERATIONS = {"kind": "EstimatorKind", "sensor": "Sensor", "verdict": "Verdict", "mode": "Mode", "reset_cause": "ResetCause"}


def chi_square(share, dof):
    """Point below which `share` of a chi-square variable with `dof` degrees of freedom falls."""
    return float(chdtri(dof, 1.0 - share))


def wrapped(angle_rad):
    return np.mod(angle_rad + np.pi, 2 * np.pi) - np.pi


def code_names():
    """Names of the bus's enumerations, by table and number, as the DBC has them."""
    return {table: {code: name for name, code in codes.items()} for table, codes in bus_writer.Dbc().tables.items()}


def limits(message, signal):
    """(step, largest) value that a signal of the bus can say."""
    one = bus_writer.Dbc().messages[message].signals[signal]
    return one.scale, one.raw_max * one.scale + one.offset


class Fault:
    """One fault of the simulated world: NAME@START+DURATION in run.json, seconds from the start of the run. Without times only the name."""

    def __init__(self, text):
        self.name, _, when = text.strip().partition("@")
        start, _, duration = when.partition("+")
        try:
            self.start_s, self.duration_s = float(start), float(duration)
        except ValueError:
            self.start_s = self.duration_s = None

    @property
    def words(self):
        if self.start_s is None:
            return self.name
        return f"{self.name} at {self.start_s:g} s" + (f" for {self.duration_s:g} s" if self.duration_s else "")


def faults(run):
    """The faults that the world had, in the order given."""
    text = run.about.get("fault") or ""
    return [Fault(one) for one in text.split(",") if one.strip()] if isinstance(text, str) and text != "none" else []


def fault_spans(run):
    """(name, start, end) of the faults on the run's own clock. The world ticks once per epoch and epoch 1 is its first tick, so a fault is
    found by epoch: its own clock may be what jumps."""
    order = np.argsort(run.estimates["epoch"], kind="stable")
    epoch, time_s = run.estimates["epoch"][order], run.estimates["time_s"][order]
    spans = []
    for one in faults(run):
        if one.start_s is not None:
            ends = [one.start_s / TICK_S, (one.start_s + one.duration_s) / TICK_S]
            start, end = np.interp(ends, epoch, time_s)
            spans.append((one.name, float(start), float(end)))
    return spans


def read_table(path, columns, also=()):
    """Columns of a CSV file as arrays of floats by name, and those of `also` that it has. Empty: NaN. Names of the bus's enumerations stand
    for their numbers."""
    try:
        with open(path, "rb") as file:
            data = file.read().replace(b"\r\n", b"\n")
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    skipped = 0
    while data.startswith(b"#"):
        data = data[data.find(b"\n") + 1:] if b"\n" in data else b""
        skipped += 1
    header, _, body = data.partition(b"\n")
    names = [name.strip() for name in header.decode("utf-8", "replace").split(",")]
    missing = [name for name in columns if name not in names]
    if missing:
        raise BadInput(f"{path}:{skipped + 1}: no column {missing[0]!r}")
    if not body.endswith(b"\n"):
        body += b"\n"
    first_line = skipped + 2
    values = _parse(body, len(names))
    if values is None:
        values = _parse_names(body, names, path, first_line)
    return {name: values[:, names.index(name)] for name in [*columns, *also] if name in names}


def _parse(body, width):
    """All fields as numbers at once, or None when something is not a number or a line has another number of fields."""
    if body.strip() == b"":
        return np.empty((0, width))
    octets = np.frombuffer(body, dtype=np.uint8)
    ends = np.flatnonzero(octets == ord("\n"))
    if np.any(np.diff(np.concatenate([[0], np.cumsum(octets == ord(","))[ends]])) != width - 1):
        return None
    flat = body[:-1].replace(b"\n", b",")
    while b",," in flat:
        flat = flat.replace(b",,", b",nan,")
    if flat.endswith(b","):
        flat += b"nan"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(flat, sep=",")
        except (DeprecationWarning, ValueError):
            return None
    return values.reshape(-1, width) if len(values) == len(ends) * width else None


def _parse_names(body, names, path, first_line):
    """The slow way, which knows names and says where a line is wrong."""
    tables = bus_writer.Dbc().tables
    codes = [tables.get(ENUMERATIONS.get(name), {}) for name in names]
    rows = []
    for number, line in enumerate(body.decode("utf-8", "replace").splitlines(), first_line):
        fields = [field.strip() for field in line.split(",")]
        if len(fields) != len(names):
            raise BadInput(f"{path}:{number}: {len(fields)} columns, expected {len(names)}")
        try:
            rows.append([code[field] if field in code else float(field or "nan") for field, code in zip(fields, codes)])
        except ValueError as error:
            raise BadInput(f"{path}:{number}: {error}") from None
    return np.array(rows, dtype=np.float64)


class Run:
    """The recorder's directory: run.json, estimates, innovations, status."""

    def __init__(self, directory):
        path = os.path.join(directory, "run.json")
        self.about = read_json(path)
        self.estimates = read_table(os.path.join(directory, "estimates.csv"), ESTIMATES)
        if len(self.estimates["time_s"]) == 0:
            raise BadInput(f"{directory}/estimates.csv: no estimate in it")
        self.innovations = self._optional(directory, "innovations.csv", INNOVATIONS)
        self.status = self._optional(directory, "status.csv", STATUS)
        self.estimators = sorted(int(one) for one in np.unique(self.estimates["estimator"]))

    @staticmethod
    def _optional(directory, name, columns):
        path = os.path.join(directory, name)
        if os.path.exists(path):
            return read_table(path, columns)
        return {column: np.empty(0) for column in columns}

    def of(self, estimator):
        """Rows of one estimator."""
        mask = self.estimates["estimator"] == estimator
        return {name: column[mask] for name, column in self.estimates.items()}


def read_json(path):
    try:
        with open(path, encoding="utf-8") as file:
            about = json.load(file)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise BadInput(f"{path}:{getattr(error, 'lineno', 1)}: not JSON: {getattr(error, 'msg', error)}") from None
    if not isinstance(about, dict):
        raise BadInput(f"{path}:1: not a JSON object")
    return about


class Truth:
    """Where the robot was, by time. `about` is the JSON beside NAME.truth.csv, when there is one.

    A simulated world says for each row which of the node's epochs it belongs to: then the rows are paired by epoch, because a fault may have
    made the clock of the bus jump, which the truth does not."""

    def __init__(self, path, max_gap_s=None):
        self.path = path
        rows = read_table(path, TRUTH, ["epoch"])
        self.epoch = rows.get("epoch")
        if self.epoch is not None and not (np.diff(self.epoch) > 0).all():
            raise BadInput(f"{path}: row {int(np.argmin(np.diff(self.epoch) > 0)) + 2}: epoch does not grow")
        self.time_s, self.x_m, self.y_m, self.yaw_rad = (rows[name] for name in TRUTH)
        if len(self.time_s) < 2:
            raise BadInput(f"{path}: fewer than two rows")
        for column, name in ((self.time_s, "time_s"), (self.x_m, "x_m"), (self.y_m, "y_m")):
            if not np.isfinite(column).all():
                raise BadInput(f"{path}: row {int(np.argmin(np.isfinite(column))) + 1} has no {name}")
        steps = np.diff(self.time_s)
        if (steps < 0).any():
            raise BadInput(f"{path}: row {int(np.argmax(steps < 0)) + 2}: time goes back")
        self.max_gap_s = max(LEAST_GAP_S, 2.5 * float(np.median(steps))) if max_gap_s is None else max_gap_s
        self.has_yaw = bool(np.isfinite(self.yaw_rad).any())
        beside = path[:-len(".truth.csv")] + ".json" if path.endswith(".truth.csv") else ""
        self.about = read_json(beside) if beside and os.path.exists(beside) else {}
        self.is_reference = self.about.get("truth") == "gps track"

    def of(self, rows):
        """x, y, yaw for rows of estimates."""
        if self.epoch is None:
            return self.at(rows["time_s"])
        found = np.clip(np.searchsorted(self.epoch, rows["epoch"]), 0, len(self.epoch) - 1)
        known = self.epoch[found] == rows["epoch"]
        return tuple(np.where(known, column[found], np.nan) for column in (self.x_m, self.y_m, self.yaw_rad))

    def at(self, time_s):
        """x, y, yaw at the times given, linear in between; NaN outside of the truth and in its gaps."""
        after = np.clip(np.searchsorted(self.time_s, time_s), 1, len(self.time_s) - 1)
        before = after - 1
        span = self.time_s[after] - self.time_s[before]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(span > 0, (time_s - self.time_s[before]) / span, 0.0)
        inside = (time_s >= self.time_s[0]) & (time_s <= self.time_s[-1]) & ((span <= self.max_gap_s + 1e-9) | (part == 1.0))
        part = np.where(inside, part, np.nan)
        turn = wrapped(self.yaw_rad[after] - self.yaw_rad[before])
        return (self.x_m[before] + part * (self.x_m[after] - self.x_m[before]),
                self.y_m[before] + part * (self.y_m[after] - self.y_m[before]),
                wrapped(self.yaw_rad[before] + part * turn))


def errors(rows, truth):
    """Estimate minus truth of one estimator's rows: dx, dy, dyaw; NaN where there is no truth or the estimate is not valid."""
    x, y, yaw = truth.of(rows)
    dx, dy, dyaw = rows["x_m"] - x, rows["y_m"] - y, wrapped(rows["yaw_rad"] - yaw)
    position, heading = rows["pos_valid"] == 1, rows["hdg_valid"] == 1
    return np.where(position, dx, np.nan), np.where(position, dy, np.nan), np.where(position & heading, dyaw, np.nan)


def nees_by_row(rows, dx, dy, dyaw, dof):
    """Normalised squared error of each row; NaN without a published covariance or a known error. And how many covariances were of no use."""
    std = np.stack([rows["std_x_m"], rows["std_y_m"], rows["std_yaw_rad"]], axis=1)[:, :dof]
    error = np.stack([dx, dy, dyaw], axis=1)[:, :dof]
    correlation = np.empty((len(error), dof, dof))
    correlation[:, range(dof), range(dof)] = 1.0
    pairs = {(0, 1): "corr_xy", (0, 2): "corr_x_yaw", (1, 2): "corr_y_yaw"}
    for (i, j), name in pairs.items():
        if j < dof:
            correlation[:, i, j] = correlation[:, j, i] = rows[name]
    known = np.flatnonzero(np.isfinite(std).all(axis=1) & np.isfinite(error).all(axis=1) & np.isfinite(correlation).all(axis=(1, 2)))
    positive = (std[known] > 0).all(axis=1)
    if len(known):
        positive &= np.linalg.eigvalsh(correlation[known])[:, 0] > 1e-6
    use = known[positive]
    scaled = (error[use] / std[use])[:, :, None]
    values = np.full(len(error), np.nan)
    values[use] = (scaled * np.linalg.solve(correlation[use], scaled)).sum(axis=(1, 2))
    return values, int(np.count_nonzero(~positive))


def nees(rows, dx, dy, dyaw, dof):
    """The same of the rows that have one."""
    values, unusable = nees_by_row(rows, dx, dy, dyaw, dof)
    return values[np.isfinite(values)], unusable


def rms(values):
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values ** 2))) if len(values) else None


def measurements(innovations, estimator, names):
    """By sensor: accepted, rejected, other, and the innovations' NIS, as published in Est_Innov."""
    result = {}
    mine = innovations["estimator"] == estimator
    for sensor in np.unique(innovations["sensor"][mine]):
        rows = mine & (innovations["sensor"] == sensor)
        verdict = innovations["verdict"][rows]
        accepted, rejected = verdict == 0, verdict == 1
        nis, dof = innovations["nis"][rows], innovations["dof"][rows]
        tested = (accepted | rejected) & np.isfinite(nis)
        one = {"accepted": int(accepted.sum()), "rejected": int(rejected.sum()), "other": int((~accepted & ~rejected).sum())}
        one["verdicts"] = {names["Verdict"].get(int(v), str(int(v))): int((verdict == v).sum()) for v in np.unique(verdict)}
        if tested.any():
            bound = np.array([chi_square(0.95, max(int(d), 1)) for d in np.unique(dof[tested])])[np.searchsorted(np.unique(dof[tested]), dof[tested])]
            use = accepted & np.isfinite(nis)
            one["nis_mean"] = float(nis[use].mean()) if use.any() else None
            one["nis_mean_with_rejected"] = float(nis[tested].mean())
            one["nis_expected"] = float(dof[tested].mean())
            one["nis_inside_95"] = float((nis[tested] <= bound).mean())
        result[names["Sensor"].get(int(sensor), str(int(sensor)))] = one
    return result


def judge(run, estimator, truth, names):
    """The metrics of one estimator. Without truth: what can be said without."""
    rows = run.of(estimator)
    valid = rows["pos_valid"] == 1
    result = {"name": NAMES.get(estimator, f"estimator{estimator}"),
              "kind": names["EstimatorKind"].get(int(rows["kind"][-1]), str(int(rows["kind"][-1]))),
              "epochs": int(len(valid)), "epochs_not_valid": int((~valid).sum()),
              "measurements": measurements(run.innovations, estimator, names)}
    if valid.any():
        last = np.flatnonzero(valid)[-1]
        result["end"] = {"time_s": float(rows["time_s"][last]), "x_m": float(rows["x_m"][last]), "y_m": float(rows["y_m"][last]),
                         "yaw_rad": float(rows["yaw_rad"][last])}
    empty = dict.fromkeys(["position_rmse_m", "heading_rmse_deg", "final_error_m", "max_error_m", "nees_mean", "nees_inside_95",
                           "nees_inside_two_sided_95"])
    result.update(empty, epochs_with_truth=0)
    if truth is None:
        return result
    dx, dy, dyaw = errors(rows, truth)
    distance = np.hypot(dx, dy)
    known = np.flatnonzero(np.isfinite(distance))
    result["epochs_with_truth"] = len(known)
    if len(known) == 0:
        return result
    heading = rms(dyaw)
    result.update(position_rmse_m=rms(distance), heading_rmse_deg=None if heading is None else float(np.degrees(heading)),
                  final_error_m=float(distance[known[-1]]), max_error_m=float(distance[known].max()))
    if np.isfinite(dyaw).any():
        result["final_heading_error_deg"] = float(np.degrees(dyaw[np.isfinite(dyaw)][-1]))
    if truth.is_reference:  # the reference is fused itself and has errors of its own: consistency with it says nothing
        return result
    dof = 3 if truth.has_yaw else 2
    values, unusable = nees(rows, dx, dy, dyaw, dof)
    result.update(nees_dof=dof, nees_epochs=len(values), nees_covariances_not_usable=unusable)
    if len(values):
        low, high = chi_square(0.025, dof), chi_square(0.975, dof)
        result.update(nees_mean=float(values.mean()), nees_inside_95=float((values <= chi_square(0.95, dof)).mean()),
                      nees_inside_two_sided_95=float(((values >= low) & (values <= high)).mean()))
    return result


def warnings_of(run, judged):
    """What makes the numbers of the run doubtful as a whole. Odometry is left out: it drifts, and nothing tests it."""
    cause = f"fault {', '.join(one.words for one in faults(run))}" if faults(run) else (
        f"is {run.about['robot']} the robot of this log?" if run.about.get("robot") else "the wrong robot for this log?")
    found = []
    for one in judged:
        if one["kind"] == "Odometry":
            continue
        for sensor, counts in one["measurements"].items():
            tested = counts["accepted"] + counts["rejected"]
            if tested >= LEAST_TESTED and counts["rejected"] > MOST_REJECTED * tested:
                found.append(f"{one['name']} rejected {counts['rejected']} of {tested} {sensor} measurements")
        if one["nees_mean"] is not None and one["nees_mean"] > MOST_NEES:
            found.append(f"NEES mean of {one['name']} is {one['nees_mean']:.0f}, not {one['nees_dof']}")
    return [f"{'; '.join(found)} ({cause})"] if found else []


def summary(run, truth):
    """All of summary.json: what the player wrote, then what was computed here."""
    names = code_names()
    result = dict(run.about)
    result["truth"] = None if truth is None else {
        "file": os.path.basename(truth.path), "kind": truth.about.get("truth", "truth"), "is_reference": truth.is_reference,
        "has_yaw": truth.has_yaw, "max_gap_s": truth.max_gap_s}
    judged = [judge(run, estimator, truth, names) for estimator in run.estimators]
    result.update({one["name"]: one for one in judged})
    result["warnings"] = warnings_of(run, judged)
    best = result.get("fused") or result[NAMES.get(run.estimators[-1], f"estimator{run.estimators[-1]}")]
    result["position_rmse_m"], result["heading_rmse_deg"] = best["position_rmse_m"], best["heading_rmse_deg"]
    return result
