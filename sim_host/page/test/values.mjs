// SPDX-License-Identifier: Apache-2.0
// node values.mjs PUPPETEER PAGE.html OUT CASES COUNT: what a chart says under the pointer against the tables of the host's player. CASES [{robot, log, tables, settings: [{path,
// value, tables}]}], tables a folder of tetap-play. COUNT draws (0 settings or one; state; zoom; epoch) of a fixed seed, shared among the cases. Status 1 where something differs.
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { session } from "./session.mjs";

const [modules, file, out, cases, count] = process.argv.slice(2);
const { page, expect, data, settled, diagnosed, upload, end } = await session(modules, file, out);
const STATES = ["x_m", "y_m", "yaw_rad", "speed_mps", "yaw_rate_radps", "v_east_mps", "height_m", "gyro_bias_z_radps"];
let drawn = 20261;
const draw = () => ((drawn = (Math.imul(drawn, 1664525) + 1013904223) >>> 0), drawn / 2 ** 32);

/** {column: Map(time in hundredths of a second -> text)} of the main estimator: the last of those with the most rows. */
function table(path) {
  const [head, ...lines] = readFileSync(path, "ascii").trimEnd().split("\n").map((line) => line.split(",")), number = head.indexOf("estimator"), rows = new Map();
  for (const line of lines) rows.set(line[number], [...(rows.get(line[number]) ?? []), line]);
  return { head, rows };
}
function mainOf(folder) {
  const { rows, head } = table(join(folder, "estimates.csv")), most = Math.max(...[...rows.values()].map((all) => all.length));
  const which = [...rows].filter(([, all]) => all.length === most).map(([name]) => name).sort().at(-1), states = table(join(folder, "states.csv"));
  const columns = {};
  for (const { head: names, all } of [{ head: states.head, all: states.rows.get(which) ?? [] }, { head, all: rows.get(which) }])
    names.forEach((name, i) => (columns[name] = new Map(all.filter((line) => line[i] !== "").map((line) => [Math.round(100 * Number(line[1])), line[i]]))));
  return columns;
}

let compared = 0, blank = 0, asked = 0;
const wrong = [];
async function look(columns, series, times) {
  await page.$eval("#state canvas", (canvas) => canvas.scrollIntoView({ block: "center", behavior: "instant" }));
  for (let n = 0; n < times; n++) {
    const state = STATES[Math.floor((n / times) * STATES.length)];
    if (!columns[state]?.size || !(await page.$eval("#state-name", (select, wanted) => [...select.options].some(({ value }) => value === wanted), state))) continue;
    if ((await page.$eval("#state-name", ({ value }) => value)) !== state) await page.select("#state-name", state);
    const box = await (await page.$("#state .u-over")).boundingBox(), x = () => box.x + 2 + draw() * (box.width - 4), y = box.y + box.height / 2;
    // All of it again, then closer, up to three times.
    await page.mouse.click(box.x + box.width / 2, y, { count: 2 });
    for (let closer = Math.floor(draw() * 4); closer > 0; closer--) {
      await page.mouse.move(x(), y);
      await page.keyboard.down("Control"); // without it the page scrolls
      await page.mouse.wheel({ deltaY: -200 });
      await page.keyboard.up("Control");
    }
    await page.mouse.move(x(), y);
    await page.mouse.move(x(), y, { steps: 2 });
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
    const [time, ...shown] = await page.$$eval("#state .u-legend .u-value", (all) => all.map(({ textContent }) => textContent));
    const host = columns[state].get(Math.round(100 * Number(time)));
    asked++;
    if (shown[series] === "–" || host === undefined) blank++;
    else if (Number(shown[series]) !== +Number(host).toPrecision(7)) wrong.push(`${state} at ${time}: ${shown[series]}, by the host ${host}`);
    else compared++;
  }
}

const all = JSON.parse(readFileSync(cases, "utf8")), runs = all.reduce((sum, { settings }) => sum + 1 + settings.length, 0);
for (const { robot, log, tables, settings } of all) {
  await upload(log);
  await settled();
  await diagnosed();
  await look(mainOf(tables), 0, Math.ceil(count / runs));
  for (const { path, value, tables: changed } of settings) {
    await page.evaluate(() => delete document.body.dataset.second);
    await page.$eval("#settings", (input, text) => ((input.value = text), input.dispatchEvent(new Event("change"))), `${robot};${path}=${value}`);
    await page.waitForFunction(() => document.body.dataset.state === "done" && document.body.dataset.second !== undefined, { timeout: 60000 }).catch(() => {});
    const labels = await page.$$eval("#state .u-legend .u-label", (found) => found.map(({ textContent }) => textContent));
    const own = labels.slice(1).findLastIndex((label) => !/3σ/.test(label));
    if ((await data()).second !== "") await look(mainOf(changed), own, Math.ceil(count / runs));
  }
}
expect(wrong.length === 0, `${compared} values under the pointer are the host's ${wrong.slice(0, 3)}`);
expect(compared > 0.9 * asked && asked > 0.6 * count, `${blank} of ${asked} moments have no value of that state; numbers without an effect have no second run`);
await end();
