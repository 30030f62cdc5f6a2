# SPDX-License-Identifier: Apache-2.0
"""Reads config/tetap.dbc, by canmatrix, and refuses what canmatrix lets pass. Shared by tools/can/generate_messages and tools/can/decode_log."""
import collections
import decimal
import io
import logging
import re

BASE = 0x300          # the id base the DBC is written for
BLOCK = 0x40          # ids of one node
MAP_BLOCK = 0x10      # further ids of a node that maps, directly behind its block: its base is a multiple of 128
NOT_AVAILABLE = "NotAvailable"
NAME_LIMIT = 32
SEND_TYPES = ("Cyclic", "Event", "NoMsgSendType")
# What a signal without a unit may be, beside an enum, a mask, a page and a single bit: a checksum, a sequence or a name in numbers.
# How many there are of something has unit 1.
NO_QUANTITY = re.compile(r"(Crc|Ctr|Seq|Epoch|Id|Inst|Estimator|Git|Config)$")
# How a line of a DBC begins, and what stands alone in its list of new symbols (NS_): anything else is dropped by readers without a word.
LINE = re.compile(r"\s*($|VERSION\s|NS_\s*:|BS_\s*:|BU_\s*:|BO_\s|SG_\s|BO_TX_BU_\s|CM_\s|BA_\s|BA_DEF_\s|BA_DEF_DEF_\s|BA_REL_\s|BA_DEF_REL_\s|"
                  r"VAL_\s|VAL_TABLE_\s|SIG_VALTYPE_\s|SIG_GROUP_\s|SG_MUL_VAL_\s|EV_\s|[A-Z_]+_\s*$)")
FAMILY = re.compile(r"^((?:In_Imu|Est))(\d)(_?\w+)$")   # one struct for all instances: In_Imu0Gyro, Est1_Pos


class Refused(Exception):
    """The DBC is not acceptable; the text names place and reason."""


class Signal:
    """One signal: where its bits are and what they mean."""

    def __init__(self, source, message):
        values = {int(raw): text for raw, text in source.values.items()}
        self.name = source.name
        self.field = source.name.split("_", 1)[1] if "_" in source.name else source.name
        self.start, self.length, self.signed = source.start_bit, source.size, source.is_signed
        self.scale, self.offset = decimal.Decimal(source.factor), decimal.Decimal(source.offset)
        self.little_endian, self.is_float = source.is_little_endian, source.is_float
        self.low, self.high = source.min, source.max
        self.unit, self.comment = source.unit or "", (source.comment or "").strip()
        self.is_mux = source.multiplex == "Multiplexor"
        self.page = None if self.is_mux or source.multiplex is None else int(source.multiplex)
        self.gap_code = next((raw for raw, text in values.items() if text == NOT_AVAILABLE), None)
        self.enum = source.attributes.get("EnumType", "")
        self.bit_names = source.attributes.get("BitNames", "")
        self.wraps = source.attributes.get("Overflow", "Saturates") == "Wraps"
        self.values = values
        self.message = message

    @property
    def gap(self):
        """A code for "not available" outside the range; an enum's is one of its values."""
        return self.gap_code is not None and not self.enum

    @property
    def steps(self):
        """Range of the raw value, without the code for "not available"."""
        low = -(1 << (self.length - 1)) if self.signed else 0
        high = (1 << (self.length - 1 if self.signed else self.length)) - 1
        if self.gap:
            low, high = (low + 1, high) if self.signed else (low, high - 1)
        return low, high

    @property
    def per_unit(self):
        return int(1 / self.scale)

    @property
    def physical(self):
        """A quantity (float, NaN when not available), not a count or a code."""
        return self.scale != 1 or (self.gap and self.unit not in ("", "1"))

    @property
    def needs_unit(self):
        return not (self.enum or self.bit_names or self.is_mux or self.length == 1 or NO_QUANTITY.search(self.field))

    def where(self):
        return "%s %s" % (self.message.name, self.name)


class Message:
    def __init__(self, frame):
        attribute = frame.attributes
        self.name, self.id, self.size = frame.name, frame.arbitration_id.id, frame.size
        self.extended = frame.arbitration_id.extended
        self.offset = self.id - BASE
        self.comment = (frame.comment or "").strip()
        self.sender = frame.transmitters[0] if frame.transmitters else ""
        self.cycle_ms, self.delay_ms = (self._milliseconds(attribute, name) for name in ("GenMsgCycleTime", "GenMsgDelayTime"))
        self.send_type = attribute.get("GenMsgSendType", "")
        self.protected = attribute.get("Protection", "None") != "None"
        self.page_names = attribute.get("PageNames", "").split()
        self.signals = sorted((Signal(s, self) for s in frame.signals), key=lambda s: (s.page or 0, s.start))
        family = FAMILY.match(self.name)
        self.family = family.group(1) + family.group(3) if family else None
        self.instance = int(family.group(2)) if family else 0

    @staticmethod
    def _milliseconds(attribute, name):
        """None when the DBC has none, the text when it is no whole number."""
        text = attribute.get(name)
        return int(text) if text and re.fullmatch(r"-?\d+", str(text)) else text

    @property
    def mux(self):
        return next((s for s in self.signals if s.is_mux), None)

    @property
    def short(self):
        """Prefix of its signals' names."""
        prefix, rest = self.name.split("_", 1) if "_" in self.name else ("", self.name)
        return prefix + rest if prefix.startswith("Est") and prefix != "Est" else rest

    @property
    def struct(self):
        return re.sub(r"\d", "", self.short) if self.family else self.name.replace("_", "")

    def page_signals(self, page):
        return [s for s in self.signals if not s.is_mux and s.page in (None, page)]

    @property
    def pages(self):
        return sorted({s.page for s in self.signals if s.page is not None}) if self.mux else [None]


Database = collections.namedtuple("Database", "messages tables path")


class _Text:
    """The file's own lines: for line numbers, and for what canmatrix drops without a word."""

    def __init__(self, path):
        try:
            with open(path, "rb") as file:
                raw = file.read()
        except OSError as error:
            raise Refused("%s: %s" % (path, error.strerror))
        self.path, self.message_line, self.signal_line, self.signals = path, {}, {}, []
        names = {}
        current, quoted = None, False
        for number, line in enumerate(raw.split(b"\n"), 1):
            try:
                text = line.decode("ascii")
            except UnicodeDecodeError:
                raise Refused("%s:%d: not ASCII; readers disagree about anything else" % (path, number))
            if not quoted and not LINE.match(text):
                raise Refused("%s:%d: no line of a DBC: %s" % (path, number, text.strip()))
            within, quoted = quoted, quoted != (text.replace('\\"', "").count('"') % 2 == 1)
            if within:  # a comment of several lines
                continue
            message = re.match(r"\s*BO_\s+(\d+)\s+(\w+)\s*:", text)
            signal = re.match(r"\s*SG_\s+(\w+)", text)
            if re.match(r"\s*BO_\s", text) and not message:
                raise Refused("%s:%d: not a message: %s" % (path, number, text.strip()))
            if re.match(r"\s*SG_\s", text) and not signal:
                raise Refused("%s:%d: not a signal: %s" % (path, number, text.strip()))
            if message:
                current = message.group(2)
                self._name(current, number)
                for key in (current, int(message.group(1))):
                    if key in self.message_line:
                        raise Refused("%s:%d: message %s: name or id %s is used in line %d already"
                                      % (path, number, current, message.group(1), self.message_line[key]))
                    self.message_line[key] = number
            elif signal:
                name = signal.group(1)
                self._name("%s" % name, number, current)
                if name in names:
                    raise Refused("%s:%d: %s %s: signal name is used in line %d already"
                                  % (path, number, current, name, names[name]))
                names[name] = number
                self.signal_line[current, name] = number
        self.raw = raw

    def _name(self, name, number, message=None):
        if len(name) > NAME_LIMIT:
            raise Refused("%s:%d: %s%s: name has %d characters, more than %d"
                          % (self.path, number, message + " " if message else "", name, len(name), NAME_LIMIT))


def read(path):
    """The database, or Refused."""
    import contextlib
    text = _Text(path)
    log = io.StringIO()
    handler = logging.StreamHandler(log)
    with contextlib.redirect_stdout(io.StringIO()):   # canmatrix reports missing optional formats when imported
        quiet = logging.getLogger("canmatrix")
        quiet.propagate = False
        quiet.setLevel(logging.CRITICAL)
        import canmatrix.formats
        quiet.setLevel(logging.WARNING)
        quiet.addHandler(handler)
        try:
            source = canmatrix.formats.load_flat(io.BytesIO(text.raw), "dbc", dbcImportEncoding="ascii")
        except Exception as error:  # the reader raises anything on broken input
            raise Refused("%s: not readable as DBC: %s" % (path, error or type(error).__name__))
        finally:
            quiet.removeHandler(handler)
    complaint = log.getvalue().strip().split("\n")[0]
    if complaint:
        line = re.search(r"line (\d+)", complaint)
        raise Refused("%s%s: %s" % (path, ":" + line.group(1) if line else "", complaint))
    messages = [Message(frame) for frame in source.frames]
    tables = {name: {int(raw): text for raw, text in table.items()} for name, table in source.value_tables.items()}
    database = Database(sorted(messages, key=lambda m: m.id), tables, path)
    _check(database, text)
    return database


def _check(database, text):
    found = {(m.name, s.name) for m in database.messages for s in m.signals}
    for (message, signal), line in text.signal_line.items():
        if (message, signal) not in found:
            raise Refused("%s:%d: %s %s: line not understood" % (text.path, line, message, signal))
    if not database.messages:
        raise Refused("%s: no messages" % text.path)
    for message in database.messages:
        line = text.message_line.get(message.name)

        def refuse(reason, signal=None):
            at = text.signal_line.get((message.name, signal.name), line) if signal else line
            raise Refused("%s:%s: %s: %s" % (text.path, at, signal.where() if signal else message.name, reason))

        if message.extended or not BASE <= message.id < BASE + BLOCK + MAP_BLOCK:
            refuse("id 0x%X is outside the block 0x%X..0x%X" % (message.id, BASE, BASE + BLOCK + MAP_BLOCK - 1))
        if message.size != 8:
            refuse("length %d, not 8" % message.size)
        if not message.comment:
            refuse("no comment (CM_ BO_)")
        if "_" not in message.name:
            refuse("name has no prefix (In_, Cmd_, Est_)")
        _check_sending(message, refuse)
        _check_pages(message, refuse)
        for signal in message.signals:
            _check_signal(signal, database, lambda reason, signal=signal: refuse(reason, signal))
        _check_overlaps(message, refuse)
        if message.protected:
            layout = [(s.field, s.start, s.length) for s in message.signals[:2]]
            if layout != [("Crc", 0, 8), ("Ctr", 8, 4)]:
                refuse("protected, but does not begin with Crc 0|8 and Ctr 8|4")
    _check_families(database, text)


def _check_sending(message, refuse):
    """The bus load is the sum over all messages, so every message needs a rate."""
    cycle, delay, kind = message.cycle_ms, message.delay_ms, message.send_type
    if kind not in SEND_TYPES:
        refuse("GenMsgSendType is %s, not one of %s" % ("'%s'" % kind if kind else "missing", " ".join(SEND_TYPES)))
    for name, value in (("GenMsgCycleTime", cycle), ("GenMsgDelayTime", delay)):
        if value is not None and not (isinstance(value, int) and 0 <= value <= 65535):
            refuse("%s '%s' is no whole number in 0..65535" % (name, value))
    if kind == "Cyclic" and not cycle:
        refuse("cyclic, but without GenMsgCycleTime")
    if kind != "Cyclic" and cycle:
        refuse("GenMsgCycleTime %d, but not cyclic" % cycle)
    if kind == "Event" and delay is None:
        refuse("on event, but without GenMsgDelayTime (0: too seldom to count)")
    if kind == "Event" and delay == 0 and message.sender == "TETAP":
        refuse("on event from the node, so GenMsgDelayTime must not be 0")
    if kind != "Event" and delay:
        refuse("GenMsgDelayTime %d, but not on event" % delay)


def _check_pages(message, refuse):
    if sum(s.is_mux for s in message.signals) > 1:
        refuse("more than one multiplexor")
    paged = [s for s in message.signals if s.page is not None]
    if paged and not message.mux:
        refuse("pages without multiplexor", paged[0])
    if message.mux and len(message.page_names) != len(message.pages):
        refuse("%d pages but %d PageNames" % (len(message.pages), len(message.page_names)))
    for signal in paged:
        if signal.page > message.mux.steps[1]:
            refuse("page %d does not fit the multiplexor" % signal.page, signal)


def _check_signal(signal, database, refuse):
    if not signal.name.startswith(signal.message.short + "_"):
        refuse("name does not begin with %s_" % signal.message.short)
    if signal.length < 1 or signal.start < 0 or signal.start + signal.length > 64:
        refuse("bits %d..%d are outside the frame" % (signal.start, signal.start + signal.length - 1))
    if not signal.little_endian:
        refuse("big-endian; this bus is little-endian")
    if signal.is_float:
        refuse("float on the bus; this bus has scaled integers only")
    if signal.offset != 0:
        refuse("offset %s; zero is zero on this bus" % signal.offset)
    if not 0 < signal.scale <= 1 or (1 / signal.scale) % 1 != 0 or 1 / signal.scale > 10**9:
        refuse("scale %s is not 1/n" % signal.scale)
    if not signal.comment:
        refuse("no comment (CM_ SG_)")
    if '"' in signal.comment or "\n" in signal.comment:
        refuse("comment is not one plain line")
    if signal.unit not in UNIT_SUFFIX:
        refuse("unit '%s' is not one of %s" % (signal.unit, " ".join(u for u in UNIT_SUFFIX if u)))
    if signal.scale != 1 and signal.gap_code is None:
        refuse("no code for not available (VAL_ with \"%s\")" % NOT_AVAILABLE)
    code = -(1 << (signal.length - 1)) if signal.signed else (1 << signal.length) - 1
    if signal.gap_code is not None and signal.gap_code != code:
        refuse("not available is %d, not %d" % (signal.gap_code, code))
    if signal.wraps and (signal.gap_code is not None or signal.signed or signal.enum):
        refuse("wraps, so it must be unsigned, without a code for not available")
    if signal.enum:
        if signal.enum not in database.tables:
            refuse("EnumType %s is no VAL_TABLE_" % signal.enum)
        _check_names(signal, database.tables[signal.enum], "VAL_TABLE_ " + signal.enum, refuse)
        if signal.scale != 1 or signal.signed or signal.length > 8:
            refuse("enum, so it must be unsigned, of scale 1 and at most 8 bits")
    elif signal.is_mux:
        _check_names(signal, dict(zip(signal.message.pages, signal.message.page_names)), "PageNames", refuse)
    elif signal.bit_names:
        if signal.bit_names not in database.tables:
            refuse("BitNames %s is no VAL_TABLE_" % signal.bit_names)
        # Readers that know no masks show a word at least while one bit is set.
        bits = {1 << bit: name for bit, name in database.tables[signal.bit_names].items() if name != NOT_AVAILABLE}
        _check_names(signal, {0: "None", **bits}, "the bits of VAL_TABLE_ " + signal.bit_names, refuse)
    elif set(signal.values) - {signal.gap_code}:
        refuse("VAL_ without EnumType, BitNames or pages")
    if not signal.unit and (signal.scale != 1 or signal.needs_unit):
        refuse("no unit (a ratio and a count have unit 1)")
    for raw, name in signal.values.items():
        if not re.fullmatch(r"[A-Z]\w*", name):
            refuse("VAL_ %d \"%s\" is no PascalCase name" % (raw, name))
        if raw != signal.gap_code and not signal.steps[0] <= raw <= signal.steps[1]:
            refuse("VAL_ %d \"%s\" does not fit %d bits" % (raw, name, signal.length))
    low, high = (steps * signal.scale for steps in signal.steps)
    if (signal.low, signal.high) != (low, high):
        refuse("range [%s|%s] should be [%s|%s]" % (signal.low, signal.high, plain(low), plain(high)))


def _check_names(signal, names, source, refuse):
    if signal.values != names:
        refuse("VAL_ %s %s" % ("differs from" if signal.values else "is missing, to be", source))


def _check_overlaps(message, refuse):
    for index, b in enumerate(message.signals):
        for a in message.signals[:index]:
            together = a.page is None or b.page is None or a.page == b.page
            if together and a.start < b.start + b.length and b.start < a.start + a.length:
                refuse("overlaps %s (bits %d..%d and %d..%d)" % (a.name, b.start, b.start + b.length - 1,
                                                                 a.start, a.start + a.length - 1), b)


def _check_families(database, text):
    """Instances of one message have one layout and even id distances: one C++ struct serves them all."""
    def layout(message):
        return [(s.field, s.start, s.length, s.signed, s.scale, s.unit, s.page, s.is_mux, s.gap, s.wraps, s.enum, s.comment)
                for s in message.signals] + [(message.page_names, message.protected, message.sender)]

    for messages in families(database).values():
        first = messages[0]
        for index, message in enumerate(messages):
            at = "%s:%s: %s" % (text.path, text.message_line.get(message.name), message.name)
            if message.instance != index:
                raise Refused("%s: instance %d of %s is missing" % (at, index, first.family))
            if message.offset != first.offset + index * stride(messages):
                raise Refused("%s: id is not at an even distance from %s" % (at, first.name))
            if layout(message) != layout(first):
                odd = [a for a, b in zip(layout(message), layout(first)) if a != b]
                what = "signal %s" % odd[0][0] if odd and isinstance(odd[0][0], str) else "number of signals or pages"
                raise Refused("%s: layout differs from %s (%s)" % (at, first.name, what))


def families(database):
    result = {}
    for message in database.messages:
        if message.family:
            result.setdefault(message.family, []).append(message)
    for messages in result.values():
        messages.sort(key=lambda m: m.instance)
    return result


def stride(messages):
    return messages[1].offset - messages[0].offset if len(messages) > 1 else 0


UNIT_SUFFIX = {"": "", "1": "", "m": "_m", "rad": "_rad", "m/s": "_mps", "rad/s": "_radps", "us": "_us", "ms": "_ms",
               "s": "_s", "deg": "_deg", "degC": "_degC", "uT": "_uT", "Pa": "_Pa", "m/s2": "_mps2"}


def plain(number):
    """A Decimal without exponent or trailing zeros."""
    text = format(decimal.Decimal(number), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text
