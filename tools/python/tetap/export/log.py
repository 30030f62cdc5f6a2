# SPDX-License-Identifier: Apache-2.0
"""A log as topics of ROS 2, and these as one MCAP file or a CSV for each: what tools/can/export_log does."""
import gzip
import os

import numpy as np

from tetap.can import columns
from tetap.can.bus_writer import BadInput
from tetap.dataset import occupancy, planar_scans
from tetap.export import cdr, diagnostics, estimates, mcap, table, topics
from tetap.export.clock import Clock

LIBRARY = "tetap"
TF_STATIC, DIAGNOSTICS = "/tf_static", "/diagnostics"


class Scanner:
    """Where scanner 0 is on the robot (x, y, yaw; m, rad), its ranges that count [m], and the map's cell [m]."""

    def __init__(self, mounting=None, ranges=(0.1, 12.0), resolution=0.05):
        self.mounting, self.ranges, self.resolution = mounting, ranges, resolution


class Export:
    """The topics of one node's log, a path or columns.Messages. `utc_us` is UTC less the node's time, None where the log does not show it."""

    def __init__(self, log, base=0x300, prefix="/tetap", scanner=None, by_boot=False):
        read = isinstance(log, columns.Messages)
        self.path, self.prefix, scanner = "log" if read else str(log), prefix.rstrip("/"), scanner or Scanner()
        self.is_file = not read
        self.messages = messages = log if read else columns.Messages(columns.read(log), base)
        path, base = self.path, messages.base
        self.clock = clock = Clock(messages)
        self.utc_us = None if by_boot else clock.utc_us
        found = estimates.estimates(messages, clock)
        place = topics.origin(messages)
        self.topics = self._estimated(found, place)
        self.topics += self._measured()
        self.topics += self._mapped(scanner)
        rows = [*diagnostics.status(messages, f"tetap 0x{base:X}"), *diagnostics.refusals(messages, f"tetap 0x{base:X}")]
        if found:
            rows += diagnostics.sources(messages, found[-1].instance, f"tetap 0x{base:X}")
        self.status = list(diagnostics.topic(rows, clock)) if len(clock.epochs) else []
        self.topics = [topic for topic in self.topics if len(topic)]
        if not self.topics and not self.status:
            raise BadInput(f"{path}: no estimate and no sample of a node with base 0x{base:X} (--base)")

    def _estimated(self, found, place):
        made = []
        for one in found:
            own = self.prefix if one is found[-1] else f"{self.prefix}/{one.kind.lower()}{one.instance}"
            made.append(topics.odometry(one, own + "/odometry", place))
            if place and not one.is_odometry:
                made.append(topics.position_on_earth(one, own + "/fix", place))
        return made + ([topics.transforms(found)] if found else [])

    def _measured(self):
        made = [topics.imu(self.messages, self.clock, k, f"{self.prefix}/imu{k}") for k in range(4)]
        receivers = sorted(set(self.messages["In_GnssAcc"].Inst.tolist()))
        made += [topics.fix(self.messages, self.clock, k, f"{self.prefix}/gnss{k}/fix") for k in receivers]
        return made + topics.scans(self.messages, self.clock, f"{self.prefix}/scan")

    def _mapped(self, scanner):
        made, last = [], self.clock.epochs[-1] if len(self.clock.epochs) else 0
        if scanner.mounting is not None and len(self.messages["In_ScanHead"]):
            made.append(topics.mounting(self.clock.epochs[0] if len(self.clock.epochs) else 0, "laser0", scanner.mounting))
        if len(self.messages["Est_KeyframePose"]) and len(self.messages["In_ScanHead"]):
            if scanner.mounting is None:
                raise BadInput(f"{self.path}: a map of its scans needs the scanner's place on the robot: --mounting X Y YAW (lidar.x_b_m, y_b_m, yaw_rad)")
            drawn, _ = planar_scans.keyframes(self.messages, self.path)
            made.append(topics.grid(occupancy.cast(list(planar_scans.seen(drawn, scanner.mounting, *scanner.ranges)), scanner.resolution), last))
        return made

    def write_mcap(self, path):
        """The file; (messages, bytes). The log itself is attached, so that its frames can be replayed."""
        offset = self.utc_us or 0
        file = mcap.File(LIBRARY, {"tetap": {"log": os.path.basename(self.path), "clock": "UTC of the recording host" if self.utc_us is not None else "node"}},
                         [self._attached()] if self.is_file else [])
        numbers, count = {}, 0
        for topic in [*self.topics, *self.status]:
            if topic.name not in numbers:
                package, name = topic.kind.split("/")
                numbers[topic.name] = file.channel(topic.name, f"{package}/msg/{name}", cdr.schema(topic.kind))
            file.add(numbers[topic.name], (topic.time_us + offset) * 1000, topic.rows(offset))
            count += len(topic)
        data = bytes(file)
        _write(path, data)
        return count, len(data)

    def _attached(self):
        with open(self.path, "rb") as file:
            return os.path.basename(self.path) + ".gz", "application/gzip", gzip.compress(file.read(), 6, mtime=0)

    def write_tables(self, folder):
        """A CSV for each topic but transforms and the map, which the other tables and tools/dataset/export_map have; their names."""
        try:
            os.makedirs(folder, exist_ok=True)
        except OSError as error:
            raise BadInput(f"{folder}: {error.strerror}") from None
        names = []
        for topic in self.topics:
            if topic.kind in ("tf2_msgs/TFMessage", "nav_msgs/OccupancyGrid"):
                continue
            names.append(topic.name.strip("/").replace("/", "_") + ".csv")
            table.write(topic, self.utc_us, os.path.join(folder, names[-1]))
        if self.status:
            names.append("diagnostics.csv")
            table.write_status(self.status, self.utc_us, os.path.join(folder, names[-1]))
        return names

    def summary(self):
        """Lines: topic, type, messages."""
        kinds = {}
        for topic in [*self.topics, *self.status]:
            kind, count = kinds.get(topic.name, (topic.kind, 0))
            kinds[topic.name] = kind, count + len(topic)
        return [f"{name}  {kind}  {count}" for name, (kind, count) in kinds.items()]


def _write(path, data):
    try:
        with open(path + ".part", "wb") as file:
            file.write(data)
        os.replace(path + ".part", path)
    except OSError as error:
        raise BadInput(f"{path}: {error.strerror}") from None


def span_s(export):
    """First and last time of all topics, by the node's clock."""
    ends = [(topic.time_us.min(), topic.time_us.max()) for topic in [*export.topics, *export.status]]
    return np.min([first for first, _ in ends]) * 1e-6, np.max([last for _, last in ends]) * 1e-6
