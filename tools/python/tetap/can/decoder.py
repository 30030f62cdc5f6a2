# SPDX-License-Identifier: Apache-2.0
"""Frames in words and units: `candump -L vcan0 | tools/can/decode_log`, `candump vcan0 | tools/can/decode_log`, `tools/can/decode_log LOG...`

One line per frame: time, interface, id, message, signal=value unit. Enums by name, masks by the names of their bits. A CRC that is wrong
is marked so. Frames of no known message are shown as they are. Malformed lines and frames of wrong length are reported on stderr with
file and line; decoding goes on and the exit status is 1.

--csv writes a table: time_s,interface,id,message,signal,value,unit, a row a signal. With --message it has a row a frame and a column a signal,
`AngX [rad]`, as tetap-import reads it. A value that is not available is an empty cell; frames of no known message are left out.
"""
import argparse
import datetime
import os
import re
import signal
import sys

from tetap.can import bus_database
from tetap.can.bus_writer import DEFAULT_DBC

# candump -L: (time) interface ID#DATA, with _ and a raw length above 8, ID#R[length] (remote), ID##FDATA (CAN FD), then R or T for the direction
LOG = re.compile(rb"\s*\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(#[0-9A-Fa-f]|)([0-9A-Fa-f]*|R[0-8]?)(_[9A-Fa-f])?(?:\s+[RT])?\s*$")
# CAN XL: VCID and priority, then ###flags:type:acceptance#DATA
XL = re.compile(rb"\s*\((\d+\.\d+)\)\s+(\S+)\s+([0-9A-Fa-f]{5})###[0-9A-Fa-f]{2}:[0-9A-Fa-f]{2}:[0-9A-Fa-f]{8}#((?:[0-9A-Fa-f]{2})*)(?:\s+[RT])?\s*$")
# Vector's .asc: seconds channel ID[x] Rx d length bytes, in base hex or base dec; frames that are counted; headings, and events that are no frame
ASC = re.compile(rb"\s*(\d+\.\d+)\s+(\d+)\s+([0-9A-Fa-f]{1,10})(x?)\s+(?:Rx|Tx|TxRq)\s+(?:(r)(?:\s.*)?|d\s+([0-9A-Fa-f]{1,2})((?:\s+[0-9A-Fa-f]{1,3})*)(?:\s+\w+ = .*)?)\s*$")
ASC_COUNTED = re.compile(rb"\s*(\d+\.\d+)\s+(?:(CANFD)\s.*|(\d+)\s+ErrorFrame.*)$")
ASC_OTHER = re.compile(rb"\s*(?:(?:date |base hex|base dec|(?:no )?internal events|// |Begin Trigger|End ).*|\d+\.\d+\s+(?:(?:Start|SV:|CAN)\s.*|\d+\s+Statistic:.*))$", re.IGNORECASE)
# candump: [(time)] interface [RX - -] ID [length] bytes, then the bytes as text; the length of a CAN FD frame has two digits (can-utils, lib.c)
PLAIN = re.compile(rb"\s*(?:\((\d+\.\d+|[\d-]{10} [\d:]{8}\.\d+)\)\s+)?(\S+)\s+(?:(?:RX|TX)\s+\S\s+\S\s+)?([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[(\d+)\]"
                   rb"((?:\s+[0-9A-Fa-f]{2})*)(?:\s+(remote request|ERRORFRAME))?(?:\s+'.*')?\s*$")

ERROR_FLAG = 0x20000000  # candump writes it into the id
INPUTS = 0x20  # offsets below are inputs
AUTO = range(0x300, 0x580, bus_database.BLOCK)  # bases looked for without --base: above it CANopen's SDO begin


class Malformed(Exception):
    """A line that is no frame; the text names the reason."""


def crc8_table():
    """CRC-8 of the DBC's protected messages, polynomial 0x2F."""
    table = []
    for byte in range(256):
        for _ in range(8):
            byte = (byte << 1 ^ 0x2F) & 0xFF if byte & 0x80 else byte << 1
        table.append(byte)
    return table


CRC8 = crc8_table()


def crc8(data):
    crc = 0xFF
    for byte in data:
        crc = CRC8[crc ^ byte]
    return crc ^ 0xFF


def formatter(field, tables, bare=False):
    """A function of the raw value, made once. `bare`: without unit, and empty where it is not available, for a table."""
    if field.enum:
        names = field.values
        return lambda raw: names.get(raw) or "%d (no name)" % raw
    if field.bit_names:
        bits = sorted(tables[field.bit_names].items())
        named = sum(1 << bit for bit, _ in bits)

        def mask(raw):
            words = [name for bit, name in bits if raw >> bit & 1]
            if raw & ~named:
                words.append("0x%X" % (raw & ~named))
            return "|".join(words) or "none"
        return mask
    unit = " " + field.unit if field.unit not in ("", "1") and not bare else ""
    if field.field.endswith("Crc") or (field.wraps and field.length == 32):
        form = "0x%%0%dX" % ((field.length + 3) // 4)
        return lambda raw: form % raw
    if field.scale == 1:
        show = lambda raw: "%d%s" % (raw, unit)  # noqa: E731
    else:
        per_unit, form = field.per_unit, "%%.%df%%s" % -field.scale.as_tuple().exponent
        show = lambda raw: form % (raw / per_unit, unit)  # noqa: E731
    if not field.gap:
        return show
    gap, none = field.gap_code, "" if bare else "not available"
    return lambda raw: none if raw == gap else show(raw)


class Decoder:
    """Offset in the block -> words. Everything that depends on the DBC alone is worked out once."""

    def __init__(self, database, bases, bare=False):
        self.bases = bases
        self.nodes = set()  # bases of nodes that have sent
        self.messages = {}
        for message in database.messages:
            mux = message.mux
            pages = {}
            for page, name in zip(message.pages, message.page_names or [None]):
                pages[page] = ("%s[%s]" % (message.name, name) if name else message.name,
                               [(s.field + "=", s.start, (1 << s.length) - 1, 1 << (s.length - 1) if s.signed else 0,
                                 formatter(s, database.tables, bare)) for s in message.page_signals(page)])
            self.messages[message.offset] = (message, (mux.start, (1 << mux.length) - 1) if mux else None, pages)

    def _base(self, frame_id):
        """Base of the node that the frame belongs to. The ids of a map are those of inputs of a node 64 further on, if there is one."""
        own = frame_id & ~(bus_database.BLOCK - 1)
        maps = own - bus_database.BLOCK if own % (2 * bus_database.BLOCK) and frame_id - own < bus_database.MAP_BLOCK else None
        if self.bases:
            return own if own in self.bases else maps if maps in self.bases else next((b for b in self.bases if b <= frame_id < b + bus_database.BLOCK), None)
        if frame_id - own >= INPUTS:
            self.nodes.add(own)
        found = maps if maps in self.nodes and own not in self.nodes else own
        return found if found in AUTO else None

    def fields(self, frame_id, data):
        """(name of the message and its page, ["Signal=", text] of each, whether its CRC is right); None when it is not ours, Malformed when it
        should be and cannot."""
        base = self._base(frame_id)
        if base is None:
            return None
        entry = self.messages.get(frame_id - base)
        if entry is None:
            return None
        message, mux, pages = entry
        at = "" if base == bus_database.BASE else "@%X" % base
        if len(data) != message.size:
            raise Malformed("%s%s has %d bytes, not %d" % (message.name, at, len(data), message.size))
        word = int.from_bytes(data, "little")
        page = word >> mux[0] & mux[1] if mux else None
        if page not in pages:
            return "%s%s page %d (unknown) %s" % (message.name, at, page, data.hex().upper()), [], True
        name, fields = pages[page]
        text = []
        for label, start, mask, sign, show in fields:
            raw = word >> start & mask
            text.append((label, show((raw ^ sign) - sign)))
        return name + at, text, not message.protected or crc8(bytes([message.offset]) + data[1:]) == data[0]

    def words(self, frame_id, data):
        """The frame in words, None when it is not ours, Malformed when it should be and cannot."""
        found = self.fields(frame_id, data)
        if found is None:
            return None
        name, fields, right = found
        text = [name] + [label + value for label, value in fields]
        if not right:
            text[1] += " (wrong)"
        return " ".join(text)


def cell(text):
    return '"%s"' % text.replace('"', '""') if any(c in text for c in ',"\n') else text


class Rows:
    """Lines of a table in place of words: one a signal, or one a frame of the message that is asked for."""

    def __init__(self, database, bases, message):
        self.decoder, self.message = Decoder(database, bases, bare=True), message
        units = {}
        for one in database.messages:
            for field in one.signals:
                units[one.name, field.field] = field.unit if field.unit != "1" else ""
        self.units = units
        if message is None:
            self.header = "time_s,interface,id,message,signal,value,unit"
            return
        found = next((m for m in database.messages if m.name == message), None)
        if found is None:
            sys.exit("tools/can/decode_log: no message '%s'; there are: %s" % (message, " ".join(m.name for m in database.messages)))
        self.columns = list(dict.fromkeys(field.field + "=" for field in found.signals))
        named = [name[:-1] + (" [%s]" % units[message, name[:-1]] if units[message, name[:-1]] else "") for name in self.columns]
        self.header = ",".join(["time_s", "interface", "id"] + named)

    def lines(self, time, interface, id_text, data):
        if data is None or len(id_text) != 3:
            return ""
        found = self.decoder.fields(int(id_text, 16), data)
        if found is None or not found[1]:
            return ""
        name, fields, right = found
        message = name.partition("@")[0].partition("[")[0]
        if self.message not in (None, message):
            return ""
        if not right:
            raise Malformed("%s: its CRC is wrong" % name)
        head = "%s,%s,%s," % (time.decode() if time else "", cell(interface.decode("ascii", "replace")), id_text.decode())
        if self.message is not None:
            values = dict(fields)
            return head + ",".join(cell(values.get(name, "")) for name in self.columns) + "\n"
        return "".join("%s%s,%s,%s,%s\n" % (head, name, label[:-1], cell(value), self.units[message, label[:-1]]) for label, value in fields)


def asc_decimal(line, before):
    """Whether numbers of an .asc after this line are decimal; `before`: whether they were until it."""
    return b"base dec" in line if line.lstrip().startswith(b"base ") else before


def asc_number(text, decimal, most):
    try:
        value = int(text, 10 if decimal else 16)
    except ValueError:
        raise Malformed("'%s' is no decimal number" % text.decode()) from None
    if value > most:
        raise Malformed("'%s' is above %X" % (text.decode(), most))
    return value


def parse_asc(line, decimal):
    """As parse(); None of a line that is none of an .asc."""
    found = ASC_COUNTED.match(line)
    if found:
        return found[1], found[2] or found[3], b"-", None, "CAN FD" if found[2] else "error frame"
    found = ASC.match(line)
    if not found:
        return None
    time, interface, frame_id, extended, remote, length, payload = found.groups()
    frame_id = b"%0*X" % (8 if extended else 3, asc_number(frame_id, decimal, 0x1FFFFFFF if extended else 0x7FF))
    if remote:
        return time, interface, frame_id, None, "remote request"
    data = bytes(asc_number(byte, decimal, 255) for byte in payload.split())
    if len(data) != min(asc_number(length, decimal, 15), 8):
        raise Malformed("%d bytes announced, %d there" % (min(asc_number(length, decimal, 15), 8), len(data)))
    return time, interface, frame_id, data, None


def checked(time, frame_id):
    """Whether it is an error frame; Malformed where there is no such id, or no such date."""
    number = int(frame_id, 16)
    error = len(frame_id) == 8 and number & ERROR_FLAG != 0
    if number & ~(ERROR_FLAG if error else 0) > (0x7FF if len(frame_id) == 3 else 0x1FFFFFFF):
        raise Malformed("no such id: %s" % frame_id.decode())
    if time and b"-" in time:
        try:
            datetime.datetime.fromisoformat(time[:19].decode())
        except ValueError:
            raise Malformed("no such date: %s" % time.decode()) from None
    return error


def parse(line, decimal=False):
    """(time, interface, id text, data or None, what it is when it is no data frame); None of an .asc's line that is no frame.
    `decimal`: after its line "base dec"."""
    if ASC_OTHER.match(line):
        return None
    found = parse_asc(line, decimal)
    if found:
        return found
    found = XL.match(line)
    if found:
        return *found.groups()[:3], None, "CAN XL, %d bytes" % (len(found.group(4)) // 2)
    found = LOG.match(line)
    if found:
        time, interface, frame_id, fd, payload, code = found.groups()
        error = checked(time, frame_id)
        if payload[:1] == b"R":
            return time, interface, frame_id, None, "remote request"
        if len(payload) % 2:
            raise Malformed("half a byte of data")
        data = bytes.fromhex(payload.decode())
        if fd and len(data) <= 64:
            return time, interface, frame_id, None, "CAN FD, %d bytes" % len(data)
        if code and len(data) != 8:
            raise Malformed("a raw length above 8 with %d bytes" % len(data))
    else:
        found = PLAIN.match(line)
        if not found:
            raise Malformed("no candump line: %s" % shown(line))
        time, interface, frame_id, length, payload, special = found.groups()
        error = checked(time, frame_id) or special == b"ERRORFRAME"
        data = bytes.fromhex(payload.decode())
        if special == b"remote request":
            return time, interface, frame_id, None, "remote request"
        if len(data) != int(length):
            raise Malformed("%d bytes announced, %d there" % (int(length), len(data)))
        if len(length) > 1 and len(data) <= 64:
            return time, interface, frame_id, None, "CAN FD, %d bytes" % len(data)
    if len(data) > 8:
        raise Malformed("%d bytes in a frame" % len(data))
    return time, interface, frame_id, None if error else data, "error frame" if error else None


def shown(line):
    text = line.decode("ascii", "backslashreplace").strip()
    return repr(text[:60] + ("..." if len(text) > 60 else ""))


LONGEST_LINE = 4096 + 256  # digits of the longest CAN XL frame, and what stands before them: nothing longer is a log


def decode(source, name, decoder, out):
    """Number of lines and frames that were wrong. `decoder`: Decoder, or Rows for a table."""
    wrong, decimal = 0, False
    for number, line in enumerate(iter(lambda: source.readline(LONGEST_LINE + 1), b""), 1):
        if len(line) > LONGEST_LINE:
            out.flush()
            print("tools/can/decode_log: %s:%d: a line above %d bytes: %s" % (name, number, LONGEST_LINE, shown(line)), file=sys.stderr, flush=True)
            return wrong + 1
        if not line.strip():
            continue
        try:
            found = parse(line, decimal)
            if found is None:
                decimal = asc_decimal(line, decimal)
                continue
            time, interface, id_text, data, other = found
            words = None
            if isinstance(decoder, Rows):
                out.write(decoder.lines(time, interface, id_text, data))
                continue
            if data is not None and len(id_text) == 3:
                words = decoder.words(int(id_text, 16), data)
        except Malformed as reason:
            out.flush()
            print("tools/can/decode_log: %s:%d: %s" % (name, number, reason), file=sys.stderr, flush=True)
            wrong += 1
            continue
        if words is None:
            words = "? " + (other or " ".join("%02X" % byte for byte in data) or "no data")
        out.write("%s%s %s %s\n" % ("(%s) " % time.decode() if time else "", interface.decode("ascii", "replace"), id_text.decode(), words))
    return wrong


def base_number(text):
    try:
        base = int(text, 0)
    except ValueError:
        raise argparse.ArgumentTypeError("'%s' is no number (0x300 is one)" % text)
    if not 0 <= base <= 0x800 - bus_database.BLOCK:
        raise argparse.ArgumentTypeError("0x%X is no id base: 0 to 0x%X" % (base, 0x800 - bus_database.BLOCK))
    return base


def main():
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", default=["-"], help="candump logs; - or none: stdin")
    parser.add_argument("--base", action="append", type=base_number, metavar="ID",
                        help="id base of a node, repeatable; without: 0x%X, 0x%X ... 0x%X" % (AUTO[0], AUTO[1], AUTO[-1]))
    parser.add_argument("--csv", action="store_true", help="a table with a row for each signal")
    parser.add_argument("--message", metavar="NAME", help="with --csv: a table of this message, a column for each signal")
    parser.add_argument("--dbc", default=DEFAULT_DBC)
    options = parser.parse_args()
    if options.message and not options.csv:
        parser.error("--message goes with --csv")
    wrong = 0
    try:
        database = bus_database.read(options.dbc)
        decoder = Rows(database, options.base, options.message) if options.csv else Decoder(database, options.base)
        if options.csv:
            print(decoder.header)
        for name in options.files:
            try:
                source = sys.stdin.buffer if name == "-" else open(name, "rb")
                live = not os.path.isfile("/dev/stdin") if name == "-" else False
                sys.stdout.reconfigure(line_buffering=live or sys.stdout.isatty())
                wrong += decode(source, "stdin" if name == "-" else name, decoder, sys.stdout)
            except OSError as error:
                print("tools/can/decode_log: %s: %s" % (name, error.strerror), file=sys.stderr)
                wrong += 1
        sys.stdout.flush()
    except bus_database.Refused as refusal:
        sys.exit("tools/can/decode_log: %s" % refusal)
    except KeyboardInterrupt:  # the usual way to stop watching
        try:
            sys.stdout.flush()
        except KeyboardInterrupt:
            pass
    sys.exit(1 if wrong else 0)
