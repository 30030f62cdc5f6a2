# SPDX-License-Identifier: Apache-2.0
"""What the parts of a calibration hand back: numbers with 1 sigma and their place in param::Parameters, residuals, notes; or why there is none."""
import dataclasses
import os
import re
import subprocess

import numpy as np

from tetap.can.bus_writer import BadInput

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[os.pardir] * 4))
STRUCTS = ("src/param/parameters.hpp", "src/model/differential_drive.hpp")


class Refusal(Exception):
    """The data does not give this number: why, and what to record."""

    def __init__(self, why, record):
        super().__init__(f"{why} Record: {record}")
        self.why, self.record = why, record


@dataclasses.dataclass
class Number:
    """One number or a list of them. `field`: where it belongs in param::Parameters ("": nowhere); `scale`: shown = value * scale, in `unit`."""

    name: str
    value: np.ndarray
    sigma: np.ndarray
    unit: str
    field: str = ""
    labels: tuple = ("",)
    digits: int = 5
    off: bool = False  # together with its fellow, by more than two sigma, though perhaps not alone: two wheels' radii and their difference
    offered: np.ndarray = None  # for the header, where that is not all of `value`: what is known well enough of it

    def __post_init__(self):
        self.value, self.sigma = np.atleast_1d(np.asarray(self.value, float)).ravel(), np.atleast_1d(np.asarray(self.sigma, float)).ravel()
        if len(self.sigma) != len(self.value):
            raise ValueError(f"{self.name}: {len(self.value)} values, {len(self.sigma)} sigmas")
        self.offered = self.value if self.offered is None else np.atleast_1d(np.asarray(self.offered, float))
        if not (np.isfinite(self.value).all() and np.isfinite(self.sigma).all() and (self.sigma >= 0).all()):
            raise Refusal(f"{self.name} does not come out as a finite number.", "a longer log with more variety")


class Part:
    """What one part of the calibration found."""

    def __init__(self, name, title):
        self.name, self.title = name, title
        self.numbers, self.notes, self.refusals, self.residuals = [], [], [], []
        self.draw = self.draw_more = None  # functions of one pair of axes

    def add(self, *arguments, **keywords):
        self.numbers.append(Number(*arguments, **keywords))

    def number(self, name):
        return next(number for number in self.numbers if number.name == name)

    def residual(self, what, before, after, unit):
        if not np.isfinite([before, after]).all():
            raise Refusal(f"The residual ({what}) is no finite number.", "a longer log with more variety")
        self.residuals.append((what, before, after, unit))

    def refuse(self, what, refusal):
        self.refusals.append((what, refusal.why, refusal.record))


class Robot:
    """What a robot's header says now (designated initialisers), as far as a calibration compares with it or needs it."""

    def __init__(self, name=None):
        self.name, self.text = name, ""
        if name:
            path = os.path.join(ROOT, "config", f"{name}.hpp")
            try:
                with open(path, encoding="utf-8") as file:
                    self.text = re.sub(r"//.*", "", file.read())
            except OSError as error:
                known = subprocess.run([os.path.join(ROOT, "tools/run/list_robots")], check=True, capture_output=True, text=True).stdout.split()
                raise BadInput(f"config/{name}.hpp: {error.strerror}; there are: {', '.join(known)}") from None
            if "param::Parameters" not in self.text:
                raise BadInput(f"{path}: no robot: no param::Parameters in it")
        self.given = {}

    def number(self, field, default=None):
        if field in self.given:
            return self.given[field]
        found = re.search(r"\.%s\s*=\s*([-+\d.eE]+)F?\s*[,}]" % re.escape(field), self.text)
        return float(found[1]) if found else default

    def now(self, field):
        """The values of one of the fields a calibration finds, as the header has them or param::Parameters by itself; None without a robot."""
        if not self.name:
            return None
        member = field.split(".")[-1]
        if member == "mounting_bs" and field.startswith("magnetic."):
            return None
        found = re.search(r"\.%s\s*=\s*\{([^{}]*)\}" % re.escape(member), self.text)
        if found:
            return np.array([float(one.strip().rstrip("F")) for one in found[1].split(",") if one.strip()])
        one = self.number(member)
        return np.array([one]) if one is not None else UNSET.get(member)

    def has(self, number):
        """What it says now is no further off than two of its sigmas, each: nothing to change."""
        if number.off:
            return False
        now = self.now(number.field) if number.field else None
        return now is not None and len(now) == len(number.value) and bool((np.abs(number.value - now) <= 2 * number.sigma).all())


# What param::Parameters has where a header says nothing (test/tools/calibrate_robot_test.py compares).
UNSET = {"mounting_bs": np.eye(3).ravel(), "up_s": np.array([0.0, 0.0, 1.0]), "accel_bias_mps2": np.zeros(3), "gyro_bias_radps": np.zeros(3),
         "accel_matrix": np.eye(3).ravel(), "speed_scale": np.ones(1), "left_speed_scale": np.ones(1), "right_speed_scale": np.ones(1),
         "yaw_rate_scale": np.ones(1)}


def structs():
    """Of each struct that param::Parameters is made of: its members in order, name -> type."""
    found = {}
    for path in STRUCTS:
        with open(os.path.join(ROOT, path), encoding="utf-8") as file:
            text = re.sub(r"//.*", "", file.read())
        for name, body in re.findall(r"^struct (\w+) \{\n(.*?)^\};", text, re.MULTILINE | re.DOTALL):
            found[name] = {member: kind.split("::")[-1]
                           for kind, member in re.findall(r"^  ([\w:]+(?:<[^>]*>)?) (\w+)(?: = [^;]*|\{[^;]*\})?;", body, re.MULTILINE)}
    return found


def literal(value, digits):
    text = f"{value:.{digits}g}"
    return text + ("F" if "." in text or "e" in text else ".0F")


def snippet(parts, robot=None):
    """The numbers as designated initialisers of param::Parameters, in its order; without those that the robot has already."""
    known, values = structs(), {}
    for number in (number for part in parts for number in part.numbers if number.field):
        if robot is not None and robot.has(number):
            continue
        text = ", ".join(literal(value, number.digits) for value in number.offered)
        values[number.field] = text if len(number.value) == 1 else "{" + text + "}"

    def lines(struct, path, indent):
        result = []
        for member, kind in known[struct].items():
            field = f"{path}{member}"
            if field in values:
                result.append(f"{indent}.{member} = {values.pop(field)},")
            elif any(name.startswith(f"{field}.") for name in values):
                result += [f"{indent}.{member} = {{"] + lines(kind, f"{field}.", indent + "    ") + [f"{indent}}},"]
        return result

    text = "\n".join(lines("Parameters", "", "    "))
    if values:
        raise LookupError(f"param::Parameters has no {', '.join(values)}")
    return text
