#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""tools/can/generate_messages refuses what it must, its load table says what the formula gives, and canmatrix, which knows only the DBC, reads the same
values from our frames as our decoder. $TETAP_RANDOM_FRAMES names the program that prints frames (without it that test is skipped)."""
import contextlib
import decimal
import io
import logging
import os
import re
import select
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.realpath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import bus_database, decoder  # noqa: E402

DBC = os.path.join(ROOT, "config", "tetap.dbc")
TOOL = os.path.join(ROOT, "tools", "can", "generate_messages")
DECODE = os.path.join(ROOT, "tools", "can", "decode_log")
FRAMES = os.environ.get("TETAP_RANDOM_FRAMES")


def run(*command, text=None):
    return subprocess.run(command, input=text, capture_output=True, text=True, timeout=60)


def read(path):
    with open(path) as source:
        return source.read()


def write(path, text):
    with open(path, "w", encoding="latin-1") as out:
        out.write(text)


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)


class Refusals(Folder):
    """Each test breaks the DBC in one place; the tool must say where and why in one line, and fail."""

    def refused(self, old, new, *parts, count=1):
        text = read(DBC)
        self.assertEqual(text.count(old), count, "the test no longer finds what it breaks: %s" % old)
        broken = self.path("broken.dbc")
        write(broken, text.replace(old, new))
        result = run(TOOL, broken)
        self.assertEqual(result.returncode, 1, result)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(broken, result.stderr)
        for part in parts:
            self.assertIn(part, result.stderr)
        return result.stderr

    def each_refused(self, choose, lose, reason, least):
        """Every one that `choose` takes from a message is refused without what `lose` takes from it; one reading serves them all."""
        database = bus_database.read(DBC)
        text = bus_database._Text(DBC)
        chosen = [(m, thing) for m in database.messages for thing in choose(m)]
        self.assertGreaterEqual(len(chosen), least)
        for message, thing in chosen:
            before = dict(vars(thing))
            lose(thing)
            with self.subTest(message=message.name, thing=thing.name), self.assertRaisesRegex(bus_database.Refused, "%s.*%s" % (thing.name, reason)):
                bus_database._check(database, text)
            vars(thing).update(before)

    def test_the_dbc_itself_is_accepted(self):
        result = run(TOOL, DBC)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_overlapping_signals(self):
        said = self.refused("BodySpeed_YawRate : 45|19@1-", "BodySpeed_YawRate : 44|19@1-", "In_BodySpeed BodySpeed_YawRate",
                            "overlaps BodySpeed_Forward", "bits 44..62 and 26..44")
        line = int(re.search(r"broken\.dbc:(\d+):", said).group(1))
        self.assertIn("BodySpeed_YawRate", read(self.path("broken.dbc")).split("\n")[line - 1])

    def test_overlap_within_a_page(self):
        self.refused("Diag_SyncBack m1 : 40|16", "Diag_SyncBack m1 : 39|16", "Diag_SyncBack", "overlaps Diag_SyncLost")

    def test_overlap_of_a_paged_signal_with_one_of_all_pages(self):
        self.refused("Origin_Lon m1 : 4|38@", "Origin_Lon m1 : 3|38@", "Origin_Lon", "overlaps Origin_Source")

    def test_signals_of_different_pages_may_share_bits(self):
        text = read(DBC)
        self.assertIn("Diag_TicksLate m1 : 8|16", text)
        self.assertIn("Diag_TimelineHigh m2 : 8|16", text)

    def test_signal_outside_the_frame(self):
        self.refused("BodySpeed_YawRate : 45|19@1-", "BodySpeed_YawRate : 46|19@1-", "BodySpeed_YawRate", "outside the frame")

    def test_long_signal_name(self):
        self.refused("SG_ BodySpeed_Forward :", "SG_ BodySpeed_ForwardAlongTheBodyAxis :", "33 characters", "broken.dbc:")

    def test_long_message_name(self):
        self.refused("BO_ 776 In_BodySpeed:", "BO_ 776 In_BodySpeedWithANameThatIsTooLong:", "characters", "broken.dbc:")

    def test_duplicate_signal_name_in_one_message(self):
        self.refused("SG_ GnssAcc_Ver :", "SG_ GnssAcc_Hor :", "GnssAcc_Hor", "used in line")

    def test_duplicate_signal_name_in_two_messages(self):
        self.refused("SG_ GnssVelU_Up :", "SG_ GnssVelEN_East :", "GnssVelEN_East", "used in line")

    def test_duplicate_id(self):
        self.refused("BO_ 776 In_BodySpeed:", "BO_ 775 In_BodySpeed:", "In_BodySpeed", "used in line")

    def test_missing_unit(self):
        self.refused('SG_ BodySpeed_Forward : 26|19@1- (0.0001,0) [-26.2143|26.2143] "m/s"',
                     'SG_ BodySpeed_Forward : 26|19@1- (0.0001,0) [-26.2143|26.2143] ""', "BodySpeed_Forward", "no unit")

    def test_missing_unit_of_what_has_scale_one(self):
        for start in ("Sync_Time : 0|48@1+ (1,0) [0|281474976710655]", "WheelCounts_Stamp : 0|20@1+ (1,0) [0|1048575]",
                      "Diag_LoopMean m0 : 32|16@1+ (1,0) [0|65535]", "WheelCounts_Left : 26|16@1+ (1,0) [0|65535]"):
            with self.subTest(start):
                unit = re.search(re.escape(start) + r' ("\S+")', read(DBC)).group(1)
                self.refused("%s %s" % (start, unit), '%s ""' % start, start.split()[0], "no unit")

    def test_no_signal_that_has_a_unit_may_lose_it(self):
        def lose(signal):
            signal.unit = ""
        self.each_refused(lambda m: [s for s in m.signals if s.unit], lose, "no unit", 300)

    def test_unknown_unit(self):
        self.refused('SG_ BodySpeed_Forward : 26|19@1- (0.0001,0) [-26.2143|26.2143] "m/s"',
                     'SG_ BodySpeed_Forward : 26|19@1- (0.0001,0) [-26.2143|26.2143] "kn"', "BodySpeed_Forward", "unit 'kn'")

    def test_unit_that_is_not_ascii(self):
        self.refused('"degC"', '"\xb0C"', "not ASCII", "broken.dbc:", count=5)

    def test_missing_comment_of_a_message(self):
        self.refused("CM_ BO_ 776 ", "CM_ BU_ TETAP ", "In_BodySpeed", "no comment")

    def test_missing_comment_of_a_signal(self):
        self.refused('CM_ SG_ 776 BodySpeed_Forward "along body x, positive forward";', "", "BodySpeed_Forward", "no comment")

    def test_missing_values_of_an_enum(self):
        text = re.search(r"VAL_ 802 Status_Mode .*\n", read(DBC)).group(0)
        self.refused(text, "", "Status_Mode", "VAL_ is missing")

    def test_values_that_differ_from_their_table(self):
        self.refused('VAL_ 768 Sync_Kind 0 "Tick"', 'VAL_ 768 Sync_Kind 0 "Tock"', "Sync_Kind", "differs from VAL_TABLE_ SyncKind")

    def test_values_of_what_is_no_enum(self):
        self.refused('BA_ "EnumType" SG_ 768 Sync_Kind "SyncKind";', "", "Sync_Kind", "without EnumType")

    def test_words_of_a_selector_are_its_page_names(self):
        words = 'VAL_ 807 Origin_Sel 0 "Lat" 1 "Lon" 2 "Height" 3 "Fault" ;'
        self.refused(words, "", "Origin_Sel", "VAL_ is missing, to be PageNames")
        self.refused(words, words.replace('0 "Lat" 1 "Lon"', '0 "Lon" 1 "Lat"'), "Origin_Sel", "differs from PageNames")

    def test_words_of_a_mask_are_its_bits(self):
        words = re.search(r"VAL_ 802 Status_Faults .*\n", read(DBC)).group(0)
        self.refused(words, "", "Status_Faults", "VAL_ is missing, to be the bits of VAL_TABLE_ Fault")
        self.refused(words, words.replace('256 "WheelSlip"', '8 "WheelSlip"'), "Status_Faults", "differs from the bits")
        self.refused(words, words.replace(' 256 "WheelSlip"', ""), "Status_Faults", "differs from the bits")

    def test_missing_code_for_not_available(self):
        self.refused('VAL_ 776 BodySpeed_Forward -262144 "NotAvailable" ;', "", "BodySpeed_Forward", "not available")

    def test_wrong_code_for_not_available(self):
        self.refused('VAL_ 776 BodySpeed_Forward -262144 "NotAvailable" ;', 'VAL_ 776 BodySpeed_Forward 262143 "NotAvailable" ;',
                     "BodySpeed_Forward", "-262144")

    def test_range_that_is_not_that_of_the_bits(self):
        self.refused("(0.0001,0) [-26.2143|26.2143] \"m/s\" TETAP\n SG_ BodySpeed_YawRate",
                     "(0.0001,0) [-30|30] \"m/s\" TETAP\n SG_ BodySpeed_YawRate", "BodySpeed_Forward", "range")

    def test_scale_that_is_not_one_over_n(self):
        self.refused("SG_ BodySpeed_Forward : 26|19@1- (0.0001,0)", "SG_ BodySpeed_Forward : 26|19@1- (0.0003,0)", "BodySpeed_Forward",
                     "scale 0.0003")

    def test_big_endian_signal(self):
        self.refused("SG_ Version_Git : 4|28@1+", "SG_ Version_Git : 7|28@0+", "Version_Git", "big-endian")

    def test_id_outside_the_block(self):
        text = read(DBC)
        broken = self.path("broken.dbc")
        write(broken, text.replace(" 776 ", " 848 "))
        result = run(TOOL, broken)
        self.assertEqual(result.returncode, 1)
        self.assertIn("In_BodySpeed: id 0x350 is outside the block 0x300..0x34F", result.stderr)

    def test_estimators_of_different_layout(self):
        self.refused("SG_ Est2Motion_Epoch : 48|4@1+", "SG_ Est2Motion_Epoch : 56|4@1+", "Est2_Motion", "layout differs from Est0_Motion")

    def test_estimators_of_different_scale(self):
        self.refused('SG_ Est3Motion_Speed : 16|16@1- (0.001,0) [-32.767|32.767]', 'SG_ Est3Motion_Speed : 16|16@1- (0.01,0) [-327.67|327.67]',
                     "Est3_Motion", "signal Speed")

    def test_estimator_at_an_uneven_distance(self):
        text = read(DBC)
        broken = self.path("broken.dbc")
        write(broken, text.replace(" 827 ", " 8 27 ").replace(" 828 ", " 827 ").replace(" 8 27 ", " 828 "))
        result = run(TOOL, broken)
        self.assertEqual(result.returncode, 1)
        self.assertIn("Est3_Motion: id is not at an even distance from Est0_Motion", result.stderr)

    def test_a_line_that_readers_would_drop_without_a_word(self):
        self.refused(' SG_ Reset_What ', ' SGX_ Reset_What ', ": no line of a DBC: SGX_ Reset_What")
        self.refused('\nBO_ 768 ', '\nthis is garbage\nBO_ 768 ', ": no line of a DBC: this is garbage")
        # What stands within a comment of several lines is its, and refused as such.
        self.refused('CM_ SG_ 802 Status_Faults "troubles', 'CM_ SG_ 802 Status_Faults "first\nthis is a comment\ntroubles', "comment is not one plain line")

    def test_cycle_time_that_is_missing_or_zero_or_negative(self):
        line = 'BA_ "GenMsgCycleTime" BO_ 800 10;'
        self.refused(line, "", "Est_Epoch", "without GenMsgCycleTime")
        self.refused(line, line.replace("10", "0"), "Est_Epoch", "without GenMsgCycleTime")
        self.refused(line, line.replace("10", "-10"), "Est_Epoch", "'-10' is no whole number in 0..65535")
        self.refused(line, line.replace("10", "70000"), "Est_Epoch", "'70000' is no whole number in 0..65535")
        self.refused(line, line.replace("10", "10.5"), "Est_Epoch", "'10.5' is no whole number in 0..65535")

    def test_interval_of_an_event_that_is_missing_or_zero_or_negative(self):
        line = 'BA_ "GenMsgDelayTime" BO_ 803 20;'
        self.refused(line, "", "Est_Innov", "without GenMsgDelayTime")
        self.refused(line, line.replace("20", "0"), "Est_Innov", "must not be 0")
        self.refused(line, line.replace("20", "-20"), "Est_Innov", "'-20' is no whole number in 0..65535")
        self.refused('BA_ "GenMsgDelayTime" BO_ 777 20;', "", "In_RangeBearing", "without GenMsgDelayTime")

    def test_send_type_that_is_missing_or_another_than_the_times_say(self):
        line = 'BA_ "GenMsgSendType" BO_ 800 0;'
        self.refused(line, "", "Est_Epoch", "GenMsgSendType is missing")
        self.refused(line, line.replace("800 0", "800 1"), "Est_Epoch", "GenMsgCycleTime 10, but not cyclic")
        self.refused('BA_ "GenMsgSendType" BO_ 803 1;', 'BA_ "GenMsgSendType" BO_ 803 2;', "Est_Innov", "GenMsgDelayTime 20, but not on event")

    def test_no_message_may_lose_its_interval(self):
        def lose(message):
            message.cycle_ms = message.delay_ms = None
        self.each_refused(lambda m: [m] if m.cycle_ms or m.delay_ms else [], lose, "without GenMsg", 35)

    def test_protected_message_without_a_crc_in_front(self):
        self.refused("BA_ \"Protection\" BO_ 770 1;", "BA_ \"Protection\" BO_ 776 1;", "In_BodySpeed", "Crc 0|8")

    def test_signal_line_that_is_none(self):
        self.refused("SG_ BodySpeed_Forward : 26|19@1- (0.0001,0)", "SG_ BodySpeed_Forward : 26-19@1- (0.0001;0)", "broken.dbc:")

    def test_message_line_that_is_none(self):
        self.refused("BO_ 776 In_BodySpeed: 8 HOST", "BO_ In_BodySpeed 776: 8 HOST", "broken.dbc:", "In_BodySpeed")

    def test_values_that_do_not_parse(self):
        self.refused('VAL_ 776 BodySpeed_Forward -262144 "NotAvailable" ;', 'VAL_ 776 BodySpeed_Forward x "NotAvailable" ;', "broken.dbc")

    def test_empty_file_and_no_file(self):
        write(self.path("empty.dbc"), "")
        for path, reason in ((self.path("empty.dbc"), "no messages"), (self.path("none.dbc"), "No such file")):
            result = run(TOOL, path)
            self.assertEqual(result.returncode, 1)
            self.assertIn("%s: %s" % (path, reason), result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)


class Generated(Folder):
    def test_the_header_in_the_repository_is_fresh(self):
        result = run(TOOL, "--check")
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_a_stale_header_is_found_with_its_first_wrong_line(self):
        header = self.path("messages.hpp")
        self.assertEqual(run(TOOL, DBC, "--header", header).returncode, 0)
        self.assertEqual(run(TOOL, DBC, "--header", header, "--check").returncode, 0)
        lines = read(header).split("\n")
        lines[19] += " "
        write(header, "\n".join(lines))
        result = run(TOOL, DBC, "--header", header, "--check")
        self.assertEqual(result.returncode, 1)
        self.assertIn("%s:20: stale" % header, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1)

    def test_a_changed_dbc_makes_the_header_stale(self):
        changed = self.path("tetap.dbc")
        header = self.path("messages.hpp")
        self.assertEqual(run(TOOL, DBC, "--header", header).returncode, 0)
        write(changed, read(DBC).replace("along body x, positive forward", "along x"))
        result = run(TOOL, changed, "--header", header, "--check")
        self.assertEqual(result.returncode, 1)
        self.assertIn("%s:" % header, result.stderr)

    def test_a_header_that_is_right_is_not_written_again(self):
        header = self.path("messages.hpp")
        run(TOOL, DBC, "--header", header)
        os.utime(header, (1, 1))
        run(TOOL, DBC, "--header", header)
        self.assertEqual(os.stat(header).st_mtime, 1)

    def test_the_table_has_every_message_and_signal(self):
        table = self.path("messages.md")
        self.assertEqual(run(TOOL, DBC, "--table", table).returncode, 0)
        text = read(table)
        for name in re.findall(r"^BO_ \d+ (\w+):", read(DBC), re.M):
            self.assertIn(name, text)
        self.assertIn("| Forward | 26..44 | s19 | 0.0001 | m/s | -26.2143 .. 26.2143 | -262144 | along body x, positive forward |", text)

    def test_a_place_that_cannot_be_written_is_one_message(self):
        result = run(TOOL, DBC, "--header", self.path("none/messages.hpp"))
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)


class Load(Folder):
    ROW = re.compile(r"^(.*\S)\s+(\d+)\s+(\d+)\s+([\d.]+) %.*\s(ok|TOO MUCH)$", re.M)

    def test_figures_are_those_of_the_formula(self):
        result = run(TOOL, DBC, "--load")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertIn("135 bits", result.stdout)
        rows = [(int(b), int(f), float(p), ok) for _, b, f, p, ok in self.ROW.findall(result.stdout)]
        self.assertEqual(len(rows), 4)
        for bitrate, frames, percent, verdict in rows:
            self.assertAlmostEqual(percent, 100 * frames * 135 / bitrate, delta=0.1)
            self.assertEqual(verdict, "ok")
        self.assertEqual(rows[0], (500000, 591, 16.0, "ok"))
        self.assertEqual([frames - rows[1][1] for _, frames, _, _ in rows[1:]], [0, 300, 900], "three frames per IMU sample")

    def test_too_many_frames_fail_with_the_line_that_says_so(self):
        busy = self.path("busy.dbc")
        write(busy, read(DBC).replace('"GenMsgCycleTime" BO_ 812 100;', '"GenMsgCycleTime" BO_ 812 2;'))
        result = run(TOOL, busy, "--load")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(self.ROW.findall(result.stdout)[0][4], "TOO MUCH")
        self.assertEqual(result.stderr.count("\n"), 1)


def canmatrix_database():
    logging.disable(logging.CRITICAL)  # it names the formats it has no reader for
    with contextlib.redirect_stdout(io.StringIO()):
        import canmatrix.formats
        return canmatrix.formats.loadp_flat(DBC)


def float32(number):
    return struct.unpack("f", struct.pack("f", number))[0]


class Field:
    """How the C++ struct holds a signal, from the DBC: a float with NaN, steps of a wide signal, or a plain integer."""

    def __init__(self, source):
        self.size, self.factor = source.size, decimal.Decimal(source.factor)
        self.gap_code = next((raw for raw, text in source.values.items() if text == "NotAvailable"), None)
        self.has_gap = self.gap_code is not None and "EnumType" not in source.attributes
        self.wraps = source.attributes.get("Overflow") == "Wraps"
        self.steps = self.factor != 1 and self.size > 24
        self.quantity = not self.steps and (self.factor != 1 or self.has_gap and source.unit not in ("", "1"))
        self.low, self.high = (decimal.Decimal(x) / (self.factor if self.steps else 1) for x in (source.min, source.max))
        bits = next(n for n in (8, 16, 32, 64) if self.size <= n)
        self.not_available = "nan" if self.quantity else -(1 << (bits - 1)) if source.is_signed else (1 << bits) - 1

    def number(self, text):
        if not self.quantity:
            return int(text)
        return "nan" if "nan" in text else float32(float(text))


class Words(unittest.TestCase):
    """What a reader that knows only the DBC shows beside a number."""

    def test_a_single_bit_of_a_mask_and_a_page_have_a_word(self):
        database = {frame.arbitration_id.id: frame for frame in canmatrix_database().frames}

        def word(frame_id, start, raw):
            name = next(s.name for s in database[frame_id].signals if s.start_bit == start)
            return database[frame_id].decode((raw << start).to_bytes(8, "little"))[name].named_value
        self.assertEqual([word(802, 32, raw) for raw in (0, 1 << 8, 1 << 13)], ["None", "WheelSlip", "AttitudeDisagrees"])
        self.assertEqual([word(802, 20, raw) for raw in (0, 1, 1 << 5)], ["None", "Imu", "GnssPosition"])
        self.assertEqual([word(805, 0, 5), word(807, 0, 2), word(830, 0, 1), word(813, 0, 9)], ["Bus", "Height", "More", "ImuHealth"])


@unittest.skipUnless(FRAMES, "TETAP_RANDOM_FRAMES is not set")
class Judge(unittest.TestCase):
    """canmatrix against our encoder and decoder."""

    def test_canmatrix_reads_the_values_our_decoder_reads(self):
        database = {frame.arbitration_id.id: frame for frame in canmatrix_database().frames}
        lines = run(FRAMES, "60").stdout.splitlines()
        seen, bases, gaps, saturated = set(), set(), 0, 0
        for line in lines:
            frame_id, data, values = re.match(r"\(\S+\) vcan0 (\w+)#(\w{16}) ;(.*)", line).groups()
            base = int(frame_id, 16) & ~0x7F  # robots that map have bases 128 apart
            frame = database[int(frame_id, 16) - base + 0x300]
            page = [s for s in frame.signals if s.is_multiplexer]
            decoded = frame.decode(bytes.fromhex(data))
            ours = dict(re.findall(r" (\d+)=(\S+:\S+)", values))
            by_start = {s.start_bit: s for s in frame.signals if s.name in decoded and s not in page}
            self.assertEqual({str(s) for s in by_start}, set(ours), line)
            for start, words in ours.items():
                source = by_start[int(start)]
                value = decoded[source.name]
                where = "%s in %s" % (source.name, line)
                seen.add(source.name)
                bases.add(base)
                kind = Field(source)
                given, read = (kind.number(text) for text in words.split(":"))
                if kind.has_gap and value.raw_value == kind.gap_code:
                    gaps += 1
                    self.assertEqual((given, read), (kind.not_available, kind.not_available), where)
                    continue
                judged = value.raw_value if kind.steps else float32(float(value.phys_value)) if kind.quantity else int(value.phys_value)
                self.assertEqual(judged, read, where)
                saturated += self.check_given(kind, given, decimal.Decimal(value.raw_value if kind.steps else value.phys_value), where)
        everything = {s.name for f in database.values() for s in f.signals if not s.is_multiplexer}
        self.assertEqual(seen, everything, "every signal was judged")
        self.assertEqual(bases, {0x300, 0x380}, "two nodes")
        self.assertGreater(gaps, 100)
        self.assertGreater(saturated, 100)

    def check_given(self, kind, given, value, where):
        """What arrived is what was given, limited to the range, to half a step and a float's rounding; 1 when it was limited."""
        if kind.wraps:
            self.assertEqual(given % (1 << kind.size), value, where)
            return 0
        self.assertNotEqual(given, kind.not_available if kind.has_gap else None, where)
        low, high = (float(x) if kind.quantity else int(x) for x in (kind.low, kind.high))
        limited = min(max(given, low), high)
        slack = 0.5 * float(kind.factor) + 1.2e-7 * abs(limited) if kind.quantity else 0
        self.assertLessEqual(abs(type(limited)(value) - limited), slack, where)
        return int(limited != given)

    def test_tools_decode_prints_the_values_canmatrix_reads(self):
        database = {frame.arbitration_id.id: frame for frame in canmatrix_database().frames}
        lines = [line.split(" ;")[0] for line in run(FRAMES, "10").stdout.splitlines()]
        said = run(DECODE, text="\n".join(lines) + "\n")
        self.assertEqual((said.returncode, said.stderr), (0, ""))
        words = said.stdout.splitlines()
        self.assertEqual(len(words), len(lines))
        for line, text in zip(lines, words):
            frame_id, data = re.search(r" (\w+)#(\w+)", line).groups()
            frame = database[(int(frame_id, 16) & 0x7F) + 0x300]
            for name, value in frame.decode(bytes.fromhex(data)).items():
                source = frame.signal_by_name(name)
                if source.is_multiplexer:
                    continue
                shown = re.search(r" %s=(.*?)(?= \w+=|$)" % name.split("_", 1)[1], text).group(1).replace(" (wrong)", "")
                named = source.values.get(value.raw_value)
                if named == "NotAvailable" and "EnumType" not in source.attributes:
                    self.assertEqual(shown, "not available", text)
                elif "EnumType" in source.attributes:
                    self.assertEqual(shown, named or "%d (no name)" % value.raw_value, text)
                elif "BitNames" not in source.attributes:
                    number = shown.split()[0]
                    number = int(number, 16) if number.startswith("0x") else decimal.Decimal(number)
                    self.assertEqual(number, value.phys_value, text)
                    self.assertEqual(shown.split()[1:], [source.unit] if source.unit not in ("", "1") else [], text)


class Decode(Folder):
    MOTION = "(1700000000.010000) vcan0 32F#102718FC00805500\n"
    WORDS = ("(1700000000.010000) vcan0 32F Est1_Motion Yaw=1.0000 rad Speed=-1.000 m/s YawRate=not available Epoch=5 "
             "PosValid=1 HdgValid=0 VelValid=1\n")

    def said(self, text, *options, code=0):
        result = run(DECODE, *options, text=text)
        self.assertEqual(result.returncode, code, result)
        return result

    def test_says_a_frame_in_words_and_units(self):
        self.assertEqual(self.said(self.MOTION).stdout, self.WORDS)

    def test_reads_files(self):
        log = self.path("run.log")
        write(log, self.MOTION * 3)
        self.assertEqual(self.said("", log, log).stdout, self.WORDS * 6)

    def test_reads_the_plain_format_too(self):
        plain = "  vcan0  32F   [8]  10 27 18 FC 00 80 55 00\n"
        self.assertEqual(self.said(plain).stdout, self.WORDS.split(" ", 1)[1])
        extra = " (1700000000.010000)  vcan0  RX - -  32F   [8]  10 27 18 FC 00 80 55 00   '.'....U.'\n"
        self.assertEqual(self.said(extra).stdout, self.WORDS)
        self.assertIn("32F ? CAN FD, 8 bytes", self.said(plain.replace("[8]", "[08]")).stdout)

    def test_reads_what_other_programs_write(self):
        channel = self.MOTION.replace("vcan0", "/dev/ttyACM0@115200")
        self.assertEqual(self.said(channel).stdout, self.WORDS.replace("vcan0", "/dev/ttyACM0@115200"))
        asc = ("date Sat Nov 28 10:00:00.000 2026\r\nbase hex  timestamps absolute\r\n// version 13.0.0\r\nBegin Triggerblock\r\n   0.000000 Start of measurement\r\n"
               "   0.010000 1  32F             Rx   d 8 10 27 18 FC 00 80 55 00  Length = 244000 BitCount = 126 ID = 815\r\n"
               "   0.020000 1  18FEF100x       Tx   d 2 01 02\r\n   0.030000 1  ErrorFrame\r\n   0.040000 2  302             Rx   r 8\r\nEnd TriggerBlock\r\n")
        self.assertEqual(self.said(asc).stdout, self.WORDS.replace("(1700000000.010000) vcan0", "(0.010000) 1")
                         + "(0.020000) 1 18FEF100 ? 01 02\n(0.030000) 1 - ? error frame\n(0.040000) 2 302 ? remote request\n")
        for line, words in (("123#1122334455667788_F", "123 ? 11 22 33 44 55 66 77 88"), ("123#R8_9", "123 ? remote request"),
                            ("123##1112233445566778899", "123 ? CAN FD, 9 bytes"), ("00123###81:00:12345678#112233445566", "00123 ? CAN XL, 6 bytes")):
            self.assertEqual(self.said("(0.0) can0 " + line + "\n").stdout, "(0.0) can0 " + words + "\n")

    def test_refuses_a_line_that_is_too_long_when_it_is_seen(self):
        result = self.said(self.MOTION + "(0.0) can0 00123###81:00:12345678#" + "0" * 4096 + "\n" + "0" * 5000 + "\n" + self.MOTION, code=1)
        self.assertEqual(result.stdout, self.WORDS + "(0.0) can0 00123 ? CAN XL, 2048 bytes\n")
        self.assertTrue(result.stderr.startswith("tools/can/decode_log: stdin:3: a line above 4352 bytes: "), result.stderr)
        self.assertEqual(self.said("", "/dev/zero", code=1).stdout, "")

    def test_names_enums_pages_and_bits(self):
        self.assertIn("In_Sync Time=1 us Ctr=2 Kind=Step", self.said("(0.0) can0 300#0100000000000201\n").stdout)
        self.assertIn("Est_Origin[Lon] Source=FirstFix Lon=0.000000002 deg", self.said("(0.0) can0 327#1900000000000000\n").stdout)
        self.assertIn("Used=WheelCounts|RangeBearing Faults=none", self.said("(0.0) can0 322#0000200100000000\n").stdout)
        self.assertIn("Mode=15 (no name)", self.said("(0.0) can0 322#00F0000000000000\n").stdout)

    def test_marks_a_wrong_crc(self):
        # CRC-8 H2F over 02 00 00 00 00 00 00 00, worked out bit by bit here
        crc = 0xFF
        for byte in (2, 0, 0, 0, 0, 0, 0, 0):
            crc ^= byte
            for _ in range(8):
                crc = (crc << 1 ^ 0x2F if crc & 0x80 else crc << 1) & 0xFF
        crc ^= 0xFF
        self.assertNotIn("wrong", self.said("(0.0) can0 302#%02X00000000000000\n" % crc).stdout)
        self.assertIn("Crc=0x%02X (wrong)" % (crc ^ 1), self.said("(0.0) can0 302#%02X00000000000000\n" % (crc ^ 1)).stdout)

    def test_finds_nodes_with_other_bases(self):
        other = self.MOTION.replace("32F", "36F")
        self.assertIn("36F Est1_Motion@340 Yaw=1.0000 rad", self.said(other).stdout)
        self.assertIn("36F ? 10 27", self.said(other, "--base", "0x300").stdout)
        self.assertIn("36F Est1_Motion@340 Yaw", self.said(other, "--base", "0x300", "--base", "0x340").stdout)
        self.assertIn("12F Est1_Motion@100 Yaw", self.said(self.MOTION.replace("32F", "12F"), "--base", "256").stdout)
        self.assertIn("is no number", self.said("", "--base", "x", code=2).stderr)

    def test_tells_a_map_from_the_inputs_of_another_node(self):
        frame = "(0.0) can0 340#0700000000000000\n"
        landmark, sync = "340 Est_Landmark Id=7 ", "340 In_Sync@340 Time=7 us"
        self.assertIn(sync, self.said(frame).stdout)  # nothing says otherwise
        self.assertIn(landmark, self.said(self.MOTION + frame).stdout)
        self.assertIn(sync, self.said(self.MOTION + self.MOTION.replace("32F", "36F") + frame).stdout)
        self.assertIn(landmark, self.said(frame, "--base", "0x300").stdout)
        self.assertIn(sync, self.said(frame, "--base", "0x300", "--base", "0x340").stdout)

    def test_shows_what_is_not_ours_as_it_is(self):
        for line, words in (("(0.0) can0 123#DEAD\n", "(0.0) can0 123 ? DE AD\n"),
                            ("(0.0) can0 32F#R\n", "(0.0) can0 32F ? remote request\n"),
                            ("(0.0) can0 0000032F#102718FC00805500\n", "(0.0) can0 0000032F ? 10 27 18 FC 00 80 55 00\n"),
                            ("(0.0) can0 32F##100\n", "(0.0) can0 32F ? CAN FD, 1 bytes\n"),
                            ("(0.0) can0 123#\n", "(0.0) can0 123 ? no data\n")):
            self.assertEqual(self.said(line).stdout, words)
        unused = self.said("(0.0) can0 350#0000000000000000\n", "--base", "0x300")
        self.assertEqual(unused.stdout, "(0.0) can0 350 ? 00 00 00 00 00 00 00 00\n")
        self.assertIn("In_Guard page 13 (unknown) 0D00", self.said("(0.0) can0 301#0D00000000000000\n").stdout)

    def test_the_time_for_a_line_grows_as_its_length(self):
        # A pattern that tries every way to divide a line takes minutes for these; others take at most 3 times an ordinary line's time a byte.
        def seconds(lines):
            began = time.process_time()
            for line in lines:
                for pattern in (decoder.LOG, decoder.PLAIN, decoder.XL, decoder.ASC, decoder.ASC_OTHER):
                    pattern.match(line)
            return time.process_time() - began

        length, ordinary = 40_000, b"(1.0) can0 123#0011223344556677"
        for line in ("(" + "1" * length, "(1." + "1" * length, "(1" + " " * length, "can0 123 [8]" + " 00" * length + " x",
                     "can0 123 [8]" + " " * length + "x", "can0 123 [8] 00 '" + "'  " * length + "x", "(1.0) can0 123#" + "0" * length + "x",
                     "(1.0) can0 123#00" + " " * length + "x", " " * length + "x", "(1.0) " + "a" * length, "can0 123 [" + "1" * length, "1" * length, "1." + "1" * length + "x", "1.0 1 123 Rx d 8" + " 00" * length + "\nx",
                     "(1.0) can0 00123###81:00:12345678#" + "0" * length + "x"):
            for pattern in (decoder.LOG, decoder.PLAIN, decoder.XL, decoder.ASC, decoder.ASC_OTHER):
                self.assertIsNone(pattern.match(line.encode()), line[:20])
            self.assertLess(seconds([line.encode()]), 30 * seconds([ordinary] * (len(line) // len(ordinary))), line[:20])

    def test_reports_malformed_lines_with_their_number_and_goes_on(self):
        bad = ["garbage", "(1.0) vcan0 32F#1", "(1.0) vcan0 32F#00112233445566778899", "(1.0) vcan0 XYZ#00", "\xff\xfe", "(1.0) vcan0 32F",
               "  vcan0  32F   [8]  10 27"]
        for text in bad:
            result = self.said(self.MOTION + text + "\n" + self.MOTION, code=1)
            self.assertEqual(result.stdout, self.WORDS * 2, text)
            self.assertTrue(result.stderr.startswith("tools/can/decode_log: stdin:2: "), result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)

    def test_reports_a_frame_of_wrong_length(self):
        result = self.said("(1.0) vcan0 32F#1027\n" + self.MOTION, code=1)
        self.assertEqual(result.stdout, self.WORDS)
        self.assertEqual(result.stderr, "tools/can/decode_log: stdin:1: Est1_Motion has 2 bytes, not 8\n")

    def test_reports_a_file_that_is_not_there(self):
        result = self.said("", self.path("none.log"), code=1)
        self.assertEqual(result.stderr, "tools/can/decode_log: %s: No such file or directory\n" % self.path("none.log"))

    def test_reports_a_broken_dbc(self):
        write(self.path("bad.dbc"), "BO_ 768 In_Sync: 8 HOST\n")
        result = self.said(self.MOTION, "--dbc", self.path("bad.dbc"), code=1)
        self.assertEqual((result.stdout, result.stderr.count("\n")), ("", 1))

    def live(self):
        process = subprocess.Popen([DECODE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: (process.kill(), process.wait(), process.stdin.close(), process.stdout.close(), process.stderr.close()))
        process.stdin.write(self.MOTION.encode())
        process.stdin.flush()
        self.assertTrue(select.select([process.stdout], [], [], 30)[0], "a line is there as soon as its frame is")
        self.assertEqual(process.stdout.readline().decode(), self.WORDS)
        return process

    def test_prints_each_frame_as_it_comes_and_stops_silently_when_interrupted(self):
        process = self.live()
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(30), 0)
        self.assertEqual(process.stderr.read(), b"")

    def test_stops_silently_when_nobody_reads_on(self):
        process = self.live()
        process.stdout.close()
        end = time.monotonic() + 30
        with contextlib.suppress(BrokenPipeError):
            while process.poll() is None and time.monotonic() < end:
                process.stdin.write(self.MOTION.encode())
                process.stdin.flush()
                time.sleep(0.01)
        self.assertEqual(process.wait(30), -signal.SIGPIPE)
        self.assertEqual(process.stderr.read(), b"")


if __name__ == "__main__":
    unittest.main()
