// SPDX-License-Identifier: Apache-2.0
// The doctor's evidence as curves: what two devices say of one motion, second by second.
import { Chart } from "./charts.js";
import { colour } from "./dom.js";
import { say } from "./texts.js";

const KINDS = {
  turn: ["deg_for_rad", "gyro_sign", "gyro_scale", "wheels_swapped", "wheel_reversed", "wheels_reversed", "wheels_unequal", "track_width"],
  speed: ["wheel_scale", "antenna_arm"],
  unit: ["velocity_unit", "fix_unit"],
  force: ["accel_sign", "imu_axes"],
  gravity: ["imu_upside_down", "accel_scale", "g_for_mps2", "rates_for_increments"],
  velocity: ["velocity_axes", "lat_lon_swapped", "latitude_sign", "longitude_sign"],
  axis: ["dead_axis"],
};
const UNITS = { turn: "axis.turn", speed: "axis.speed", unit: "axis.speed", force: "axis.force", gravity: "axis.force", velocity: "axis.speed", axis: "axis.means" };
/** Slower than this a course is noise [m/s]. */
const SLOWEST_MPS = 0.5;
/** Time between two fixes whose distance gives a speed [s]. */
const BETWEEN_S = 4;

const each = (a, b, f) => a.map((x, i) => (x === null || b[i] === null ? null : f(x, b[i])));

/** Turn rate of the course from one second to the next [rad/s]; null while the robot is slow. */
export function courseTurn({ t, east, north }) {
  return t.map((time, i) => {
    const before = i - 1;
    if (before < 0 || time - t[before] > 1.5 || [east, north].some((axis) => axis[i] === null || axis[before] === null)) return null;
    if (Math.min(Math.hypot(east[i], north[i]), Math.hypot(east[before], north[before])) < SLOWEST_MPS) return null;
    const cross = east[before] * north[i] - north[before] * east[i], along = east[before] * east[i] + north[before] * north[i];
    return Math.atan2(cross, along) / (time - t[before]);
  });
}

/** Velocity between fixes that are some seconds apart: {t, east, north}. `fixes` [{x, y, stamp}] in the order of their time. */
export function fixVelocity(fixes) {
  const found = { t: [], east: [], north: [] };
  for (let i = 0, k = 0; k < fixes.length; k++) {
    if (fixes[k].stamp - fixes[i].stamp < BETWEEN_S) continue;
    while (i + 1 < k && fixes[k].stamp - fixes[i + 1].stamp >= BETWEEN_S) i++;
    const span = fixes[k].stamp - fixes[i].stamp;
    if (span > 2 * BETWEEN_S || (found.t.length > 0 && (fixes[k].stamp + fixes[i].stamp) / 2 < found.t.at(-1) + 1)) continue;
    found.t.push((fixes[k].stamp + fixes[i].stamp) / 2);
    found.east.push((fixes[k].x - fixes[i].x) / span);
    found.north.push((fixes[k].y - fixes[i].y) / span);
  }
  return found;
}

/** Curves behind a finding: {unit, curves: [{name, t, v}]}; null where there are fewer than two. `seconds` of the module, `fixes` of the run. */
export function evidenceOf({ code, evidence }, seconds, fixes) {
  const kind = Object.keys(KINDS).find((one) => KINDS[one].includes(code));
  if (!seconds || !kind) return null;
  const { t } = seconds, own = (name, v) => ({ name, t, v }), between = ["unit", "velocity"].includes(kind) ? fixVelocity(fixes) : null;
  const ofFixes = (name, v) => ({ name, t: between.t, v });
  const curves = {
    turn: () => [own("gyroscope", seconds.turn), own("wheels", seconds.wheel_turn), own("course", courseTurn(seconds))],
    speed: () => [own("wheels", seconds.wheel_speed), own("receiver", each(seconds.east, seconds.north, Math.hypot))],
    unit: () => [...curves.speed(), ofFixes("fixes", each(between.east, between.north, Math.hypot))],
    force: () => [own("ahead", seconds.force_x), own("left", seconds.force_y), own("curves", each(seconds.wheel_speed, seconds.wheel_turn, (v, w) => v * w))],
    gravity: () => [own("ahead", seconds.force_x), own("left", seconds.force_y), own("up", seconds.force_z), own("gravity", t.map(() => 9.81))],
    velocity: () => [own("east", seconds.east), ofFixes("east.fixes", between.east), own("north", seconds.north), ofFixes("north.fixes", between.north)],
    axis: () => ["x", "y", "z"].map((axis) => own(axis, seconds[`${/Accel/.test(evidence) ? "sensor" : "turn"}_${axis}`])),
  };
  const known = curves[kind]().filter(({ v }) => v.some((value) => value !== null));
  return known.length < 2 ? null : { unit: UNITS[kind], curves: known };
}

/** The curves in a chart that is tied to the others. */
export function evidenceChart(parent, view, { unit, curves }) {
  const inks = ["first", "second", "third", "faint"].map(colour);
  const series = curves.map(({ name }, i) => ({ label: say(`evidence.${name}`), stroke: inks[i], width: 1.5, points: { show: false } }));
  return new Chart(parent, view, { title: "", height: 190, series, labels: [say("axis.time"), say(unit)], data: uPlot.join(curves.map(({ t, v }) => [t, v])) });
}
