# SPDX-License-Identifier: Apache-2.0
"""Mounting of the IMU: the rotation from its axes to the body's (x forward, y left, z up).

Up is where gravity points while the robot stands on level ground. Forward is where the specific force points when the robot accelerates:
in the level plane, as complex numbers, f = e^(i alpha) (k_x a + i k_y v w + l (i dw/dt - w^2)) + b with the speed v of wheels or GNSS, its
derivative a, the turn rate w about up, the arm l from the axle to the sensor, and k_x, k_y near 1 (squat, lean and a wheel radius
that is not known yet change only these). Least squares over pieces of half a second.
"""
import numpy as np

from tetap.calibrate.robot_numbers import Part, Refusal
from tetap.calibrate.rest import AXES, positions

PIECE_S = 0.5
LEAST_PIECES = 20
LEAST_MPS2 = 0.15       # RMS of the acceleration
MOST_YAW_RAD = 0.05     # 1 sigma: with more it is refused
FALSE_LEVEL_MPS2 = 0.05 # 1 sigma of the accelerometer's bias when it was not calibrated [ICM-42688-P on a board, after a factory calibration; own]


def speed(log):
    """(times [s], speed [m/s], where from): of the middle of each interval. Wheels need no calibrated radius: only the direction counts."""
    if log.wheels is not None:
        w = log.wheels
        if w.kind == "counts":
            turn = [((np.diff(side) + 0x8000) % 0x10000 - 0x8000) for side in (w.one, w.two)]
            dt = np.diff(w.t)
            return 0.5 * (w.t[1:] + w.t[:-1]), (turn[0] + turn[1]) / 2 / dt, "wheel counts"
        return w.t, w.one if w.kind == "body speed" else 0.5 * (w.one + w.two), w.message
    if log.velocity is not None:
        return log.velocity.t, np.hypot(log.velocity.east, log.velocity.north), "GNSS speed (driving forward)"
    return None


def driving_force(log):
    """Mean specific force while it drives, None without evidence: of starts and stops, left and right, gravity is left."""
    source = speed(log)
    if source is None or not (np.abs(source[1]) > 0).any():
        return None
    t, v = source[0], np.abs(source[1])
    fast = np.interp(log.imu.t, t, v, left=0, right=0) > 0.3 * np.quantile(v, 0.95)
    return log.imu.velocity[fast].sum(axis=0) / log.imu.dt[fast].sum() if fast.any() else None


def upwards(log, rests, bias, matrix):
    """Unit vector of up in the sensor's axes, seconds rested, number of attitudes: of several attitudes the one in which it drives."""
    groups = positions(rests)
    group = groups[0]
    if len(groups) > 1:
        driven = driving_force(log)
        if driven is None:
            raise Refusal(f"It rests in {len(groups)} attitudes, and nothing says in which of them the robot is on its wheels.",
                          "wheels as well, or choose the time at which it stands (--span mounting:START,END)")
        group = max(groups, key=lambda one: one[0].force @ driven / np.linalg.norm(one[0].force))
    force = np.average([r.force for r in group], axis=0, weights=[r.duration for r in group])
    force = matrix @ (force - bias)
    return force / np.linalg.norm(force), sum(r.duration for r in group), len(groups)


def mounting(log, rests, accel, level_deg):
    part = Part("mounting", "mounting: gravity at rest, acceleration while driving")
    how = "10 s standing on level ground, then a minute of driving with brisk starts and stops"
    if log.imu is None:
        raise Refusal("The log has no IMU samples (In_Imu<n>Gyro, Accel, Time).", how)
    if not rests:
        raise Refusal("The log has no rest, so up is not known.", how)
    bias, matrix = (accel.bias, accel.matrix) if accel else (np.zeros(3), np.eye(3))
    up, rested, attitudes = upwards(log, rests, bias, matrix)
    sigma_tilt = np.hypot(np.radians(level_deg), (0.005 if accel else FALSE_LEVEL_MPS2) / 9.81)
    part.add("up in sensor axes", up, sigma_tilt * np.sqrt(np.maximum(1 - up**2, 0)), "1", "gyro.up_s", AXES)
    part.notes.append(f"level from {rested:.0f} s of rest; 1 sigma of {np.degrees(sigma_tilt):.2f} deg: ground within {level_deg:g} deg (--level-deg)"
                      + ("" if accel else f", accelerometer not calibrated in this log ({FALSE_LEVEL_MPS2:g} m/s2)"))
    if attitudes > 1:
        part.notes.append(f"{attitudes} attitudes at rest; the one in which it drives counts")
    try:
        _forward(log, part, up, bias, matrix, sigma_tilt, how)
    except Refusal as refusal:
        part.refuse("forward direction (mounting_bs)", refusal)
    return part


def _pieces(log, t, v, up, bias, matrix):
    """Per half second of driving: force (sensor axes), acceleration, speed times turn rate, turn rate squared, its derivative."""
    imu = log.imu
    edges = np.arange(max(t[0], imu.t[0]), min(t[-1], imu.t[-1]), max(PIECE_S, 2 * np.median(np.diff(t))))
    if len(edges) < 3:
        return None
    travelled = np.append(0, np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t)))
    force_sum = np.vstack([np.zeros(3), np.cumsum((imu.velocity - bias * imu.dt[:, None]) @ matrix.T, axis=0)])
    clock, turned = np.append(0, np.cumsum(imu.dt)), np.append(0, np.cumsum(imu.angle @ up))
    at = np.append(imu.t[0] - imu.dt[0], imu.t)

    def of(series, where):
        return np.interp(where, at, series)

    span = np.diff(of(clock, edges))
    full = span > 0.8 * np.diff(edges)
    force = np.stack([np.diff(of(force_sum[:, axis], edges)) for axis in range(3)], axis=1) / np.where(full, span, 1)[:, None]
    window = 0.25 * (edges[1] - edges[0])
    around = (np.interp(edges + window, t, travelled) - np.interp(edges - window, t, travelled)) / (2 * window)
    rate = (of(turned, edges + window) - of(turned, edges - window)) / (2 * window)
    step = np.diff(edges)
    acceleration, turning = np.diff(around) / step, np.diff(rate) / step
    mean_v, mean_w = np.diff(np.interp(edges, t, travelled)) / step, np.diff(of(turned, edges)) / np.where(full, span, 1)
    full &= np.diff(np.searchsorted(t, edges)) > 0
    return [x[full] for x in (force, acceleration, mean_v * mean_w, mean_w**2, turning, mean_v)]


def _forward(log, part, up, bias, matrix, sigma_tilt, how):
    source = speed(log)
    if source is None:
        raise Refusal("The log has neither wheels nor a GNSS velocity, so when it accelerates is not known.", how)
    t, v, name = source
    pieces = _pieces(log, t, v, up, bias, matrix) if len(t) > 10 else None
    if pieces is None or len(pieces[1]) < LEAST_PIECES:
        raise Refusal(f"Less than {LEAST_PIECES * PIECE_S:g} s with both the IMU and a speed.", how)
    force, acceleration, lateral, rate2, turning, mean_v = pieces
    if name == "wheel counts":  # in counts: brought to metres by the force itself
        size = np.linalg.norm(force - np.median(force, axis=0), axis=1)
        scale = np.sqrt((size**2).sum() / max((acceleration**2 + lateral**2).sum(), 1e-12))
        acceleration, lateral, mean_v = acceleration * scale, lateral * scale, mean_v * scale
    if np.sqrt((acceleration**2).mean()) < LEAST_MPS2:
        raise Refusal(f"It accelerates by {np.sqrt((acceleration**2).mean()):.2f} m/s2 only (RMS), {LEAST_MPS2:g} are needed.", how)
    first = np.eye(3)[np.argmin(np.abs(up))]
    e1 = first - up * (up @ first)
    e1 /= np.linalg.norm(e1)
    e2 = np.cross(up, e1)
    z = force @ e1 + 1j * (force @ e2)
    design = np.stack([acceleration, 1j * lateral, 1j * turning - rate2, np.ones_like(acceleration)], axis=1).astype(complex)
    used = np.ones(len(z), dtype=bool)
    turns = np.sqrt((rate2).mean()) > 0.02
    columns = [0, 1, 2, 3] if turns else [0, 3]
    for _ in range(4):
        a = design[used][:, columns]
        solution, *_ = np.linalg.lstsq(a, z[used], rcond=None)
        left = z - design[:, columns] @ solution
        used = np.abs(left) < 5 * 1.4826 * np.median(np.abs(left)) + 1e-6
    r = left[used]
    inverse = np.linalg.inv((a.conj().T @ a))
    rho = np.clip((r[1:] * r[:-1].conj()).sum().real / (np.abs(r) ** 2).sum(), 0, 0.9)
    noise2 = (np.abs(r) ** 2).sum() / 2 / (len(r) - len(columns)) * (1 + rho) / (1 - rho)  # per real part
    angles, sigmas = [], []
    for column in range(2 if turns else 1):
        c = solution[column]
        angles.append(np.angle(c))
        sigmas.append(np.sqrt(noise2 * inverse[column, column].real) / max(abs(c), 1e-9))
    if abs(solution[0]) < 0.3 and name != "wheel counts":
        raise Refusal(f"The force follows the acceleration by {abs(solution[0]):.2f} only, so this is no speed of this IMU.", how)
    alpha, sigma = angles[0], sigmas[0]
    if turns:
        apart = np.angle(np.exp(1j * (angles[1] - angles[0])))
        both = np.hypot(*sigmas)
        part.notes.append(f"forward by acceleration and by curves: {np.degrees(apart):+.2f} deg apart (1 sigma {np.degrees(both):.2f})")
        w = np.array([1 / sigmas[0] ** 2, 1 / sigmas[1] ** 2])
        alpha, sigma = alpha + apart * w[1] / w.sum(), 1 / np.sqrt(w.sum())
        sigma *= max(1.0, abs(apart) / both)  # both disagree: neither is preferred
        part.notes.append(f"arm from the axle to the sensor, not corrected: {(solution[2] * np.exp(-1j * alpha)).real:.2f} m forward, "
                          f"{(solution[2] * np.exp(-1j * alpha)).imag:.2f} m left")
    if sigma > MOST_YAW_RAD:
        raise Refusal(f"The direction of forward comes out to {np.degrees(sigma):.1f} deg only (1 sigma).", how)
    forward = e1 * np.cos(alpha) + e2 * np.sin(alpha)
    rotation = np.stack([forward, np.cross(up, forward), up])
    sd = np.array([sigma_tilt, sigma_tilt, sigma])
    # d R = -[d theta]x R: each element moves with the two rotations that are not about its row's axis
    spread = np.sqrt(np.stack([(sd[2] * rotation[1]) ** 2 + (sd[1] * rotation[2]) ** 2, (sd[2] * rotation[0]) ** 2 + (sd[0] * rotation[2]) ** 2,
                               (sd[1] * rotation[0]) ** 2 + (sd[0] * rotation[1]) ** 2]))
    roll, yaw = np.arctan2(rotation[2, 1], rotation[2, 2]), np.arctan2(rotation[1, 0], rotation[0, 0])
    pitch = np.arcsin(np.clip(-rotation[2, 0], -1, 1))
    part.add("sensor in the body:", np.degrees([roll, pitch, yaw]), np.degrees(sd), "deg", "", ("roll", "pitch", "yaw"))
    part.add("mounting_bs, body axis by sensor axis:", rotation, spread, "1", "inertial.mounting_bs",
             tuple(f"{b}{s}" for b in AXES for s in AXES))
    plain = np.stack([force[:, 0], force[:, 1]], axis=1)
    body = force @ rotation.T
    gain_x, gain_y = abs(solution[0]), abs(solution[1]) if turns else 0.0
    steady = body[:, :2] - np.median(body[:, :2], axis=0)
    model = np.stack([gain_x * acceleration, gain_y * lateral], axis=1)
    before = plain - np.median(plain, axis=0) - model
    part.residual(f"horizontal force against {name}, {len(z)} pieces of {PIECE_S:g} s", np.sqrt((before[used] ** 2).mean()),
                  np.sqrt(((steady - model)[used] ** 2).mean()), "m/s2")

    def draw(axes):
        for values, colour, label in ((plain - np.median(plain, axis=0), "#e69f00", "before"), (steady, "#0072b2", "after")):
            axes.plot(gain_x * acceleration, values[:, 0], ".", ms=4, color=colour, label=f"along x, {label}")
        ends = np.array([acceleration.min(), acceleration.max()]) * gain_x
        axes.plot(ends, ends, color="#3c3c3c", lw=1)
        axes.set(xlabel=f"acceleration by {name} [m/s2]", ylabel="specific force along x [m/s2]")

    part.draw = draw
