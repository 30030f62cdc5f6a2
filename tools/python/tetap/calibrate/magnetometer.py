# SPDX-License-Identifier: Apache-2.0
"""Magnetometer: hard and soft iron from a log in which the robot was turned through many attitudes.

The field is the same everywhere, so the readings lie on an ellipsoid: m = S^-1 u F + h. Start: algebraic ellipsoid fit (Q. Li, J. Griffiths,
"Least squares ellipsoid specific fitting", GMP 2004); then |S (m - h)| = F by maximum likelihood (Gebre-Egziabher, Elkaim, Powell, Parkinson,
"Calibration of strapdown magnetometers in magnetic field domain", J. Aerosp. Eng. 19(2), 2006). S is symmetric with determinant 1: a rotation and the
strength of the field do not show in an ellipsoid.

Readings are gathered in cells of direction, so that a place where the sensor lay for a minute does not count more than one it passed.
"""
import numpy as np
from scipy.linalg import eig

from tetap.calibrate.robot_numbers import Part, Refusal

AXES = ("x", "y", "z")
CELLS = 240
LEAST_CELLS = 40        # least number of cells with a sample
MOST_HARD, MOST_SOFT = 0.03, 0.03  # 1 sigma, or residual that lasts, as a share of the field: with more the number is refused
LEAST_SPREAD = 0.04     # smallest eigenvalue of the directions' covariance; 1/3 when all directions are there
OUTLIER = 5.0           # times the scatter


def _sphere(count):
    """Evenly spread directions (A. Gonzalez, "Measurement of areas on a sphere using Fibonacci and latitude-longitude lattices", 2010)."""
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    angle = np.pi * (1 + 5**0.5) * k
    return np.stack([np.sqrt(1 - z**2) * np.cos(angle), np.sqrt(1 - z**2) * np.sin(angle), z], axis=1)


def _ellipsoid(m):
    """Centre and symmetric matrix A with (m - c)^T A (m - c) = 1 (Li and Griffiths, k = 4), or None when it is none."""
    middle, size = m.mean(axis=0), np.abs(m - m.mean(axis=0)).max()
    x, y, z = ((m - middle) / size).T
    d = np.stack([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y, 2 * x, 2 * y, 2 * z, np.ones_like(x)], axis=1)
    scatter = d.T @ d
    c1 = np.zeros((6, 6))
    c1[:3, :3] = 1 - 2 * np.eye(3)
    c1[3:, 3:] = -4 * np.eye(3)
    s11, s12, s22 = scatter[:6, :6], scatter[:6, 6:], scatter[6:, 6:]
    if np.linalg.cond(s22) > 1e12:
        return None
    values, vectors = eig(np.linalg.solve(c1, s11 - s12 @ np.linalg.solve(s22, s12.T)))
    best = vectors[:, np.argmax(values.real)].real
    v = np.concatenate([best, -np.linalg.solve(s22, s12.T @ best)])
    a = np.array([[v[0], v[5], v[4]], [v[5], v[1], v[3]], [v[4], v[3], v[2]]])
    if np.linalg.cond(a) > 1e6:
        return None
    centre = -np.linalg.solve(a, v[6:9])
    level = centre @ a @ centre - v[9]
    a = a / level
    if not np.isfinite(a).all() or np.linalg.eigvalsh(a).min() <= 0:
        return None
    return centre * size + middle, a / size**2


def _soft(p):
    return np.array([[p[3], p[6], p[7]], [p[6], p[4], p[8]], [p[7], p[8], p[5]]])


def _rows(m, p):
    """|S (m - h)| - 1 with its derivatives by (h, S), S here with the field in it."""
    s, away = _soft(p), m - p[:3]
    true = away @ s
    size = np.linalg.norm(true, axis=1)
    u = true / size[:, None]
    a, b, c = away.T
    jacobian = np.concatenate([-(u @ s), np.stack([u[:, 0] * a, u[:, 1] * b, u[:, 2] * c, u[:, 0] * b + u[:, 1] * a,
                                                   u[:, 0] * c + u[:, 2] * a, u[:, 1] * c + u[:, 2] * b], axis=1)], axis=1)
    return size - 1, jacobian, u


def _lasting(r):
    """Scatter of the residuals less that from one sample to the next: noise is new in each sample, another field is not."""
    noise = 1.4826 * np.median(np.abs(np.diff(r))) / 2**0.5
    return max(0.0, np.var(r) - noise**2) ** 0.5


def magnetometer(log):
    part = Part("mag", "magnetometer: one field strength in all attitudes")
    how = "30 s or more of turning the robot by hand through all attitudes (each face up, each face north), away from iron"
    if log.mag is None:
        raise Refusal("The log has no magnetometer samples (In_Mag).", how)
    m = log.mag.flux
    if len(m) < 100:
        raise Refusal(f"{len(m)} magnetometer samples, 100 are needed.", how)
    extent = np.sqrt(np.linalg.eigvalsh(np.cov(m.T)))
    strength = np.median(np.linalg.norm(m, axis=1))
    flat = (f"The magnetometer's readings spread over {2 * extent[2]:.1f} x {2 * extent[1]:.1f} x {2 * extent[0]:.1f} uT of a field of about "
            f"{strength:.0f} uT: "
            "not enough attitudes for an ellipsoid.")
    if extent[0] < 0.1 * strength and extent[2] < 0.3 * strength:
        raise Refusal(flat, how)
    start = _ellipsoid(m)
    if start is None:
        raise Refusal(flat, how)
    values, vectors = np.linalg.eigh(start[1])
    s = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    p = np.concatenate([start[0], [s[0, 0], s[1, 1], s[2, 2], s[0, 1], s[0, 2], s[1, 2]]])
    cells = _sphere(CELLS)
    keep = np.ones(len(m), dtype=bool)
    covariance, u, index = None, None, None
    for _ in range(30):
        r, jacobian, u = _rows(m, p)
        if not np.isfinite(r).all():
            raise Refusal(flat, how)
        scatter = 1.4826 * np.median(np.abs(r - np.median(r))) + 1e-4
        keep = np.abs(r - np.median(r)) < OUTLIER * scatter
        _, index, count = np.unique(np.argmax(u[keep] @ cells.T, axis=1), return_inverse=True, return_counts=True)
        if len(count) < LEAST_CELLS:
            break

        def mean(values):
            return np.bincount(index, values) / count

        rc = mean(r[keep])
        jc = np.stack([mean(jacobian[keep, column]) for column in range(9)], axis=1)
        within = ((r[keep] - rc[index]) ** 2).sum() / max(keep.sum() - len(count), 1)
        between = max(0.0, (rc**2).sum() / max(len(count) - 9, 1) - (within / count).mean())
        weight = 1 / (within / count + between)
        normal = jc.T * weight @ jc
        balance = 1 / np.sqrt(np.diag(normal))
        covariance = np.linalg.pinv(normal * np.outer(balance, balance), rcond=1e-12) * np.outer(balance, balance)
        step = -covariance @ (jc.T * weight @ rc)
        p = p + step
        if np.abs(step / np.sqrt(np.diag(covariance))).max() < 1e-3:
            break
    centred = u[keep][np.unique(index, return_index=True)[1]]  # one direction of each cell
    if len(centred) < LEAST_CELLS:
        raise Refusal(f"The field was seen from {len(centred)} of {CELLS} directions, {LEAST_CELLS} are needed: "
                      "not enough attitudes for an ellipsoid.", how)
    spread, axes = np.linalg.eigh(np.cov(centred.T))
    if spread[0] < LEAST_SPREAD:
        raise Refusal(f"The field was seen from {len(centred)} of {CELLS} directions, too few of them along "
                      f"{AXES[int(np.argmax(np.abs(axes[:, 0])))]} (spread {spread[0]:.3f} of 0.333): not enough attitudes for an ellipsoid.", how)
    s = _soft(p)
    if np.linalg.eigvalsh(s).min() <= 0:
        raise Refusal("The readings do not lie on an ellipsoid.", how)
    field = np.linalg.det(s) ** (-1 / 3)

    def unit(q):
        matrix = _soft(q)
        size = np.linalg.det(matrix) ** (-1 / 3)
        return np.append((matrix * size).ravel(), size)

    steps = np.sqrt(np.diag(covariance)) * 1e-2
    to_unit = np.stack([(unit(p + d) - unit(p - d)) / (2 * step) for d, step in zip(np.diag(steps), steps)], axis=1)
    soft_sigma = np.sqrt(np.diag(to_unit @ covariance @ to_unit.T))
    hard_sigma = np.sqrt(np.diag(covariance))[:3]
    if hard_sigma.max() > MOST_HARD * field or soft_sigma[:9].max() > MOST_SOFT:
        raise Refusal(f"Hard iron comes out to {hard_sigma.max():.1f} uT and soft iron to {soft_sigma[:9].max():.3f} only (1 sigma).", how)
    lasting = _lasting(_rows(m, p)[0][keep])
    if lasting > MOST_HARD:
        raise Refusal(f"The field moves: on the best ellipsoid the readings are off by {lasting * field:.1f} of {field:.1f} uT for longer than a sample. "
                      "A motor, a current or iron near the sensor adds a field of its own.", "the same with motors and loads off, or with a constant current")
    part.add("hard iron", p[:3], hard_sigma, "uT", "magnetic.hard_iron_uT", AXES, 4)
    part.add("soft iron: m = S (raw - hard)", s * field, soft_sigma[:9], "1", "magnetic.soft_iron", tuple(a + b for a in AXES for b in AXES))
    part.add("field strength", field, soft_sigma[9], "uT", "magnetic.norm_uT")
    raw, fitted = np.linalg.norm(m, axis=1), np.linalg.norm((m - p[:3]) @ (s * field), axis=1)
    part.residual(f"|m| - its median, {keep.sum()} samples", (raw[keep] - np.median(raw[keep])).std(), (fitted[keep] - field).std(), "uT")
    if not keep.all():
        part.notes.append(f"{np.count_nonzero(~keep)} of {len(m)} samples left out as disturbed")
    part.notes.append("a rotation of the magnetometer against the IMU does not show in an ellipsoid, nor does the strength of the field: "
                      "S has determinant 1")

    def draw(axes):
        t = log.mag.t
        axes.plot(t, raw, ".", ms=2, color="#e69f00", label="before")
        axes.plot(t, fitted, ".", ms=2, color="#0072b2", label="after")
        axes.set(xlabel="time [s]", ylabel="|m| [uT]")

    part.draw = draw
    return part
