// SPDX-License-Identifier: Apache-2.0
// The five equations against NumPy, and the choice of an update by its record.
import { test } from "node:test";
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { apart, byTheBook, ellipse, updateOf } from "../web/equations.js";
import { gaussian } from "../web/lesson.js";

function drawn(n, m, seed) {
  const draw = gaussian(seed), list = (size) => Array.from({ length: size }, draw), root = list(n * n);
  const prior = Array.from({ length: n * n }, (_, i) => Array.from({ length: n }, (_, k) => root[Math.floor(i / n) * n + k] * root[(i % n) * n + k]).reduce((a, b) => a + b));
  return { states: n, components: m, prior, h: list(m * n), noise: list(m).map((x) => x * x + 0.01), nu: list(m) };
}

test("S, K, dx, P+ and NIS are NumPy's", () => {
  const all = [[2, 1], [3, 2], [15, 3], [4, 4], [15, 1]].map(([n, m], i) => drawn(n, m, i + 1));
  const code = `import json, sys, numpy as np
out = []
for u in json.load(sys.stdin):
    n, m = u["states"], u["components"]
    P, H, nu = np.reshape(u["prior"], (n, n)), np.reshape(u["h"], (m, n)), np.array(u["nu"])
    S = H @ P @ H.T + np.diag(u["noise"]); K = np.linalg.solve(S, H @ P).T
    out.append({"s": S.ravel().tolist(), "k": K.ravel().tolist(), "dx": (K @ nu).tolist(), "posterior": ((np.eye(n) - K @ H) @ P).ravel().tolist(), "nis": float(nu @ np.linalg.solve(S, nu))})
print(json.dumps(out))`;
  const wanted = JSON.parse(execFileSync("/usr/bin/python3", ["-c", code], { input: JSON.stringify(all), encoding: "utf8" }));
  all.forEach((update, i) => {
    const book = byTheBook(update);
    for (const name of ["s", "k", "dx", "posterior"]) wanted[i][name].forEach((value, at) => assert.ok(Math.abs(book[name][at] - value) < 1e-9 * (1 + Math.abs(value)), `${name} ${at}: ${book[name][at]} ${value}`));
    assert.ok(Math.abs(book.nis - wanted[i].nis) < 1e-9 * (1 + wanted[i].nis));
    const right = { ...update, posterior: book.posterior, moved: book.dx };
    assert.ok(apart(right, book).p === 0 && apart(right, book).x === 0);
    const wrong = apart({ ...right, posterior: book.posterior.map((x, at) => (at === 0 ? 1.1 * x + 0.1 : x)) }, book);
    assert.ok(wrong.p > 0.01);
  });
  assert.equal(byTheBook({ ...drawn(2, 1, 1), prior: [0, 0, 0, 0], noise: [0] }), null);
});

test("an ellipse's axes are the roots of its covariance's eigenvalues", () => {
  const { long, short, angle } = ellipse([5, 2, 2, 2], 2, [0, 1], 1); // eigenvalues 6 and 1, the first along (2, 1)
  assert.ok(Math.abs(long - Math.sqrt(6)) < 1e-12 && Math.abs(short - 1) < 1e-12 && Math.abs(Math.tan(angle) - 0.5) < 1e-12);
});

test("a record finds the update of its sensor and its NIS, and none where a test came before", () => {
  const update = (model, after_s, nis, verdict = "Accepted", components = 3) => ({ model, after_s, nis, verdict, components });
  const all = [update("GnssFix3d", 1, 2.31), update("WheelSpeed", 1.01, 2.3), update("GnssFix3d", 1.1, 7.7), update("GnssVelocity3d", 1.1, 40, "Rejected"), update("GnssFix3d", 1.5, 2.3)];
  const record = { source: "GnssPosition", verdict: "Accepted", dof: 3, nis: 2.3, time: 1.2 };
  assert.equal(updateOf(all, record), all[0]);
  assert.equal(updateOf(all, { ...record, nis: 5 }), all[2]); // the test of the fix had another NIS than the update
  assert.equal(updateOf(all, { ...record, verdict: "Rejected" }), null);
  assert.equal(updateOf(all, { source: "GnssVelocity", verdict: "Rejected", dof: 3, nis: 40, time: 1.2 }), all[3]);
});
