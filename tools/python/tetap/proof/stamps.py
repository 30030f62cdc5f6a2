# SPDX-License-Identifier: Apache-2.0
"""Stamps by content: whether anything that a step depends on is other than when it last passed.

A stamp is the SHA-256 of a step's command, of what the table declares (files by content, tools by version, environment), and it is kept beside
the log of the run that passed. A step may name further files that it read in the file $TETAP_READS; those are compared, too."""
import glob
import hashlib
import json
import os
import re
import shutil
import subprocess
import threading
import time

# The commit in a program (toolchain/version.cmake), and what is made of it, the image header's CRC and the linker's build id: where it is from, not what it does.
COMMIT = re.compile(rb"tetap-git:.{6}|tetapIMG.{8}|\x04\0\0\0\x14\0\0\0\x03\0\0\0GNU\0.{20}", re.S)
RACY_NS = 2_000_000_000  # a file changed this recently may change again without another time: its hash is not kept
ABSENT = "absent"


def braces(pattern):
    """a{b,c}d as ab d and ac d, as a shell reads it."""
    found = re.search(r"\{([^{}]*)\}", pattern)
    if not found:
        return [pattern]
    return [whole for one in found[1].split(",") for whole in braces(pattern[:found.start()] + one + pattern[found.end():])]


def matches(root, pattern):
    """Files of a pattern, sorted; ** is any number of folders, caches of Python are none."""
    found = set()
    for one in braces(pattern):
        for path in glob.glob(os.path.join(root, one), recursive=True, include_hidden=True):
            if os.path.isfile(path) and "__pycache__" not in path:
                found.add(os.path.relpath(path, root) if path.startswith(root + os.sep) else path)
    return sorted(found)


class Contents:
    """Hashes of files, remembered by inode, size and time of change."""

    def __init__(self, root, path):
        self.root, self.path, self.lock, self.changed = root, path, threading.Lock(), False
        try:
            with open(path, encoding="utf-8") as file:
                self.known = json.load(file)
        except (OSError, ValueError):
            self.known = {}

    def of(self, name):
        path = os.path.join(self.root, name)
        try:
            about = os.stat(path)
            key = [about.st_ino, about.st_size, about.st_mtime_ns, about.st_ctime_ns, about.st_mode & 0o111]
            with self.lock:
                known = self.known.get(name)
            if known and known[0] == key:
                return known[1]
            with open(path, "rb") as file:
                data = file.read()
        except OSError:
            return ABSENT
        if name.startswith("build/"):
            data = COMMIT.sub(b"tetap-git", data)
        digest = hashlib.sha256(data + str(key[4]).encode()).hexdigest()
        if time.time_ns() - max(about.st_ctime_ns, about.st_mtime_ns) > RACY_NS:
            with self.lock:
                self.known[name], self.changed = [key, digest], True
        return digest

    def save(self):
        with self.lock:
            if not self.changed:
                return
            os.makedirs(os.path.dirname(self.path), exist_ok=True)
            with open(self.path + ".new", "w", encoding="utf-8") as file:
                json.dump(self.known, file)
            os.replace(self.path + ".new", self.path)
            self.changed = False


class Versions:
    """Version texts of the tools, asked once."""

    def __init__(self):
        self.known, self.lock = {}, threading.Lock()

    def of(self, tool):
        with self.lock:
            if tool not in self.known:
                self.known[tool] = self.ask(tool)
            return self.known[tool]

    @staticmethod
    def ask(tool):
        if tool.startswith("python3-"):  # a package that the programs import
            import importlib.metadata
            try:
                return importlib.metadata.version(tool.removeprefix("python3-"))
            except importlib.metadata.PackageNotFoundError:
                return ABSENT
        path = shutil.which(tool)
        if path is None:
            return ABSENT
        done = subprocess.run([path, "--version"], capture_output=True, text=True, errors="replace", check=False)
        return done.stdout + done.stderr


class Stamps:
    """Records of runs that passed, one file a step: DIR/NAME.json, its log beside it."""

    def __init__(self, root, directory, environment=None):
        self.root, self.directory = root, directory
        self.contents, self.versions = Contents(root, os.path.join(directory, "contents.json")), Versions()
        self.environment = os.environ if environment is None else environment

    def data(self):
        return self.environment.get("TETAP_DATA") or os.path.join(os.path.dirname(self.root), "shared", "data")

    def settings(self, names):
        """Variables of the environment by pattern: TETAP_* is all that begin so, but for those that only choose what is run."""
        chosen = set()
        for name in names:
            chosen |= {one for one in self.environment if one == name or name.endswith("*") and one.startswith(name[:-1])}
        return {one: self.environment[one] for one in sorted(chosen - {"TETAP_FRESH", "TETAP_READS", "TETAP_DATA"})}

    def declared(self, command, inputs=(), data=(), tools=(), environment=()):
        """The stamp, and a list of what is missing: patterns of inputs without a file."""
        digest, missing = hashlib.sha256(), []

        def add(*words):
            digest.update(("\0".join(words) + "\n").encode())
        add("command", command)
        for pattern in inputs:
            names = matches(self.root, pattern)
            if not names:
                missing.append(pattern)
            for name in names:
                add("file", name, self.contents.of(name))
        for pattern in data:
            for name in matches(self.data(), pattern):
                add("data", name, self.contents.of(os.path.join(self.data(), name)))
        for tool in tools:
            add("tool", tool, self.versions.of(tool))
        for name, value in self.settings(environment).items():
            add("environment", name, value)
        return digest.hexdigest(), missing

    def file(self, name):
        return os.path.join(self.directory, re.sub(r"[^\w.+-]", "_", name) + ".json")

    def passed(self, name, stamp, makes=()):
        """The record of the run that passed with the same inputs, or nothing. Its products have to be there still."""
        try:
            with open(self.file(name), encoding="utf-8") as file:
                record = json.load(file)
        except (OSError, ValueError):
            return None
        if record["stamp"] != stamp or not all(matches(self.root, pattern) for pattern in makes):
            return None
        if any(self.contents.of(path) != digest for path, digest in record["reads"].items()):
            return None
        return record

    def keep(self, name, stamp, record, reads=()):
        os.makedirs(self.directory, exist_ok=True)
        record = dict(record, stamp=stamp, reads={path: self.contents.of(path) for path in sorted(reads)})
        path = self.file(name)
        with open(path + ".new", "w", encoding="utf-8") as file:
            json.dump(record, file, indent=1)
        os.replace(path + ".new", path)

    def forget(self, name):
        if os.path.exists(self.file(name)):
            os.remove(self.file(name))
