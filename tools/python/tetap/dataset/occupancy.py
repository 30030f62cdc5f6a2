# SPDX-License-Identifier: Apache-2.0
"""Occupancy grids in the form of Nav2's map_server: a PGM image and a YAML beside it.

The shades are those of its trinary mode: 0 occupied, 254 free, 205 unknown, row 0 at the top. A shade's occupancy is (255 - shade) / 255. The
thresholds that are written are 0.65 and 0.196: with Nav2's default of 0.25 for the lower one, a reader takes 205 for free.
"""
import collections
import os
import re

import numpy as np

from tetap.can.bus_writer import BadInput

OCCUPIED, FREE, UNKNOWN = 0, 254, 205
OCCUPIED_ABOVE, FREE_BELOW = 0.65, 0.196
MOST_CELLS = 1 << 26

# shade: rows from the top, one of the three shades above; resolution in m; origin: x, y in m of the lower left corner of the lower left cell
Grid = collections.namedtuple("Grid", "shade resolution origin")


def cast(scans, resolution):
    """Grid of scans: pairs of the scanner's pose (x, y, yaw; m, rad) and the points it saw (n x 2, m, in its own frame). A cell is occupied when
    it ends more beams than 0.65 of those that reach it. A scan counts once in a cell, and its ends count before its way."""
    ends = [pose[:2] + points @ turn(pose[2]).T for pose, points in scans]
    starts = np.array([pose[:2] for pose, _ in scans]).reshape(-1, 2)
    if not scans or not sum(map(len, ends)):
        raise BadInput("the scans have no point")
    everything = np.concatenate([starts] + ends)
    low = np.floor(everything.min(axis=0) / resolution).astype(np.int64) - 1
    size = np.floor(everything.max(axis=0) / resolution).astype(np.int64) + 2 - low
    if size[0] * size[1] > MOST_CELLS:
        raise BadInput(f"the map would have {size[0]} x {size[1]} cells of {resolution} m")
    hits, seen = np.zeros(size[0] * size[1], np.int32), np.zeros(size[0] * size[1], np.int32)
    touched = np.zeros(size[0] * size[1], bool)
    for start, end in zip(starts, ends):
        at_end = cells(end, low, resolution, size)
        touched[:] = False
        touched[at_end] = True
        hits += touched
        length = np.hypot(*(end - start).T).max(initial=resolution)
        for share in np.arange(0, 1, resolution / 2 / length):
            touched[cells(start + (end - start) * share, low, resolution, size)] = True
        seen += touched
    hits, seen = hits.reshape(size[::-1]), seen.reshape(size[::-1])
    share = hits / np.maximum(seen, 1)
    shade = np.where(seen == 0, UNKNOWN, np.where(share > OCCUPIED_ABOVE, OCCUPIED, np.where(share < FREE_BELOW, FREE, UNKNOWN)))
    return Grid(shade[::-1].astype(np.uint8), resolution, tuple(float(v) * resolution for v in low))


def turn(yaw):
    return np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])


def placed(pose, frame):
    """A pose given in a frame, in that in which the frame's own pose is given: x, y, yaw (m, m, rad)."""
    return (*(np.asarray(frame[:2]) + turn(frame[2]) @ np.asarray(pose[:2])), pose[2] + frame[2])


def cells(points, low, resolution, size):
    """Numbers of the cells, by rows from below."""
    column, row = (np.floor(points / resolution).astype(np.int64) - low).T
    return row * size[0] + column


def write(grid, path):
    """path.pgm and path.yaml."""
    rows, columns = grid.shade.shape
    with open(path + ".pgm", "wb") as file:
        file.write(b"P5\n%d %d\n255\n" % (columns, rows) + grid.shade.tobytes())
    with open(path + ".yaml", "w", encoding="ascii") as file:
        file.write(f"image: {os.path.basename(path)}.pgm\nmode: trinary\nresolution: {grid.resolution:.6g}\n"
                   f"origin: [{grid.origin[0]:.6f}, {grid.origin[1]:.6f}, 0]\nnegate: 0\n"
                   f"occupied_thresh: {OCCUPIED_ABOVE}\nfree_thresh: {FREE_BELOW}\n")


def read(path):
    """Grid of a YAML file and the image that it names, as map_server reads them in its trinary mode; P5 with up to 255 shades or P2."""
    facts = {}
    for number, line in enumerate(text_of(path).decode("utf-8", "replace").splitlines(), 1):
        line = line.split("#")[0].rstrip()
        if not line or line == "---":
            continue
        key, colon, value = line.partition(":")
        if not colon or key != key.strip():
            raise BadInput(f"{path}:{number}: expected 'key: value', got {line[:40]!r}")
        facts[key] = value.strip().strip("'\"")
    if facts.get("mode", "trinary") != "trinary":
        raise BadInput(f"{path}: mode is {facts['mode']!r}, expected trinary")
    resolution, above, below = (fact(facts, path, key, 1)[0] for key in ("resolution", "occupied_thresh", "free_thresh"))
    origin, negate = fact(facts, path, "origin", 3), fact(facts, path, "negate", 1)[0]
    if not resolution > 0:
        raise BadInput(f"{path}: resolution is {resolution}, expected above 0")
    if origin[2] != 0:
        raise BadInput(f"{path}: origin has a yaw of {origin[2]}, expected 0")
    if "image" not in facts:
        raise BadInput(f"{path}: image is missing")
    image = shades(os.path.join(os.path.dirname(path), facts["image"]))
    occupancy = image if negate else 1 - image
    shade = np.where(occupancy > above, OCCUPIED, np.where(occupancy < below, FREE, UNKNOWN)).astype(np.uint8)
    return Grid(shade, resolution, (origin[0], origin[1]))


def fact(facts, path, key, count):
    words = facts.get(key, "").strip("[]").replace(",", " ").split()
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count or not np.all(np.isfinite(values)):
        raise BadInput(f"{path}: {key} is {facts.get(key, 'missing')!r}, expected {count} number{'s' if count > 1 else ''}")
    return values


def shades(path):
    """A PGM image as shares of white, rows from the top."""
    data = text_of(path)
    head = re.match(rb"(P[25])((?:\s|#[^\n]*\n)+)(\d+)((?:\s|#[^\n]*\n)+)(\d+)((?:\s|#[^\n]*\n)+)(\d+)\s", data)
    if not head:
        raise BadInput(f"{path}: no PGM image (P5 or P2)")
    columns, rows, white = (int(head.group(i)) for i in (3, 5, 7))
    if not (0 < columns * rows <= MOST_CELLS and 0 < white <= 255):
        raise BadInput(f"{path}: {columns} x {rows} cells of {white} shades")
    body = data[head.end():]
    values = np.frombuffer(body, np.uint8) if head.group(1) == b"P5" else np.array([int(w) for w in body.split() if w.isdigit()])
    if len(values) < columns * rows:
        raise BadInput(f"{path}: {len(values)} cells, expected {columns * rows}")
    return values[:columns * rows].reshape(rows, columns) / white


def text_of(path):
    try:
        with open(path, "rb") as file:
            return file.read()
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None
