# SPDX-License-Identifier: Apache-2.0
"""Wheels: radius of left and right, their difference, track width, from a drive with GNSS and the gyroscope (method: fit.py)."""
import numpy as np

from tetap.calibrate.drive import WINDOW_S, Run
from tetap.calibrate.fit import LEAST_DISTANCE_M, Fit
from tetap.calibrate.robot_numbers import Part, Refusal

LEAST_TURN_RAD = 2 * np.pi
MOST_SCALE, MOST_TRACK, MOST_DIFFERENCE = 0.02, 0.05, 0.02  # 1 sigma, relative: with more the number is refused


def wheels(log, up, robot, bias=None):
    """`up` in the IMU's axes; `bias` of the gyroscope there, if the log rests."""
    part = Part("wheels", "wheels: radius, difference, track from GNSS and the gyroscope")
    how = "ten minutes of driving with a GNSS fix under open sky: straights, and curves to both sides"
    for samples, what in ((log.wheels, "wheels (In_WheelCounts, In_WheelSpeed or In_BodySpeed)"),
                          (log.gnss, "GNSS position (In_GnssLat, Lon, Alt, Acc)"),
                          (log.imu, "gyroscope (In_Imu<n>Gyro, Accel, Time)")):
        if samples is None:
            raise Refusal(f"The log has no {what}.", how)
    run = Run(log, up, robot)
    fit = Fit(run, log.gnss, log.velocity, robot, None if bias is None else float(bias @ up))
    extent = np.abs(fit.fix - np.median(fit.fix)).max()
    if fit.distance * (1 + fit.p[fit.names.index("mean")]) < LEAST_DISTANCE_M or extent < 3 * fit.accuracy:
        raise Refusal(f"It moves {fit.distance:.0f} m, and {extent:.0f} m away, too little for fixes of {fit.accuracy:.1f} m "
                      f"({LEAST_DISTANCE_M:g} m at least).", how)
    fit.solve()
    part.notes += run.notes
    if fit.frozen:
        part.notes.append(f"{fit.frozen} fixes left out that repeat the one before to the last digit while the wheels roll")
    _numbers(part, fit, run, how)
    _state(part, fit, run)
    return part


def _numbers(part, fit, run, how):
    mean = fit.value("mean")
    scaled = mean[1] <= MOST_SCALE
    if not scaled:
        part.refuse("wheel radius", Refusal(f"It comes out to {100 * mean[1]:.1f} % only (1 sigma).", how))
    sides = run.has_turn and run.kind != "body speed"
    difference = fit.value("difference") if run.has_turn else None
    known = run.has_turn and difference[1] <= MOST_DIFFERENCE
    if sides and not known:
        part.refuse("wheel difference", Refusal(f"It comes out to {100 * difference[1]:.1f} % only (1 sigma).", how))
    both = sides and scaled and known
    # What both radii share is known worse than what they differ by: each may be within two sigma and their difference far beyond.
    off = bool(both and run.nominal_known and abs(difference[0]) > 2 * difference[1])
    # A mean that may as well be what it is now stays: to follow it would carry its own error into both radii.
    kept = off and run.kind == "counts" and bool(run.per_turn) and not fit.rescaled and abs(mean[0]) <= 2 * mean[1]
    if off:
        part.notes.append(f"the wheels differ by {abs(difference[0] / difference[1]):.1f} sigma from what the numbers now say: "
                          "left and right are to be changed together")
    if kept:
        part.notes.append(f"their mean is within {abs(mean[0] / mean[1]):.1f} sigma of what it is now and stays in the lines below")
    if run.kind == "body speed" and scaled:
        part.add("true speed over stated speed", *fit.derived(lambda q: 1 + q["mean"]), "1", "wheels.speed_scale")
    elif both:
        # r_left = r0 (1 + mean)(1 + difference/2): difference = (left - right) / mean on top of what is there now
        sign = {"left": 0.5, "right": -0.5}
        for k, side in enumerate(("left", "right")):
            factor = fit.derived(lambda q, side=side: (1 + q["mean"]) * (1 + sign[side] * q["difference"]))
            if run.kind == "counts" and run.per_turn:
                offered = 1 + sign[side] * difference[0] if kept else factor[0]
                part.add(f"{side} wheel radius", run.radius[k] * factor[0], run.radius[k] * factor[1], "m", f"wheels.drive.{side}_radius_m", off=off,
                         offered=run.radius[k] * offered)
            elif run.kind == "counts":
                part.add(f"{side} wheel, metres per count", run.step[k] * factor[0], run.step[k] * factor[1], "m")
            else:
                part.add(f"{side} wheel, true speed over stated speed", *factor, "1", f"wheels.{side}_speed_scale", off=off)
        base = run.step if run.kind == "counts" else np.ones(2)
        total = fit.derived(lambda q: 2 * (base[0] * (1 + q["difference"] / 2) - base[1] * (1 - q["difference"] / 2))
                            / (base[0] * (1 + q["difference"] / 2) + base[1] * (1 - q["difference"] / 2)))
        part.add("wheel difference (left - right)/mean", *total, "1")
        if run.kind == "counts" and not run.per_turn:
            part.notes.append("radius needs the counts per turn of the wheel: --counts-per-turn N, or --robot NAME that has them")
    if not run.has_turn:
        part.refuse("track", Refusal("The wheels say nothing about turning (YawRate not available).", "left and right wheels"))
        return
    sigma_track = fit.value("track")[1]
    if fit.turned < LEAST_TURN_RAD or sigma_track > MOST_TRACK:
        part.refuse("track" if sides else "yaw rate scale", Refusal(
            f"It turns by {np.degrees(fit.turned):.0f} deg in all and the number comes out to {100 * sigma_track:.1f} % (1 sigma).", how))
    elif sides:
        # The gyroscope shows the ratio of radii and track: radii that stay where they are take a track that goes with them.
        stays = fit.value("track")[0] if not kept else (1 + fit.value("track")[0]) / (1 + mean[0]) - 1
        part.add("track width", *fit.derived(lambda q: fit.track0 * (1 + q["track"])), "m", "wheels.drive.track_m", offered=fit.track0 * (1 + stays))
    else:
        part.add("true yaw rate over stated yaw rate", *fit.derived(lambda q: (1 + q["mean"]) / (1 + q["track"])), "1", "wheels.yaw_rate_scale")


def _rms(values):
    return float(np.sqrt((np.abs(values) ** 2).mean()))


def _state(part, fit, run):
    old = fit.before()
    new = fit.residuals
    what = "with the numbers as they are now" if run.nominal_known else "with equal wheels"
    part.residual(f"position, {len(fit.fix)} fixes ({fit.dropped['fix']} left out)", _rms(old[0]), _rms(new[0]), "m")
    part.residual("the same in its own 1 sigma, without the correlation", fit.whitened(fit.mean(old[0], fit.starts), fit.noise[0]),
                  fit.white_rms[0], "1")
    if new[1] is not None:
        part.residual(f"velocity, {len(fit.vel)} fixes ({fit.dropped['velocity']} left out)", _rms(old[1]), _rms(new[1]), "m/s")
    if new[2] is not None:
        unit = "rad" if run.kind == "body speed" else "m"
        part.residual(f"wheels' turn against the gyroscope's, {WINDOW_S:g} s ({fit.dropped['wheel']} slips left out)",
                      _rms(old[2]), _rms(new[2]), unit)
    one = fit.noise[0]
    white = one.white * np.sqrt(len(fit.fix_t) / len(fit.starts))  # sigma of one fix, not of a group's mean
    part.notes.append(f"before: {what}")
    worst = max(((fit.more[fit.names.index(name)], name) for name in ("mean", "difference", "track") if name in fit.names))
    if worst[0] > 1.5:
        part.notes.append(f"parts of the run disagree by {worst[0]:.1f} times what the model explains (wheels that skid?): the 1 sigma holds that")
    part.notes.append(f"GNSS position error found: {white:.2f} m from fix to fix and {one.slow:.2f} m that lasts {one.tau:.0f} s "
                      f"(the receiver says {fit.accuracy:.2f} m)")
    others = []
    for name, text, unit in (("gyro_scale", "gyroscope scale", "1"), ("c_curve", "slip in curves", "s2/m"),
                             ("c_acc", "slip by acceleration", "s2/m"), ("c_side", "side slip", "s"), ("arm_x", "antenna ahead by", "m"),
                             ("arm_y", "antenna left by", "m"), ("delay", "GNSS stamps late by", "s")):
        value, sigma = fit.value(name)
        others.append(f"{text} {value:+.4f} +- {sigma:.4f} {unit}")
    part.notes.append("estimated along: " + "; ".join(others))

    def draw(axes):
        from tetap.report import pictures  # matplotlib takes its time: only when there is something to draw
        t, before, after = pictures.broken_at_gaps(fit.fix_t, fit.fix_t, np.abs(old[0]), np.abs(new[0]))
        axes.plot(t, before, color="#e69f00", lw=1, label="before")
        axes.plot(t, after, color="#0072b2", lw=1, label="after")
        axes.axhline(np.hypot(white, one.slow) * np.sqrt(2), color="#6b6b6b", lw=1, ls=":", label="GNSS found, both axes")
        axes.set(xlabel="time [s]", ylabel="position residual [m]")

    part.draw = draw
    if new[2] is None:
        return

    def draw_turn(axes):
        t = fit.run.t[0] + WINDOW_S * np.arange(1, len(new[2]) + 1)
        per_turn = np.degrees(1 / fit.track0)
        for residual, colour, label in ((old[2], "#e69f00", "before"), (new[2], "#0072b2", "after")):
            axes.plot(t, np.cumsum(np.where(fit.slips, 0.0, residual)) * per_turn, color=colour, lw=1.4, label=label)
        axes.set(xlabel="time [s]", ylabel="heading, wheels' minus\ngyroscope's, no slips [deg]")

    part.draw_more = draw_turn
