# SPDX-License-Identifier: Apache-2.0
"""Results of the parts of a calibration: numbers with 1 sigma and their place in the parameter table, residuals, notes; or why there is none."""
import dataclasses
import os

import numpy as np

from tetap.calibrate import parameter_table


class Refusal(Exception):
    """The data does not give this number: why, and what to record."""

    def __init__(self, why, record):
        super().__init__(f"{why} Record: {record}")
        self.why, self.record = why, record


@dataclasses.dataclass
class Number:
    """One number or a list of them. `field`: its path in the parameter table ("": nowhere); `scale`: shown = value * scale, in `unit`."""

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
    """Result of one part of the calibration."""

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
    """The parameters of a robot (tetap-params), as far as a calibration compares with them or needs them."""

    def __init__(self, name=None):
        self.name, self.given = name, {}
        self.rows = parameter_table.rows(name)

    def number(self, path, default=None):
        """A single value that the robot sets or the command line gives, else the default of the caller."""
        if path in self.given:
            return self.given[path]
        row = self.rows[path]
        return row["value"] if self.name and row["value"] != row["default"] else default

    def now(self, path):
        """The values of one of the fields a calibration finds; None without a robot."""
        return np.atleast_1d(np.array(self.rows[path]["value"], float)) if self.name else None

    def has(self, number):
        """The robot's values are no further off than two of its sigmas, each: nothing to change."""
        if number.off:
            return False
        now = self.now(number.field) if number.field else None
        return now is not None and len(now) == len(number.value) and bool((np.abs(number.value - now) <= 2 * number.sigma).all())


def offered(parts, robot=None):
    """{path: number} of what has a place in the table, in its order; without what the robot has already."""
    found = {number.field: number for part in parts for number in part.numbers if number.field and not (robot and robot.has(number))}
    rows = parameter_table.rows()
    unknown = [path for path in found if path not in rows]
    if unknown:
        raise LookupError(f"the parameter table has no {', '.join(unknown)}")
    return {path: found[path] for path in rows if path in found}


def settings(parts, robot=None):
    """The numbers as `path = value` lines, which PARAMS= and --params read."""
    return "\n".join(f"{path} = " + " ".join(f"{value:.{number.digits}g}" for value in number.offered)
                     for path, number in offered(parts, robot).items())


def literal(value, digits):
    text = f"{value:.{digits}g}"
    return text + ("F" if "." in text or "e" in text else ".0F")


def snippet(parts, robot=None):
    """The same as designated initialisers of a robot's header: a level of braces for each struct of a path."""
    lines, within = [], []
    for path, number in offered(parts, robot).items():
        *structs, member = path.split(".")
        common = len(os.path.commonprefix([structs, within]))
        lines += ["    " * level + "}," for level in range(len(within), common, -1)]
        lines += ["    " * (level + 1) + f".{structs[level]} = {{" for level in range(common, len(structs))]
        within = structs
        text = ", ".join(literal(value, number.digits) for value in number.offered)
        lines.append("    " * (len(within) + 1) + f".{member} = {text if len(number.offered) == 1 else '{' + text + '}'},")
    return "\n".join(lines + ["    " * level + "}," for level in range(len(within), 0, -1)])
