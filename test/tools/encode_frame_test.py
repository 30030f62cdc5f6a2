#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""What tools/can/encode_frame makes of words, tools/can/decode_log and canmatrix (which knows only the DBC) read back; what it cannot make is refused in one line."""
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import random
import re
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
DBC = os.path.join(ROOT, "config", "tetap.dbc")
TOOL = os.path.join(ROOT, "tools", "can", "encode_frame")
with contextlib.redirect_stdout(io.StringIO()):  # canmatrix reports missing optional formats when imported
    import canmatrix.formats


def tool():
    loader = importlib.machinery.SourceFileLoader("tetap_encode", TOOL)
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("tetap_encode", loader))
    loader.exec_module(module)
    return module


encode = tool()
DATABASE = encode.bus_database.read(DBC)
SOURCE = {frame.name: frame for frame in canmatrix.formats.loadp_flat(DBC, dbcImportEncoding="ascii").frames}


def run(*words):
    return subprocess.run((TOOL,) + words, capture_output=True, text=True, timeout=60)


def crc_bitwise(data):
    crc = 0xFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1 ^ 0x2F) & 0xFF if crc & 0x80 else crc << 1
    return crc ^ 0xFF


def random_words(message, page, chance):
    """(raw by field, the same as words)"""
    raws, words = {}, []
    for field in ([message.mux] if message.mux else []) + message.page_signals(page):
        if message.protected and field.field == "Crc":
            continue
        low, high = field.steps
        raw = page if field.is_mux else chance.choice(sorted(field.values)) if field.enum else chance.choice([low, high, chance.randint(low, high)])
        raws[field.name] = raw
        text = field.values[raw] if field.enum else str(raw * field.scale)
        if field.is_mux and message.page_names:
            text = message.page_names[message.pages.index(page)]
        words.append("%s=%s" % (field.field, text))
    return raws, words


class Encode(unittest.TestCase):
    def each(self):
        chance = random.Random(1)
        for message in DATABASE.messages:
            for page in message.pages:
                for _ in range(20):
                    yield (message, page) + random_words(message, page, chance)

    def test_canmatrix_reads_back_every_signal_of_every_message(self):
        for message, _, raws, words in self.each():
            offset, data = encode.encode(DATABASE, message.name, words)
            self.assertEqual(offset, message.id - 0x300)
            decoded = SOURCE[message.name].decode(bytes(data))
            self.assertEqual({name: int(decoded[name].raw_value) for name in raws}, raws, words)

    def test_our_decoder_says_the_words_again(self):
        decoder = encode.decode.Decoder(DATABASE, None)
        for message, page, raws, words in self.each():
            offset, data = encode.encode(DATABASE, message.name, words)
            text = decoder.words(0x300 + offset, data)
            self.assertNotIn("(wrong)", text)
            self.assertTrue(re.match(re.escape(message.name) + r"(\[| )", text), text)
            for word in words:
                field, value = word.split("=")
                if any(s.field == field and s.enum for s in message.page_signals(page)):
                    self.assertIn(" %s=%s" % (field, value), text)

    def test_the_crc_is_that_of_the_offset_and_bytes_1_to_7(self):
        protected = 0
        for message, _, _, words in self.each():
            if message.protected:
                offset, data = encode.encode(DATABASE, message.name, words)
                self.assertEqual(data[0], crc_bitwise(bytes([offset]) + data[1:]))
                protected += 1
        self.assertGreater(protected, 0)

    def test_what_is_not_given_is_not_available(self):
        text = encode.decode.Decoder(DATABASE, None).words(0x304, encode.encode(DATABASE, "Cmd_SetYaw", ["Yaw=0.5"])[1])
        self.assertIn("StdPos=not available StdYaw=not available", text)

    def test_the_line_is_a_frame_for_cansend_or_a_line_of_a_log(self):
        self.assertRegex(run("In_MapEntry", "Id=7", "X=1", "Y=-2").stdout, r"^305#[0-9A-F]{16}\n$")
        self.assertRegex(run("In_MapEntry", "Id=7", "X=1", "Y=-2", "--base", "0x340").stdout, r"^345#[0-9A-F]{16}\n$")
        line = run("In_BodySpeed", "Inst=0", "Forward=1", "YawRate=0", "--time", "2.5").stdout
        self.assertRegex(line, r"^\(2\.500000\) vcan0 308#[0-9A-F]{16}\n$")
        self.assertEqual(int.from_bytes(bytes.fromhex(line.strip().split("#")[1]), "little") & 0xFFFFF, 2500000 % (1 << 20))

    def test_a_batch_is_the_frames_of_its_lines(self):
        chance, lines, alone = random.Random(3), [], []
        for number in range(40):
            seq, left, time = number % 16, chance.randrange(1 << 16), "%d.%02d" % divmod(95 + number, 100)
            words = ["In_WheelCounts", "Inst=0", "Seq=%d" % seq, "Left=%d" % left, "Right=7", "--time", time, *(["--stamp", "0.5"] if number % 3 == 0 else [])]
            lines.append(" ".join(words))
            stamp = 500000 if number % 3 == 0 else (950 + 10 * number) * 1000
            word = stamp % (1 << 20) | seq << 20 | left << 26 | 7 << 42
            alone.append("(%d.%02d0000) vcan0 306#%s\n" % (*divmod(95 + number, 100), word.to_bytes(8, "little").hex().upper()))
        text = "# a comment\n\n" + "\n".join(lines) + "\n"
        done = subprocess.run([TOOL, "-"], input=text, capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout, "".join(alone))
        self.assertEqual(run(*lines[0].split()).stdout, alone[0])
        based = subprocess.run([TOOL, "-", "--base", "0x340", "--interface", "can1"], input=lines[1] + "\n", capture_output=True, text=True, timeout=60).stdout
        self.assertEqual(based, alone[1].replace("vcan0 306", "can1 346"))

    def test_lines_of_one_form_are_what_each_is_word_by_word(self):
        chance, lines = random.Random(7), []
        for message in DATABASE.messages:
            if message.mux or message.protected:
                continue
            for number in range(60):
                words = []
                for field in message.page_signals(None):
                    low, high = field.steps
                    raw = chance.choice([low, high, chance.randint(low, high)])
                    value = raw * field.scale
                    if field.scale != 1 and low < raw < high:  # halves of a step, exactly
                        value += chance.choice([-1, 0, 1]) * field.scale / 2
                    text = str(sorted(field.values)[0]) if field.enum else str(value)
                    words.append("%s=%s" % (field.field, text))
                lines.append(" ".join([message.name, *words, "--time", "%d.%0*d" % (chance.randrange(10**9), chance.randint(1, 6), chance.randrange(10))]))
        lines += ["In_GnssLat Inst=0 Seq=1 Lat=%s --time 4294967295.999999" % text for text in ("48.", ".5", "-.5", "007", "1e1", "0x10", "+3")] * 20
        chance.shuffle(lines)
        done = subprocess.run([TOOL, "-"], input="\n".join(lines), capture_output=True, text=True, timeout=120)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        options = encode.parser().parse_args(["-"])
        each = encode.line_parser(options)
        alone = [encode.frame_text(DATABASE, each.parse_intermixed_args(line.split())) for line in lines]
        self.assertEqual(done.stdout.splitlines(), alone)
        fast = encode.forms.frames(DATABASE, options, lines)
        self.assertGreater(sum(frame is not None for frame in fast), 0.9 * len(lines))

    def test_a_line_of_a_batch_that_is_wrong_is_named_and_nothing_is_printed(self):
        good = "In_MapEntry Id=7 X=1 Y=2 --time 0.5"
        for bad, reason in (("In_Nothing", "no message 'In_Nothing'"), ("In_MapEntry Id=300", "out of range"), ("In_MapEntry Id=1 X=1 Y=2 --time x", "no time in seconds"),
                            ("In_MapEntry Id=1 X=1 Y=2 --tme 1", "unrecognized arguments: --tme"), ("In_MapEntry Id='1", "No closing quotation"), ("In_MapEntry Id=1 X=134217.728 Y=2 --time 0.5", "out of range"),
                            ("In_MapEntry Id=1.5 X=1 Y=2 --time 0.5", "no whole number")):
            done = subprocess.run([TOOL, "-"], input=f"{good}\n{good}\n{bad}\n" + f"{good}\n" * 40, capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stdout, done.stderr.count("\n")), (1, "", 1), done)
            self.assertIn("line 3: ", done.stderr)
            self.assertIn(reason, done.stderr)
        self.assertIn("beside -", run("-", "Id=7").stderr)

    def test_bad_words_are_refused_in_one_line_that_says_why(self):
        for words, reason in ((["In_Nothing"], "no message 'In_Nothing'"), (["In_MapEntry", "Id=7", "Z=1"], "no 'Z'; there are: Id X Y"),
                              (["In_MapEntry", "Id=300"], "300 is out of range: 0 to 254"), (["In_MapEntry", "Id=1.5"], "no whole number"),
                              (["Cmd_SetPos", "X=1e9", "Y=0"], "out of range: -67108.862 to 67108.862 m"),
                              (["Cmd_SetPos", "X=nan", "Y=0"], "'nan' is no number"), (["Cmd_SetPos", "X"], "no Signal=value"),
                              (["Cmd_SetPos", "X=1", "X=2"], "twice"), (["Cmd_SetPos", "Crc=1"], "worked out"),
                              (["Cmd_Reset", "What=Everything"], "there are: Estimators Counters LandmarkMap"),
                              (["Cmd_Reset"], "missing, and there is no code for not available: What"),
                              (["Est_Diag"], "Page= is missing; there are: "), (["In_Guard", "Page=14"], "no page 14")):
            result = run(*words)
            self.assertEqual((result.returncode, result.stdout, result.stderr.count("\n")), (1, "", 1), result)
            self.assertIn(reason, result.stderr)


if __name__ == "__main__":
    unittest.main()
