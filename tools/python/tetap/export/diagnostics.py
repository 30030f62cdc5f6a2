# SPDX-License-Identifier: Apache-2.0
"""diagnostic_msgs/DiagnosticArray: the node's status and faults, the state of each source of its primary estimator, and each refused measurement
with its reason."""
import numpy as np

from tetap.export.topics import Topic

OK, WARN, ERROR, STALE = range(4)
LEVELS = {"Nominal": OK, "Fault": ERROR}  # of a mode; any other is a warning
SOURCES = {"Imu": "Imu", "Position": "GnssPosition", "Velocity": "GnssVelocity", "Wheel": "Wheels", "Speed": "ForwardSpeed", "Heading": "Heading",
           "Mag": "Magnetometer", "Baro": "Barometer"}
STATE_LEVELS = {"Fusing": OK, "Stopped": STALE, "Confirming": WARN, "Rejecting": WARN, "Distrusted": ERROR}
REFUSED = ("Rejected", "TooLate", "UnknownLandmark", "Singular", "NotFinite", "Stale", "Ambiguous", "NoRoom", "Outlier")


def words(mask, names):
    return " ".join(name for bit, name in sorted(names.items()) if mask >> bit & 1) or "none"


def status(messages, hardware):
    """(place, level, name, message, hardware, values) of each Est_Status."""
    found = messages["Est_Status"]
    columns = zip(found.at.tolist(), found.names("Mode"), found.Faults.tolist(), found.MapFaults.tolist(), found.Used.tolist(), found.PosValid.tolist(),
                  found.HdgValid.tolist(), found.VelValid.tolist(), found.ResetCtr.tolist(), found.names("ResetCause"))
    for at, mode, faults, map_faults, used, position, heading, velocity, resets, cause in columns:
        level = max(LEVELS.get(mode, WARN), WARN if faults or map_faults else OK)
        named = words(faults, messages.tables["Fault"])
        values = {"mode": mode, "faults": named, "map faults": words(map_faults, messages.tables["MapFault"]),
                  "used": words(used, messages.tables["SensorUsed"]), "position valid": str(position), "heading valid": str(heading),
                  "velocity valid": str(velocity), "resets": str(resets), "last reset": cause}
        yield at, level, "tetap: estimator", mode if named == "none" else f"{mode}: {named}", hardware, values


def sources(messages, instance, hardware):
    """The same of each source of an inertial estimator."""
    found = messages[f"Est{instance}_State", "Sources"]
    for field, name in SOURCES.items():
        for at, state, check in zip(found.at.tolist(), found.names(field + "State"), found.names(field + "Check")):
            yield at, STATE_LEVELS.get(state, WARN), f"tetap: source {name}", state, hardware, {"state": state, "last failed check": check}


def refusals(messages, hardware):
    """The same of each measurement that an estimator refused."""
    found = messages["Est_Innov"]
    columns = zip(found.at.tolist(), found.names("Verdict"), found.names("Check"), found.names("Sensor"), found.Inst.tolist(), found.Estimator.tolist(),
                  found.Dof.tolist(), found.Nis.tolist(), found.Ratio.tolist(), found.Age.tolist())
    for at, verdict, check, sensor, instance, estimator, dof, nis, ratio, age in columns:
        if verdict in REFUSED:
            why = verdict if check == "None" else f"{verdict} by {check}"
            yield (at, WARN, f"tetap: refused {sensor}{instance}", why, hardware,
                   {"estimator": f"Est{estimator}", "verdict": verdict, "check": check, "ratio": f"{ratio:g}", "normalised innovation squared": f"{nis:g}",
                    "degrees of freedom": str(dof), "age [s]": f"{age:g}"})


def topic(rows, clock, name="/diagnostics"):
    """The messages, one for each epoch with rows; those of equal texts and lengths share their shape."""
    by_epoch = {}
    for at, *entry in sorted(rows, key=lambda row: row[0]):
        by_epoch.setdefault(int(clock.index(at)), []).append(entry)
    for epoch, entries in sorted(by_epoch.items()):
        if epoch < 0:
            continue
        given, columns = {"header.frame_id": "", "status": len(entries)}, {}
        for i, (level, title, message, hardware, values) in enumerate(entries):
            path = f"status[{i}]."
            columns[path + "level"] = level
            given.update({path + "name": title, path + "message": message, path + "hardware_id": hardware, path + "values": len(values)})
            for k, (key, value) in enumerate(values.items()):
                given.update({f"{path}values[{k}].key": key, f"{path}values[{k}].value": value})
        yield Topic(name, "diagnostic_msgs/DiagnosticArray", np.array([clock.epochs[epoch]]), columns, given)
