# SPDX-License-Identifier: Apache-2.0
"""Replays of logs with other numbers, on all cores: a tetap-innovations per core, each with all logs in memory."""
import collections
import concurrent.futures
import contextlib
import json
import os
import queue
import subprocess
import sys
import time

import numpy as np

from tetap.can.bus_writer import BadInput

TERM = np.dtype([("time_ms", "<i4"), ("nis", "<f4"), ("gate", "<f4"), ("log_variance", "<f4"), ("innovation", "<f4"),
                 ("model", "u1"), ("verdict", "u1"), ("component", "u1"), ("components", "u1")])

Replay = collections.namedtuple("Replay", "models terms state_crc")


class Progress:
    """A line on stderr with what is done and the time that is left."""

    def __init__(self, quiet):
        self.quiet, self.done, self.expected, self.began, self.shown = quiet, 0, 0, time.monotonic(), 0.0

    def more(self, expected):
        self.expected += expected

    def fewer(self, gone):
        self.expected = max(self.done, self.expected - gone)

    def one(self, what):
        self.done += 1
        self.expected = max(self.expected, self.done)
        now = time.monotonic()
        if self.quiet or now - self.shown < (0.5 if sys.stderr.isatty() else 15):
            return
        self.shown = now
        left = (now - self.began) / self.done * (self.expected - self.done)
        text = f"tune: {what}: replay {self.done} of about {self.expected}, about {left:.0f} s left"
        print(f"\r\033[K{text}" if sys.stderr.isatty() else text, end="" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)

    def end(self):
        if not self.quiet and sys.stderr.isatty():
            print("\r\033[K", end="", file=sys.stderr, flush=True)


class Replays:
    """Raises BadInput with the program's own words where a log or a number is refused."""

    def __init__(self, program, logs, robot, given=(), cores=None, quiet=True):
        if not os.path.exists(program):
            raise BadInput(f"{program}: not built (make tune builds it)")
        self.logs, self.progress = list(logs), Progress(quiet)
        command = [program, *self.logs, "--robot", robot, *given]
        self._workers = [subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                         for _ in range(cores or len(os.sched_getaffinity(0)))]
        self._idle = queue.Queue()
        for worker in self._workers:
            self._idle.put(worker)
        self._threads = concurrent.futures.ThreadPoolExecutor(len(self._workers))

    def close(self):
        self._threads.shutdown(cancel_futures=True)
        for worker in self._workers:
            with contextlib.suppress(BrokenPipeError):  # of one that has ended: why is said already
                worker.stdin.close()
            worker.stdout.close()
            worker.wait()
            worker.stderr.close()
        self.progress.end()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def play(self, settings, what="replays"):
        """For each of the settings ({path: value}) a list of Replay, one a log."""
        return list(self._threads.map(lambda one: self._play(one, what), settings))

    def _play(self, setting, what):
        worker = self._idle.get()
        try:
            worker.stdin.write((" ".join(f"{path}={value:.7g}" for path, value in setting.items()) + "\n").encode())
            worker.stdin.flush()
            return [self._read(worker) for _ in self.logs]
        except BrokenPipeError:
            self._fail(worker)
        finally:
            self.progress.one(what)
            self._idle.put(worker)

    def _read(self, worker):
        line = worker.stdout.readline()
        if not line:
            self._fail(worker)
        head = json.loads(line)
        if "refused" in head:
            raise BadInput(head["refused"])
        data = worker.stdout.read(head["terms"] * TERM.itemsize)
        if len(data) != head["terms"] * TERM.itemsize:
            self._fail(worker)
        return Replay(head["models"], np.frombuffer(data, TERM), head["state_crc"])

    @staticmethod
    def _fail(worker):
        said = worker.stderr.read().decode(errors="replace").strip().removeprefix("tetap-innovations: ")
        raise BadInput(said or f"tetap-innovations ended with {worker.wait()}")
