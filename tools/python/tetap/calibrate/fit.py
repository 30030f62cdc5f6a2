# SPDX-License-Identifier: Apache-2.0
"""The least squares behind calibrate_wheels.py: unknowns, model, weights, solution, and how sure of it one may be.

Idea: J. Borenstein, L. Feng, "Measurement and correction of systematic odometry errors in mobile robots", IEEE T-RA 12(6), 1996: unequal
wheels and a wrong track are the two errors that matter. Here no square is driven: everything is one generalised least squares over the
run (A. C. Aitken 1936),

    turned by the wheels  (dR - dL)(1 - slip) = B (gyro scale * gyro - bias dt)      pieces of 2 s
    position of antenna   p0 + sum ds e^(i yaw) + e^(i yaw) l                         fixes
    velocity of antenna   its derivative                                             fixes

with ds = (dR + dL)/2 (1 - slip), slip = c_curve |v w| + c_acc a: tyres turn further than they roll under load, which is not a smaller
wheel. Unknown besides the numbers: start pose, gyroscope bias (knots, random walk) and scale, slip, side slip, lever arm, delay; each with
a stated prior, so an unknown that the run does not show stays in the 1 sigma. GNSS errors are correlated: calibrate_noise.py.
"""
import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import nnls

from tetap.calibrate.drive import WINDOW_S
from tetap.calibrate.noise import Noise
from tetap.calibrate.robot_numbers import Refusal
from tetap.dataset.inertial import to_enu

REST_BIAS = 1e-3          # rad/s: 1 sigma of the bias against the one at rest, where there was one
BIAS_WALK = 1e-5          # rad/s/sqrt(s), as InertialParameters::gyro_bias_radps2_rthz
MOST_FIXES = 1000         # comparisons of one kind: more are averaged in groups
JUMP_RADPS = 0.2          # 1 sigma of what the turn rate did meanwhile, against the mean of before and after
BLOCKS = 10               # parts of the run: each is left out in turn
LEAST_DISTANCE_M, LEAST_FIXES = 30.0, 30
SYSTEMATIC = 0.001        # relative, of the radius: lean of the antenna's mast, tyres' warmth, ground: what no term here has [own]
OUTLIER = 6.0
# Unknowns and their 1 sigma before the run; None: not known at all.
PRIORS = {"yaw": None, "east": None, "north": None, "mean": None, "difference": 0.2, "track": None, "gyro_scale": 0.01,
          "c_curve": 0.02, "c_acc": 0.02, "c_side": 0.1, "arm_x": 0.3, "arm_y": 0.3, "delay": 0.2}


class Fit:
    """Unknowns, model, weights."""

    def __init__(self, run, gnss, velocity, robot, rest_rate=None):
        self.run, self.rest_rate = run, rest_rate
        ok = (gnss.t > run.t[0] + 1) & (gnss.t < run.t[-1] - 1)
        gnss = gnss.keep(ok)
        if velocity is not None:
            velocity = velocity.keep((velocity.t > run.t[0] + 1) & (velocity.t < run.t[-1] - 1))
        frozen = self._frozen(gnss.t, gnss.lat, gnss.lon)
        gnss = gnss.keep(~frozen)
        if velocity is not None:
            stuck = self._frozen(velocity.t, velocity.east, velocity.north)
            velocity = velocity.keep(~stuck)
        self.frozen = int(frozen.sum())
        if len(gnss) < LEAST_FIXES:
            raise Refusal(f"{len(gnss)} GNSS fixes while wheels and IMU are there, {LEAST_FIXES} are needed.", "ten minutes of driving with a fix")
        height = np.where(np.isfinite(gnss.height), gnss.height, 0.0)
        east, north, _ = to_enu(gnss.lat, gnss.lon, height)
        self.fix_t, self.fix = gnss.t, east + 1j * north
        self.vel_t = self.vel = None
        if velocity is not None and len(velocity) > LEAST_FIXES:
            self.vel_t, self.vel = velocity.t, velocity.east + 1j * velocity.north
        accuracy = np.nanmedian(gnss.acc) if np.isfinite(gnss.acc).any() else 2.5
        self.accuracy = float(np.clip(accuracy, 0.005, 30))
        self.vel_accuracy = 0.2
        if self.vel is not None and np.isfinite(velocity.acc).any():
            self.vel_accuracy = float(np.clip(np.nanmedian(velocity.acc), 0.01, 3))
        self.all = (self.fix_t, self.fix), (self.vel_t, self.vel)
        self.names = [name for name in PRIORS if run.has_turn or name not in ("difference", "track")]
        self.names += [f"jump{k}" for k in range(len(run.gaps))] + [f"bias{k}" for k in range(len(run.knots))]
        self.arm = robot.number("gnss.antenna_x_b_m", 0.0) + 1j * robot.number("gnss.antenna_y_b_m", 0.0)
        self.dropped = {"fix": 0, "velocity": 0}
        self._start()

    def _frozen(self, t, one, two):
        """Rows that repeat the one before to the last digit, while the wheels roll."""
        if len(t) < 2:
            return np.zeros(len(t), dtype=bool)
        path = np.interp(t, self.run.t, self.run.path)
        step = np.median(np.diff(path)[np.diff(path) > 0]) if (np.diff(path) > 0).any() else 0.0
        return np.append(False, (np.diff(one) == 0) & (np.diff(two) == 0) & (np.diff(path) > 0.1 * step))

    # --- model ---

    def at(self, p):
        q = dict(zip(self.names, p))
        run = self.run
        bias = run.hats @ p[len(self.names) - len(run.knots):]
        turn = (1 + q["gyro_scale"]) * run.turn - bias
        for k, gap in enumerate(run.gaps):
            turn[gap] += q[f"jump{k}"]
        yaw = q["yaw"] + np.append(0, np.cumsum(turn))
        slip = 1 - q["c_curve"] * run.lateral - q["c_acc"] * run.acceleration * np.sign(run.speed)
        forward = run.forward
        if run.has_turn and run.kind != "body speed":
            forward = forward - 0.25 * q["difference"] * run.across
        ds = (1 + q["mean"]) * forward * slip
        middle = 0.5 * (yaw[1:] + yaw[:-1]) - q["c_side"] * run.rate
        track = q["east"] + 1j * q["north"] + np.append(0, np.cumsum(ds * np.exp(1j * middle)))
        antenna = track + np.exp(1j * yaw) * (self.arm + q["arm_x"] + 1j * q["arm_y"])

        def there(t):
            return np.interp(t, run.t, antenna.real) + 1j * np.interp(t, run.t, antenna.imag)

        fix = self.fix - there(self.fix_t + q["delay"])
        vel = None
        if self.vel is not None:
            vel = self.vel - (there(self.vel_t + q["delay"] + 0.05) - there(self.vel_t + q["delay"] - 0.05)) / 0.1
        wheel = None
        if run.has_turn:
            across = (1 + q["mean"]) * (run.across - q["difference"] * run.forward) * slip
            wheel = np.bincount(run.windows, across - self.track0 * (1 + q["track"]) * turn)
        return fix, vel, wheel

    def jacobian(self, p):
        """Central differences; the steps are small against what the data resolve."""
        columns = []
        for k, name in enumerate(self.names):
            step = 1e-6 if name.startswith("bias") else 1e-4
            up, down = p.copy(), p.copy()
            up[k] += step
            down[k] -= step
            columns.append([None if a is None else (a - b) / (2 * step) for a, b in zip(self.at(up), self.at(down))])
        return [None if column[0] is None else np.stack(column, axis=1) for column in zip(*columns)]

    def prior(self):
        """Information matrix of the priors, and where they are."""
        n, k0 = len(self.names), len(self.names) - len(self.run.knots)
        information = np.zeros((n, n))
        for k, name in enumerate(self.names[:k0]):
            sigma = JUMP_RADPS * self.run.dt[self.run.gaps[int(name[4:])]] if name.startswith("jump") else PRIORS[name]
            if sigma:
                information[k, k] = sigma**-2
        walk = BIAS_WALK**2 * (self.run.knots[1] - self.run.knots[0])
        for k in range(k0, n - 1):
            information[k:k + 2, k:k + 2] += np.array([[1, -1], [-1, 1]]) / walk
        information[k0:, k0:] += np.eye(n - k0) / (REST_BIAS if self.rest_rate is not None else 10.0) ** 2
        at = np.zeros(n)
        at[k0:] = self.rest_rate or 0.0
        return information, at

    # --- start ---

    def _start(self):
        run = self.run
        self.rescaled = False
        self.track0, bias, difference = 1.0, self.rest_rate or 0.0, 0.0
        moved = run.path[-1]
        if run.has_turn:
            sums = [np.bincount(run.windows, x) for x in (run.across, run.turn, run.dt, run.forward)]
            keep = np.ones(len(sums[0]), dtype=bool)
            for _ in range(5):
                a = np.stack(sums[1:], axis=1)[keep]
                scale = np.maximum(np.abs(a).max(axis=0), 1e-9)
                solution = np.linalg.lstsq(a / scale, sums[0][keep], rcond=1e-6)[0] / scale
                left = np.abs(sums[0] - np.stack(sums[1:], axis=1) @ solution)
                keep = left < 6 * 1.4826 * np.median(left) + 1e-4
            if abs(solution[0]) < 1e-6:
                raise Refusal("The wheels do not turn the robot as the gyroscope says (no track comes out).", "curves to both sides")
            nominal = run.track if run.track else (1.0 if run.kind == "body speed" else None)
            self.track0 = nominal or abs(solution[0])
            bias, difference = -solution[1] / solution[0], solution[2]
            if solution[0] < 0:
                raise Refusal("The wheels turn the other way than the gyroscope: left and right are swapped, or the gyroscope's up is down.",
                              "the same with the wiring (or the mounting) put right")
        self.turned = float(np.abs(np.bincount(run.windows, run.turn - bias * run.dt)).sum())
        yaw = np.append(0, np.cumsum(run.turn - bias * run.dt))
        track = np.append(0, np.cumsum(run.forward * np.exp(1j * 0.5 * (yaw[1:] + yaw[:-1]))))
        # Displacements over ten accuracies of path: heading and scale of the whole.
        length = max(10 * self.accuracy, moved / 200)
        path = np.interp(self.fix_t, run.t, run.path)
        later = np.searchsorted(path, path + length)
        rows = np.flatnonzero(later < len(path))
        if len(rows) < 5:
            raise Refusal(f"What it drives is too little for fixes of {self.accuracy:.1f} m.",
                          f"a drive of at least {max(LEAST_DISTANCE_M, 30 * self.accuracy):.0f} m, ten minutes are better")
        model = np.interp(self.fix_t, run.t, track.real) + 1j * np.interp(self.fix_t, run.t, track.imag)
        d_model, d_fix = model[later[rows]] - model[rows], self.fix[later[rows]] - self.fix[rows]
        weight = 1.0
        for _ in range(5):
            gain = (weight * d_fix * d_model.conj()).sum() / (weight * np.abs(d_model) ** 2).sum()
            left = np.abs(d_fix - gain * d_model)
            weight = 1 / (1 + (left / (2 * self.accuracy)) ** 2)
        if abs(gain) < 1e-6:
            raise Refusal("The fixes do not move as the wheels do.", "a drive with both")
        if not run.nominal_known or not 0.5 < abs(gain) < 2:  # numbers as they are now are far off, or not known: those of the log
            self.rescale(abs(gain))
            track, gain = track * abs(gain), gain / abs(gain)
            model = np.interp(self.fix_t, run.t, track.real) + 1j * np.interp(self.fix_t, run.t, track.imag)
        start = dict(yaw=np.angle(gain), mean=abs(gain) - 1, difference=difference)
        offset = self.fix - gain * model
        start["east"], start["north"] = np.median(offset.real), np.median(offset.imag)
        self.p = np.array([bias if name.startswith("bias") else start.get(name, 0.0) for name in self.names])
        self.distance = moved if run.nominal_known else run.path[-1]

    def rescale(self, gain):
        run = self.run
        self.rescaled = True
        run.forward, run.speed, run.acceleration = run.forward * gain, run.speed * gain, run.acceleration * gain
        run.path, run.lateral, run.quantum = run.path * gain, run.lateral * gain, run.quantum * gain
        if run.has_turn and run.kind != "body speed":
            run.across = run.across * gain
            if not run.track:
                self.track0 *= gain
        if run.step is not None:
            run.step = run.step * gain
            run.radius = tuple(r * gain for r in run.radius)

    # --- solution ---

    @staticmethod
    def _outliers(r, factor):
        """Far from the median of the neighbours: jumps that no correlation explains."""
        size = 21
        padded = np.pad(r, size // 2, mode="reflect" if len(r) > size else "edge")
        windows = np.lib.stride_tricks.sliding_window_view(padded, size)
        away = np.abs(r - np.median(windows.real, axis=1) - 1j * np.median(windows.imag, axis=1))
        return away > max(factor * OUTLIER * np.median(away) / 1.1774, 0.05)  # Rayleigh's median

    def clean(self, factor=1.0):
        """Leaves the outliers out; every time from all of the fixes."""
        (self.fix_t, self.fix), (self.vel_t, self.vel) = self.all
        fix, vel, _ = self.at(self.p)
        bad = self._outliers(fix, factor)
        self.dropped["fix"] = int(bad.sum())
        self.fix_t, self.fix = self.fix_t[~bad], self.fix[~bad]
        if vel is not None:
            bad = self._outliers(vel, factor)
            self.dropped["velocity"] = int(bad.sum())
            self.vel_t, self.vel = self.vel_t[~bad], self.vel[~bad]

    def weigh_wheels(self, wheel):
        """Variance of each comparison of wheels and gyroscope (counts, path, load in curves: from the residuals), and their correlation."""
        run = self.run
        path = np.bincount(run.windows, np.abs(run.forward))
        load = np.bincount(run.windows, np.abs(run.forward) * run.lateral)
        floor = (2 * run.quantum / 3) ** 2 / 3
        features = np.stack([np.ones_like(path), path, load], axis=1)
        square = wheel**2
        limit = np.inf
        for _ in range(4):
            keep = square < limit
            scale = 1 / np.sqrt(features @ [floor, 1e-5, 1e-5]) ** 2
            answer, _ = nnls(features[keep] * scale[keep, None], square[keep] * scale[keep])
            variance = np.maximum(features @ answer, floor)
            limit = 16 * variance
        normal = np.clip(wheel / np.sqrt(variance), -4, 4)
        inflation = 1.0
        for lag in (1, 2, 3):
            inflation += 2 * max(0.0, float((normal[lag:] * normal[:-lag]).mean() / max((normal**2).mean(), 1e-9))) * (1 - lag / 4)
        far = np.abs(wheel) > 4 * np.sqrt(variance)
        self.wheel_variance = variance * inflation * np.where(far, 1e4, 1.0)
        self.slips, self.dropped["wheel"] = far, int(far.sum())
        moving = path > 0.2 * path.max()
        self.path_noise = float(np.median((variance / np.maximum(path, 1e-9))[moving])) if moving.any() else 1e-3

    def groups(self, t):
        size = max(1, -(-len(t) // MOST_FIXES))
        return np.arange(0, len(t), size)

    @staticmethod
    def mean(values, starts):
        sizes = np.diff(np.append(starts, len(values)))
        return np.add.reduceat(values, starts, axis=0) / (sizes if values.ndim == 1 else sizes[:, None])

    def solve(self):
        run = self.run
        self.clean(4.0)  # nothing is fitted yet
        self.path_noise, self.wheel_variance = 1e-3, None
        noise = None
        for outer in range(3):
            if outer == 1:
                self.clean()
            if outer < 2:
                if run.has_turn and run.kind != "body speed":  # each wheel has a share of the scatter of the comparison with the gyroscope
                    self.weigh_wheels(self.at(self.p)[2])
                starts = self.groups(self.fix_t)
                t = self.mean(self.fix_t, starts)
                noise = [Noise(t, np.interp(t, run.t, run.path), self.path_noise / 4, self.accuracy, 60.0)]
                vstarts = None
                if self.vel is not None:
                    vstarts = self.groups(self.vel_t)
                    vt = self.mean(self.vel_t, vstarts)
                    noise.append(Noise(vt, np.zeros(len(vt)), 0.0, self.vel_accuracy, 5.0))
            for _ in range(3):
                fix, vel, wheel = self.at(self.p)
                j_fix, j_vel, j_wheel = self.jacobian(self.p)
                if wheel is not None:
                    self.weigh_wheels(wheel)
                series = [(self.mean(fix, starts), self.mean(j_fix, starts))]
                if vel is not None:
                    series.append((self.mean(vel, vstarts), self.mean(j_vel, vstarts)))
                information, gradient = self._normal(series, noise, wheel, j_wheel)
                step = -np.linalg.solve(information, gradient)
                self.p = self.p + step
                if (np.abs(step) < 0.02 * np.sqrt(np.diag(np.linalg.inv(information)))).all():
                    break
            if outer < 2:
                for k, one in enumerate(noise):
                    others = [(s, n) for i, (s, n) in enumerate(zip(series, noise)) if i != k]
                    other, _ = self._normal([s for s, _ in others], [n for _, n in others], wheel, j_wheel)
                    one.tune(*series[k], other)
        self.noise, self.starts = noise, starts
        self.covariance = np.linalg.inv(information)
        self._without_blocks(series, wheel, j_wheel)
        self.residuals = self.at(self.p)
        self.white_rms = [self.whitened(r, one) for (r, _), one in zip(series, noise)]

    def _without_blocks(self, series, wheel, j_wheel):
        """Jackknife over BLOCKS parts of the run (B. Efron, C. Stein, Ann. Statist. 9, 1981): where its scatter exceeds the model's, it counts.

        A robot whose wheels skid in some places and not in others is found out so, whatever the model assumes.
        """
        run = self.run
        edges = np.interp(np.linspace(0, run.path[-1], BLOCKS + 1), run.path, run.t)
        window_t = run.t[0] + WINDOW_S * (np.arange(len(wheel)) + 0.5) if wheel is not None else None
        k0 = len(self.names) - len(run.knots)
        estimates = []
        for start, end in zip(edges, edges[1:]):
            parts, noises = [], []
            for (r, j), one in zip(series, self.noise):
                rest = np.flatnonzero((one.t < start) | (one.t >= end))
                noises.append(one.only(rest))
                parts.append((r[rest], j[rest]))
            rows = None if wheel is None else (window_t < start) | (window_t >= end)
            information, gradient = self._normal(parts, noises, wheel, j_wheel, rows)
            estimates.append(np.linalg.solve(information, gradient))
        spread = np.array(estimates) - np.mean(estimates, axis=0)
        jackknife = np.sqrt((BLOCKS - 1) / BLOCKS * (spread**2).sum(axis=0))
        sigma = np.sqrt(np.diag(self.covariance))
        self.more = np.maximum(1.0, jackknife / sigma)
        self.more[k0:] = 1.0
        self.covariance = self.covariance * np.outer(self.more, self.more)

    @staticmethod
    def whitened(r, noise):
        """RMS of residuals without their correlation, in their own 1 sigma."""
        w = solve_triangular(noise.factor(), np.stack([r.real, r.imag], axis=1), lower=True)
        return float(np.sqrt((w**2).mean()))

    def _normal(self, series, noise, wheel, j_wheel, rows=None):
        information, at = self.prior()
        gradient = information @ (self.p - at)
        for (r, j), one in zip(series, noise):
            factor = one.factor()
            for part in (np.real, np.imag):
                wj, wr = (solve_triangular(factor, x, lower=True) for x in (part(j), part(r)))
                information += wj.T @ wj
                gradient += wj.T @ wr
        if wheel is not None:
            weight = (1 / self.wheel_variance) * (1.0 if rows is None else rows)
            information += j_wheel.T * weight @ j_wheel
            gradient += j_wheel.T * weight @ wheel
        return information, gradient

    def before(self):
        """Residuals with the numbers as they are now: only the start pose and the gyroscope's bias are fitted, with the same weights."""
        names = ["mean", "difference", "track", "c_curve", "c_acc", "c_side", "arm_x", "arm_y", "delay", "gyro_scale"]
        fixed = np.array([name in names for name in self.names])
        p, keep = self.p, self.p.copy()
        p = np.where(fixed, 0.0, p)
        starts = self.groups(self.fix_t)
        for _ in range(3):
            self.p = p
            fix, _, wheel = self.at(p)
            j_fix, _, j_wheel = self.jacobian(p)
            information, gradient = self._normal([(self.mean(fix, starts), self.mean(j_fix, starts))], self.noise[:1], wheel, j_wheel)
            step = np.zeros(len(p))
            step[~fixed] = -np.linalg.solve(information[np.ix_(~fixed, ~fixed)], gradient[~fixed])
            p = p + step
        result = self.at(p)
        self.p = keep
        return result

    def value(self, name):
        k = self.names.index(name)
        return self.p[k], np.sqrt(self.covariance[k, k])

    def derived(self, function):
        """Value and 1 sigma of a function of the unknowns (by name)."""
        def at(p):
            return function(dict(zip(self.names, p)))
        gradient = np.zeros(len(self.p))
        for k in range(len(self.p)):
            step = 1e-6
            up, down = self.p.copy(), self.p.copy()
            up[k] += step
            down[k] -= step
            gradient[k] = (at(up) - at(down)) / (2 * step)
        common = gradient[self.names.index("mean")] * SYSTEMATIC
        return at(self.p), float(np.sqrt(gradient @ self.covariance @ gradient + common**2))
