#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Shards: jobs of one function, played by processes of this machine, by GNU parallel or by slurm. A result is a file named by the hash of what decides it.

That is the code of the tool, the contents of the files that it reads (programs, logs), and the job: arguments and seed, as JSON. A result that is there
is not made again, so an interrupted run goes on; with other code or files the folder begins anew. A worker that is killed leaves no result, and its shard
is given out again. Nodes share this folder, the tools and the programs by a file system.

Worker: `shards.py FOLDER` takes jobs as lines of its input, `shards.py FOLDER NUMBER...` those of batches.
"""
import argparse
import collections
import concurrent.futures
import contextlib
import fcntl
import hashlib
import importlib.machinery
import importlib.util
import json
import os
import pickle
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import types

if __name__ == "__main__":
    sys.path[0] = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
sys.dont_write_bytecode = True

from tetap.can.bus_writer import BadInput  # noqa: E402

TOOLS = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
ENGINES = ("local", "parallel", "slurm")
TRIES = 3
MOST_BATCHES = 1000  # slurm's arrays have 1001 at most by default
ALONE = types.SimpleNamespace(engine="local", jobs=1, nodes=None)
OF_ENGINES = ("--engine", "--jobs", "--nodes")


def at_least_one(text):
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"'{text}' must be 1 or more")
    return int(text)


def add_options(parser, *names):
    """--engine, --jobs (also by these names) and --nodes."""
    parser.add_argument("--engine", choices=ENGINES, default="local", help="processes of this machine, GNU parallel, or slurm; the results are the same (default local)")
    parser.add_argument("--jobs", *names, type=at_least_one, default=len(os.sched_getaffinity(0)), metavar="N",
                        help="at a time; by GNU parallel on each node (default: this machine's processors)")
    parser.add_argument("--nodes", metavar="FILE", help="nodes for GNU parallel, as its --sshloginfile has them (default: this machine)")


def words_of(arguments):
    """A command's words without those of engines, which no result depends on."""
    left, words = list(arguments), []
    while left:
        word = left.pop(0)
        if word in OF_ENGINES:
            left = left[1:]
        elif not word.startswith(tuple(name + "=" for name in OF_ENGINES)):
            words.append(word)
    return words


def code():
    """Paths of the tools' own modules that this program has imported."""
    paths = {os.path.realpath(module.__file__) for module in list(sys.modules.values()) if getattr(module, "__file__", None)}
    return sorted(path for path in paths if path.startswith(TOOLS + os.sep))


def digest(paths):
    whole = hashlib.sha256()
    for path in paths:
        with open(path, "rb") as file:
            whole.update(hashlib.file_digest(file, "sha256").digest())
    return whole.hexdigest()


def modules_of(programs, robots):
    """Paths of the modules that programs of that folder load for robots."""
    paths = [os.path.join(os.path.dirname(os.path.realpath(programs)), "robots", robot.removesuffix("_matched") + ".so") for robot in sorted(set(robots))]
    return [path for path in paths if os.path.exists(path)]


class Progress:
    """A line on stderr with what is done and the time that is left."""

    def __init__(self, name, quiet=False):
        self.name, self.quiet, self.done, self.expected, self.began, self.shown = name, quiet, 0, 0, time.monotonic(), 0.0

    def more(self, expected):
        self.expected += expected

    def some(self, count, what=""):
        self.done += count
        self.expected = max(self.expected, self.done)
        now = time.monotonic()
        if self.quiet or not count or now - self.shown < (0.5 if sys.stderr.isatty() else 15):
            return
        self.shown = now
        left = (now - self.began) / self.done * (self.expected - self.done)
        text = f"{self.name}: {what + ': ' if what else ''}{self.done} of about {self.expected}, about {left:.0f} s left"
        print(f"\r\033[K{text}" if sys.stderr.isatty() else text, end="" if sys.stderr.isatty() else "\n", file=sys.stderr, flush=True)

    def end(self):
        if not self.quiet and sys.stderr.isatty():
            print("\r\033[K", end="", file=sys.stderr, flush=True)


class Shards:
    """Results of function(job) for jobs that are JSON. Raises BadInput with the words of the first that refuses its job."""

    def __init__(self, function, files, options, out, progress=None, fresh=False):
        path = os.path.realpath(sys.modules[function.__module__].__file__)
        self.name = os.path.basename(path).removesuffix(".py") + "." + function.__name__
        self.options, self.folder, self.progress = options, os.path.join(os.path.abspath(out), "shards", self.name), progress or Progress(self.name.split(".")[0])
        self.base, self.made, self.cpu_s, self._workers = digest([*code(), *files]), 0, [], {}
        os.makedirs(os.path.dirname(self.folder), exist_ok=True)
        self._lock = open(self.folder + ".lock", "w", encoding="ascii")  # noqa: SIM115
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._lock.close()
            raise BadInput(f"{self.folder}: another run is at work here; give another --out") from None
        about = {"base": self.base, "file": path, "function": function.__name__, "folder": os.getcwd(), "environment": {name: value for name, value in os.environ.items() if name.startswith("TETAP_")}}
        with contextlib.suppress(FileNotFoundError, ValueError), open(os.path.join(self.folder, "about.json"), encoding="utf-8") as file:
            if json.load(file)["base"] == self.base and not fresh:
                self._write_about(about)
                return
        shutil.rmtree(self.folder, ignore_errors=True)
        os.makedirs(self.folder)
        self._write_about(about)

    def _write_about(self, about):
        for name in ("batches", "scratch"):
            shutil.rmtree(os.path.join(self.folder, name), ignore_errors=True)
            os.makedirs(os.path.join(self.folder, name))
        with open(os.path.join(self.folder, "about.json"), "w", encoding="utf-8") as file:
            json.dump(about, file, indent=1)

    def close(self, keep):
        for worker in self._workers.values():
            worker.stdin.close()
            worker.wait()
            worker.stdout.close()
        self._workers.clear()
        self.progress.end()
        shutil.rmtree(self.folder if not keep else os.path.join(self.folder, "scratch"), ignore_errors=True)
        if not keep:
            os.remove(self._lock.name)
            with contextlib.suppress(OSError):  # of another function
                os.rmdir(os.path.dirname(self.folder))
        self._lock.close()

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.close(keep=kind is not None)

    def _path(self, key):
        return os.path.join(self.folder, key[:2], key)

    def run(self, jobs, what=""):
        """Results in the order of the jobs, once all are there; one at a time is in memory."""
        texts = [json.dumps(job) for job in jobs]
        order = [hashlib.sha256((self.base + text).encode()).hexdigest() for text in texts]
        lines = dict(zip(order, texts))
        self.progress.more(max(0, self.progress.done + len(lines) - self.progress.expected))
        missing = self._missing(lines)
        self.progress.some(len(lines) - len(missing), what)
        self._make(missing, lines, what)
        for key in order:
            try:
                yield self._result(key)
            except (EOFError, pickle.UnpicklingError):  # half of it was on the disk when the machine stopped
                os.remove(self._path(key))
                self._make([key], lines, what)
                yield self._result(key)

    def _result(self, key):
        with open(self._path(key), "rb") as file:
            cpu_s, result = pickle.load(file)
        self.cpu_s.append(cpu_s)
        return result

    def _missing(self, keys):
        return [key for key in keys if not os.path.exists(self._path(key))]

    def _make(self, missing, lines, what):
        self.made += len(missing)
        for _ in range(TRIES):
            if not missing:
                return
            for key in missing:
                os.makedirs(os.path.dirname(self._path(key)), exist_ok=True)
                with contextlib.suppress(FileNotFoundError):
                    os.remove(self._path(key) + ".refused")
            getattr(self, "_by_" + self.options.engine)([(key, f"{key} {lines[key]}\n") for key in missing], what)
            for key in missing:
                with contextlib.suppress(FileNotFoundError), open(self._path(key) + ".refused", encoding="utf-8") as file:
                    raise BadInput(file.read())
            missing = self._missing(missing)
        if missing:
            raise BadInput(f"{self.name}: {len(missing)} shards were given out {TRIES} times and left no result; the first: {lines[missing[0]]}; what was said is in {self.folder}/batches")

    def _by_local(self, todo, what):
        waiting = collections.deque(todo)

        def serve(place):
            while True:
                try:
                    _, line = waiting.popleft()
                except IndexError:
                    return
                worker = self._workers.get(place)
                if worker is None:
                    worker = self._workers[place] = subprocess.Popen([sys.executable, os.path.realpath(__file__), self.folder], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
                with contextlib.suppress(BrokenPipeError):
                    worker.stdin.write(line)
                    worker.stdin.flush()
                if worker.stdout.readline():
                    self.progress.some(1, what)
                    continue
                worker.wait()
                worker.stdout.close()
                with contextlib.suppress(BrokenPipeError):
                    worker.stdin.close()
                del self._workers[place]

        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as threads:
            try:
                list(threads.map(serve, range(min(self.options.jobs, len(todo)))))
            finally:
                waiting.clear()

    def _batches(self, todo, places):
        """Numbers of new files of batches: some eight for each place, so that the last ones end together."""
        folder = os.path.join(self.folder, "batches")
        size = max(1, len(todo) // (8 * places), -(-len(todo) // MOST_BATCHES))
        first = len(os.listdir(folder))
        for number, begin in enumerate(range(0, len(todo), size)):
            with open(os.path.join(folder, str(first + number)), "w", encoding="utf-8") as file:
                file.writelines(line for _, line in todo[begin:begin + size])
        return range(first, first + -(-len(todo) // size))

    def _command(self):
        return [sys.executable, os.path.realpath(__file__), self.folder]

    def _by_parallel(self, todo, what):
        nodes, count = [], 1
        if self.options.nodes:
            nodes = ["--sshloginfile", os.path.abspath(self.options.nodes)]
            with open(self.options.nodes, encoding="utf-8") as file:
                count = max(1, sum(bool(line.strip()) and not line.startswith("#") for line in file))
        numbers = self._batches(todo, self.options.jobs * count)
        command = ["parallel", "--will-cite", "--plain", "--jobs", str(self.options.jobs), "--retries", str(TRIES), *nodes, *self._command(), "{}"]
        self._watch(command, "\n".join(map(str, numbers)) + "\n", todo, what)

    def _by_slurm(self, todo, what):
        numbers = self._batches(todo, self.options.jobs)
        wrapped = " ".join(f"'{word}'" for word in self._command()) + f" $(({numbers[0]} + SLURM_ARRAY_TASK_ID))"
        command = ["sbatch", "--wait", "--parsable", "--requeue", f"--array=0-{len(numbers) - 1}%{self.options.jobs}", "--output", os.path.join(self.folder, "batches", "said.%a"),
                   "--chdir", os.path.dirname(TOOLS), "--job-name", self.name, "--wrap", "exec " + wrapped]
        number = self._watch(command, "", todo, what)
        if not number:
            with open(os.path.join(self.folder, "batches", "said"), encoding="utf-8") as file:
                raise BadInput(f"sbatch took no job: {file.read().strip()}")

    def _watch(self, command, given, todo, what):
        """Runs an engine until it ends; what it prints."""
        said = os.path.join(self.folder, "batches", "said")
        keys = [key for key, _ in todo]
        with open(said, "w", encoding="utf-8") as errors, tempfile.TemporaryFile("w+") as into, tempfile.TemporaryFile("w+") as printed:
            into.write(given)
            into.seek(0)
            try:
                process = subprocess.Popen(command, stdin=into, stdout=printed, stderr=errors, text=True)
            except FileNotFoundError:
                raise BadInput(f"--engine {self.options.engine}: no program '{command[0]}' (Debian: {'slurm-client' if command[0] == 'sbatch' else command[0]})") from None
            try:
                ended = None
                while ended is None:
                    with contextlib.suppress(subprocess.TimeoutExpired):
                        process.wait(1 + len(keys) / 20_000)
                    ended, left = process.poll(), self._missing(keys)
                    self.progress.some(len(keys) - len(left), what)
                    keys = left
            except BaseException:
                process.terminate()
                process.wait()
                printed.seek(0)
                if command[0] == "sbatch" and (number := printed.read().strip()):
                    subprocess.run(["scancel", number.split(";")[0]], check=False)
                raise
            printed.seek(0)
            return printed.read().strip()

    def cost(self, cells, nodes=(1, 10, 100), processors=2):
        """What 10^6 cells would cost, from the processor time of these shards."""
        each_s = sum(self.cpu_s) / cells
        hours = ", ".join(f"{each_s * 1e6 / 3600 / processors / count:.2g} h on {count}" for count in nodes)
        return f"{self.name}: {cells} cells, {each_s:.2g} s of CPU each; 10^6 on nodes of {processors} processors: {hours}"


def played(function, folder, line):
    """Leaves the result of a line "KEY JOB", or why it is refused."""
    key, text = line.split(" ", 1)
    path = os.path.join(folder, key[:2], key)

    def used_s():
        return sum(one.ru_utime + one.ru_stime for one in (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)))

    before_s = used_s() if played.any else 0.0  # the first pays for the start of its worker
    played.any = True
    try:
        result = function(json.loads(text))
        data = pickle.dumps((used_s() - before_s, result), protocol=4)
    except BadInput as error:
        data, path = str(error).encode(), path + ".refused"
    with tempfile.NamedTemporaryFile(dir=os.path.join(folder, "scratch"), delete=False) as file:
        file.write(data)
    os.replace(file.name, path)


played.any = False


def work(folder, numbers):
    with open(os.path.join(folder, "about.json"), encoding="utf-8") as file:
        about = json.load(file)
    os.environ.update(about["environment"])
    os.chdir(about["folder"])
    tempfile.tempdir = os.path.join(folder, "scratch")  # what a killed worker leaves goes away with it
    loader = importlib.machinery.SourceFileLoader("tool_of_shards", about["file"])
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader(loader.name, loader))
    sys.modules[loader.name] = module
    loader.exec_module(module)
    function = getattr(module, about["function"])
    for number in numbers:
        with open(os.path.join(folder, "batches", number), encoding="utf-8") as lines:
            for line in lines:
                key = line.split(" ", 1)[0]
                if not os.path.exists(os.path.join(folder, key[:2], key)):  # of a batch whose first worker was killed
                    played(function, folder, line)
    if not numbers:
        replies = os.dup(1)
        os.dup2(2, 1)  # what the function prints is no reply
        for line in sys.stdin:
            played(function, folder, line)
            os.write(replies, b"\n")


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt, BrokenPipeError):
        work(sys.argv[1], sys.argv[2:])
