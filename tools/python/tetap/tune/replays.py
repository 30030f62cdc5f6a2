# SPDX-License-Identifier: Apache-2.0
"""Replays of logs with other numbers, a shard each; a worker keeps a tetap-innovations with all logs in memory."""
import collections
import json
import os
import subprocess

import numpy as np

from tetap import shards
from tetap.can.bus_writer import BadInput

TERM = np.dtype([("time_ms", "<i4"), ("nis", "<f4"), ("gate", "<f4"), ("log_variance", "<f4"), ("innovation", "<f4"),
                 ("model", "u1"), ("verdict", "u1"), ("component", "u1"), ("components", "u1")])

Replay = collections.namedtuple("Replay", "models terms state_crc")


_players = {}  # by command


def read(player):
    line = player.stdout.readline()
    if not line:
        fail(player)
    head = json.loads(line)
    if "refused" in head:
        raise BadInput(head["refused"])
    data = player.stdout.read(head["terms"] * TERM.itemsize)
    if len(data) != head["terms"] * TERM.itemsize:
        fail(player)
    return head["models"], data, head["state_crc"]


def fail(player):
    said = player.stderr.read().decode(errors="replace").strip().removeprefix("tetap-innovations: ")
    raise BadInput(said or f"tetap-innovations ended with {player.wait()}")


def replay(job):
    """Of each log models, bytes of terms, CRC of the states."""
    command = tuple(job["command"])
    player = _players.pop(command, None) or subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    try:
        player.stdin.write((job["setting"] + "\n").encode())
        player.stdin.flush()
    except BrokenPipeError:
        fail(player)
    found = [read(player) for _ in range(job["logs"])]
    _players[command] = player
    return found


class Replays:
    """Raises BadInput with the program's own words where a log or a number is refused."""

    def __init__(self, program, logs, robot, given=(), options=shards.ALONE, out=".", quiet=True):
        if not os.path.exists(program):
            raise BadInput(f"{program}: not built (make tune builds it)")
        self.logs, self.command, self.progress = list(logs), [program, *logs, "--robot", robot, *given], shards.Progress("tune", quiet)
        files = [word for word in self.command if os.path.isfile(word)]
        self._plays = shards.Shards(replay, [*files, *shards.modules_of(os.path.dirname(program), [robot])], options, out, self.progress)

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self._plays.close(keep=kind is not None)

    def play(self, settings, what="replays"):
        """For each of the settings ({path: value}) a list of Replay, one a log."""
        texts = (" ".join(f"{path}={value:.7g}" for path, value in setting.items()) for setting in settings)
        jobs = [{"command": self.command, "setting": text, "logs": len(self.logs)} for text in texts]
        return [[Replay(models, np.frombuffer(data, TERM), crc) for models, data, crc in found] for found in self._plays.run(jobs, what)]
