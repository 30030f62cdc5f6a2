// SPDX-License-Identifier: Apache-2.0
// Tables: what a dropped file is, archives by the zip program, the form's rows and what of them was changed, robots that suit a log.
import { test } from "node:test";
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import "./globals.mjs";
import { formOf, isTable, named, robotsFor, tablesOf } from "../web/tables.js";
import { unzipped } from "../web/unzip.js";

test("a log is a log, a table a table, whatever the file's name", () => {
  for (const log of ["(1.000000) vcan0 310#0011\n", " (0001.5)  can0  310   [2]  00 11\n", "  can0  310   [8]  00 11 22 33 44 55 66 77\n", "date Mon Jan 1 00:00:00 2024\nbase hex timestamps absolute\n"])
    for (const name of ["a.log", "a.csv"]) assert.equal(isTable(name, log), false, log);
  for (const table of ['"Time (s)","Gyroscope x (rad/s)"\n0,1\n', "time;x;y;z\n", "# remark\ntime,seconds_elapsed,z\n", "t\tgyro_x\n"]) assert.equal(isTable("a.txt", table), true, table);
});

/** By Python's zipfile: another hand's archive. */
function zipped(files, method) {
  const folder = mkdtempSync(join(tmpdir(), "tetap-zip-")), path = join(folder, "a.zip");
  writeFileSync(join(folder, "files.json"), JSON.stringify(files));
  execFileSync("/usr/bin/python3", ["-c", `import json, sys, zipfile\nwith zipfile.ZipFile(sys.argv[1], "w", ${method}) as z:\n for n, t in json.load(open(sys.argv[2])).items(): z.writestr(n, t)`, path, join(folder, "files.json")]);
  const bytes = new Uint8Array(readFileSync(path));
  rmSync(folder, { recursive: true });
  return bytes;
}

test("the tables of an archive are read, the rest of it is not", async () => {
  const gyro = `time,x\n${"1,2\n".repeat(5000)}`, files = { "Gyroscope.csv": gyro, "meta/device.csv": "a,b\n", "picture.png": "..." };
  for (const method of [0, 8]) {
    const found = await tablesOf([new File([zipped(files, method)], "phone.zip")]);
    assert.deepEqual(found.map(({ name }) => name), ["Gyroscope.csv"]);
    assert.equal(new TextDecoder().decode(found[0].bytes), gyro);
  }
  assert.equal(await tablesOf([new File(["(1.0) can0 310#00\n"], "a.csv")]), null);
  await assert.rejects(tablesOf([new File(["a,b\n1,2\n"], "a.csv"), new File(["(1.0) can0 310#00\n"], "run.log")]), /run\.log: no table/);
});

test("a broken archive is one clear line, wherever it is cut or bent", async () => {
  const whole = zipped({ "a.csv": `t,x\n${"1,2\n".repeat(300)}` }, 8);
  let refused = 0;
  for (let size = 0; size < whole.length; size += 3) await unzipped(whole.slice(0, size), () => true).then(() => assert.fail(`${size} bytes`), ({ message }) => (refused++, assert.ok(message.length > 5)));
  assert.ok(refused > 20);
  for (let at = 0; at < whole.length; at++) {
    const bent = whole.slice();
    bent[at] ^= 0xff;
    await unzipped(bent, () => true).catch((error) => assert.ok(error instanceof Error));
  }
});

const COLUMNS = { files: [{ name: "Gyroscope.csv", columns: ["t", "X (rad/s)", "Y (rad/s)", "Z (rad/s)"], wrong: "",
  bound: [{ quantity: "time", column: 0, unit: "s" }, { quantity: "gyro.x", column: 1, unit: "rad/s" }, { quantity: "gyro.y", column: 2, unit: "rad/s" }, { quantity: "gyro.z", column: 3, unit: "rad/s" }] }],
quantities: [{ name: "time", units: "s ms us ns" }, { name: "gyro.x", units: "rad/s deg/s rpm" }, { name: "gyro.y", units: "rad/s deg/s rpm" }, { name: "gyro.z", units: "rad/s deg/s rpm" }] };

test("a sensor is one row of the form, and only what was changed is named", () => {
  const rows = formOf(COLUMNS);
  assert.deepEqual(rows.map(({ kind, sensor, unit, fields }) => [kind, sensor, unit, fields.length]), [["time", null, "s", 1], ["gyro", "Imu", "rad/s", 3]]);
  assert.deepEqual(named(rows), { columns: [], units: [] });
  rows[1].unit = "deg/s";
  rows[1].fields[0].column = "Y (rad/s)";
  assert.deepEqual(named(rows), { columns: [["gyro.x", "Gyroscope.csv:Y (rad/s)"]], units: [["gyro.x", "deg/s"], ["gyro.y", "deg/s"], ["gyro.z", "deg/s"]] });
});

test("the robot that takes most of a log is offered first, and one that it leaves with nothing last", () => {
  const robots = [{ takes: ["Imu", "WheelCounts", "GnssPosition"], needs_imu: true }, { takes: ["BodySpeed", "RangeBearing"], needs_imu: false }, { takes: ["Imu", "GnssPosition"], needs_imu: true }];
  const order = (...sensors) => robotsFor(robots, sensors.map((sensor) => ({ sensor }))).map(({ number }) => number);
  assert.deepEqual(order("Imu", "GnssPosition"), [2, 0, 1]);
  assert.deepEqual(order("Imu", "WheelCounts"), [0, 2, 1]);
  assert.deepEqual(order("WheelCounts", "RangeBearing"), [1, 0, 2]);
  assert.deepEqual(order("BodySpeed", "WheelCounts", "GnssPosition"), [1, 0, 2]); // the first takes two of them, and is nothing without an IMU
  assert.ok(robotsFor(robots, []).every(({ useless }) => useless));
});
