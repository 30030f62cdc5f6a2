# SPDX-License-Identifier: Apache-2.0
"""A drive on the clock of the IMU: the way by the wheels, and how far the gyroscope turned."""
import numpy as np

from tetap.calibrate.robot_numbers import Refusal

WINDOW_S = 2.0            # span of one comparison of wheels and gyroscope
SMOOTH_S = 0.1            # half the span over which speed and acceleration are taken
KNOT_S = 60.0             # between two values of the gyroscope's bias
GAP_S, CUT_S = 0.1, 2.0   # holes of the IMU: from the first on the heading may have jumped, at the second the run is cut


class Run:
    """Per IMU sample: travel forward and across, turn, speed and its derivative; windows and bias knots on top."""

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
            raise Refusal(f"The IMU has {len(self.gaps)} gaps of more than {GAP_S:g} s while it drives.",
                          "a log without lost frames (candump -r 8000000)")
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
            per_turn, radius = robot.number("wheels.drive.counts_per_turn"), robot.number("wheels.drive.left_radius_m")
            right = robot.number("wheels.drive.right_radius_m", radius)
            self.nominal_known = None not in (per_turn, radius)
            self.radius = (radius or 0.1, right or 0.1)
            self.per_turn = per_turn
            self.step = 2 * np.pi * np.array(self.radius) / per_turn if per_turn else np.array([1e-3, 1e-3])
            turn = []
            for name, side in (("left", wheels.one), ("right", wheels.two)):
                step = (np.diff(side) + 0x8000) % 0x10000 - 0x8000
                turn.append(np.append(0, np.cumsum(step)))
                leap = np.abs(step) > 0x4000
                if leap.any():
                    row = np.flatnonzero(leap)[0] + 1
                    raise Refusal(f"The {name} counter moves by {abs(step[row - 1]):.0f} counts from one sample to the next "
                                  f"(line {wheels.line[row]}), "
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
        self.track = robot.number("wheels.drive.track_m")
        self.nominal_known &= self.track is not None
        return 0.5 * (left + right), right - left
