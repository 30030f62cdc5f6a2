# SPDX-License-Identifier: Apache-2.0
"""Mounting of the camera: the rotation from its axes (z along the view, x right, y down) to the body's, of a drive with turns.

A point keeps its bearings f1, f2 on one plane with the displacement b of the camera between two images (Hartley, Zisserman 2004, 9.6):

    e = b . (M f1 x R M f2) = 0,    b = p + R l - l

M: the mounting; R, p: turn by the gyroscope and displacement by the wheels; l: position of the camera. Turns about the body's axes show two angles of
M, the direction of the displacement the third. Each e is divided by its own slope along the four pixels (Sampson), so it is in pixels; least squares
with Cauchy's weights over M and the gyroscope's bias. The bias has a prior. The jackknife over ten parts of the drive (Efron, Stein 1981) widens the
1 sigma.
"""
import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tetap.calibrate.drive import Run
from tetap.calibrate.robot_numbers import Part, Refusal

APART_S = 0.4           # between the two images of a pair
LEAST_DISTANCE_M = 0.1  # of the camera between them
LEAST_FEATURES = 500    # in all pairs
MOST_SIGMA_RAD = 0.003  # with more it is refused
MOST_PX = 3.0           # RMS of the weighted residuals; with more these are no images of this drive
MOST_STEP_RAD = 0.35    # from the stated mounting
BIAS_RADPS = 0.005      # 1 sigma of the bias before the images
NOISE_PX = 1.5          # scale of Cauchy's weights
BLOCKS = 10
HOW = "three minutes of driving with curves to both sides, and what stands still in the images"


class Pairs:
    """Features of two images each: bearings (n, 3), turn vector [rad], duration [s] and displacement [m] of the body between them."""

    def __init__(self, log, run, camera, axes):
        self.camera, self.axes, images = camera, axes, log.images
        clock = np.append(log.imu.t[0] - log.imu.dt[0], log.imu.t)
        angle = np.vstack([np.zeros(3), np.cumsum(log.imu.angle @ axes.T, axis=0)])
        path = np.append(0, np.cumsum(run.forward))

        def turned(t):
            return np.stack([np.interp(t, clock, angle[:, i]) for i in range(3)], axis=-1)

        first, second, turn, displacement, span, t = [], [], [], [], [], []
        begin, end = run.t[0], run.t[-1]
        i = 0
        while i < len(images):
            j = int(np.searchsorted(images.t, images.t[i] + APART_S - 0.02))
            if j >= len(images):
                break
            if images.t[j] - images.t[i] < 2 * APART_S and begin < images.t[i] and images.t[j] < end:
                steps = np.linspace(images.t[i], images.t[j], 21)
                moved = np.diff(np.interp(steps, run.t, path))
                middle = turned(0.5 * (steps[1:] + steps[:-1])) - turned(steps[0])
                p = (Rotation.from_rotvec(middle).apply([1.0, 0.0, 0.0]) * moved[:, None]).sum(axis=0)
                _, a, b = np.intersect1d(images.track[i], images.track[j], return_indices=True)
                if np.abs(moved).sum() >= LEAST_DISTANCE_M and len(a):
                    first.append(images.pixel[i][a])
                    second.append(images.pixel[j][b])
                    for rows, value in ((turn, turned(steps[-1]) - turned(steps[0])), (displacement, p), (span, steps[-1] - steps[0]), (t, steps[0])):
                        rows.append(np.broadcast_to(value, (len(a), *np.shape(value))))
            i = j
        count = sum(map(len, first))
        if count < LEAST_FEATURES:
            raise Refusal(f"{count} features were followed for {APART_S:g} s while the robot drove, {LEAST_FEATURES} are needed.", HOW)
        self.first, self.second = (self._bearings(np.concatenate(rows)) for rows in (first, second))
        self.turn, self.displacement, self.span, self.t = (np.concatenate(rows) for rows in (turn, displacement, span, t))

    def _bearings(self, pixel):
        fu, fv, cu, cv = self.camera["pinhole"]
        return np.stack([(pixel[:, 0] - cu) / fu, (pixel[:, 1] - cv) / fv, np.ones(len(pixel))], axis=1)

    def residuals(self, x):
        """Of the turn x[:3] of the mounting, in the body's axes, and of the bias x[3:], in pixels (n)."""
        mounting = Rotation.from_rotvec(x[:3]).as_matrix() @ self.camera["mounting"]
        turn = Rotation.from_rotvec(self.turn - x[3:] * self.span[:, None])
        b = self.displacement + turn.apply(self.camera["position"]) - self.camera["position"]
        one, two = self.first @ mounting.T, turn.apply(self.second @ mounting.T)
        to_one, to_two = np.cross(two, b), np.cross(b, one)  # e = one . to_one = two . to_two
        fu, fv = self.camera["pinhole"][:2]
        back = turn.inv().apply(to_two)
        slope = [(to_one @ mounting[:, 0]) / fu, (to_one @ mounting[:, 1]) / fv, (back @ mounting[:, 0]) / fu, (back @ mounting[:, 1]) / fv]
        return (one * to_one).sum(axis=1) / np.maximum(np.sqrt(np.square(slope).sum(axis=0)), 1e-9)


def camera_of(robot):
    """{pinhole (fu, fv, cu, cv) [px], mounting (3, 3), position [m]} as the robot has them."""
    pinhole = [robot.rows[f"camera.{name}"]["value"] for name in ("fu_px", "fv_px", "cu_px", "cv_px")]
    if not robot.name or not min(pinhole[:2]) > 0:
        raise Refusal("The robot has no camera (camera.fu_px).", "the same with --robot, the name of a robot with a camera")
    return {"pinhole": pinhole, "mounting": robot.now("camera.mounting_bc").reshape(3, 3), "position": robot.now("camera.position_b_m")}


def camera(log, up, robot):
    """`up` in the IMU's axes."""
    part = Part("camera", "camera: bearings of followed features against gyroscope and wheels")
    for samples, what in ((log.images, "images (In_Feature, In_Image)"), (log.imu, "gyroscope (In_Imu<n>Gyro, Accel, Time)"),
                          (log.wheels, "wheels (In_WheelCounts, In_WheelSpeed or In_BodySpeed)")):
        if samples is None:
            raise Refusal(f"The log has no {what}.", HOW)
    stated = camera_of(robot)
    pairs = Pairs(log, Run(log, up, robot), stated, robot.now("inertial.mounting_bs").reshape(3, 3))

    def cost(x):
        return np.concatenate([pairs.residuals(x), NOISE_PX * x[3:] / BIAS_RADPS])

    found = least_squares(cost, np.zeros(6), loss="cauchy", f_scale=NOISE_PX, x_scale=[0.01] * 3 + [0.001] * 3)
    left = pairs.residuals(found.x)
    weight = 1 / (1 + (left / NOISE_PX) ** 2)
    noise_px = float(np.sqrt((weight * left**2).sum() / weight.sum()))
    usable = float(np.mean(np.abs(left) < 3 * NOISE_PX))
    if noise_px > MOST_PX or usable < 0.5 or np.linalg.norm(found.x[:3]) > MOST_STEP_RAD:
        raise Refusal(f"{100 * usable:.0f} % of the features fit the turns and the distance, under a camera that is "
                      f"{np.degrees(np.linalg.norm(found.x[:3])):.0f} deg off; tetap-doctor names a camera that is turned, mirrored or late.", HOW)
    sigma = _sigma(pairs, found.x, left, weight, noise_px)
    if sigma[:3].max() > MOST_SIGMA_RAD:
        axis = ("roll", "pitch", "yaw")[int(sigma[:3].argmax())]
        raise Refusal(f"The {axis} of the camera comes out to {1e3 * sigma[:3].max():.1f} mrad only (1 sigma), {1e3 * MOST_SIGMA_RAD:g} are needed.", HOW)
    turn = Rotation.from_rotvec(found.x[:3]).as_matrix()
    rotation = turn @ stated["mounting"]
    part.add("turned in the body, from what is stated:", np.degrees(found.x[:3]), np.degrees(sigma[:3]), "deg", "", ("roll", "pitch", "yaw"))
    # d M = [d theta]x M: the rows move with the two angles that are not about their axis.
    spread = np.sqrt(np.stack([(sigma[i] * rotation[j]) ** 2 + (sigma[j] * rotation[i]) ** 2 for i, j in ((1, 2), (2, 0), (0, 1))]))
    part.add("mounting_bc, body axis by camera axis:", rotation, spread, "1", "camera.mounting_bc", tuple(f"{b}{c}" for b in "xyz" for c in "xyz"), digits=8)
    before = pairs.residuals(np.zeros(6))
    part.residual(f"median distance from the epipolar line, {len(left)} features", np.median(np.abs(before)), np.median(np.abs(left)), "px")

    def draw(axes):
        for values, colour, label in ((before, "#e69f00", "before"), (left, "#0072b2", "after")):
            axes.hist(values, np.linspace(-12, 12, 97), histtype="step", color=colour, label=label)
        axes.set(xlabel="distance from the epipolar line [px]", ylabel="features")

    part.draw = draw
    return part


def _sigma(pairs, x, left, weight, noise_px):
    """1 sigma of mounting and bias [rad, rad/s]: of the noise, or by the parts of the drive where that is more."""
    steps = np.array([1e-5] * 3 + [1e-6] * 3)
    jacobian = np.stack([(pairs.residuals(x + d) - pairs.residuals(x - d)) / (2 * step) for d, step in zip(np.diag(steps), steps)], axis=1)
    prior = np.diag([0.0] * 3 + [(NOISE_PX / BIAS_RADPS) ** 2] * 3)
    block = np.minimum(BLOCKS * (pairs.t - pairs.t[0]) / max(pairs.t[-1] - pairs.t[0], 1e-9), BLOCKS - 1).astype(int)
    weighted = jacobian * weight[:, None]
    information = np.stack([weighted[block == k].T @ jacobian[block == k] for k in range(BLOCKS)])
    gradient = np.stack([weighted[block == k].T @ left[block == k] for k in range(BLOCKS)])
    whole = information.sum(axis=0) + prior
    without = np.array([-np.linalg.solve(whole - mine, gradient.sum(axis=0) - its) for mine, its in zip(information, gradient)])
    jackknife = np.sqrt((BLOCKS - 1) / BLOCKS * np.square(without - without.mean(axis=0)).sum(axis=0))
    return np.maximum(jackknife, noise_px * np.sqrt(np.diag(np.linalg.inv(whole))))
