# SPDX-License-Identifier: Apache-2.0
"""Lines of one form, `In_WheelCounts Inst=0 Seq=3 Left=1290 Right=1291 --time 0.13`, as frames, all of a form at once.

Taken are lines of plain numbers that are right: everything else (names of enums, masks, errors) is left to tools/can/encode_frame's word by
word, which is the reference. Nothing is refused here.
"""
import re

NUMBER = r"([-+]?(?:\d{1,15}(?:\.\d{0,15})?|\.\d{1,15}))"
TIME = r"(\d{1,10}(?:\.\d{1,6})?)"
SHAPE = re.compile(r"(?<==)\S*|(?<=--time )\S+|(?<=--stamp )\S+")
OPTIONS = ("--time", "--stamp")
STAMP_SPAN = 1 << 20
MOST = 256    # forms of a batch
LEAST = 16    # lines of a form, for less the arrays do not pay
NEAR = 1e-4   # of a step: nearer to half a step is not decided in floating point


def nearest_even(text, per_unit):
    """Steps of a decimal number; the even ones of two that are as near."""
    whole, _, fraction = text.lstrip("+-").partition(".")
    steps, rest = divmod(int(whole + fraction) * per_unit, 10**len(fraction))
    twice = 2 * rest - 10**len(fraction)
    steps += twice > 0 or (twice == 0 and steps & 1)
    return -steps if text.startswith("-") else steps


class Form:
    """The fields of lines of one form in their order, and the bits of what is not given. `good` is False where a word is not known here."""

    def __init__(self, database, shape):
        self.good, self.columns, self.options = False, [], []
        name, *words = shape.split() or [""]
        pattern = [re.escape(name)] + [re.escape(word) + (" " + TIME if word in OPTIONS else NUMBER) for word in words]
        self.pattern = re.compile(r"\s*" + r"\s+".join(pattern) + r"\s*$", re.ASCII)
        message = next((m for m in database.messages if m.name == name), None)
        if message is None or message.mux or message.protected:
            return
        fields = {field.field: field for field in message.page_signals(None)}
        while words:
            word = words.pop(0)
            if word in OPTIONS:
                if word in self.options:
                    return
                self.options.append(word)
                self.columns.append(word)
            else:
                field = fields.get(word[:-1]) if word.endswith("=") else None
                if field is None or field in self.columns or field.bit_names:
                    return
                self.columns.append(field)
        self.message, self.constant, self.stamp = message, 0, None
        for field in fields.values():
            if field in self.columns:
                continue
            if field.field == "Stamp" and self.options:
                self.stamp = field
            elif field.gap_code is not None:
                self.constant |= (field.gap_code & (1 << field.length) - 1) << field.start
            elif field.field not in ("Ctr", "Seq"):
                return
        self.good = True

    def payloads(self, numpy, texts):
        """(times [us] or None, payloads, which of the lines are done), from a list of texts a column."""
        right = numpy.ones(len(texts[0]), dtype=bool)
        word = numpy.full(len(right), self.constant, dtype=numpy.uint64)
        times = {}
        for column, text in zip(self.columns, texts):
            value = numpy.array(text, dtype=numpy.float64)
            if column in self.options:
                steps = value * 1e6
                raw = numpy.rint(steps)
                right &= raw < 2**50
                times[column] = raw.astype(numpy.int64)
                continue
            low, high = column.steps
            steps = value * float(column.per_unit)
            raw = numpy.rint(steps)
            off = numpy.abs(steps - raw)
            if column.scale == 1:
                right &= off == 0
            else:
                for i in numpy.flatnonzero(off > 0.5 - NEAR).tolist():
                    raw[i] = nearest_even(text[i], column.per_unit)
            right &= (raw >= low) & (raw <= high)
            if column.enum:
                right &= numpy.isin(raw, list(column.values))
            raw = numpy.where(right, raw, 0).astype(numpy.int64).astype(numpy.uint64)
            word |= (raw & numpy.uint64((1 << column.length) - 1)) << numpy.uint64(column.start)
        at = times.get("--time")
        if self.stamp is not None:
            stamp = times.get("--stamp", at)
            word |= (stamp.astype(numpy.uint64) & numpy.uint64(STAMP_SPAN - 1)) << numpy.uint64(self.stamp.start)
        return at, word, right


def grouped(database, lines):
    """(form, numbers of its lines, their texts), for the lines that are numbers alone."""
    known, tried, groups = {}, set(), []
    for number, line in enumerate(lines):
        begin = line[:line.find("=")]  # the message and its first field: nearly always one form
        for match, numbers, rows in known.get(begin, ()):
            found = match(line)
            if found:
                numbers.append(number)
                rows.append(found.groups())
                break
        else:
            shape = SHAPE.sub("", line)
            if shape in tried or len(tried) > MOST:
                continue
            tried.add(shape)
            form = Form(database, shape)
            found = form.pattern.match(line) if form.good and form.columns else None
            if found:
                groups.append((form, [number], [found.groups()]))
                known.setdefault(begin, []).append((form.pattern.match, *groups[-1][1:]))
            else:
                tried.discard(shape)
    return [group for group in groups if len(group[1]) >= LEAST]


def frames(database, options, lines):
    """The frames' texts; None where a line is not done here."""
    done = [None] * len(lines)
    if options.time is not None or options.stamp is not None:  # of all lines: word by word
        return done
    groups = grouped(database, lines)
    if not groups:
        return done
    import numpy  # half of the start of a single frame
    for form, numbers, rows in groups:
        at, word, right = form.payloads(numpy, list(zip(*rows)))
        data = word.astype("<u8").tobytes().hex().upper()
        head = "%03X#" % (options.base + form.message.offset)
        if at is None:
            for i in numpy.flatnonzero(right).tolist():
                done[numbers[i]] = head + data[16 * i:16 * i + 16]
            continue
        seconds, micros = (part.tolist() for part in numpy.divmod(at, 10**6))
        line = "(%d.%06d) " + options.interface.replace("%", "%%") + " " + head + "%s"
        for i in numpy.flatnonzero(right).tolist():
            done[numbers[i]] = line % (seconds[i], micros[i], data[16 * i:16 * i + 16])
    return done
