// SPDX-License-Identifier: Apache-2.0
// Tables of sensors: which files are tables, what the form shows of their columns, and what of it the user has changed.
import { isZip, unzipped } from "./unzip.js";

/** Numbers of a robot that a recording does not hold: fields of the form, by the sensor that they belong to. */
export const DESCRIBED = [
  [["WheelCounts"], "wheels.drive.left_radius_m"], [["WheelCounts"], "wheels.drive.right_radius_m"], [["WheelCounts"], "wheels.drive.counts_per_turn"], [["WheelCounts", "WheelSpeed"], "wheels.drive.track_m"],
  [["GnssPosition"], "gnss.antenna_x_b_m"], [["GnssPosition"], "gnss.antenna_y_b_m"], [["GnssPosition"], "gnss.antenna_z_b_m"], [["GnssPosition"], "gnss.sigma_floor_m"],
  [["Imu"], "inertial.gyro_radps_rthz"], [["Imu"], "inertial.accel_mps2_rthz"], [["Imu"], "gyro.noise"],
];
/** Sensors of tables by the importer's words for them. */
const SENSORS = { gyro: "Imu", accel: "Imu", linear: "Imu", gravity: "Imu", mag: "Magnetometer", baro: "Barometer", gnss: "GnssPosition", velocity: "GnssVelocity", wheels: "WheelSpeed",
  counts: "WheelCounts", body: "BodySpeed", heading: "Heading", sighting: "RangeBearing" };

/** A log has a time in brackets, a date line, or an interface with a length; a table has several names in its first line. */
export function isTable(name, head) {
  const line = head.split(/\r?\n/).find((one) => one.trim() !== "" && !one.startsWith("#")) ?? head.split(/\r?\n/)[0];
  if (/^\s*\(\d+(\.\d+)?\)/.test(line) || /^date /i.test(line) || /^\s*\S+\s+[0-9A-F]{3,8}\s+\[\d+\]/i.test(line)) return false;
  if (/\.(csv|tsv)$/i.test(name)) return true;
  return line.split(/[,;\t]/).length > 1 && /[A-Za-z]/.test(line);
}

/** The tables in files that were dropped together: [{name, bytes}], or null where they are a log. @throws Error */
export async function tablesOf(files) {
  const tables = [], isWanted = (name) => /\.(csv|tsv|txt)$/i.test(name) && !/(^|\/)(meta|__MACOSX)\//i.test(name);
  for (const file of files) {
    const head = new Uint8Array(await file.slice(0, 4096).arrayBuffer());
    if (isZip(head)) tables.push(...(await unzipped(new Uint8Array(await file.arrayBuffer()), isWanted)));
    else if (isTable(file.name, new TextDecoder().decode(head))) tables.push({ name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) });
    else if (files.length > 1) throw new Error(`${file.name}: no table; a log is opened alone`);
    else return null;
  }
  if (tables.length === 0) throw new Error("no table (.csv) in the archive");
  return tables;
}

/** Rows of the form: [{kind, sensor, unit, units, fields: [{quantity, file, column}]}], a row a sensor of a file. `columns` is of the module. */
export function formOf({ files, quantities }) {
  const units = new Map(quantities.map(({ name, units: all }) => [name, all.split(" ")])), rows = new Map();
  for (const { name: file, columns, bound } of files)
    for (const { quantity, column, unit } of bound) {
      const kind = quantity.split(".")[0], key = `${file}\n${kind}\n${unit}\n${units.get(quantity)}`;
      if (!rows.has(key)) rows.set(key, { kind, sensor: SENSORS[kind] ?? null, file, unit, was: unit, units: units.get(quantity) ?? [], fields: [] });
      rows.get(key).fields.push({ quantity, column: columns[column], was: columns[column] });
    }
  return [...rows.values()];
}

/** What was changed, for the importer: {columns: [[quantity, "FILE:COLUMN"]], units: [[quantity, unit]]}. */
export function named(rows) {
  const columns = [], units = [];
  for (const { file, unit, was, fields } of rows)
    for (const { quantity, column, was: before } of fields) {
      if (column !== before) columns.push([quantity, `${file}:${column}`]);
      if (unit !== was) units.push([quantity, unit]);
    }
  return { columns, units };
}

/**
 * Robots in the order of how well they suit a log: [{number, taken, left, missing}].
 * `robots` of the module's description; `inputs` [{sensor}] of the log. A robot that is nothing without an IMU does not suit a log without one.
 */
export function robotsFor(robots, inputs) {
  const there = inputs.map(({ sensor }) => sensor);
  return robots.map(({ takes, needs_imu: needsImu }, number) => {
    const taken = there.filter((sensor) => takes.includes(sensor)), left = there.filter((sensor) => !takes.includes(sensor));
    const missing = takes.filter((sensor) => !there.includes(sensor));
    return { number, taken, left, missing, useless: taken.length === 0 || (needsImu && !there.includes("Imu")) };
  }).sort((a, b) => a.useless - b.useless || b.taken.length - a.taken.length || a.missing.length - b.missing.length || a.number - b.number);
}
