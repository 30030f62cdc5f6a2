# SPDX-License-Identifier: Apache-2.0
"""The table of steps (tools/proof/steps.toml): read, checked, and made into jobs for one form."""
import dataclasses
import os
import subprocess
import tomllib

from tetap.proof import stamps

LISTS = ("each", "without", "inputs", "optional", "data", "tools", "environment", "after", "makes")
WORDS = {"name": str, "command": str, "each_from": str, "form": str, "part_of": str, "slots": (int, float, str), "stamp": bool, "realtime": bool}
LIMIT = {"silence_s": 600, "cpu_s": 7200}  # of one step, where [limit.FORM] says nothing else
MADE = ("build/", "out/")  # paths that exist only after steps have run


class TableError(Exception):
    """An error in the table. The text names the step and the error."""


@dataclasses.dataclass
class Step:
    name: str
    command: str
    each: list = dataclasses.field(default_factory=list)
    without: list = dataclasses.field(default_factory=list)
    each_from: str = ""
    inputs: list = dataclasses.field(default_factory=list)
    optional: list = dataclasses.field(default_factory=list)
    data: list = dataclasses.field(default_factory=list)
    tools: list = dataclasses.field(default_factory=list)
    environment: list = dataclasses.field(default_factory=list)
    after: list = dataclasses.field(default_factory=list)
    makes: list = dataclasses.field(default_factory=list)
    slots: object = 1
    stamp: bool = True
    realtime: bool = False
    form: str = ""
    part_of: str = ""


class Table:
    def __init__(self, root, path):
        self.root, self.path = root, path
        try:
            with open(path, "rb") as file:
                text = tomllib.load(file)
        except OSError as error:
            raise TableError(f"{path}: {error.strerror}") from None
        except tomllib.TOMLDecodeError as error:
            raise TableError(f"{path}: {error}") from None
        self.forms, self.groups = text.get("form", {}), text.get("group", {})
        self.limits = {form: LIMIT | text.get("limit", {}).get(form, {}) for form in self.forms}
        self.steps = [self.step(row) for row in text.get("step", [])]
        names = [step.name for step in self.steps]
        for step in self.steps:
            if names.count(step.name) > 1:
                raise TableError(f"{path}: two steps are called {step.name}")
            for other in step.after:
                if other not in names:
                    raise TableError(f"{path}: {step.name} comes after {other}, which is no step")
            for pattern in [one for whole in step.inputs + step.each + step.without for one in stamps.braces(whole)]:
                if not pattern.startswith(MADE) and "$item" not in pattern and not stamps.matches(root, pattern):
                    raise TableError(f"{path}: {step.name}: no file is like {pattern}")

    def step(self, row):
        for key, value in row.items():
            wanted = list if key in LISTS else WORDS.get(key)
            if wanted is None or not isinstance(value, wanted):
                raise TableError(f"{self.path}: {row.get('name', 'a step')}: {key} = {value!r} is not understood")
        for key in ("name", "command"):
            if key not in row:
                raise TableError(f"{self.path}: {row.get('name', 'a step')}: {key} is missing")
        step = Step(**row)
        if step.form and step.form not in self.forms:
            raise TableError(f"{self.path}: {step.name}: there is no form {step.form}")
        for key in ("inputs", "optional", "each", "without"):
            setattr(step, key, [pattern for name in getattr(step, key) for pattern in self.expanded(step, name)])
        return step

    def expanded(self, step, name):
        if not name.startswith("@"):
            return [name]
        if name[1:] not in self.groups:
            raise TableError(f"{self.path}: {step.name}: there is no group {name}")
        return [pattern for one in self.groups[name[1:]] for pattern in self.expanded(step, one)]

    def chosen(self, form, words):
        """The steps of a form: all, or those that are named by themselves or by what they are part of, and what these come after."""
        if form not in self.forms:
            raise TableError(f"no form '{form}'; there are: {' '.join(self.forms)}")
        steps = [step for step in self.steps if step.form in ("", form)]
        known = {step.name for step in steps} | {step.part_of for step in steps if step.part_of}
        for word in words:
            if word not in known:
                raise TableError(f"no step '{word}'; there are: {' '.join(sorted(known))}")
        wanted = {step.name for step in steps if not words or step.name in words or step.part_of in words}
        while more := {name for step in steps if step.name in wanted for name in step.after} - wanted:
            wanted |= more
        return [step for step in steps if step.name in wanted]

    def items(self, step):
        """The parts of a step; one that is nothing where it has none."""
        if step.each_from:
            done = subprocess.run(["bash", "-c", step.each_from], cwd=self.root, capture_output=True, text=True, check=False)
            if done.returncode != 0 or not done.stdout.split():
                raise TableError(f"{step.name}: '{step.each_from}' gave no list: {done.stderr.strip()}")
            return done.stdout.split()
        if not step.each:
            return [""]
        left_out = {path for pattern in step.without for path in stamps.matches(self.root, pattern)}
        found = [path for pattern in step.each for path in stamps.matches(self.root, pattern) if path not in left_out]
        found = [path for path in found if not path.startswith("build/") or os.access(os.path.join(self.root, path), os.X_OK)]
        if not found:
            raise TableError(f"{step.name}: no file is like {' '.join(step.each)}")
        return found
