#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Logs as messages of ROS 2: bytes of another hand's encoder, poses and covariances against scipy's rotations, places against GeographicLib, the file's own
checksums, and what is refused. test/export/judge reads whole files with the libraries of others."""
import gzip
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import numpy as np
from scipy.spatial.transform import Rotation

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(ROOT, "tools", "python"))
from tetap.can import bus_writer  # noqa: E402
from tetap.can.bus_writer import BadInput  # noqa: E402
from tetap.export import cdr  # noqa: E402
from tetap.export.log import Export, Scanner  # noqa: E402

TICK_US = 10_000
# Written by @foxglove/rosmsg2-serialization 3.1.0 with the definitions of rosmsg-msgs-common 3.2.3: type, strings and lengths, values, bytes.
GOLDEN = (
    ("sensor_msgs/NavSatFix", {"header.frame_id": "map"},
     {"header.stamp.sec": 7, "header.stamp.nanosec": 9, "status.status": -1, "status.service": 3, "latitude": 48.5, "longitude": -11.25, "altitude": 520,
      "position_covariance": np.arange(1.0, 10), "position_covariance_type": 2},
     "000100000700000009000000040000006d617000ff00030000000000000000000040484000000000008026c00000000000408040000000000000f03f0000000000000040000000000000"
     "08400000000000001040000000000000144000000000000018400000000000001c400000000000002040000000000000224002"),
    ("sensor_msgs/LaserScan", {"header.frame_id": "laser", "ranges": 3, "intensities": 0},
     {"header.stamp.sec": 7, "header.stamp.nanosec": 9, "angle_min": -1, "angle_max": 1, "angle_increment": 0.5, "scan_time": 0.25, "range_min": 0.125,
      "range_max": 30, "ranges": [1, 2.5, np.inf]},
     "000100000700000009000000060000006c61736572000000000080bf0000803f0000003f000000000000803e0000003e0000f041030000000000803f000020400000807f00000000"),
    ("tf2_msgs/TFMessage", {"transforms": 2, "transforms[0].header.frame_id": "map", "transforms[0].child_frame_id": "odom",
                            "transforms[1].header.frame_id": "odom", "transforms[1].child_frame_id": "base_link"},
     {**{f"transforms[{i}].header.stamp.{field}": value for i in range(2) for field, value in (("sec", 7), ("nanosec", 9))},
      **{f"transforms[{i}].transform.translation.{axis}": 3 * i + k + 1 for i in range(2) for k, axis in enumerate("xyz")},
      "transforms[0].transform.rotation.w": 1, "transforms[1].transform.rotation.z": 1},
     "00010000020000000700000009000000040000006d617000050000006f646f6d00000000000000000000f03f00000000000000400000000000000840000000000000000000000000000000"
     "000000000000000000000000000000f03f0700000009000000050000006f646f6d000000000a000000626173655f6c696e6b00000000000000000000000000104000000000000014400000"
     "00000000184000000000000000000000000000000000000000000000f03f0000000000000000"),
    ("diagnostic_msgs/DiagnosticArray", {"header.frame_id": "", "status": 2, "status[0].name": "a", "status[0].message": "bcd", "status[0].hardware_id": "",
                                         "status[0].values": 1, "status[0].values[0].key": "k", "status[0].values[0].value": "vw", "status[1].name": "x",
                                         "status[1].message": "", "status[1].hardware_id": "y", "status[1].values": 0},
     {"header.stamp.sec": 7, "header.stamp.nanosec": 9, "status[0].level": 2},
     "0001000007000000090000000100000000000000020000000200000002000000610000000400000062636400010000000000000001000000020000006b00000003000000767700000200"
     "0000780000000100000000000000020000007900000000000000"),
    ("nav_msgs/OccupancyGrid", {"header.frame_id": "map", "data": 3},
     {"header.stamp.sec": 7, "header.stamp.nanosec": 9, "info.resolution": 0.5, "info.width": 3, "info.height": 1, "info.origin.position.x": -1,
      "info.origin.position.y": 2, "info.origin.orientation.w": 1, "data": [-1, 0, 100]},
     "000100000700000009000000040000006d61700000000000000000000000003f030000000100000000000000000000000000f0bf000000000000004000000000000000000000"
     "00000000000000000000000000000000000000000000000000000000f03f03000000ff0064"))


class ExportLogTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.log = bus_writer.Log(bus_writer.default_dbc())

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def export(self, **options):
        with open(self.path("raw.log"), "wb") as file:
            file.write(self.log.text())
        return Export(self.path("raw.log"), **options)

    def epochs(self, count, log_us=None, **pages):
        """Epochs 1 to `count`. `pages`: message of estimator 2, or of another by its whole name, -> its values in every epoch."""
        for k in range(1, count + 1):
            at = TICK_US * k if log_us is None else log_us(k)
            self.log.add("Est_Epoch", at, Time=TICK_US * k)
            for name, values in pages.items():
                for one in values if isinstance(values, list) else [values]:
                    values_now = {key: value(k) if callable(value) else value for key, value in one.items()}
                    self.log.add(name if "_" in name else f"Est2_{name}", at, **values_now)
            self.log.add("Est_StateCrc", at, Epoch=k)

    def topic(self, export, name):
        return next(topic for topic in export.topics if topic.name == name)

    def test_bytes_are_those_of_another_encoder(self):
        for kind, given, values, expected in GOLDEN:
            rows = cdr.Shape(kind, given).rows(2, values)
            self.assertEqual([bytes(row).hex() for row in rows], [expected] * 2, kind)

    def turned_robot(self, turn, std_body, yaw_rate=0.3):
        """Epochs of a robot so turned, whose position is uncertain by so much along its own axes; and its covariance in the map by scipy."""
        to_map = turn.as_matrix()
        pose = to_map @ np.diag(np.square(std_body)) @ to_map.T
        velocity_body, spread_body = np.array([1.5, -0.2, 0.1]), np.array([0.02, 0.3, 0.1])
        velocity, spread = to_map @ velocity_body, to_map @ np.diag(spread_body ** 2) @ to_map.T
        x, y, z, w = (Rotation.from_euler("Z", -0.2) * turn).as_quat()  # sent when the heading was another

        def parts(matrix):
            std = np.sqrt(np.diag(matrix))
            return std, matrix / np.outer(std, std)
        (sx, sy, sz), c = parts(pose)
        (se, sn, su), v = parts(spread)
        self.epochs(3, Pos={"X": 12.5, "Y": -3.25, "Kind": 6}, Att={"W": w, "X": x, "Y": y, "Z": z}, Vel=dict(zip(("East", "North", "Up"), velocity)),
                    Motion={"Yaw": turn.as_euler("ZYX")[0], "Speed": 1.5, "YawRate": yaw_rate, "PosValid": 1, "HdgValid": 1, "VelValid": 1},
                    Std=[{"Sel": 0, "StdX": sx, "StdY": sy, "StdYaw": 0.05, "CorrXY": c[0, 1]}, {"Sel": 1, "CorrXYaw": 0, "CorrYYaw": 0, "StdSpeed": 0.03, "StdYawRate": 0.01}],
                    State=[{"Sel": 0, "Height": 4.0, "StdHeight": sz, "JumpZ": 0}, {"Sel": 10, "CorrXZ": c[0, 2], "CorrYZ": c[1, 2]},
                           {"Sel": 3, "StdVelEast": se, "StdVelNorth": sn, "StdVelUp": su}, {"Sel": 11, "CorrVelEN": v[0, 1], "CorrVelEU": v[0, 2], "CorrVelNU": v[1, 2]},
                           {"Sel": 4, "StdTiltEast": 0.01, "StdTiltNorth": 0.02}, {"Sel": 12, "CorrTiltEN": 0.5, "CorrTiltEYaw": 0.25, "CorrTiltNYaw": -0.5}])
        return pose, velocity_body, np.diag((0.03, 0.3, 0.1)) ** 2  # forward as the node states it

    def test_a_turned_robot_has_its_pose_in_the_map_and_its_twist_in_the_body(self):
        for angles in ((0, 0, 0), (70, 0, 0), (-160, 20, 0), (130, -15, 25)):
            self.log = bus_writer.Log(bus_writer.default_dbc())
            turn = Rotation.from_euler("ZYX", angles, degrees=True)
            pose, velocity, spread = self.turned_robot(turn, (2.0, 0.5, 1.0))
            topic = self.topic(self.export(), "/tetap/odometry")
            self.assertEqual(topic.given, {"header.frame_id": "map", "child_frame_id": "base_link"})
            np.testing.assert_array_equal(topic.time_us, TICK_US * np.arange(1, 4))
            value = {path: np.broadcast_to(one, (3, *np.shape(one)[1:]))[-1] for path, one in topic.columns.items()}
            q = [value[f"pose.pose.orientation.{axis}"] for axis in "xyzw"]
            self.assertLess((Rotation.from_quat(q) * turn.inv()).magnitude(), 2e-4)  # steps of Att and Yaw
            np.testing.assert_allclose([value[f"pose.pose.position.{axis}"] for axis in "xyz"], (12.5, -3.25, 4.0), atol=1e-9)
            covariance = value["pose.covariance"].reshape(6, 6)
            np.testing.assert_allclose(covariance[:3, :3], pose, atol=4e-3)
            np.testing.assert_allclose(covariance[3:, 3:], [[1e-4, 1e-4, 1.25e-4], [1e-4, 4e-4, -5e-4], [1.25e-4, -5e-4, 2.5e-3]], atol=1e-6)
            np.testing.assert_array_equal(covariance[:3, 3:], 0)
            np.testing.assert_allclose([value[f"twist.twist.linear.{axis}"] for axis in "xyz"], velocity, atol=1e-3)
            np.testing.assert_allclose([value[f"twist.twist.angular.{axis}"] for axis in "xyz"], (0, 0, 0.3), atol=1e-9)
            twist = value["twist.covariance"].reshape(6, 6)
            np.testing.assert_allclose(twist[:3, :3], spread, atol=2e-4)
            np.testing.assert_allclose(np.diag(twist)[3:], (1e6, 1e6, 1e-4))

    def test_what_is_published_is_a_covariance_or_says_nothing(self):
        self.epochs(2, Pos={"X": 0, "Y": 0, "Kind": 6}, Motion={"Yaw": 0, "Speed": 0, "YawRate": 0, "PosValid": 1},
                    Std=[{"Sel": 0, "StdX": 1, "StdY": 1, "StdYaw": 0.1, "CorrXY": 0}, {"Sel": 1, "CorrXYaw": 0.9, "CorrYYaw": 0, "StdSpeed": np.nan, "StdYawRate": np.nan}],
                    State=[{"Sel": 4, "StdTiltEast": 0.01, "StdTiltNorth": 0.02}, {"Sel": 12, "CorrTiltEN": 0, "CorrTiltEYaw": 0.9, "CorrTiltNYaw": 0}])
        columns = self.topic(self.export(), "/tetap/odometry").columns
        pose = columns["pose.covariance"][-1].reshape(6, 6)
        self.assertGreater(np.linalg.eigvalsh(pose).min(), 0)
        self.assertAlmostEqual(pose[0, 5], 0.09, places=4)  # 0.9 twice with 0 between is no covariance: that of the tilt goes
        self.assertEqual(pose[3, 5], 0)
        self.assertEqual(pose[2, 2], 1e6)
        np.testing.assert_allclose(np.diag(columns["twist.covariance"][-1].reshape(6, 6)), 1e6)

    def test_transforms_of_odometry_and_map_make_the_map_pose(self):
        self.epochs(4, Est0_Pos={"X": lambda k: 1.0 * k, "Y": 0.5, "Kind": 1}, Est0_Motion={"Yaw": 0.7, "Speed": 1, "YawRate": 0, "PosValid": 0}, Pos={"X": 5, "Y": lambda k: 2.0 * k, "Kind": 6}, Motion={"Yaw": -2.1, "Speed": 1, "YawRate": 0, "PosValid": 1},
                    Att=dict(zip("XYZW", Rotation.from_euler("ZYX", (-2.1, 0.1, -0.05)).as_quat())), State={"Sel": 0, "Height": 1.5, "StdHeight": 1, "JumpZ": 0})
        topic = self.topic(self.export(), "/tf")
        self.assertEqual([topic.given[f"transforms[{i}].{field}"] for i in (0, 1) for field in ("header.frame_id", "child_frame_id")],
                         ["map", "odom", "odom", "base_link"])
        link = [[np.stack([topic.columns[f"transforms[{i}].transform.{part}.{axis}"] for axis in axes], axis=1) for part, axes in (("translation", "xyz"), ("rotation", "xyzw"))]
                for i in (0, 1)]
        outer, inner = Rotation.from_quat(link[0][1]), Rotation.from_quat(link[1][1])
        np.testing.assert_allclose(outer.apply(link[1][0]) + link[0][0], [[5, 2.0 * k, 1.5] for k in range(1, 5)], atol=1e-9)
        self.assertLess(((outer * inner) * Rotation.from_euler("ZYX", (-2.1, 0.1, -0.05)).inv()).magnitude().max(), 2e-4)
        np.testing.assert_allclose(link[1][0], [[k, 0.5, 0] for k in range(1, 5)])

    def test_samples_of_sensors_have_their_units_and_full_stamps(self):
        self.epochs(300)
        stamp = 2_500_123  # beyond the 20 bits of a stamp
        kind = bus_writer.default_dbc().tables["GnssFix"]
        for k, (fix, status) in enumerate((("Fix3D", 0), ("RtkFixed", 2), ("TimeOnly", -1))):
            at, seq = {"Stamp": (stamp + k) & 0xFFFFF, "Seq": k}, 2_500_200 + 10 * k
            self.log.add("In_GnssLat", seq, Lat=-33.5, **at)
            self.log.add("In_GnssLon", seq, Lon=151.25, **at)
            self.log.add("In_GnssAlt", seq, Height=17.5, Fix=kind[fix], NumSv=9, **at)
            self.log.add("In_GnssAcc", seq, Hor=1.5, Ver=2.5, **at)
        self.log.add("In_Imu1Gyro", 2_500_300, AngX=0.001, AngY=-0.002, AngZ=0.004, Seq=5)
        self.log.add("In_Imu1Accel", 2_500_300, VelX=0.01, VelY=-0.02, VelZ=0.0981, Seq=5)
        self.log.add("In_Imu1Time", 2_500_300, Stamp=stamp & 0xFFFFF, Interval=10_000, Seq=5)
        self.log.add("In_Imu1Time", 2_510_300, Stamp=(stamp + TICK_US) & 0xFFFFF, Interval=10_000, Seq=6)  # its increments are missing
        export = self.export()
        fixes, imu = self.topic(export, "/tetap/gnss0/fix"), self.topic(export, "/tetap/imu1")
        np.testing.assert_array_equal(fixes.time_us, stamp + np.arange(3))
        np.testing.assert_array_equal(fixes.columns["status.status"], (0, 2, -1))
        np.testing.assert_allclose(fixes.columns["position_covariance"][0], np.diag((2.25, 2.25, 6.25)).ravel())
        self.assertEqual((fixes.columns["latitude"][0], fixes.columns["longitude"][0], fixes.columns["altitude"][0]), (-33.5, 151.25, 17.5))
        np.testing.assert_array_equal(imu.time_us, [stamp])
        np.testing.assert_allclose([imu.columns[f"angular_velocity.{axis}"][0] for axis in "xyz"], (0.1, -0.2, 0.4))
        np.testing.assert_allclose([imu.columns[f"linear_acceleration.{axis}"][0] for axis in "xyz"], (1, -2, 9.81))
        self.assertEqual(imu.columns["orientation_covariance"][0, 0], -1)

    def test_the_estimate_has_its_place_on_the_earth(self):
        self.log.add("Est_Origin", 1, Sel=0, Source=1, Lat=60.0)
        self.log.add("Est_Origin", 1, Sel=1, Source=1, Lon=25.0)
        self.log.add("Est_Origin", 1, Sel=2, Source=1, Height=30.0)
        self.epochs(2, Pos={"X": 40_000, "Y": -20_000, "Kind": 6}, Motion={"Yaw": 0, "Speed": 0, "YawRate": 0, "PosValid": 1},
                    Std={"Sel": 0, "StdX": 3, "StdY": 1, "StdYaw": 0, "CorrXY": 0}, State={"Sel": 0, "Height": 5, "StdHeight": 2, "JumpZ": 0})
        export = self.export()
        fix = self.topic(export, "/tetap/fix").columns
        judge = subprocess.run(["CartConvert", "-r", "-l", "60", "25", "30", "-p", "9"], input="40000 -20000 5", capture_output=True, text=True, check=True)
        lat, lon, height = map(float, judge.stdout.split())
        np.testing.assert_allclose((fix["latitude"][-1], fix["longitude"][-1]), (lat, lon), atol=1e-10)
        self.assertAlmostEqual(fix["altitude"][-1], height, places=5)
        meridians = np.radians((lon - 25) * np.sin(np.radians(60)))  # they converge: the axes there are turned against the map's
        expected = np.array([[np.cos(meridians), np.sin(meridians)], [-np.sin(meridians), np.cos(meridians)]])
        np.testing.assert_allclose(fix["position_covariance"][-1].reshape(3, 3)[:2, :2], expected @ np.diag((9, 1)) @ expected.T, atol=5e-3)
        export.write_tables(self.path("tables"))
        with open(self.path("tables/tetap_odometry.csv"), encoding="ascii") as file:
            head, *rows = [line.split(",") for line in file.read().splitlines()]
        row = dict(zip(head, rows[-1]))
        self.assertAlmostEqual(float(row["latitude_deg"]), lat, places=8)
        self.assertEqual((len(rows), row["pose.pose.position.x"], row["pose.covariance[0]"]), (2, "40000", "9"))

    def test_stamps_are_of_the_calendar_where_the_log_was_recorded_live(self):
        begin = 1_795_940_861_000_000
        self.epochs(50, log_us=lambda k: begin + TICK_US * k + 300 * (k % 7), Pos={"X": 0, "Y": 0, "Kind": 6}, Motion={"PosValid": 1, "Yaw": 0, "Speed": 0, "YawRate": 0})
        self.assertEqual(self.export().utc_us, begin)
        self.assertIsNone(self.export(by_boot=True).utc_us)
        self.export().write_mcap(self.path("a.mcap"))
        with open(self.path("a.mcap"), "rb") as file:
            self.assertIn(struct.pack("<iI", 1_795_940_861, 20_000_000), file.read())
        self.log = bus_writer.Log(bus_writer.default_dbc())  # a replay faster than time shows no calendar
        self.epochs(50, log_us=lambda k: begin + 50 * k, Pos={"X": 0, "Y": 0, "Kind": 6}, Motion={"PosValid": 1, "Yaw": 0, "Speed": 0, "YawRate": 0})
        self.assertIsNone(self.export().utc_us)

    def test_time_goes_on_behind_a_power_cycle(self):
        """Two runs of 300 epochs, the second 7 s behind the first by the clock of the recording host; times of a host, of none, and faster than time."""
        begin, cycle = 1_795_940_861_000_000, 7_000_000
        for log_us, apart in ((lambda k: begin + TICK_US * k, cycle), (lambda k: TICK_US * k, cycle), (lambda k: begin + 50 * k, 300 * TICK_US)):
            self.log = bus_writer.Log(bus_writer.default_dbc())
            moves = {"Pos": {"X": 0, "Y": 0, "Kind": 6}, "Motion": {"PosValid": 1, "Yaw": 0, "Speed": 0, "YawRate": 0}}
            self.epochs(300, log_us=log_us, Std={"Sel": 0, "StdX": 3, "StdY": 1, "StdYaw": 0, "CorrXY": 0}, **moves)
            for stamp in (20_000, 10_000):  # of samples from before its first epoch, the older one comes last
                at = log_us(1) + cycle - 2000
                for name, values in (("Gyro", "Ang"), ("Accel", "Vel")):
                    self.log.add(f"In_Imu0{name}", at, Seq=stamp // TICK_US, **{values + axis: 0 for axis in "XYZ"})
                self.log.add("In_Imu0Time", at, Stamp=stamp, Interval=10_000, Seq=stamp // TICK_US)
            self.epochs(300, log_us=lambda k: log_us(k) + cycle, **moves)
            export = self.export()
            topic, of_node = self.topic(export, "/tetap/odometry"), TICK_US * np.arange(1, 301)
            self.assertEqual(export.clock.restarts, 1)
            np.testing.assert_array_equal(topic.time_us, np.append(of_node, of_node + apart))
            self.assertEqual([one[0] for one in topic.columns["pose.covariance"]], [9.0] * 300 + [1e6] * 300)
            if apart == cycle:
                np.testing.assert_array_equal(self.topic(export, "/tetap/imu0").time_us, np.array([20_000, 10_000]) + cycle)
            export.write_mcap(self.path("a.mcap"))
            seen = self.messages(self.path("a.mcap"))
            self.assertEqual([time for time, _, _ in seen], sorted(time for time, _, _ in seen))
            for channel in {one for _, one, _ in seen}:
                numbers = [sequence for _, one, sequence in seen if one == channel]
                self.assertEqual(numbers, list(range(len(numbers))))

    @staticmethod
    def messages(path):
        """(log time, channel, sequence) of each message, in the order of the file."""
        with open(path, "rb") as file:
            data = file.read()
        found, at, end = [], 8, len(data) - 8
        while at < end:
            opcode, length = struct.unpack_from("<BQ", data, at)
            if opcode == 5:
                channel, sequence, time_ns = struct.unpack_from("<HIQ", data, at + 9)
                found.append((time_ns, channel, sequence))
            at += 9 + (40 if opcode == 6 else length)  # a chunk's records lie behind its head
        return found

    def test_diagnostics_name_faults_and_refusals_with_their_reason(self):
        table = bus_writer.default_dbc().tables
        self.log.add("Est_Epoch", 1, Time=TICK_US)
        self.log.add("Est_Status", 2, Mode=table["Mode"]["Degraded"], Faults=1 << 4 | 1 << 8, Used=1 << 5, ResetCause=2)
        for verdict, check in (("Rejected", "Gate"), ("Accepted", "None"), ("TooLate", "Time")):
            self.log.add("Est_Innov", 3, Sensor=5, Inst=1, Verdict=table["Verdict"][verdict], Check=table["Check"][check], Dof=2, Nis=31.5, Ratio=3.4, Age=0.1, Id=np.nan)
        given = self.export().status[0].given
        self.assertEqual([given[f"status[{i}].{field}"] for i in range(given["status"]) for field in ("name", "message")],
                         ["tetap: estimator", "Degraded: Malformed WheelSlip", "tetap: refused GnssPosition1", "Rejected by Gate", "tetap: refused GnssPosition1", "TooLate by Time"])
        values = {given[f"status[1].values[{k}].key"]: given[f"status[1].values[{k}].value"] for k in range(given["status[1].values"])}
        self.assertEqual((values["ratio"], values["normalised innovation squared"], values["degrees of freedom"]), ("3.4", "31.5", "2"))

    def test_scans_and_their_map(self):
        def frames(seq, stamp, blocks):
            self.log.add("In_ScanHead", stamp, Stamp=stamp, Seq=seq, Count=8, First=-1.0, Step=0.08)
            for block in blocks:
                self.log.add("In_Scan", stamp, Seq=seq, Block=block, **{f"Range{i}": 0 if block + i == 0 else 2.0 + block for i in range(4)})
        self.log.add("Est_Epoch", 1, Time=TICK_US)
        frames(1, 1000, (0, 1))
        self.log.add("Est_Keyframe", 1001, Id=0, Stamp=1000, StepX=0, StepY=0)
        self.log.add("Est_KeyframePose", 1002, Id=0, X=1.0, Y=0, Yaw=0)
        frames(2, 2000, (1,))
        with self.assertRaisesRegex(BadInput, "raw.log: a map of its scans needs .* --mounting"):
            self.export()
        export = self.export(scanner=Scanner((0.5, 0, 0), resolution=0.1))
        scan, grid, static = (self.topic(export, name) for name in ("/tetap/scan0", "/map", "/tf_static"))
        np.testing.assert_array_equal(scan.columns["ranges"], [[np.inf, 2, 2, 2, 3, 3, 3, 3], [np.nan] * 4 + [3] * 4])
        np.testing.assert_allclose(scan.columns["angle_max"], -0.44)
        self.assertEqual((scan.given["header.frame_id"], static.given["transforms[0].child_frame_id"]), ("laser0", "laser0"))
        cells = grid.columns["data"].reshape(grid.columns["info.height"], grid.columns["info.width"])

        def at(x, y):
            return cells[tuple(int((v - grid.columns[f"info.origin.position.{axis}"]) // 0.1) for v, axis in ((y, "y"), (x, "x")))]
        self.assertEqual([at(1.5 + r * np.cos(b), r * np.sin(b)) for r, b in ((3, -0.44), (1.5, -0.6), (2, -0.84), (3, -0.68))], [100, 0, 100, 100])
        self.assertEqual(at(3.9, -0.15), -1)
        self.assertEqual(set(np.unique(cells)), {-1, 0, 100})

    def test_the_file_is_whole(self):
        self.epochs(3000, Pos={"X": 0, "Y": 0, "Kind": 6}, Motion={"PosValid": 1, "Yaw": 0, "Speed": 0, "YawRate": 0})
        count, size = self.export().write_mcap(self.path("a.mcap"))
        self.assertEqual(count, 6000)
        with open(self.path("a.mcap"), "rb") as file:
            data = file.read()
        self.assertEqual((len(data), data[:8], data[-8:]), (size, b"\x89MCAP0\r\n", b"\x89MCAP0\r\n"))
        at, chunks, messages, attached = 8, 0, 0, []
        while at < size - 8:
            opcode, length = struct.unpack_from("<BQ", data, at)
            body = data[at + 9:at + 9 + length]
            if opcode == 6:
                content, crc = struct.unpack_from("<QI", body, 16)
                self.assertEqual(zlib.crc32(body[40:40 + content]), crc)
                chunks += 1
            if opcode == 15:
                self.assertEqual(struct.unpack("<I", body)[0], zlib.crc32(data[:at]))
            messages += struct.unpack_from("<Q", body)[0] if opcode == 11 else 0
            at += 9 + length
            if opcode == 9:
                begin = 16 + 4 + len("raw.log.gz") + 4 + len("application/gzip") + 8
                attached.append(gzip.decompress(body[begin:-4]))
                self.assertEqual(zlib.crc32(body[:-4]), struct.unpack("<I", body[-4:])[0])
        self.assertGreater(chunks, 1)
        with open(self.path("raw.log"), "rb") as log:
            self.assertEqual(attached, [log.read()])
        self.assertEqual((at, messages), (size - 8, 6000))

    def test_bad_input_ends_in_one_line(self):
        def run(text, *words):
            with open(self.path("bad.log"), "w", encoding="ascii") as file:
                file.write(text)
            return subprocess.run([os.path.join(ROOT, "tools/can/export_log"), self.path("bad.log"), *words], capture_output=True, text=True, timeout=60)
        out = self.path("o.mcap")
        for text, words, message in (("(1.0) can0 320#0000000000000000\nwhat\n", [out], "bad.log:2: "), ("(1.0) can0 320#0000000000000000\n", [out], "no estimate and no sample"),
                                     ("", [out, "--base", "0x340"], "base 0x340"), ("", [], "OUT.mcap or --csv"), ("", [out, "--resolution", "0"], "--resolution is 0.0")):
            result = run(text, *words)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(message, result.stderr)
            self.assertNotIn("Traceback", result.stderr)
            self.assertFalse(os.path.exists(out))


if __name__ == "__main__":
    unittest.main()
