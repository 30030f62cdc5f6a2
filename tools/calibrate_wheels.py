# SPDX-License-Identifier: Apache-2.0
"""Wheels: radius of left and right, their difference, track width, from a drive with GNSS and the gyroscope.

Idea: J. Borenstein, L. Feng, "Measurement and correction of systematic odometry errors in mobile robots", IEEE T-RA 12(6), 1996: unequal wheels
and a wrong track are the two errors that matter. Here no square is driven: everything is one generalised least squares over the run (A. C. Aitken 1936),

    turned by the wheels  (dR - dL)(1 - slip) = B (gyro scale * gyro - bias dt)      pieces of 2 s
    position of antenna   p0 + sum ds e^(i yaw) + e^(i yaw) l                         fixes
    velocity of antenna   its derivative                                             fixes

with ds = (dR + dL)/2 (1 - slip), slip = c_curve |v w| + c_acc a: tyres turn further than they roll under load, which is not a smaller wheel. Unknown
besides the numbers: start pose, gyroscope bias (knots, random walk) and scale, slip, side slip, lever arm, delay; each with a stated
prior, so what the run does not tell stays in the 1 sigma. GNSS errors are correlated: variance s_w^2 I + s_c^2 exp(-|dt|/tau) + k * path
(the wheels' own random walk), its numbers by restricted maximum likelihood (D. A. Harville, JASA 72, 1977).
"""
import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.optimize import minimize, nnls

from calibrate_numbers import Part, Refusal
from import_inertial import to_enu

TWO_PI = 2 * np.pi
WINDOW_S = 2.0            # of one comparison of wheels and gyroscope
SMOOTH_S = 0.1            # half the span over which speed and acceleration are taken
KNOT_S = 60.0             # between two values of the gyroscope's bias
REST_BIAS = 1e-3          # rad/s: 1 sigma of the bias against the one at rest, where there was one
BIAS_WALK = 1e-5          # rad/s/sqrt(s), as InertialNumbers::gyro_bias_radps2_rthz
MOST_FIXES = 1000         # of one kind: more are averaged in groups
TUNE_FIXES = 200          # for the noise's own numbers
GAP_S, CUT_S = 0.1, 2.0   # of the IMU: from the first on the heading may have jumped, at the second the run is cut
JUMP_RADPS = 0.2          # 1 sigma of what the turn rate did meanwhile, against the mean of before and after
BLOCKS = 10               # of the run: each is left out in turn
LEAST_DISTANCE_M, LEAST_TURN_RAD, LEAST_FIXES = 30.0, TWO_PI, 30
SYSTEMATIC = 0.001        # relative, of the radius: lean of the antenna's mast, tyres' warmth, ground: what no term here has [own]
MOST_SCALE, MOST_TRACK, MOST_DIFFERENCE = 0.02, 0.05, 0.02  # 1 sigma, relative: with more the number is refused
OUTLIER = 6.0
# Unknowns and their 1 sigma before the run; None: not known at all.
PRIORS = {"yaw": None, "east": None, "north": None, "mean": None, "difference": 0.2, "track": None, "gyro_scale": 0.01, "c_curve": 0.02, "c_acc": 0.02,
          "c_side": 0.1, "arm_x": 0.3, "arm_y": 0.3, "delay": 0.2}


class Noise:
    """s_w^2 I + s_c^2 exp(-|dt|/tau) + path part; tuned by restricted likelihood, with a weak belief in what the receiver says."""

    def __init__(self, t, path, path_noise, accuracy, tau_s):
        self.t, self.path = t, path
        self.accuracy, self.tau0, self.walk0 = accuracy, tau_s, path_noise  # what is believed before the residuals speak
        self.found = np.array([accuracy / np.sqrt(2), accuracy / np.sqrt(2), tau_s] + ([path_noise] if path_noise else []))

    @property
    def white(self):
        return float(self.found[0])

    @property
    def slow(self):
        return float(self.found[1])

    @property
    def tau(self):
        return float(self.found[2])

    def only(self, rows):
        """The same noise at some of the fixes."""
        one = Noise.__new__(Noise)
        one.__dict__.update(self.__dict__)
        one.t, one.path = self.t[rows], self.path[rows]
        return one

    def matrix(self, rows, white, slow, tau, walk=0.0):
        t, path = self.t[rows], self.path[rows]
        c = slow**2 * np.exp(-np.abs(t[:, None] - t) / tau) + walk * np.minimum(path[:, None], path)
        c[np.diag_indices(len(t))] += white**2
        return c

    def factor(self):
        return np.linalg.cholesky(self.matrix(slice(None), *self.found))

    def tune(self, residual, jacobian, other):
        """`residual` complex, `jacobian` complex columns; `other`: what the rest of the data says about the unknowns."""
        rows = np.arange(0, len(self.t), max(1, -(-len(self.t) // TUNE_FIXES)))
        r = np.stack([residual[rows].real, residual[rows].imag], axis=1)
        j = np.hstack([jacobian[rows].real, jacobian[rows].imag])
        columns = jacobian.shape[1]

        def cost(logs):
            white, slow, tau, *walk = np.exp(logs)
            try:
                factor = cho_factor(self.matrix(rows, white, slow, tau, *walk), lower=True)
            except np.linalg.LinAlgError:
                return 1e12
            solved = cho_solve(factor, r)
            solved_j = cho_solve(factor, j)
            information = other + j[:, :columns].T @ solved_j[:, :columns] + j[:, columns:].T @ solved_j[:, columns:]
            sign, logdet = np.linalg.slogdet(information)
            if sign <= 0:
                return 1e12
            value = 2 * 2 * np.log(np.diag(factor[0])).sum() + (r * solved).sum() + logdet
            value += (np.log(np.hypot(white, slow) / self.accuracy) / 0.5) ** 2 + np.log(tau / self.tau0) ** 2 + (np.log(slow / white) / 2.0) ** 2
            return value + sum((np.log(one / self.walk0) / 1.5) ** 2 for one in walk)

        start = np.log(self.found)
        simplex = np.vstack([start, start + np.diag([0.4, 0.4, 0.5, 1.5][:len(start)])])
        found = minimize(cost, start, method="Nelder-Mead", options={"maxfev": 120, "xatol": 0.02, "fatol": 0.05, "initial_simplex": simplex})
        self.found = np.exp(found.x)


class Run:
    """The drive on the IMU's clock: what wheels and gyroscope say, and what GNSS says."""

    def __init__(self, log, up, robot):
        imu, wheels = log.imu, log.wheels
        clipped = int(imu.clipped.sum())
        if clipped:
            imu = imu.keep(~imu.clipped)
            if len(imu) < 100:
                raise Refusal("Nearly every IMU sample is clipped.", "with a larger range of the IMU")
        begin, end = max(imu.t[0], wheels.t[0]), min(imu.t[-1], wheels.t[-1])
        pieces = np.split(np.arange(len(imu)), np.flatnonzero(np.diff(imu.t) > CUT_S) + 1)
        longest = max(pieces, key=lambda rows: min(imu.t[rows[-1]], end) - max(imu.t[rows[0]], begin))
        self.notes = [f"{len(pieces) - 1} gaps of more than {CUT_S:g} s in the IMU: the longest piece is used"] if len(pieces) > 1 else []
        if clipped:
            self.notes.append(f"{clipped} IMU samples with a clipped axis left out")
        imu = imu.keep(longest)
        inside = (imu.t >= begin) & (imu.t <= end)
        if np.count_nonzero(inside) < 100:
            raise Refusal("IMU and wheels have less than 100 samples of the same time.", "both at once")
        self.t = imu.t[inside]
        self.dt = np.diff(self.t)
        # The rate of each sample over the time since the one before; where samples are missing, the mean of both sides.
        rate = ((imu.angle / imu.dt[:, None]) @ up)[inside]
        lost = self.dt > 1.5 * imu.dt[inside][1:]
        self.turn = np.where(lost, 0.5 * (rate[1:] + rate[:-1]), rate[1:]) * self.dt
        self.gaps = np.flatnonzero(self.dt > GAP_S)
        if len(self.gaps) > 20:
            raise Refusal(f"The IMU has {len(self.gaps)} gaps of more than {GAP_S:g} s while it drives.", "a log without lost frames (candump -r 8000000)")
        if len(self.gaps):
            self.notes.append(f"{len(self.gaps)} gaps of up to {self.dt.max():.2f} s in the IMU: a jump of the heading is estimated at each")
        self.has_turn = True
        travel = self._travel(wheels, robot)
        self.forward = np.diff(np.interp(self.t, wheels.t, travel[0]))
        self.across = np.diff(np.interp(self.t, wheels.t, travel[1])) if self.has_turn else None
        at = np.append(0, np.cumsum(self.forward)), np.append(0, np.cumsum(self.turn))
        self.speed, self.rate = (self._derivative(series) for series in at)
        self.acceleration = np.clip(self._derivative(None, self.speed), -20, 20)
        self.lateral = np.abs(self.speed * self.rate)
        self.path = np.append(0, np.cumsum(np.abs(self.forward)))
        self.knots = np.linspace(self.t[0], self.t[-1], max(2, int((self.t[-1] - self.t[0]) / KNOT_S) + 1))
        # Integral of each knot's hat function: the bias is linear between knots.
        middle = 0.5 * (self.t[1:] + self.t[:-1])
        self.hats = np.stack([np.interp(middle, self.knots, row) for row in np.eye(len(self.knots))], axis=1) * self.dt[:, None]
        self.windows = np.floor((self.t[1:] - self.t[0]) / WINDOW_S).astype(int)

    def _derivative(self, series, values=None):
        middle = 0.5 * (self.t[1:] + self.t[:-1])
        if values is not None:
            return (np.interp(middle + SMOOTH_S, middle, values) - np.interp(middle - SMOOTH_S, middle, values)) / (2 * SMOOTH_S)
        return (np.interp(middle + SMOOTH_S, self.t, series) - np.interp(middle - SMOOTH_S, self.t, series)) / (2 * SMOOTH_S)

    def _travel(self, wheels, robot):
        """Cumulative (mean travel, right minus left or turn) with the numbers as they are now; sets what these numbers are."""
        self.kind = wheels.kind
        self.radius = self.track = self.step = None
        if wheels.kind == "counts":
            per_turn, radius = robot.number("counts_per_turn"), robot.number("left_radius_m")
            right = robot.number("right_radius_m", radius)
            self.nominal_known = None not in (per_turn, radius)
            self.radius = (radius or 0.1, right or 0.1)
            self.per_turn = per_turn
            self.step = TWO_PI * np.array(self.radius) / per_turn if per_turn else np.array([1e-3, 1e-3])
            turn = []
            for name, side in (("left", wheels.one), ("right", wheels.two)):
                step = (np.diff(side) + 0x8000) % 0x10000 - 0x8000
                turn.append(np.append(0, np.cumsum(step)))
                leap = np.abs(step) > 0x4000
                if leap.any():
                    row = np.flatnonzero(leap)[0] + 1
                    raise Refusal(f"The {name} counter moves by {abs(step[row - 1]):.0f} counts from one sample to the next (line {wheels.line[row]}), "
                                  "half its range may be lost.", "wheel counts more often")
            left, right = turn[0] * self.step[0], turn[1] * self.step[1]
            self.quantum = float(self.step.mean())
        else:
            self.nominal_known = True
            dt = np.append(0, np.diff(wheels.t))
            one, two = np.cumsum(wheels.one * dt), np.cumsum(np.nan_to_num(wheels.two) * dt)
            self.quantum = 1e-3
            if wheels.kind == "body speed":
                self.has_turn = bool(np.isfinite(wheels.two).mean() > 0.9)
                return one, two
            left, right = one, two
        self.track = robot.number("track_m")
        self.nominal_known &= self.track is not None
        return 0.5 * (left + right), right - left


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
        self.vel_t, self.vel = (velocity.t, velocity.east + 1j * velocity.north) if velocity is not None and len(velocity) > LEAST_FIXES else (None, None)
        accuracy = np.nanmedian(gnss.acc) if np.isfinite(gnss.acc).any() else 2.5
        self.accuracy = float(np.clip(accuracy, 0.005, 30))
        self.vel_accuracy = float(np.clip(np.nanmedian(velocity.acc), 0.01, 3)) if self.vel is not None and np.isfinite(velocity.acc).any() else 0.2
        self.all = (self.fix_t, self.fix), (self.vel_t, self.vel)
        self.names = [name for name in PRIORS if run.has_turn or name not in ("difference", "track")]
        self.names += [f"jump{k}" for k in range(len(run.gaps))] + [f"bias{k}" for k in range(len(run.knots))]
        self.arm = robot.number("antenna_x_b_m", 0.0) + 1j * robot.number("antenna_y_b_m", 0.0)
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
            raise Refusal(f"It drives {moved * (1 if run.nominal_known else np.nan):.0f} m only, too little for fixes of {self.accuracy:.1f} m." if run.nominal_known else
                          f"Too little is driven for fixes of {self.accuracy:.1f} m.", f"a drive of at least {max(LEAST_DISTANCE_M, 30 * self.accuracy):.0f} m")
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
        """Variance of each comparison of wheels and gyroscope: counts, path, and load in curves (all from the residuals), and their correlation."""
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
        self.dropped["wheel"] = int(far.sum())
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
                if run.has_turn and run.kind != "body speed":  # what the comparison with the gyroscope scatters, each wheel has a share of
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
        """Jackknife over BLOCKS parts of the run (B. Efron, C. Stein, Ann. Statist. 9, 1981): where it says more scatter than the model, it counts.

        A robot whose wheels skid in some places and not in others is found out so, whatever the model believes.
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


def wheels(log, up, robot, bias=None):
    """`up` in the IMU's axes; `bias` of the gyroscope there, if the log rests."""
    part = Part("wheels", "wheels: radius, difference, track from GNSS and the gyroscope")
    how = "ten minutes of driving with a GNSS fix under open sky: straights, and curves to both sides"
    for samples, what in ((log.wheels, "wheels (In_WheelCounts, In_WheelSpeed or In_BodySpeed)"), (log.gnss, "GNSS position (In_GnssLat, Lon, Alt, Acc)"),
                          (log.imu, "gyroscope (In_Imu<n>Gyro, Accel, Time)")):
        if samples is None:
            raise Refusal(f"The log has no {what}.", how)
    run = Run(log, up, robot)
    fit = Fit(run, log.gnss, log.velocity, robot, None if bias is None else float(bias @ up))
    extent = np.abs(fit.fix - np.median(fit.fix)).max()
    if fit.distance * (1 + fit.p[fit.names.index("mean")]) < LEAST_DISTANCE_M or extent < 3 * fit.accuracy:
        raise Refusal(f"It moves {fit.distance:.0f} m, and {extent:.0f} m away, too little for fixes of {fit.accuracy:.1f} m ({LEAST_DISTANCE_M:g} m at least).", how)
    fit.solve()
    part.notes += run.notes
    if fit.frozen:
        part.notes.append(f"{fit.frozen} fixes left out that repeat the one before to the last digit while the wheels roll")
    _numbers(part, fit, run, how)
    _state(part, fit, run)
    return part


def _numbers(part, fit, run, how):
    sigma_mean = fit.value("mean")[1]
    scaled = sigma_mean <= MOST_SCALE
    if not scaled:
        part.refuse("wheel radius", Refusal(f"It comes out to {100 * sigma_mean:.1f} % only (1 sigma).", how))
    sides = run.has_turn and run.kind != "body speed"
    difference = fit.value("difference") if run.has_turn else None
    known = run.has_turn and difference[1] <= MOST_DIFFERENCE
    if sides and not known:
        part.refuse("wheel difference", Refusal(f"It comes out to {100 * difference[1]:.1f} % only (1 sigma).", how))
    if run.kind == "body speed" and scaled:
        part.add("true speed over stated speed", *fit.derived(lambda q: 1 + q["mean"]), "1", "wheels.speed_scale")
    elif sides and scaled and known:
        # r_left = r0 (1 + mean)(1 + difference/2): difference = (left - right) / mean on top of what is there now
        sign = {"left": 0.5, "right": -0.5}
        for k, side in enumerate(("left", "right")):
            factor = fit.derived(lambda q, side=side: (1 + q["mean"]) * (1 + sign[side] * q["difference"]))
            if run.kind == "counts" and run.per_turn:
                part.add(f"{side} wheel radius", run.radius[k] * factor[0], run.radius[k] * factor[1], "m", f"wheels.drive.{side}_radius_m")
            elif run.kind == "counts":
                part.add(f"{side} wheel, metres per count", run.step[k] * factor[0], run.step[k] * factor[1], "m")
            else:
                part.add(f"{side} wheel, true speed over stated speed", *factor, "1", f"wheels.{side}_speed_scale")
        base = run.step if run.kind == "counts" else np.ones(2)
        total = fit.derived(lambda q: 2 * (base[0] * (1 + q["difference"] / 2) - base[1] * (1 - q["difference"] / 2))
                            / (base[0] * (1 + q["difference"] / 2) + base[1] * (1 - q["difference"] / 2)))
        part.add("wheel difference (left - right)/mean", *total, "1")
        if run.kind == "counts" and not run.per_turn:
            part.notes.append("radius needs the counts per turn of the wheel: --counts-per-turn N, or --robot NAME that has them")
    if not run.has_turn:
        part.refuse("track", Refusal("The wheels say nothing about turning (YawRate not available).", "left and right wheels"))
        return
    track, sigma_track = fit.value("track")
    if fit.turned < LEAST_TURN_RAD or sigma_track > MOST_TRACK:
        part.refuse("track" if sides else "yaw rate scale", Refusal(
            f"It turns by {np.degrees(fit.turned):.0f} deg in all and the number comes out to {100 * sigma_track:.1f} % (1 sigma).", how))
    elif sides:
        part.add("track width", *fit.derived(lambda q: fit.track0 * (1 + q["track"])), "m", "wheels.drive.track_m")
    else:
        part.add("true yaw rate over stated yaw rate", *fit.derived(lambda q: (1 + q["mean"]) / (1 + q["track"])), "1", "wheels.yaw_rate_scale")


def _rms(values):
    return float(np.sqrt((np.abs(values) ** 2).mean()))


def _state(part, fit, run):
    old = fit.before()
    new = fit.residuals
    what = "with the numbers as they are now" if run.nominal_known else "with equal wheels"
    part.residual(f"position, {len(fit.fix)} fixes ({fit.dropped['fix']} left out)", _rms(old[0]), _rms(new[0]), "m")
    part.residual("the same in its own 1 sigma, without the correlation", fit.whitened(fit.mean(old[0], fit.starts), fit.noise[0]), fit.white_rms[0], "1")
    if new[1] is not None:
        part.residual(f"velocity, {len(fit.vel)} fixes ({fit.dropped['velocity']} left out)", _rms(old[1]), _rms(new[1]), "m/s")
    if new[2] is not None:
        unit = "rad" if run.kind == "body speed" else "m"
        part.residual(f"wheels' turn against the gyroscope's, {WINDOW_S:g} s ({fit.dropped['wheel']} slips left out)", _rms(old[2]), _rms(new[2]), unit)
    one = fit.noise[0]
    white = one.white * np.sqrt(len(fit.fix_t) / len(fit.starts))  # of one fix, not of a group's mean
    part.notes.append(f"before: {what}")
    worst = max(((fit.more[fit.names.index(name)], name) for name in ("mean", "difference", "track") if name in fit.names))
    if worst[0] > 1.5:
        part.notes.append(f"parts of the run disagree by {worst[0]:.1f} times what the model explains (wheels that skid?): the 1 sigma holds that")
    part.notes.append(f"GNSS position error found: {white:.2f} m from fix to fix and {one.slow:.2f} m that lasts {one.tau:.0f} s (the receiver says {fit.accuracy:.2f} m)")
    others = []
    for name, text, unit in (("gyro_scale", "gyroscope scale", "1"), ("c_curve", "slip in curves", "s2/m"), ("c_acc", "slip by acceleration", "s2/m"),
                             ("c_side", "side slip", "s"), ("arm_x", "antenna ahead by", "m"), ("arm_y", "antenna left by", "m"), ("delay", "GNSS late by", "s")):
        value, sigma = fit.value(name)
        others.append(f"{text} {value:+.4f} +- {sigma:.4f} {unit}")
    part.notes.append("estimated along: " + "; ".join(others))

    def draw(axes):
        t = fit.fix_t
        axes.plot(t, np.abs(old[0]), color="#e69f00", lw=1, label="before")
        axes.plot(t, np.abs(new[0]), color="#0072b2", lw=1, label="after")
        axes.axhline(np.hypot(white, one.slow) * np.sqrt(2), color="#6b6b6b", lw=1, ls=":", label="GNSS, 1 sigma")
        axes.set(xlabel="time [s]", ylabel="position residual [m]")

    part.draw = draw
    if new[2] is None:
        return

    def draw_turn(axes):
        t = fit.run.t[0] + WINDOW_S * np.arange(1, len(new[2]) + 1)
        per_turn = np.degrees(1 / fit.track0)
        axes.plot(t, np.cumsum(old[2]) * per_turn, color="#e69f00", lw=1.4, label="before")
        axes.plot(t, np.cumsum(new[2]) * per_turn, color="#0072b2", lw=1.4, label="after")
        axes.set(xlabel="time [s]", ylabel="heading, wheels'\nminus gyroscope's [deg]")

    part.draw_more = draw_turn
