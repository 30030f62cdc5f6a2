# SPDX-License-Identifier: Apache-2.0
"""Messages of ROS 2 as CDR bytes, all messages of one shape at once.

Plain CDR of version 1 in little-endian order (OMG DDS-XTypes 1.3, 7.4.3): four bytes of encapsulation, then each primitive at a multiple of its
size, a string as its length with the closing zero, a sequence as its length. The definitions are in export/ros2.msg.
"""
import os
import re

import numpy as np

ENCAPSULATION = b"\x00\x01\x00\x00"
PRIMITIVES = {"bool": "?", "byte": "u1", "int8": "i1", "uint8": "u1", "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4",
              "float32": "<f4", "float64": "<f8"}
FIELD = re.compile(r"([\w/]+)(?:\[(\d*)\])? (\w+)(?: \d+)?$")
RULE = "=" * 80


def _definitions():
    texts, found = {}, None
    with open(os.path.join(os.path.dirname(os.path.realpath(__file__)), "ros2.msg"), encoding="ascii") as file:
        for line in file.read().splitlines():
            if line.startswith("MSG: "):
                found = texts[line[5:]] = []
            elif not line.startswith("#"):
                found.append(line)
    return texts


TEXTS = _definitions()
FIELDS = {name: [FIELD.match(line).groups() for line in lines] for name, lines in TEXTS.items()}  # (type, length or "" or None, field)


def schema(name):
    """The definition of a type with those of all types in it, as an MCAP schema of encoding ros2msg has them (mcap.dev/spec/registry)."""
    order = [name]
    for one in order:
        order += [kind for kind, _, _ in FIELDS[one] if kind in FIELDS and kind not in order]
    return "\n".join([*TEXTS[name], *(line for one in order[1:] for line in [RULE, "MSG: " + one, *TEXTS[one]])]) + "\n"


class Shape:
    """Where the fields of a message lie, for strings of given text and sequences of given length.

    `given` has the text of each string and the length of each sequence, by path: "header.frame_id", "transforms", "transforms[0].child_frame_id".
    """

    def __init__(self, name, given):
        self._given, self._used = given, set()
        self._names, self._formats, self._offsets = [], [], []
        self._fixed = [(0, ENCAPSULATION)]
        self._end = 0
        self._struct(name, "")
        unknown = set(given) - self._used
        if unknown:
            raise KeyError(f"{name} has no string or sequence {sorted(unknown)}")
        self.size = len(ENCAPSULATION) + self._end
        self.dtype = np.dtype({"names": self._names, "formats": self._formats, "offsets": self._offsets, "itemsize": self.size})

    def _struct(self, name, path):
        for kind, length, field in FIELDS[name]:
            self._field(kind, length, path + field)

    def _field(self, kind, length, path):
        if length is None:
            if kind in PRIMITIVES:
                self._place(path, PRIMITIVES[kind], ())
            elif kind == "string":
                text = self._take(path).encode()
                self._count(len(text) + 1)
                self._put(text + b"\0")
            else:
                self._struct(kind, path + ".")
            return
        count = int(length) if length else self._take(path)
        if not length:
            self._count(count)
        if kind in PRIMITIVES:
            if count:
                self._place(path, PRIMITIVES[kind], (count,))
            return
        for i in range(count):
            self._struct(kind, f"{path}[{i}].")

    def _take(self, path):
        if path not in self._given:
            raise KeyError(f"no text or length for {path}")
        self._used.add(path)
        return self._given[path]

    def _align(self, size):
        self._end += -self._end % size

    def _place(self, path, kind, shape):
        one = np.dtype(kind)
        self._align(one.itemsize)
        self._names.append(path)
        self._formats.append((one, shape))
        self._offsets.append(len(ENCAPSULATION) + self._end)
        self._end += one.itemsize * int(np.prod(shape, dtype=int))

    def _count(self, count):
        self._align(4)
        self._put(count.to_bytes(4, "little"))

    def _put(self, data):
        self._fixed.append((len(ENCAPSULATION) + self._end, data))
        self._end += len(data)

    def rows(self, count, columns):
        """Bytes of `count` messages as a matrix, a message a row. `columns` has values by path, one for all or one for each; a path that is not
        in it is 0. KeyError for a path that the message does not have."""
        rows = np.zeros((count, self.size), np.uint8)
        for offset, data in self._fixed:
            rows[:, offset:offset + len(data)] = np.frombuffer(data, np.uint8)
        fields = rows.view(self.dtype)[:, 0] if count else np.zeros(0, self.dtype)
        for path, values in columns.items():
            if path not in self._names:
                raise KeyError(f"no field {path}")
            fields[path] = values
        return rows
