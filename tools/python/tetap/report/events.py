# SPDX-License-Identifier: Apache-2.0
"""Events of a run in words, and the warnings about its numbers as a whole."""
import numpy as np

from tetap.report.recorded_run import code_names, fault_spans, faults

MOST_NEES = 100.0  # above this mean, or with more than this share of a sensor rejected, the report warns: no tuning is so far off
MOST_REJECTED, LEAST_TESTED = 1.0 / 3.0, 10
QUIET_S = 2.0  # rejections less than this apart count as one
MISSED_S = 1.0  # a sensor is missed after so long
RESET_WORDS = {"PositionJump": "position moved by", "HeadingWrong": "heading turned by"}


def events(run):
    """Events of a run, sorted: (time, text). Sources: faults of the world, the node's status, refusals of the best estimate."""
    names = code_names()
    found = [(start, f"the world: {name}" + (f", for {end - start:.1f} s" if end > start else "")) for name, start, end in fault_spans(run)]
    status = run.status
    at = status["time_s"]
    for i in np.flatnonzero(np.diff(status["mode"], prepend=np.nan) != 0) if len(at) else []:
        found.append((at[i], f"mode {names['Mode'].get(int(status['mode'][i]), int(status['mode'][i]))}"))
    for column, table, bit in [("faults", "Fault", bit) for bit in range(16)] + [("map_faults", "MapFault", bit) for bit in range(3) if "map_faults" in status]:
        on = np.nan_to_num(status[column]).astype(np.int64) >> bit & 1
        edges = np.flatnonzero(np.diff(on, prepend=0, append=0))
        spans = [[at[a], at[min(b, len(at) - 1)]] for a, b in zip(edges[::2], edges[1::2])]
        for start, end in joined(spans, QUIET_S):
            found.append((start, f"fault {names[table].get(bit, f'bit {bit}')}, for {end - start:.1f} s"))
    for bit, sensor in names["Sensor"].items():
        used = np.nan_to_num(status["used"]).astype(np.int64) >> bit & 1
        if not used.any():
            continue
        first = int(np.argmax(used))
        edges = first + np.flatnonzero(np.diff(used[first:]) != 0)  # down, up, down, ...
        edges = np.append(edges, len(at) - 1) if len(edges) % 2 else edges
        for a, b in zip(edges[::2], edges[1::2]):
            if at[b] - at[a] > MISSED_S:
                found.append((at[a + 1], f"{sensor} gives nothing that is used, for {at[b] - at[a]:.1f} s"))
    for i in np.flatnonzero(np.diff(status["reset_ctr"]) != 0) + 1 if len(at) else []:
        cause = names["ResetCause"].get(int(status["reset_cause"][i]), "?")
        found.append((at[i], f"reset: {cause}{jump_words(run, at[i], cause)}"))
    rows = run.innovations
    for sensor in np.unique(rows["sensor"][rows["estimator"] == run.best]):
        for verdict in np.unique(rows["verdict"]):
            mine = (rows["estimator"] == run.best) & (rows["sensor"] == sensor) & (rows["verdict"] == verdict)
            if verdict == 0 or not mine.any():
                continue
            times = rows["time_s"][mine]
            word = names["Verdict"].get(int(verdict), "?")
            for start, end in joined([[t, t] for t in times], QUIET_S):
                count = int(((times >= start) & (times <= end)).sum())
                what = f"{names['Sensor'].get(int(sensor), int(sensor))} {word}"
                found.append((start, f"{what}, {count} times until {end:.1f} s" if count > 1 else what))
    return sorted(found, key=lambda one: one[0])


def joined(spans, apart_s):
    """Spans (start, end) in order of time, those less than `apart_s` apart as one."""
    result = []
    for start, end in spans:
        if result and start - result[-1][1] < apart_s:
            result[-1][1] = end
        else:
            result.append([start, end])
    return result


def jump_words(run, time_s, cause):
    """Size of the step that came with a reset, from the page that follows it."""
    rows = run.states
    after = np.flatnonzero((rows["estimator"] == run.best) & (rows["time_s"] >= time_s) & np.isfinite(rows["jump_x_m"]))
    if len(after) == 0 or cause not in RESET_WORDS:
        return ""
    i = after[0]
    if cause == "HeadingWrong":
        return f", {RESET_WORDS[cause]} {np.degrees(rows['jump_yaw_rad'][i]):.1f} deg"
    # Its height is in another frame, which may be that of an epoch later.
    later = np.flatnonzero((rows["estimator"] == run.best) & (rows["time_s"] >= time_s) & np.isfinite(rows["jump_z_m"]))
    up = f", {rows['jump_z_m'][later[0]]:.2f} m up" if len(later) else ""
    return f", {RESET_WORDS[cause]} {rows['jump_x_m'][i]:.2f} m east, {rows['jump_y_m'][i]:.2f} m north{up}"


LOG_COUNTS = {"malformed_lines": "malformed lines skipped", "frames_not_data": "remote, error or CAN FD frames skipped",
              "frames_back_in_time": "frames are earlier than one before them", "frames_of_wrong_length": "input frames have not 8 bytes"}


def warnings_of(run, judged):
    """Reasons not to trust the numbers of the run as a whole, its log first. Odometry is left out: it drifts, and nothing tests it."""
    log = [f"{run.about[count]} {words}" for count, words in LOG_COUNTS.items() if run.about.get(count)]
    cause = f"fault {', '.join(one.words for one in faults(run))}" if faults(run) else (
        f"is {run.about['robot']} the robot of this log?" if run.about.get("robot") else "the wrong robot for this log?")
    found = []
    for one in judged:
        if one["kind"] == "Odometry":
            continue
        for sensor, counts in one["measurements"].items():
            tested = counts["accepted"] + counts["rejected"]
            if tested >= LEAST_TESTED and counts["rejected"] > MOST_REJECTED * tested:
                found.append(f"{one['name']} rejected {counts['rejected']} of {tested} {sensor} measurements")
        if one["nees_mean"] is not None and one["nees_mean"] > MOST_NEES:
            found.append(f"NEES mean of {one['name']} is {one['nees_mean']:.0f}, not {one['nees_dof']}")
        if one.get("converged") is False:
            state = "is under way at the end" if one["graph"]["optimisation_under_way"] else f"ended with {one['graph']['status']}"
            found.append(f"the graph of {one['name']} did not converge: its last optimisation {state}")
        if one["kind"] != "Attitude" and one["epochs"] == one["epochs_not_valid"]:
            found.append(f"{one['name']} never had a valid position" + (last_mode(run) if one["name"] == run.names[run.best] else ""))
    length_s = float(run.estimates["time_s"][-1] - run.estimates["time_s"][0])
    late = [f"{one.words}, after the end of the run ({length_s:.0f} s)" for one in faults(run) if one.start_s is not None and one.start_s > length_s]
    return (log + ([f"{'; '.join(found)} ({cause})"] if found else []) + [f"fault {one}: it did not happen" for one in late]
            + wheels_without_noise(run))


def last_mode(run):
    """The mode in which the node stayed, and for how long; nothing without a status."""
    mode, time_s = run.status["mode"], run.status["time_s"]
    if not len(mode):
        return ""
    since = int(np.flatnonzero(mode != mode[-1])[-1]) + 1 if (mode != mode[-1]).any() else 0
    word = code_names()["Mode"].get(int(mode[-1]), int(mode[-1]))
    return f": its mode was {word} for the last {time_s[-1] - time_s[since]:.0f} s"


# Sensor: parameters that make its noise, one of each group above 0.
WHEEL_NOISE = {"WheelCounts": [["wheels.drive.noise_left"], ["wheels.drive.noise_right"]],
               "WheelSpeed": [["wheels.wheel_speed_noise", "wheels.drive.noise_left"], ["wheels.wheel_speed_noise", "wheels.drive.noise_right"]],
               "BodySpeed": [["wheels.noise.speed", "wheels.noise.speed_per_speed"]]}


def wheels_without_noise(run):
    """A sentence for each wheel sensor that is used while its noise is 0: the covariance of dead reckoning then does not grow with the way."""
    parameters, names = run.about.get("parameters"), code_names()["Sensor"]
    if not isinstance(parameters, dict):
        return []
    used = set()
    for estimator, sensor in {(int(k), int(s)) for k, s in zip(*(run.sensors[name][run.sensors["accepted"] > 0] for name in ("estimator", "sensor")))}:
        if run.kinds.get(estimator) != "Inertial" or names.get(sensor) == "WheelCounts":  # inertial navigation has parameters of its own for speeds
            used.add(names.get(sensor))
    found = []
    for sensor in sorted(used & set(WHEEL_NOISE)):
        zero = sorted({path for group in WHEEL_NOISE[sensor] if not any(parameters.get(path, 1) > 0 for path in group) for path in group})
        if zero:
            found.append(f"{sensor} {'are' if sensor.endswith('s') else 'is'} used, but {' and '.join(zero)} {'is' if len(zero) == 1 else 'are'} 0: the covariance does not grow with the way "
                         "(docs/tutorial/your_robot.md has usual values)")
    return found
