# SPDX-License-Identifier: Apache-2.0
"""The replay core (sim_host/c_api/tetap_replay.h) by ctypes: a robot's node in this process."""
import ctypes
import functools
import json
import os

import numpy as np

from tetap.can import columns
from tetap.can.bus_writer import ROOT, BadInput

API = 2  # TETAP_REPLAY_API
MODES = {"automatic": 0, "inputs": 1, "as-recorded": 2}
FRAME = np.dtype({"names": ["time_us", "id", "size", "extended", "data"], "formats": ["<i8", "<u4", "u1", "u1", ("u1", 8)], "offsets": [0, 8, 12, 13, 16],
                  "itemsize": 24})


class Result(ctypes.Structure):
    """tetap_replay_result."""
    _fields_ = [(name, ctypes.c_uint64) for name in ("epochs", "compared", "different", "frames_in", "frames_lost")] + \
               [(name, ctypes.c_uint32) for name in ("state_crc", "recorded")]


@functools.lru_cache(maxsize=1)
def library():
    """libtetap_replay.so of the build, or of $TETAP_PROGRAMS."""
    programs = os.environ.get("TETAP_PROGRAMS", os.path.join(ROOT, "build", "host", "sim_host"))
    path = os.path.join(programs, "c_api", "libtetap_replay.so")
    try:
        found = ctypes.CDLL(path)
    except OSError as error:
        raise BadInput(f"{path}: not built (make programs): {error}") from None
    pointer, text = ctypes.c_void_p, ctypes.c_char_p
    found.tetap_replay_api.restype = ctypes.c_uint32
    if found.tetap_replay_api() < API:
        raise BadInput(f"{path}: of API {found.tetap_replay_api()}, this needs {API}: make programs")
    for name, result, arguments in (("robots", text, []), ("open", pointer, [text, text]), ("close", None, [pointer]),
                                    ("error", text, [pointer]), ("complaint", text, [pointer]), ("parameters", text, [pointer]),
                                    ("push", ctypes.c_int, [pointer, pointer, ctypes.c_size_t]), ("tick", ctypes.c_int, [pointer, ctypes.c_int64]),
                                    ("play", ctypes.c_int, [pointer, text, ctypes.c_size_t, text, ctypes.c_int, ctypes.POINTER(Result)]),
                                    ("read", ctypes.c_size_t, [pointer, pointer, ctypes.c_size_t]), ("began_with", text, [pointer])):
        function = getattr(found, "tetap_replay_" + name)
        function.restype, function.argtypes = result, arguments
    return found


def settings(numbers):
    """Lines of `path = value` from a dict; a value may be a number or a sequence of numbers."""
    lines = []
    for path, value in (numbers or {}).items():
        values = value if isinstance(value, (list, tuple, np.ndarray)) else [value]
        lines.append(f"{path} = " + " ".join(str(one) if isinstance(one, str) else repr(float(one)) if isinstance(one, (float, np.floating)) else str(int(one)) for one in values))
    return "\n".join(lines)


class Node:
    """A robot's node with its own parameters, and those of `set` (path -> value) over them. BadInput says why where something fails. A node is
    closed by close(), or as a context manager."""

    def __init__(self, robot, set=None):
        self._library = library()
        self._node = self._library.tetap_replay_open(robot.encode(), settings(set).encode())
        if not self._node:
            raise BadInput(self._library.tetap_replay_error(None).decode())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        if getattr(self, "_node", None):
            self.close()

    def close(self):
        self._library.tetap_replay_close(self._node)
        self._node = None

    def _open(self):
        if not self._node:
            raise BadInput("the node is closed")
        return self._node

    def _done(self, status):
        if status < 0:
            raise BadInput(self._library.tetap_replay_error(self._node).decode())
        return status

    @property
    def parameters(self):
        """Every parameter: path -> number, or list of numbers."""
        return json.loads(self._library.tetap_replay_parameters(self._open()).decode())

    def push(self, frames):
        """Input frames for the next tick: (id, bytes) pairs. How many of them are inputs of the node."""
        array = np.zeros(len(frames), FRAME)
        for row, (identifier, data) in zip(array, frames):
            if len(data) > 8:
                raise BadInput(f"frame 0x{identifier:X} has {len(data)} bytes; a classic CAN frame has at most 8")
            row["id"], row["size"] = identifier, len(data)
            row["data"][:len(data)] = np.frombuffer(data, np.uint8)
        return self._done(self._library.tetap_replay_push(self._open(), array.ctypes.data, len(array)))

    def tick(self, time_s):
        """The epoch of this time [s]; read() has its frames."""
        self._done(self._library.tetap_replay_tick(self._open(), round(time_s * 1e6)))

    def play(self, log, name="log", mode="automatic"):
        """Plays the text of a log (bytes) to a node that has just been switched on. (Result, what is wrong with it or "")."""
        if mode not in MODES:
            raise BadInput(f"no mode '{mode}'; there are: {', '.join(MODES)}")
        result = Result()
        self._done(self._library.tetap_replay_play(self._open(), log, len(log), name.encode(), MODES[mode], ctypes.byref(result)))
        return result, self._library.tetap_replay_complaint(self._node).decode()

    @property
    def began_with(self):
        """Parameters with which the node of the last log began where they are not its robot's own, as "path=value path=value"; the play's node has
        taken them from the log, but for those of `set`."""
        return self._library.tetap_replay_began_with(self._open()).decode()

    def read(self):
        """The frames that the node has sent since the last read (columns.Frames), their times those of their epochs."""
        array = np.zeros(self._library.tetap_replay_read(self._open(), None, 0), FRAME)
        self._library.tetap_replay_read(self._node, array.ctypes.data, len(array))
        return columns.from_array(array)
