# SPDX-License-Identifier: Apache-2.0
"""Attitudes as quaternions (w, x, y, z) in rows: products, the turn between two, and the attitude between two epochs."""
import numpy as np


def wrapped(angle_rad):
    return np.mod(angle_rad + np.pi, 2 * np.pi) - np.pi


def product(p, q):
    """Hamilton products of the rows of p and q."""
    (a, b, c, d), (w, x, y, z) = p.T, q.T
    return np.stack([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], axis=1)


def turns(q, reference):
    """The turn from `reference` to `q` about east, north and up: rotation vectors of q reference*."""
    d = product(q, reference * [1, -1, -1, -1])
    d = d * np.where(d[:, :1] < 0, -1.0, 1.0) / np.linalg.norm(d, axis=1, keepdims=True)
    length = np.linalg.norm(d[:, 1:], axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return d[:, 1:] * np.where(length > 1e-9, 2 * np.arctan2(length, d[:, :1]) / length, 2.0)


def quaternion(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll), as the world has it."""
    def about(axis, angle):
        q = np.zeros((len(angle), 4))
        q[:, 0], q[:, 1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
        return q
    return product(product(about(2, yaw), about(1, pitch)), about(0, roll))


def apart(q, reference):
    """(tilt, heading) from `reference` to `q`."""
    d = product(q, reference * [1, -1, -1, -1])
    tilt = 2 * np.arctan2(np.hypot(d[:, 1], d[:, 2]), np.hypot(d[:, 0], d[:, 3]))
    return tilt, wrapped(2 * np.arctan2(d[:, 3], d[:, 0]))


def attitudes_at(epoch, q, at, longest):
    """Quaternions between those before and after each of `at`, along the chord; NaN outside of them and where they are more than `longest` apart."""
    if len(epoch) < 2:
        return np.full((len(at), 4), np.nan)
    after = np.clip(np.searchsorted(epoch, at), 1, len(epoch) - 1)
    before = after - 1
    span = epoch[after] - epoch[before]
    part = ((at - epoch[before]) / span)[:, None]
    first, last = q[before], q[after]
    last = last * np.where((first * last).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    between = (1 - part) * first + part * last
    inside = (at >= epoch[0]) & (at <= epoch[-1]) & (span <= longest)
    return np.where(inside[:, None], between / np.linalg.norm(between, axis=1, keepdims=True), np.nan)
