# SPDX-License-Identifier: Apache-2.0
"""Files of MCAP (mcap.dev/spec) of messages that are all in memory: chunks without compression, indexed, each with its CRC."""
import struct
import zlib

import numpy as np

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX = range(1, 11)
STATISTICS, METADATA, METADATA_INDEX, SUMMARY_OFFSET, DATA_END = range(0x0B, 0x10)
CHUNK_BYTES = 1 << 20
MESSAGE_HEAD = np.dtype({"names": ["opcode", "length", "channel", "sequence", "log_time", "publish_time"], "formats": ["u1", "<u8", "<u2", "<u4", "<u8", "<u8"],
                         "offsets": [0, 1, 9, 11, 15, 23], "itemsize": 31})
SEQUENCE = slice(11, 15)


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value):
    data = value.encode()
    return struct.pack("<I", len(data)) + data


def listed(content):
    return struct.pack("<I", len(content)) + content


def texts(pairs):
    return listed(b"".join(text(key) + text(value) for key, value in pairs.items()))


class File:
    """Channels and their messages; bytes() is the file. Times are in ns from 0."""

    def __init__(self, library, metadata=None, attachments=()):
        self.library, self.metadata, self.attachments = library, metadata or {}, attachments  # attachments: (name, media type, bytes)
        self.schemas, self.channels, self.blocks = {}, [], []

    def channel(self, topic, type_name, definition):
        """Number of a channel of CDR messages of a type of ROS 2, pkg/msg/Type, defined by a text of encoding ros2msg."""
        number = self.schemas.setdefault((type_name, definition), len(self.schemas) + 1)
        self.channels.append((topic, number))
        return len(self.channels)

    def add(self, channel, time_ns, rows):
        """Messages of one channel: rows is a matrix of bytes, a message a row."""
        head = np.zeros(len(time_ns), MESSAGE_HEAD)
        head["opcode"], head["length"], head["channel"] = MESSAGE, MESSAGE_HEAD.itemsize - 9 + rows.shape[1], channel
        head["log_time"] = head["publish_time"] = time_ns
        self.blocks.append((channel, np.asarray(time_ns, np.uint64), np.hstack([head.view(np.uint8).reshape(len(time_ns), -1), rows])))

    def _count(self):
        """Numbers the messages of each channel in order of time, from 0: a reader finds a gap by `sequence`."""
        if not self.blocks:
            return
        channel = np.concatenate([np.full(len(times), number) for number, times, _ in self.blocks])
        order = np.lexsort((np.concatenate([times for _, times, _ in self.blocks]), channel))
        ordered, sequence = channel[order], np.empty(len(order), "<u4")
        sequence[order] = np.arange(len(order)) - np.searchsorted(ordered, ordered)
        first = 0
        for _, times, rows in self.blocks:
            rows[:, SEQUENCE] = sequence[first:first + len(times)].view(np.uint8).reshape(-1, 4)
            first += len(times)

    def _records(self):
        """(time, channel, bytes) of each message, in order of time."""
        self._count()
        made = []
        for channel, time_ns, rows in self.blocks:
            data, size = memoryview(rows.tobytes()), rows.shape[1]
            made += [(t, channel, data[i * size:(i + 1) * size]) for i, t in enumerate(time_ns.tolist())]
        made.sort(key=lambda one: one[0])
        return made

    def __bytes__(self):
        definitions = [record(SCHEMA, struct.pack("<H", number) + text(name) + text("ros2msg") + listed(definition.encode()))
                       for (name, definition), number in self.schemas.items()]
        channels = [record(CHANNEL, struct.pack("<HH", i, schema) + text(topic) + text("cdr") + texts({}))
                    for i, (topic, schema) in enumerate(self.channels, 1)]
        out = bytearray(MAGIC + record(HEADER, text("ros2") + text(self.library)))
        metadata_index = b""
        for name, pairs in self.metadata.items():
            one = record(METADATA, text(name) + texts(pairs))
            metadata_index += record(METADATA_INDEX, struct.pack("<QQ", len(out), len(one)) + text(name))
            out += one
        attachment_index = b"".join(self._attach(out, *one) for one in self.attachments)
        out += b"".join(definitions + channels)
        records, chunk_index = self._records(), b""
        chunks = 0
        first = size = 0
        for i, (_, _, data) in enumerate(records, 1):
            size += len(data)
            if size >= CHUNK_BYTES or i == len(records):
                chunk_index += self._chunk(out, records[first:i])
                chunks, first, size = chunks + 1, i, 0
        out += record(DATA_END, struct.pack("<I", zlib.crc32(out)))
        self._summary(out, [(SCHEMA, b"".join(definitions)), (CHANNEL, b"".join(channels)), (CHUNK_INDEX, chunk_index),
                            (ATTACHMENT_INDEX, attachment_index), (METADATA_INDEX, metadata_index), (STATISTICS, self._statistics(records, chunks))])
        return bytes(out)

    @staticmethod
    def _attach(out, name, media_type, data):
        """Appends an attachment without a time; its record of the index."""
        begin, content = len(out), struct.pack("<QQ", 0, 0) + text(name) + text(media_type) + struct.pack("<Q", len(data)) + data
        out += record(ATTACHMENT, content + struct.pack("<I", zlib.crc32(content)))
        return record(ATTACHMENT_INDEX, struct.pack("<QQQQQ", begin, len(out) - begin, 0, 0, len(data)) + text(name) + text(media_type))

    def _chunk(self, out, records):
        """Appends a chunk and its message indexes; its record of the chunk index."""
        content = b"".join(data for _, _, data in records)
        places, at = {}, 0
        for time_ns, channel, data in records:
            places.setdefault(channel, []).append((time_ns, at))
            at += len(data)
        times = struct.pack("<QQ", records[0][0], records[-1][0])
        begin = len(out)
        out += record(CHUNK, times + struct.pack("<QI", len(content), zlib.crc32(content)) + text("") + struct.pack("<Q", len(content)) + content)
        end, offsets = len(out), b""
        for channel, pairs in places.items():
            offsets += struct.pack("<HQ", channel, len(out))
            out += record(MESSAGE_INDEX, struct.pack("<H", channel) + listed(np.array(pairs, "<u8").tobytes()))
        return record(CHUNK_INDEX, times + struct.pack("<QQ", begin, end - begin) + listed(offsets) + struct.pack("<Q", len(out) - end) + text("") +
                      struct.pack("<QQ", len(content), len(content)))

    def _statistics(self, records, chunks):
        counts = {}
        for _, channel, _ in records:
            counts[channel] = counts.get(channel, 0) + 1
        ends = (records[0][0], records[-1][0]) if records else (0, 0)
        return record(STATISTICS, struct.pack("<QHIIIIQQ", len(records), len(self.schemas), len(self.channels), len(self.attachments), len(self.metadata), chunks, *ends) +
                      listed(b"".join(struct.pack("<HQ", *one) for one in counts.items())))

    @staticmethod
    def _summary(out, groups):
        start, offsets = len(out), b""
        summary = b""
        for opcode, content in groups:
            if content:
                offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", opcode, start + len(summary), len(content)))
                summary += content
        footer = struct.pack("<BQQQ", FOOTER, 20, start, start + len(summary))
        summary += offsets + footer
        out += summary + struct.pack("<I", zlib.crc32(summary)) + MAGIC
