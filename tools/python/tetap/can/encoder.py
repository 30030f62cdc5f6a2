# SPDX-License-Identifier: Apache-2.0
"""A frame's bytes from words, `Signal=value`, as tools/can/encode_frame describes them."""
import decimal

from tetap.can import bus_database
from tetap.can import decoder as decode

COUNTERS = ("Ctr", "Seq")
STAMP_SPAN = 1 << 20


class Bad(Exception):
    """An error in the words. The text names it and, where it helps, the alternatives."""


def whole(text):
    try:
        return int(text, 0)
    except ValueError:
        return None


def raw_value(field, text, page_names, tables):
    """The raw value of one signal from what was typed."""
    where = field.where()
    if text == bus_database.NOT_AVAILABLE and field.gap_code is not None:
        return field.gap_code
    if field.is_mux and text in page_names:
        return page_names[text]
    if field.enum:
        names = {name: raw for raw, name in field.values.items()}
        raw = names.get(text, whole(text))
        if raw not in field.values:
            raise Bad("%s: no '%s'; there are: %s" % (where, text, " ".join(names)))
        return raw
    if field.bit_names and whole(text) is None:
        bits = {name: bit for bit, name in tables[field.bit_names].items()}
        if text == "none":
            return 0
        for word in text.split("|"):
            if word not in bits:
                raise Bad("%s: no bit '%s'; there are: %s" % (where, word, " ".join(bits)))
        return sum(1 << bits[word] for word in set(text.split("|")))
    number = whole(text)
    try:
        value = decimal.Decimal(text if number is None else number)
    except decimal.InvalidOperation:
        value = decimal.Decimal("NaN")
    if not value.is_finite():
        raise Bad("%s: '%s' is no number" % (where, text))
    low, high = field.steps
    raw = (value / field.scale).to_integral_value(decimal.ROUND_HALF_EVEN) if abs(value) < 10**18 else None
    if raw is None or not low <= raw <= high:
        raise Bad("%s: %s is out of range: %s to %s%s" % (where, text, low * field.scale, high * field.scale,
                                                         " " + field.unit if field.unit not in ("", "1") else ""))
    if field.scale == 1 and value != raw:
        raise Bad("%s: %s is no whole number" % (where, text))
    return int(raw)


def encode(database, name, words, stamp_us=None):
    """(offset in the node's block, payload) of one frame."""
    message = next((m for m in database.messages if m.name == name), None)
    if message is None:
        raise Bad("no message '%s'; there are: %s" % (name, " ".join(m.name for m in database.messages)))
    given = {}
    for word in words:
        key, equals, text = word.partition("=")
        if not equals:
            raise Bad("'%s' is no Signal=value" % word)
        if key in given:
            raise Bad("%s %s is given twice" % (name, key))
        given[key] = text
    pages = dict(zip(message.page_names, message.pages))
    page = None
    if message.mux:
        mux = message.mux
        if mux.field not in given:
            raise Bad("%s: %s= is missing; there are: %s" % (name, mux.field, " ".join(pages)))
        page = raw_value(mux, given[mux.field], pages, database.tables)
        if page not in message.pages:
            raise Bad("%s: no page %d; there are: %s" % (name, page, " ".join(pages)))
    fields = ([message.mux] if message.mux else []) + message.page_signals(page)
    known = [f.field for f in fields]
    for key in given:
        if key not in known:
            raise Bad("%s has no '%s'; there are: %s" % (name, key, " ".join(known)))
        if key == "Crc" and message.protected:
            raise Bad("%s: the Crc is worked out, not given" % name)
    word = 0
    missing = []
    for field in fields:
        if field.field in given:
            raw = raw_value(field, given[field.field], pages if field.is_mux else {}, database.tables)
        elif field.field == "Stamp" and stamp_us is not None:
            raw = stamp_us % STAMP_SPAN
        elif field.gap_code is not None:
            raw = field.gap_code
        elif field.field in COUNTERS or field.field == "Crc" and message.protected:
            raw = 0
        else:
            missing.append(field.field)
            continue
        word |= (raw & (1 << field.length) - 1) << field.start
    if missing:
        raise Bad("%s: missing, and there is no code for not available: %s" % (name, " ".join(missing)))
    data = bytearray(word.to_bytes(message.size, "little"))
    if message.protected:
        data[0] = decode.crc8(bytes([message.offset]) + bytes(data[1:]))
    return message.offset, bytes(data)
