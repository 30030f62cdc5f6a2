# SPDX-License-Identifier: Apache-2.0
"""What a program of yours does with logs: `import tetap`, with tools/python on its path and numpy and canmatrix (Debian) beside it.

Messages are arrays: `tetap.decode("raw.log")["Est2_Pos"].X`, in the units of config/tetap.dbc, NaN where a value is not available. BadInput names what
is wrong and where.
"""
import json
import os
import subprocess
import tempfile

from tetap.can import bus_database, columns, encoder
from tetap.can.bus_writer import DEFAULT_DBC, ROOT, BadInput
from tetap.can.columns import Messages
from tetap.export.log import Export  # noqa: F401  part of the interface
from tetap.library import Node, settings


class Replay(Messages):
    """The frames that a node sent in a replay. `epochs`, `compared`, `different`, `frames_in`, `frames_lost`, `state_crc`, `recorded` as in
    tetap_replay.h; `complaint` is what is wrong, or ""; `began_with` as of Node."""

    def __init__(self, frames, base, result, complaint, began_with=""):
        super().__init__(frames, base)
        self.complaint, self.began_with = complaint, began_with
        for name, _ in result._fields_:
            setattr(self, name, getattr(result, name))


def decode(log, base=bus_database.BASE):
    """The messages of a log."""
    return Messages(columns.read(log), base)


def encode(message, base=bus_database.BASE, stamp_s=None, **values):
    """(identifier, bytes) of a frame: encode("In_WheelCounts", Seq=3, Left=1290, Right=1291, stamp_s=0.12)."""
    words = [f"{name}={value}" for name, value in values.items()]
    try:
        offset, data = encoder.encode(columns.database(DEFAULT_DBC), message, words, None if stamp_s is None else round(stamp_s * 1e6))
    except encoder.Bad as reason:
        raise BadInput(str(reason)) from None
    return base + offset, data


def replay(log, robot, set=None, mode="automatic"):
    """Plays a log to a robot's node in this process, with the parameters of `set` over its own. `mode`: "as-recorded" repeats the run of the log
    and compares it, "inputs" plays the sensors' frames alone, "automatic" chooses as tetap-play does."""
    try:
        with open(log, "rb") as file:
            text = file.read()
    except OSError as error:
        raise BadInput(f"{log}: {error.strerror}") from None
    with Node(robot, set) as node:
        result, complaint = node.play(text, str(log), mode)
        return Replay(node.read(), node.parameters["can_base"], result, complaint, node.began_with)


def parameters(robot, set=None):
    """Every parameter of a robot: path -> number, or list of numbers."""
    with Node(robot, set) as node:
        return node.parameters


def doctor(log, robot=None, set=None):
    """The likeliest mistakes in a log, the likeliest first: dicts of code, rank, evidence, change. tetap-doctor finds them."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "doctor.json")
        words = ["--robot", robot] if robot else []
        for line in filter(None, settings(set).splitlines()):
            words += ["--set", line.replace(" = ", "=", 1)]
        _run("tetap-doctor", str(log), *words, "--json", out)
        with open(out, encoding="utf-8") as file:
            return json.load(file)["findings"]


def record(folder, seconds, interface="vcan0", base=bus_database.BASE, snapshot=False):
    """Records a CAN interface for so long by tetap-record; the path of the log. `snapshot`: asks a node that runs already for its state."""
    _run("tetap-record", "--can", interface, "--base", hex(base), "--out", str(folder), "--duration", str(seconds), "--quiet", *(["--snapshot"] if snapshot else []))
    return os.path.join(folder, "raw.log")


def _run(program, *words):
    path = os.path.join(os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build", "host", "sim_host")), program)
    try:
        done = subprocess.run([path, *words], capture_output=True, text=True, check=False)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror} (make programs)") from None
    if done.returncode != 0:
        raise BadInput(done.stderr.strip() or f"{program}: status {done.returncode}")
