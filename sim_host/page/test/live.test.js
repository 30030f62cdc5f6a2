// SPDX-License-Identifier: Apache-2.0
import { test } from "node:test";
import assert from "node:assert/strict";
import { Table } from "../web/columns.js";
import { Live } from "../web/live.js";

const HEADS = {
  estimates: "epoch,time_s,estimator,kind,x_m,y_m,yaw_rad,std_x_m,std_y_m,std_yaw_rad,corr_xy,pos_valid",
  innovations: "epoch,time_s,estimator,sensor,inst,verdict,dof,nis,ratio,age_ms,landmark,failed",
  status: "epoch,time_s,mode,used,faults,reset_ctr,reset_cause,map_faults",
  sources: "epoch,time_s,estimator,source,state,failed",
  states: "epoch,time_s,estimator,height_m,std_height_m", fixes: "stamp_s,inst,lat_deg,lon_deg,height_m,std_m", truth: "time_s,x_m,y_m,yaw_rad,z_m",
};
function part(lines) {
  const tables = Object.fromEntries(Object.entries(HEADS).map(([name, head]) => {
    const table = new Table();
    table.add(new TextEncoder().encode([head, ...(lines[name] ?? []), ""].join("\n")));
    return [name, table.taken()];
  }));
  return { played: { time_s: 1, over: false }, tables: Object.fromEntries(Object.entries(tables).map(([name, packed]) => [name, { ...packed, rows: (lines[name] ?? []).length }])), frames: [] };
}

test("errors are of the epoch's own truth, and a turn has no jump at pi", () => {
  const live = new Live({ start_s: 1 });
  live.take(part({ estimates: ["1,1.01,2,Inertial,0.5,0,3.1,0.1,0.2,0.05,0,1", "2,1.02,2,Inertial,0.6,0,3.1,,,,,1"], truth: ["1.01,0.2,0,-3.1,0", "1.02,0.3,0,-3.1,0"] }));
  live.take(part({ estimates: ["3,1.03,2,Inertial,0.9,0,3.1,0.1,0.2,0.05,0,1", "4,1.04,2,Inertial,1,0,3.1,0.1,0.1,0.1,0,1"], truth: ["1.03,1.4,0,3,0", "1.04,,,,"] }));
  const run = live.run(), [t, error, band] = live.errors("x_m", run);
  assert.deepEqual(t.map((x) => +x.toFixed(6)), [0.01, 0.03]);
  assert.deepEqual(error.map((x) => +x.toFixed(6)), [0.3, -0.5]);
  assert.deepEqual(band.map((x) => +x.toFixed(6)), [0.3, 0.3]);
  assert.ok(Math.abs(live.errors("yaw_rad", run)[1][0] - (6.2 - 2 * Math.PI)) < 1e-9);
});

test("the error of the height is of the states' own epoch", () => {
  const live = new Live({ start_s: 1 });
  live.take(part({ estimates: ["1,1.01,2,Inertial,0,0,0,1,1,1,0,1"], states: ["1,1.01,2,7.5,0.5", "1,1.01,0,9,0.5", "2,1.02,2,,", "3,1.03,2,8,0.25"], truth: ["1.01,0,0,0,7", "1.02,0,0,0,7", "1.03,0,0,0,9"] }));
  assert.deepEqual(live.errors("height_m", live.run()).map((all) => all.map((x) => +x.toFixed(6))), [[0.01, 0.03], [0.5, -1], [1.5, 0.75]]);
});

test("time without a position counts, of the main estimator alone", () => {
  const live = new Live({ start_s: 1 });
  live.take(part({ estimates: ["1,1.01,0,Odometry,0,0,0,1,1,1,0,0", "1,1.01,2,Inertial,0,0,0,1,1,1,0,1", "2,1.02,2,Inertial,0,0,0,,,,,0", "3,1.03,2,Inertial,0,0,0,,,,,0", "4,1.04,2,Inertial,0,0,0,1,1,1,0,1"], truth: ["1.01,0,0,0,0"] }));
  assert.equal(live.unknown(live.run()), 0.5);
});

test("a sensor that never spoke is not said to have stopped, and one that did is", () => {
  const live = new Live({ start_s: 1 });
  live.take(part({ estimates: ["1,1.01,2,Inertial,0,0,0,1,1,1,0,1"], truth: ["1.01,0,0,0,0"],
    sources: ["1,2,2,Barometer,Stopped,None", "1,2,2,GnssPosition,Stopped,None", "2,3,2,GnssPosition,Fusing,None", "3,4,2,Barometer,Stopped,None", "3,4,2,GnssPosition,Stopped,None"] }));
  live.run();
  assert.deepEqual(live.said.map(({ source, word }) => `${source} ${word}`), ["GnssPosition Fusing", "GnssPosition Stopped"]);
});

test("what changes is said once, and a refusal again after a pause", () => {
  const live = new Live({ start_s: 1 });
  const estimates = ["1,1.01,2,Inertial,0,0,0,1,1,1,0,1"], truth = ["1.01,0,0,0,0"];
  const refusal = (time, source = "GnssPosition") => `1,${time},2,${source},0,Rejected,3,900,80.5,100,,Gate`;
  live.take(part({ estimates, truth, status: ["1,2,Nominal,3,0,1,SetPose,0", "2,3,Nominal,3,1,1,SetPose,0", "3,4,Degraded,3,3,1,SetPose,0"],
    sources: ["1,2,2,GnssPosition,Fusing,None", "1,2,0,GnssPosition,Stopped,None", "2,3,2,GnssPosition,Fusing,None", "3,4,2,GnssPosition,Rejecting,Gate"] }));
  live.run();
  live.take(part({ innovations: [refusal(5), refusal(5.2), refusal(5.4, "Wheels"), refusal(6.9), refusal(9.5)] }));
  live.run();
  live.run();
  assert.deepEqual(live.said.map(({ time, kind, word, bit, source }) => [time, kind, word ?? bit ?? source]),
    [[1, "mode", "Nominal"], [1, "source", "Fusing"], [2, "fault", 0], [3, "mode", "Degraded"], [3, "fault", 1], [3, "source", "Rejecting"],
      [4, "refusal", "GnssPosition"], [4.4, "refusal", "Wheels"], [8.5, "refusal", "GnssPosition"]]);
  assert.equal(live.said.at(-1).failed, "Gate");
});

test("a fault that comes and goes is said once, and again when it was away for five seconds", () => {
  const live = new Live({ start_s: 0 }), rows = [[1, 8], [2, 0], [5, 8], [6, 0], [9, 8], [10, 0], [16, 8]];
  live.take(part({ estimates: ["1,1,2,Inertial,0,0,0,1,1,1,0,1"], truth: ["1,0,0,0,0"], status: rows.map(([time, faults], i) => `${i},${time},Nominal,3,${faults},1,SetPose,0`) }));
  live.run();
  assert.deepEqual(live.said.filter(({ kind }) => kind === "fault").map(({ time }) => time), [1, 16]);
  live.faulted.clear();
  live.take(part({ status: ["8,17,Nominal,3,0,1,SetPose,0", "9,18,Nominal,3,8,1,SetPose,0"] }));
  live.run();
  assert.equal(live.said.at(-1).time, 18);
});

test("the node's map has each landmark as it was sent last, but none of a round that is over", () => {
  const live = new Live({ start_s: 0 });
  HEADS.map = "epoch,time_s,landmark,x_m,y_m,std_x_m,std_y_m,corr_xy,hits,age_s,landmark_state";
  HEADS.keyframes = "epoch,time_s,keyframe,x_m,y_m,yaw_rad";
  live.take(part({ estimates: ["1,50,2,EkfSlam,0,0,0,0.1,0.1,0.1,0,1"], map: ["1,1,7,9,9,1,1,0,1,0,Kept", "2,40,3,1,2,0.5,0.4,0.1,1,0,Kept", "3,45,3,1.5,2.5,0.2,0.3,0.2,2,0,Kept", "4,60,4,5,5,1,1,0,1,0,Kept"], keyframes: ["1,44,0,0,0,0", "2,45,1,1,0,0"] }));
  const run = live.run();
  assert.deepEqual(run.mapAt(50), { landmarks: [{ x: 1.5, y: 2.5, sx: 0.2, sy: 0.3, correlation: 0.2 }], keyframes: [{ x: 1, y: 0 }, { x: 0, y: 0 }] });
  assert.deepEqual(run.mapAt(41).landmarks.map(({ x }) => x), [1]);
  assert.equal(run.hasMap(), true);
  assert.deepEqual(run.mapAt(0.5), { landmarks: [], keyframes: [] });
});
