# SPDX-License-Identifier: Apache-2.0
"""Consistency of an estimate with its published covariance.

NEES and its bounds: Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4. The covariance is the
published one (1-sigma and correlations of Est<k>_Std and Est<k>_State), so a user of the bus gets what is judged; by block of three, in
the epochs that publish the whole covariance of the block.
"""
import numpy as np
from scipy.special import chdtri

from tetap.report.attitude import apart, attitudes_at, quaternion, turns, wrapped
from tetap.report.recorded_run import ACC_BIAS, CORRELATIONS, GYRO_BIAS, Q, STD_TILT, TICK_S, VELOCITY, limits

BLOCKS = ["position", "velocity", "attitude", "gyro bias", "acc bias"]
STEPS = {"position": ("Est2_Std", "StdX"), "velocity": ("Est2_State", "StdVelEast"), "attitude": ("Est2_State", "StdTiltEast"),
         "gyro bias": ("Est2_State", "StdGyroBiasX"), "acc bias": ("Est2_State", "StdAccBiasX")}
# Steps of the published values: rounding is no error of the estimate. An angle is twice a quaternion's component.
VALUE_STEPS = {"position": [("Est2_Pos", "X", 1), ("Est2_Pos", "Y", 1), ("Est2_State", "Height", 1)], "velocity": [("Est2_Vel", "East", 1)],
               "attitude": [("Est2_Att", "X", 2)], "gyro bias": [("Est2_State", "GyroBiasX", 1)], "acc bias": [("Est2_State", "AccBiasX", 1)]}
UNITS = {"position": "m", "velocity": "m/s", "attitude": "rad", "gyro bias": "rad/s", "acc bias": "m/s2"}


def chi_square(share, dof):
    """Point below which `share` of a chi-square variable with `dof` degrees of freedom falls."""
    return float(chdtri(dof, 1.0 - share))


def correlation_matrices(of_01, of_02, of_12):
    """One 3 x 3 matrix a row, of the columns of its three correlations."""
    matrix = np.tile(np.eye(3), (len(of_01), 1, 1))
    for (i, j), column in {(0, 1): of_01, (0, 2): of_02, (1, 2): of_12}.items():
        matrix[:, i, j] = matrix[:, j, i] = column
    return matrix


def squares(error, sigma, correlation):
    """Normalised squared error of each row: errors (n, 3), their sigmas (n, 3), a matrix of correlations each (n, 3, 3)."""
    scaled = (error / sigma)[:, :, None]
    return (scaled * np.linalg.solve(correlation, scaled)).sum(axis=(1, 2))


def three(source, names):
    return np.stack([source[name] for name in names], axis=1)


class Blocks:
    """Errors of an inertial estimate by block, and the sigmas it published: `error[name]` and `sigma[name]` with three columns and a row for
    every attitude; position east, north, up; attitude about east, north and up."""

    def __init__(self, states, true):
        self._states = states
        self.epoch, self.time_s = states["epoch"], states["time_s"]
        self.error = {"position": three(states, ["x_m", "y_m", "height_m"]) - three(true, ["x_m", "y_m", "z_m"])}
        self.sigma = {"position": three(states, ["std_x_m", "std_y_m", "std_height_m"])}
        self.error["attitude"] = turns(three(states, Q), quaternion(true["roll_rad"], true["pitch_rad"], true["yaw_rad"]))
        self.sigma["attitude"] = three(states, [*STD_TILT, "std_yaw_rad"])
        for name, columns in (("velocity", VELOCITY), ("gyro bias", GYRO_BIAS), ("acc bias", ACC_BIAS)):
            self.error[name] = three(states, columns) - three(true, columns)
            self.sigma[name] = three(states, [f"std_{one}" for one in columns])
        # A published sigma of 0 stands for at most half a step of the bus.
        for name, (message, signal) in STEPS.items():
            self.sigma[name] = np.maximum(self.sigma[name], 0.5 * limits(message, signal)[0])
        # Rows whose epoch carries the whole covariance: a robot that turns and accelerates has another one a second later.
        self._whole = {name: np.all([states[f"new {column}"] for column in columns], axis=0) for name, columns in CORRELATIONS.items()}
        invalid = states["pos_valid"] != 1
        for error in self.error.values():
            error[invalid] = np.nan

    def white(self, name):
        """Errors in their own sigmas and without correlations, by the factor L of the covariance L L^T: independent with variance 1 where the
        covariance is right. NaN in rows in whose epoch the whole covariance was not published, and where a part of it
        is not known."""
        # The estimate itself is rounded, too. Rounding is independent by component: it adds to variances, not to covariances.
        rounded = np.array([times * limits(*value)[0] / np.sqrt(12.0) for *value, times in VALUE_STEPS[name]])
        judged, correlation = np.hypot(self.sigma[name], rounded), three(self._states, CORRELATIONS[name])
        use = np.flatnonzero(self._whole[name] & np.isfinite(self.error[name] + judged + correlation).all(axis=1))
        a, b, c = (self.sigma[name][use] / judged[use]).T
        matrix = correlation_matrices(*(correlation[use].T * [a * b, a * c, b * c]))
        # Correlations are rounded, too: a correlation below their step cannot be distinguished from zero.
        least = limits(*(("Est2_Std", "CorrXY") if name == "position" else ("Est2_State", "CorrVelEN")))[0]
        short = np.maximum(0.0, least - np.linalg.eigvalsh(matrix)[:, 0]) if len(use) else np.empty(0)
        matrix += short[:, None, None] * np.eye(3)
        values = np.full((len(self.epoch), 3), np.nan)
        values[use] = np.linalg.solve(np.linalg.cholesky(matrix), (self.error[name][use] / judged[use])[:, :, None])[:, :, 0]
        return values

    def nees(self, name):
        """NEES of every row; NaN where white() is."""
        return (self.white(name) ** 2).sum(axis=1)

    def outside(self, name, sigmas=3.0):
        """Rows with an error beyond that many of its published sigmas, in any of the three."""
        with np.errstate(invalid="ignore"):
            return (np.abs(self.error[name]) > sigmas * self.sigma[name]).any(axis=1)


def blocks(run, estimator, truth):
    """None where the estimator or the truth has no more than a pose."""
    states = run.states_of(estimator) if run.kinds[estimator] != "Attitude" else None
    true = truth.more_of(states["epoch"]) if truth is not None and states is not None else None
    return None if true is None else Blocks(states, true)


def attitude_errors(run, estimator, truth):
    """(time, epoch, tilt, heading) of whoever publishes an attitude: the angle between true and estimated up, and the turn about the vertical, as
    `disagreement` of the firmware has them; None without."""
    states = run.states_of(estimator)
    true = truth.more_of(states["epoch"]) if truth is not None and states is not None else None
    if true is None:
        return None
    q = np.stack([states[name] for name in Q], axis=1)
    return states["time_s"], states["epoch"], *apart(q, quaternion(true["roll_rad"], true["pitch_rad"], true["yaw_rad"]))


PART = 1 << 14  # epochs that are worked on at once


def disagreement(run):
    """(time, tilt, heading) between the attitude filter and the best estimate, where both publish an attitude at the same epoch; None else."""
    other = next((k for k in run.estimators if run.kinds[k] == "Attitude"), None)
    a, b = (None, None) if other is None else (run.states_of(other), run.states_of(run.best))
    if a is None or b is None:
        return None
    # Both come in different epochs: a robot that turns with 1 rad/s turns by 3 deg in 50 ms. One is interpolated to the other's time.
    q, epochs, own = three(a, Q), b["epoch"], [b[name] for name in Q]
    tilt, heading = np.empty(len(epochs)), np.empty(len(epochs))
    for first in range(0, len(epochs), PART):  # in parts: a log of hours does not fit several times
        part = slice(first, first + PART)
        tilt[part], heading[part] = apart(np.stack([one[part] for one in own], axis=1), attitudes_at(a["epoch"], q, epochs[part], 0.2 / TICK_S))
    return b["time_s"], tilt, wrapped(-heading)


def nees_by_row(rows, dx, dy, dyaw, dof):
    """Normalised squared error of each row; NaN without a published covariance or a known error.
    The second value counts the covariances that were of no use."""
    sigmas, errors_, correlations = ["std_x_m", "std_y_m", "std_yaw_rad"][:dof], [dx, dy, dyaw][:dof], ["corr_xy", "corr_x_yaw", "corr_y_yaw"]
    all_known = np.ones(len(dx), dtype=bool)
    for column in [*(rows[name] for name in [*sigmas, *correlations[:2 * dof - 3]]), *errors_]:
        all_known &= np.isfinite(column)
    known = np.flatnonzero(all_known)
    std, error = np.stack([rows[name][known] for name in sigmas], axis=1), np.stack([column[known] for column in errors_], axis=1)
    correlation = correlation_matrices(*(rows[name][known] for name in correlations))[:, :dof, :dof]
    positive = (std > 0).all(axis=1)
    if len(known):
        positive &= np.linalg.eigvalsh(correlation)[:, 0] > 1e-6
    values = np.full(len(dx), np.nan)
    values[known[positive]] = squares(error[positive], std[positive], correlation[positive])
    return values, int(np.count_nonzero(~positive))


def nees(rows, dx, dy, dyaw, dof):
    """The same of the rows that have one."""
    values, unusable = nees_by_row(rows, dx, dy, dyaw, dof)
    return values[np.isfinite(values)], unusable


def rms(values):
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values ** 2))) if len(values) else None

