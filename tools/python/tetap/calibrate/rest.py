# SPDX-License-Identifier: Apache-2.0
"""Calibration from rest: where the log rests, accelerometer (six positions and more) and gyroscope (bias, temperature slope).

Accelerometer: specific force at rest is gravity, whatever the attitude: |T (f - b)| = g with T upper triangular, 9 numbers (Frosio, Pedersini,
Borghese, "Autocalibration of MEMS accelerometers", IEEE Trans. Instrum. Meas. 58(6), 2009). Six positions give six equations, which is bias and
scale; that the six are the faces of a box, to a degree, gives the misalignment (the classical six-position test, IEEE Std 1293-2018).
Gravity: WGS84 (NIMA TR8350.2, eq. 4-1 and 4-3).
"""
import numpy as np
from scipy.optimize import least_squares

from tetap.calibrate.robot_numbers import Number, Part, Refusal

AXES = ("x", "y", "z")
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
BLOCK_S = 0.25          # span that is judged at a time
LEAST_S = 1.0           # least rest, without the blocks at both ends
GYRO_CAP, ACCEL_CAP = 0.05, 0.5  # rad/s, m/s2: a block whose samples scatter more never rests
RATE_CAP = 0.1          # rad/s: no sensor's bias is larger, so more is turning
STILL_MPS, STILL_RADPS = 0.02, 0.02   # a stated speed below is a sensor at rest; counts have to stand
GNSS_MPS = 0.1          # GNSS velocity above, and three times its own accuracy more: it moves
SHIFT_MPS2 = 0.12       # a rest ends where the force is another one
POSITION_DEG = 15.0     # rests closer together than this are one position
FACE_DEG = 25.0         # from an axis: this face was up
CROSS_AXIS = 0.02       # 1 sigma of the misalignment before anything is measured [data sheets of MEMS: 1 to 2 %]
MOST_BIAS, MOST_SCALE = 0.1, 0.02   # m/s2, 1: with more 1 sigma the number is refused
FLOOR_MPS2 = 0.002      # scatter of one position: nonlinearity and hysteresis, [own]
LEAST_DEGC = 5.0        # least temperature span for a slope
SLOPE_BLOCK_S = 10.0
EARTH_RADPS = 7.292115e-5


def gravity(lat_deg, height_m):
    """Normal gravity [m/s2] on the WGS84 ellipsoid, with the free-air gradient."""
    s2 = np.sin(np.radians(lat_deg)) ** 2
    return 9.7803253359 * (1 + 0.00193185265241 * s2) / np.sqrt(1 - 0.00669437999014 * s2) - 3.086e-6 * height_m


def place(log):
    """(latitude, height) of the log, None without GNSS."""
    if log.gnss is None:
        return None
    height = log.gnss.height[np.isfinite(log.gnss.height)]
    return float(np.median(log.gnss.lat)), float(np.median(height)) if len(height) else 0.0


class Rest:
    """One rest: start and end [s], mean specific force with 1 sigma, and its blocks (time, rate, temperature)."""

    def __init__(self, t, force, rate, temp):
        self.start, self.end = t[0] - BLOCK_S, t[-1]
        self.t, self.rate, self.temp = t, rate, temp
        self.force = force.mean(axis=0)
        self.sigma = force.std(axis=0, ddof=1) / np.sqrt(len(t))

    @property
    def duration(self):
        return self.end - self.start


def find(log):
    """The rests of the log, by the IMU's own scatter and, where there are wheels, by their standing still."""
    imu = log.imu
    if imu is None:
        return []
    block = np.floor(imu.t / BLOCK_S).astype(int)
    starts = np.flatnonzero(np.append(True, np.diff(block) > 0))
    count = np.diff(np.append(starts, len(block)))
    dt = np.add.reduceat(imu.dt, starts)
    rate = np.add.reduceat(imu.angle, starts) / dt[:, None]
    force = np.add.reduceat(imu.velocity, starts) / dt[:, None]

    def scatter(increment, mean):
        deviation = increment / imu.dt[:, None] - np.repeat(mean, count, axis=0)
        return np.sqrt((np.add.reduceat(deviation**2, starts) / np.maximum(count - 1, 1)[:, None]).max(axis=1))

    turn, shake = scatter(imu.angle, rate), scatter(imu.velocity, force)
    enough = (count >= 4) & (dt > 0.6 * BLOCK_S)
    if not enough.any():
        return []
    turn_limit = min(GYRO_CAP, max(0.004, 3 * np.quantile(turn[enough], 0.05)))
    shake_limit = min(ACCEL_CAP, max(0.03, 3 * np.quantile(shake[enough], 0.05)))
    still = enough & (turn < turn_limit) & (shake < shake_limit) & (np.abs(rate).max(axis=1) < RATE_CAP)
    still &= np.add.reduceat(imu.clipped.astype(int), starts) == 0
    t = imu.t[starts + count - 1]
    if log.wheels is not None:
        still &= ~moving(log.wheels, t - BLOCK_S, t)
    if log.velocity is not None and len(log.velocity) > 1:
        still &= ~flying(log.velocity, t - BLOCK_S, t)
    temp = np.array([np.nan if np.isnan(part).all() else np.nanmean(part) for part in np.split(imu.temp, starts[1:])])
    rests, row = [], 0
    while row < len(t):
        end = row
        while end < len(t) and still[end] and t[end] - t[max(end - 1, row)] < 3 * BLOCK_S \
                and np.linalg.norm(force[end] - force[row:end + 1].mean(axis=0)) < SHIFT_MPS2:
            end += 1
        inner = slice(row + 1, end - 1)
        if end - row - 2 >= max(3, LEAST_S / BLOCK_S):
            rests.append(Rest(t[inner], force[inner], rate[inner], temp[inner]))
        row = max(end, row + 1)
    return rests


def moving(wheels, start, end):
    """Whether the wheels did anything between these times (no sample there: not known, so no)."""
    slack = 0.0
    if wheels.kind != "counts":  # a speedometer by Doppler or pulses never reads quite zero
        slack = min(0.15, 2 * float(np.quantile(np.abs(wheels.one), 0.02)))
    if wheels.kind == "counts":
        change = np.append(0, (np.diff(wheels.one) != 0) | (np.diff(wheels.two) != 0))
    else:
        two = STILL_RADPS if wheels.kind == "body speed" else STILL_MPS
        change = (np.abs(wheels.one) > STILL_MPS + slack) | (np.abs(np.nan_to_num(wheels.two)) > two + slack)
    total = np.append(0, np.cumsum(change))
    return total[np.searchsorted(wheels.t, end, "right")] - total[np.searchsorted(wheels.t, start)] > 0


def flying(velocity, start, end):
    """Whether GNSS shows motion: a hovering robot is quiet too."""
    speed = np.sqrt(velocity.east**2 + velocity.north**2 + np.nan_to_num(velocity.up) ** 2)
    fast = speed > GNSS_MPS + 3 * np.nan_to_num(velocity.acc, nan=0.1)
    near = np.searchsorted(velocity.t, 0.5 * (start + end)).clip(1, len(velocity) - 1)
    return fast[near] | fast[near - 1]


def positions(rests):
    """Rests by attitude: a list of lists."""
    groups = []
    for rest in rests:
        direction = rest.force / np.linalg.norm(rest.force)
        for group in groups:
            first = group[0].force / np.linalg.norm(group[0].force)
            if first @ direction > np.cos(np.radians(POSITION_DEG)):
                group.append(rest)
                break
        else:
            groups.append([rest])
    return groups


def face(force):
    """The face that is up (force points up at rest), None when none is within FACE_DEG."""
    direction = force / np.linalg.norm(force)
    axis = int(np.argmax(np.abs(direction)))
    if abs(direction[axis]) < np.cos(np.radians(FACE_DEG)):
        return None
    return FACES[2 * axis + (direction[axis] < 0)]


def _triangle(p):
    return np.array([[p[3], p[6], p[7]], [0, p[4], p[8]], [0, 0, p[5]]])


def accelerometer(log, rests, g_mps2, sigma_g_mps2, box_deg):
    part = Part("accel", "accelerometer: gravity in all positions")
    if log.imu is None:
        raise Refusal("The log has no IMU samples (In_Imu<n>Gyro, Accel, Time).", "the IMU at rest, six faces up in turn, 5 s each")
    groups = positions(rests)
    seen = {face(group[0].force) for group in groups} - {None}
    missing = [name for name in FACES if name not in seen]
    words = {"+": "{} up", "-": "{} down"}
    missing_text = ", ".join(words[name[0]].format(name[1]) for name in missing) or "none of the faces, but more attitudes in between"
    if len(groups) < 6:
        raise Refusal(f"{len(groups)} rest position{'s' * (len(groups) != 1)} found, six are needed; missing: {missing_text}.",
                      f"the sensor at rest for 5 s or more in each of these positions (sensor axes): {missing_text}")
    used = [rest for group in groups for rest in group]
    force = np.array([rest.force for rest in used])
    sigma = np.hypot(np.array([np.linalg.norm(rest.sigma) / np.sqrt(3) for rest in used]), FLOOR_MPS2)
    faces = [face(f) for f in force] if box_deg > 0 else [None] * len(force)
    on_face = np.array([name is not None for name in faces])
    up = np.zeros((len(force), 3))
    for row, name in enumerate(faces):
        if name:
            up[row, AXES.index(name[1])] = 1.0 if name[0] == "+" else -1.0
    # A rest that is repeated without being turned is the same place on the same table: its direction counts once.
    copies = np.array([sum(one is name for one in faces) if name else 1 for name in faces])
    box = np.radians(max(box_deg, 1e-3)) * np.sqrt(copies)

    def residual(p, noise=sigma):
        true = (force - p[:3]) @ _triangle(p).T
        rows = [(np.linalg.norm(true, axis=1) - g_mps2) / noise, p[6:9] / CROSS_AXIS]
        turned = true / g_mps2 + np.cross(p[9:12], true / g_mps2)
        beside = turned - up * (turned * up).sum(axis=1, keepdims=True)
        rows.append(((beside / box[:, None]) * on_face[:, None]).ravel())
        rows.append(p[9:12] / 0.2)  # the sensor in its box: 10 degrees at most
        return np.concatenate(rows)

    start = np.concatenate([np.zeros(3), np.ones(3), np.zeros(6)])
    fit = least_squares(residual, start, x_scale=np.concatenate([np.full(3, 0.1), np.full(9, 0.01)]))
    norms = residual(fit.x)[:len(force)]
    free = len(groups) - 6
    inflation = max(1.0, np.sqrt((norms**2).sum() / free)) if free > 0 else 1.0
    if inflation > 1:
        fit = least_squares(lambda p: residual(p, sigma * inflation), fit.x, x_scale=np.concatenate([np.full(3, 0.1), np.full(9, 0.01)]))
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    sd = np.sqrt(np.diag(covariance))
    bad = [AXES[i] for i in range(3) if sd[i] > MOST_BIAS or sd[3 + i] > MOST_SCALE]
    if bad:
        raise Refusal(f"{len(groups)} positions, but they do not tell bias from scale along {', '.join(bad)} "
                      f"(1 sigma {sd[:3].max():.2g} m/s2 and {sd[3:6].max():.2g}).", f"rest of 5 s with these faces up: {missing_text}")
    scale = np.hypot(sd[3:6], sigma_g_mps2 / g_mps2)
    part.add("accelerometer bias", fit.x[:3], sd[:3], "m/s2", "imu.accel_bias_mps2", AXES)
    seen_cross = sd[6:9] < 0.5 * CROSS_AXIS
    matrix = _triangle(fit.x)
    if not seen_cross.all():
        part.refuse("misalignment of the accelerometer's axes", Refusal(
            "These positions say nothing about it; it is taken as zero within 2 %.",
            "nine positions or more (edges and corners up as well), or the six faces of a box with --box-deg"))
    part.add("accelerometer scale", fit.x[3:6], scale, "1", "", AXES)
    part.add("accelerometer misalignment", fit.x[6:9], sd[6:9], "rad", "", ("xy", "xz", "yz"))
    matrix_sigma = np.array([[scale[0], sd[6], sd[7]], [0, scale[1], sd[8]], [0, 0, scale[2]]])
    part.add("accelerometer matrix: f = T (raw - bias)", matrix, matrix_sigma, "1", "imu.accel_matrix",
             tuple(a + b for a in AXES for b in AXES), 6)
    before = np.linalg.norm(force, axis=1) - g_mps2
    after = np.linalg.norm((force - fit.x[:3]) @ matrix.T, axis=1) - g_mps2
    part.residual(f"|f| - g over {len(used)} rests in {len(groups)} positions", np.sqrt((before**2).mean()), np.sqrt((after**2).mean()), "m/s2")
    part.notes.append(f"gravity {g_mps2:.4f} +- {sigma_g_mps2:.4f} m/s2; its error is in the 1 sigma of the scale")
    if free <= 0:
        part.notes.append("six positions fit exactly: the residual after is no test; more positions are one")
    if on_face.any():
        part.notes.append(f"faces taken as those of a box to {box_deg:g} deg; the sensor is turned in it by "
                          + ", ".join(f"{np.degrees(v):.2f}" for v in fit.x[9:12]) + " deg about x, y, z")

    def draw(axes):
        rows = np.arange(len(before))
        axes.bar(rows - 0.2, 1e3 * before, 0.4, color="#e69f00", label=f"before, RMS {1e3 * np.sqrt((before**2).mean()):.2g}")
        axes.bar(rows + 0.2, 1e3 * after, 0.4, color="#0072b2", label=f"after, RMS {1e3 * np.sqrt((after**2).mean()):.2g}")
        axes.set(ylabel="|f| - g [mm/s2]")
        axes.set_xticks(rows, [(face(f) or "?") if len(rows) <= 24 else "" for f in force])
        axes.set_xlabel("rests, by the face that is up")

    part.draw = draw
    part.matrix, part.bias = matrix, fit.x[:3]
    return part


def gyroscope(log, rests, where):
    part = Part("gyro", "gyroscope: turn rate at rest")
    if log.imu is None:
        raise Refusal("The log has no IMU samples (In_Imu<n>Gyro, Accel, Time).", "the IMU at rest for a minute")
    total = sum(rest.duration for rest in rests)
    if total < 5.0:
        raise Refusal(f"{total:.1f} s of rest found, 5 s are needed.", "the robot standing still, motors off, for a minute")
    rate = np.concatenate([rest.rate for rest in rests])
    temp = np.concatenate([rest.temp for rest in rests])
    t = np.concatenate([rest.t for rest in rests])
    group = np.concatenate([np.full(len(rest.t), k) for k, rest in enumerate(rests)])
    known = np.zeros(rate.shape)
    earth = np.full(3, EARTH_RADPS / np.sqrt(3))
    if where is not None:  # the part of the Earth's turning about the vertical is known; the other one looks north
        lat = np.radians(where[0])
        ups = np.array([rest.force / np.linalg.norm(rest.force) for rest in rests])
        known = EARTH_RADPS * np.sin(lat) * ups[group]
        earth = EARTH_RADPS * np.cos(lat) / np.sqrt(2) * np.sqrt(np.maximum(1 - (ups**2).mean(axis=0), 0.0))
    true = rate - known

    # Rests, and pieces of ten seconds of them: their scatter holds what wanders, which samples do not.
    piece = group * 100_000 + np.floor(t / SLOPE_BLOCK_S).astype(int)
    _, index, count = np.unique(piece, return_inverse=True, return_counts=True)

    def mean(values):
        return np.bincount(index, values) / count

    pieces = np.stack([mean(true[:, axis]) for axis in range(3)], axis=1)
    weight = count / count.sum()
    bias = weight @ pieces
    noise = true.std(axis=0, ddof=1) / np.sqrt(len(true))
    if len(count) > 2:
        share = (weight**2).sum()
        wander = np.sqrt(weight @ (pieces - bias) ** 2 * share / (1 - share))
    else:
        wander = noise
    temps = mean(np.nan_to_num(temp, nan=0.0)) if np.isfinite(temp).all() else None
    at = slope = None
    if temps is None:
        part.refuse("temperature slope", Refusal("The temperature of the IMU is not available on this bus (In_Imu<n>Time.Temp).",
                                                 "with a driver that fills Temp"))
    elif np.ptp(temps) < LEAST_DEGC:
        part.refuse("temperature slope", Refusal(f"The temperature at rest changes by {np.ptp(temps):.1f} degC only, {LEAST_DEGC:g} are needed.",
                                                 "rest from a cold start until the sensor is warm (ten minutes or more)"))
    elif len(count) < 6:
        part.refuse("temperature slope", Refusal(f"Only {len(count)} pieces of rest of {SLOPE_BLOCK_S:g} s.",
                                                 "a minute or more of rest while it warms up"))
    else:
        at = float(weight @ temps)
        design = np.stack([np.ones(len(temps)), temps - at], axis=1)
        normal = np.linalg.inv(design.T * weight @ design)
        both = normal @ (design.T * weight) @ pieces
        left = pieces - design @ both
        inflate = np.array([_correlation(left[:, axis]) for axis in range(3)])
        variance = (weight @ left**2) * len(count) / (len(count) - 2) / len(count) * inflate
        bias, slope = both
        spread = np.sqrt(variance[:, None] * np.diag(normal))
        wander = np.maximum(spread[:, 0], noise)
        part.add("gyroscope bias slope", slope, spread[:, 1], "rad/s/degC", "imu.gyro_bias_slope_radps_per_degC", AXES)
        part.add("gyroscope bias holds at", at, 0.0, "degC", "imu.gyro_bias_at_degC")
    sigma = np.sqrt(np.maximum(noise, wander) ** 2 + earth**2)
    part.numbers.insert(0, Number("gyroscope bias", bias, sigma, "rad/s", "imu.gyro_bias_radps", AXES))
    flat = true - bias - (0 if slope is None else (temp - at)[:, None] * slope)
    part.residual(f"turn rate at rest, {BLOCK_S:g} s means ({total:.0f} s in {len(rests)} rests)",
                  np.sqrt((rate**2).mean()), np.sqrt((flat**2).mean()), "rad/s")
    part.notes.append("the Earth turns too: " + ("its vertical part is taken out, the rest is in the 1 sigma" if where is not None
                                                 else "its 7.3e-5 rad/s are in the 1 sigma (no GNSS: latitude not known)"))

    def draw(axes):
        x = t if temps is None or slope is None else temp
        for axis, colour in enumerate(("#0072b2", "#e69f00", "#009e73")):
            axes.plot(x, 1e3 * rate[:, axis], ".", ms=2, color=colour, label=AXES[axis])
            fitted = bias[axis] + known[:, axis] + (0 if slope is None else slope[axis] * (temp - at))
            order = np.argsort(x)
            axes.plot(x[order], 1e3 * np.broadcast_to(fitted, x.shape)[order], color=colour, lw=1.2)
        axes.set(xlabel="temperature [degC]" if slope is not None else "time [s]", ylabel="turn rate at rest [mrad/s]")

    part.draw = draw
    part.bias = bias
    return part


def _correlation(series):
    """By how much neighbours that are alike make the variance of a mean larger (AR(1), Priestley 1981, sec. 5.3.2)."""
    if len(series) < 4 or not series.any():
        return 1.0
    rho = float(np.clip((series[1:] * series[:-1]).sum() / (series**2).sum(), 0.0, 0.95))
    return (1 + rho) / (1 - rho)
