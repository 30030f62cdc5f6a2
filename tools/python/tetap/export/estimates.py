# SPDX-License-Identifier: Apache-2.0
"""Estimates of a node as poses, velocities and covariances in the frames of REP-103 and REP-105.

The map frame is ENU, the body x forward, y left, z up, so nothing has to be turned but velocities: the node states them along the map's axes, a
twist is along the body's. A page that does not come in every epoch holds until it comes again.
"""
import numpy as np

UNKNOWN = 1e6  # variance of what the node does not state, in m2, rad2 and their squares by s
KINDS_OF_ODOMETRY = ("Odometry", "ScanOdometry")  # continuous and not bound to the map: frame odom of REP-105
INSTANCES = 4


def held(clock, page, field, epochs):
    """Values of a page's field at these epochs: the last that was sent up to each, NaN before the first behind a power-on."""
    if not len(page):
        return np.full(len(epochs), np.nan)
    of = clock.index(page.at)
    last = np.searchsorted(of, epochs, side="right") - 1
    known = (last >= 0) & (of[np.maximum(last, 0)] >= clock.power_on(epochs))
    return np.where(known, page[field][np.maximum(last, 0)].astype(float), np.nan)


def matrix(q):
    """Rotation matrices of unit quaternions, n x 4 as w, x, y, z."""
    w, x, y, z = q.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def multiply(a, b):
    """Products of quaternions, n x 4 as w, x, y, z."""
    (aw, ax, ay, az), (bw, bx, by, bz) = a.T, b.T
    return np.stack([aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
                     aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw], axis=1)


def about_up(yaw):
    return np.stack([np.cos(yaw / 2), np.zeros(len(yaw)), np.zeros(len(yaw)), np.sin(yaw / 2)], axis=1)


class Estimate:
    """One estimator, at each of its epochs that has a position: `time_us`, `position` [m] and `q`, body in map, and `pose_covariance` n x 6 x 6 of
    x, y, z and turns about the map's x, y, z; `linear`, `angular` [m/s, rad/s] along the body's axes, and their `twist_covariance`."""

    def __init__(self, messages, clock, instance):
        def page(message, name=None):
            key = f"Est{instance}_{message}"
            return messages[key, name] if name else messages[key]

        position = page("Pos")
        self.instance, self.kind = instance, position.names("Kind")[-1] if len(position) else ""
        self.is_odometry = self.kind in KINDS_OF_ODOMETRY
        number = clock.index(position.at)
        bound = held(clock, page("Motion"), "PosValid", number) > 0
        use = (number >= 0) & np.isfinite(position.X) & np.isfinite(position.Y) & (bound | self.is_odometry)
        self.epoch = epoch = number[use]
        self.time_us = clock.epochs[epoch] if len(epoch) else np.zeros(0, np.int64)

        def at(message, name, field, unknown=np.nan):
            value = held(clock, page(message, name), field, epoch)
            return np.where(np.isnan(value), unknown, value)

        self.speed, self.yaw_rate = at("Motion", None, "Speed", 0.0), at("Motion", None, "YawRate", 0.0)
        self.position = np.stack([position.X[use], position.Y[use], at("State", "Height", "Height", 0.0)], axis=1)
        self.q = self._attitude(page("Att"), page("Motion"), clock)
        self.pose_covariance = self._pose_covariance(at)
        self._velocity(at)

    def __len__(self):
        return len(self.epoch)

    def _attitude(self, attitude, motion, clock):
        """The published attitude, turned about up by what the heading has changed since; where there is none, level and of that heading."""
        yaw = np.nan_to_num(held(clock, motion, "Yaw", self.epoch))
        if not len(attitude):
            return about_up(yaw)
        sent = clock.index(attitude.at)
        last = np.searchsorted(sent, self.epoch, side="right") - 1
        q = np.stack([attitude[axis][np.maximum(last, 0)] for axis in "WXYZ"], axis=1)
        known = (last >= 0) & (sent[np.maximum(last, 0)] >= clock.power_on(self.epoch)) & np.isfinite(q).all(axis=1)
        q = np.where(known[:, None], q, (1, 0, 0, 0))
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        ahead = np.arctan2(2 * (q[:, 0] * q[:, 3] + q[:, 1] * q[:, 2]), 1 - 2 * (q[:, 2] ** 2 + q[:, 3] ** 2))
        return multiply(about_up(yaw - ahead), q)

    def _pose_covariance(self, at):
        """P_ij = CorrIJ StdI StdJ over x, y, z and the turns about east, north and up. Correlations that are not published are 0. Where that leaves
        no covariance, those of height and tilt are left out, then all."""
        std = np.stack([at("Std", "Pose", "StdX"), at("Std", "Pose", "StdY"), at("State", "Height", "StdHeight"),
                        at("State", "StdTilt", "StdTiltEast"), at("State", "StdTilt", "StdTiltNorth"), at("Std", "Pose", "StdYaw")], axis=1)
        missing = np.isnan(std)
        std = np.where(missing, np.sqrt(UNKNOWN), std)
        planar = {(0, 1): at("Std", "Pose", "CorrXY", 0.0), (0, 5): at("Std", "More", "CorrXYaw", 0.0), (1, 5): at("Std", "More", "CorrYYaw", 0.0)}
        further = {(0, 2): at("State", "CorrPos", "CorrXZ", 0.0), (1, 2): at("State", "CorrPos", "CorrYZ", 0.0),
                   (3, 4): at("State", "CorrTilt", "CorrTiltEN", 0.0), (3, 5): at("State", "CorrTilt", "CorrTiltEYaw", 0.0),
                   (4, 5): at("State", "CorrTilt", "CorrTiltNYaw", 0.0)}

        def filled(pairs):
            matrices = np.tile(np.eye(6), (len(self), 1, 1))
            for (i, j), value in pairs.items():
                matrices[:, i, j] = matrices[:, j, i] = np.where(missing[:, i] | missing[:, j], 0.0, value)
            return matrices
        correlation = filled({**planar, **further})
        for fewer in (planar, {}):
            wrong = np.linalg.eigvalsh(correlation)[:, 0] < 0
            correlation[wrong] = filled(fewer)[wrong]
        return correlation * std[:, :, None] * std[:, None, :]

    def _velocity(self, at):
        """The twist. Forward speed and its variance are the node's own; the two others are its velocity turned into the body, the attitude taken as
        exact. Where it states none, they are 0 and unknown, as are the rates of roll and pitch."""
        count = len(self)
        self.linear, self.angular = np.zeros((count, 3)), np.zeros((count, 3))
        covariance = np.tile(np.eye(6) * UNKNOWN, (count, 1, 1))
        to_body = matrix(self.q).transpose(0, 2, 1)
        velocity = np.stack([at("Vel", None, axis) for axis in ("East", "North", "Up")], axis=1)
        known = np.isfinite(velocity).all(axis=1)
        self.linear[known] = (to_body[known] @ velocity[known, :, None])[:, :, 0]
        self.linear[:, 0], self.angular[:, 2] = self.speed, self.yaw_rate
        std = np.stack([at("State", "StdVel", f"StdVel{axis}") for axis in ("East", "North", "Up")], axis=1)
        correlation = np.tile(np.eye(3), (count, 1, 1))
        for (i, j), name in {(0, 1): "EN", (0, 2): "EU", (1, 2): "NU"}.items():
            correlation[:, i, j] = correlation[:, j, i] = at("State", "CorrVel", f"CorrVel{name}", 0.0)
        stated = known & np.isfinite(std).all(axis=1)
        block = correlation * np.nan_to_num(std)[:, :, None] * np.nan_to_num(std)[:, None, :]
        covariance[stated, :3, :3] = to_body[stated] @ block[stated] @ to_body[stated].transpose(0, 2, 1)
        forward, turning = at("Std", "More", "StdSpeed"), at("Std", "More", "StdYawRate")
        scale = np.sqrt(np.divide(forward ** 2, covariance[:, 0, 0], out=np.zeros(count), where=covariance[:, 0, 0] > 0))
        scale = np.where(np.isfinite(forward), scale, 1.0)
        covariance[:, 0, :] *= scale[:, None]
        covariance[:, :, 0] *= scale[:, None]
        covariance[:, 5, 5] = np.where(np.isfinite(turning), turning ** 2, UNKNOWN)
        self.twist_covariance = covariance


def estimates(messages, clock):
    """The estimators with a position, the primary one last: a node's last instance is its primary."""
    found = [Estimate(messages, clock, k) for k in range(INSTANCES) if f"Est{k}_Pos" in messages]
    return [one for one in found if len(one) and one.kind != "Attitude"]
