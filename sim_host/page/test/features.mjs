// SPDX-License-Identifier: Apache-2.0
// node features.mjs PUPPETEER PAGE.html OUT CASES: what a user does beside a log of a known robot. CASES {tables: [{file, robot, sha, frames}], unknown: {file, robot, sha}, larger: {file, radius_m}, long: {file, sha},
// rover: {log, sha, mcap}}, hashes and counts as the host's programs have them. A picture of each view goes to OUT. Status 1 where something differs.
import { readFileSync } from "node:fs";
import { Bench, moduleOf } from "./bench.mjs";
import { session } from "./session.mjs";

const [modules, file, out, cases] = process.argv.slice(2);
const { tables, unknown, larger, long, rover } = JSON.parse(readFileSync(cases, "utf8"));
const { page, expect, data, picture, untilState, settled, diagnosed, upload, end } = await session(modules, file, out, { serial: true });
const text = (selector) => page.$eval(selector, (one) => one.textContent).catch(() => "");
const open = (path) => upload(...[path].flat());
const number = (words, at = 0) => Number((words.match(/-?\d+(\.\d+)?(e[-+]?\d+)?/gi) ?? [])[at]);

// Tables: the form, the log, and the host's hash.
for (const one of tables) {
  await open(one.file);
  await untilState("tables");
  const fields = await page.$$eval("#tables select, #tables input", (all) => all.filter((one) => one.checkVisibility()).length);
  expect(fields >= 9 && fields <= 16, `${one.name}: a form of ${fields} fields`);
  expect((await page.$$eval("#views", ([views]) => views.hidden)) || (await data()).sha !== one.sha, "nothing is played before the user has looked");
  await page.select("#tables-robot", await page.$eval("#tables-robot", (select, name) => [...select.options].find(({ textContent }) => textContent === name).value, one.robot));
  await picture(`tables_${one.name}`);
  await page.click("#tables-play");
  await untilState("done");
  expect((await data()).sha === one.sha, `${one.name}: the host's hash by tetap-import and tetap-play (${(await data()).sha?.slice(0, 12)}, ${(await data()).status})`);
  expect(number(await text("#tables-made")) === one.frames, `${one.name}: ${await text("#tables-made p")}`);
}
// A unit that no table has is asked for, and one that the user names makes another log.
await page.select("#tables [data-unit=gyro]", "deg/s");
await page.click("#tables-play");
await page.waitForFunction((sha) => document.body.dataset.state === "done" && document.body.dataset.sha !== sha, { timeout: 60000 }, tables.at(-1).sha).catch(() => {});
expect((await data()).sha !== tables.at(-1).sha, "another unit is another log");
await page.$eval("[data-described='gnss.antenna_z_b_m']", (input) => ((input.value = "99"), input.dispatchEvent(new Event("change"))));
await page.click("#tables-play");
await page.waitForSelector("#tables-wrong");
expect(/antenna_z_b_m/.test(await text("#tables-wrong")), `a number beyond its limits: ${await text("#tables-wrong")}`);

// A robot that the page does not know.
await open(unknown.file);
await untilState("asks");
expect(await page.$eval("#views", ({ hidden }) => hidden), "nothing is played for an unknown robot");
expect((await page.$$("#ask [data-offer]")).length === Math.min(3, (await page.$$("#ask-other option")).length) && /Hz/.test(await text("#ask")), `offers: ${(await text("#ask")).slice(0, 160)}`);
await picture("ask");
await page.click(`#ask [data-offer=${unknown.robot}]`);
await untilState("done");
expect((await data()).sha === unknown.sha, "the offer that was taken: the host's hash");

// A robot whose wheels are larger than the page's: the doctor's numbers are tried, and are nearly those of the robot.
await open(larger.file);
await untilState("asks");
await page.waitForSelector("#ask [data-offer=rover]", { visible: true, timeout: 20000 });
await page.$eval("#ask [data-offer=rover]", (button) => button.click()); // the page may still scroll
await untilState("done");
await diagnosed();
await page.waitForSelector("[data-try=wheel_scale]");
expect((await page.$$("[data-code=wheel_scale] .evidence canvas")).length === 1, `the evidence is drawn: ${await text("[data-code=wheel_scale] .evidence .u-legend")}`);
await picture("try");
await page.click("[data-try=wheel_scale]");
await settled();
const radius = number(await page.$eval("[data-path='wheels.drive.left_radius_m']", ({ value }) => value));
expect(Math.abs(radius / larger.radius_m - 1) < 0.02 && (await data()).second.length > 0, `the doctor's radius is ${radius} m of ${larger.radius_m}: ${await text("#effect")}`);

// The log in an MCAP file.
await open(rover.mcap);
await untilState("done");
expect((await data()).sha === rover.sha, `an exported MCAP: the log's hash (${(await data()).status})`);

// A log that is opened while another one is played or compared: nothing comes of the first.
for (const [before, next, state] of [[null, unknown.file, "asks"], [rover.mcap, tables[0].file, "tables"]]) {
  if (before) await open(before);
  await open(next);
  await untilState(state);
  await page.waitForFunction(() => document.body.dataset.state === "failed", { timeout: 2000 }).catch(() => {});
  expect((await data()).state === state && (await page.$eval("#views", ({ hidden }) => hidden)), `opened while another log is at work: ${state}, ${(await data()).status}`);
}

// One update, opened.
await open(rover.log);
await untilState("done");
expect((await data()).sha === rover.sha, "the filter that is looked at has the host's hash");
await page.focus("#timeline canvas");
let opened = 0, refused = 0;
for (let i = 0; i < 12; i++) {
  await page.keyboard.press("n");
  await page.evaluate(() => delete document.body.dataset.update);
  await page.click("#open-update");
  await page.waitForFunction(() => document.body.dataset.update, { timeout: 60000 });
  refused++;
  if ((await data()).update !== "none") opened++;
  await page.focus("#timeline canvas");
}
expect(refused === 12, `refusals: ${opened} of 12 are updates that can be opened, of the others a test before is named: ${(await text("#update .body")).slice(0, 90)}`);
const models = new Set();
let worst = 0;
for (let i = 1; i <= 24; i++) {
  await page.focus("#timeline canvas");
  const box = await (await page.$("#timeline canvas")).boundingBox();
  await page.mouse.move(box.x + 130 + ((box.width - 150) * i) / 25, box.y + 5);
  await page.keyboard.press("u");
  await page.evaluate(() => delete document.body.dataset.update);
  await page.click("#open-update");
  await page.waitForFunction(() => document.body.dataset.update, { timeout: 60000 });
  const model = (await data()).update;
  if (model === "none") continue;
  models.add(model);
  worst = Math.max(worst, number(await text("#update-apart"), 0) || 0);
}
expect(models.size >= 2, `updates of ${[...models].join(", ")} are opened`);
expect(worst > 0 && worst < 0.01, `the five equations give the filter's P+ to ${worst} of its sigmas`);
expect((await page.$$("#update table")).length >= 2 && (await page.$("#update canvas")) !== null, "an update has its tables and its ellipses");
await picture("update");

// Every estimator, on a run with its truth.
await page.select("#play-speed", "10");
await page.click("#play-go");
await page.waitForFunction(() => parseFloat(document.querySelector("#play .clock").textContent) >= 60, { timeout: 120000 });
await page.click("#play-go");
await page.waitForSelector("#play-look", { timeout: 60000 });
await page.click("#play-look");
await settled();
await page.$eval("#compare-run", (button) => button.click()); // the page may still scroll
await page.waitForFunction(() => document.body.dataset.compared, { timeout: 240000 });
const rows = await page.$$eval("#compare-table tbody tr", (all) => all.map((row) => [...row.children].map((cell) => cell.textContent)));
const main = rows.find(([kind, robot]) => kind === "Inertial navigation" && /^rover\b/.test(robot)), odometry = rows.find(([kind]) => kind === "Odometry");
expect(rows.length >= 2 && main && odometry, `estimators: ${rows.map((row) => row.slice(0, 4).join(" ")).join("; ")}`);
expect(Number(main?.[2]) < 3 && Number(odometry?.[2]) > Number(main?.[2]), "with truth: navigation is better than odometry");
expect(Number(main?.[3]) > 0.1 && Number(main?.[3]) < 8 && Number(main?.[8]) > 1000, `NEES ${main?.[3]}, RAM ${main?.[8]}, instructions ${main?.[9]}`);
expect(rows[0][2] === String(Math.min(...rows.map((row) => Number(row[2]))).toFixed(3)), "the best is first");
await picture("compare");

// The lesson: its numbers, a failure, three questions; by the keyboard.
await page.focus("#lesson-start");
await page.keyboard.press("Enter");
await page.waitForSelector("#lesson-figures", { timeout: 60000 });
const example = await text("#lesson-example");
for (const wanted of ["10.101", "10.601", "(0.953, 0.094)"]) expect(example.includes(wanted), `the worked example has ${wanted}`);
expect(await page.$eval("#lesson-figures", ({ className }) => className === "good"), `lesson: ${await text("#lesson-figures")}`);
await page.click("#lesson-brakes");
await page.waitForFunction(() => document.querySelector("#lesson-figures").className === "bad", { timeout: 60000 });
expect(number(await text("#lesson-figures"), 5) < 97, `it fails: ${await text("#lesson-figures")}`);
await page.$eval("#lesson-step", (input) => ((input.value = "150"), input.dispatchEvent(new Event("input"))));
await picture("lesson");
const answer = async (name, value) => {
  await page.$eval(`#answer-${name}`, (input, given) => ((input.value = given), input.dispatchEvent(new Event("input"))), value);
  await page.$eval(`[data-graded=${name}]`, (said) => (said.textContent = ""));
  await page.click(`#grade-${name}`);
  await page.waitForFunction((which) => document.querySelector(`[data-graded=${which}]`).textContent !== "", { timeout: 60000 }, name);
  return page.$eval(`[data-graded=${name}]`, ({ className }) => className === "good");
};
for (const [name, right, wrong] of [["prediction", "4,041", "10.101"], ["noise", "2", "0.5"], ["braking", "0.03", "0.001"]]) {
  expect(!(await answer(name, wrong)), `${name}: ${wrong} is wrong: ${await text(`[data-graded=${name}]`)}`);
  expect(await answer(name, right), `${name}: ${right} is right: ${await text(`[data-graded=${name}]`)}`);
}
expect(!(await answer("braking", "x")) && !(await answer("braking", "10")), "no number and a filter that repeats the sensor are wrong");

// The cable: a log through a port, at once, is the host's run again.
const sent = readFileSync(rover.log, "ascii").trimEnd().split("\n").map((line) => line.split(" ")[2]);
await page.click("#cable-connect");
await page.waitForSelector("#cable-look", { timeout: 60000 });
for (let i = 0; i < sent.length; i += 20000) await page.evaluate((frames) => window.fakePort.feed(frames), sent.slice(i, i + 20000));
await page.waitForFunction((count) => parseInt(document.querySelector("#cable-counts").textContent) >= count, { timeout: 60000 }, sent.length).catch(() => {});
expect(parseInt(await text("#cable-counts")) === sent.length, `cable: ${await text("#cable-counts")} of ${sent.length}`);
expect((await page.evaluate(() => window.fakePort.said.join())) === "C,S6,L", "the adapter was told to listen, and nothing else");
await picture("cable");
await page.click("#cable-look");
await settled();
expect((await data()).sha === rover.sha && (await data()).different === "0", "the recording of the cable is the host's run to the bit");

// Talk: a node behind the cable is read and changed by the keyboard, while it stands; not while it drives.
const bench = new Bench(moduleOf(file), "mrclam"), pages = () => bench.sent.map((line) => (parseInt(line.slice(6, 8), 16) >> 4) & 7);
bench.feed = (lines) => page.evaluate((frames) => window.fakePort.feed(frames), lines);
await page.exposeFunction("onSent", (command) => bench.command(command));
const press = async (selector) => (await page.focus(selector), await page.keyboard.press("Enter"));
const said = async (pattern) => (await page.waitForFunction((wanted) => new RegExp(wanted).test(document.querySelector("#talk-said")?.textContent), { timeout: 40000 }, pattern).catch(() => {}), text("#talk-said"));
const type = async (path, value) => {
  await page.$eval("#talk-find", (input, wanted) => ((input.value = wanted), input.dispatchEvent(new Event("input"))), path);
  await page.$eval(`[data-talk="${path}"]`, (input, given) => ((input.value = given), input.dispatchEvent(new Event("change"))), value);
};
await page.click("#cable-connect");
await page.waitForSelector("#talk-read");
bench.run();
expect((await page.evaluate(() => window.fakePort.said.join())) === "C,S6,L" && bench.sent.length === 0, "talk: nothing is sent in listen-only");
await press("#talk-read");
expect(/CRC/.test(await said("CRC")), `talk: ${await text("#talk-said")}`);
bench.stop();
bench.restart();
await bench.feed(bench.advance(150));
bench.run();
await new Promise((done) => setTimeout(done, 1500)); // the vehicle has stood for a second
await press("#talk-save");
expect(/flash/.test(await said("flash")), `talk: ${await text("#talk-said")}`);
await type("landmark.gate_scale", "99");
expect(/landmark.gate_scale/.test(await said("landmark.gate_scale")), `talk: a value beyond its limits: ${await text("#talk-said")}`);
await type("landmark.gate_scale", "2,5");
await page.waitForSelector("#talk-changes");
expect(/1\.5 → 2\.5/.test(await text("#talk-changes")) && /300 \(hex\), 500/.test(await text("#talk-changes")) && !pages().includes(0) && !pages().includes(1), `talk: old, new and device before anything is sent: ${await text("#talk-changes")}`);
await picture("talk");
await press("#talk-change");
expect(/active/.test(await said("taken the change")) && pages().filter((one) => one === 1).length === 1, `talk: ${await text("#talk-said")}`);
expect(/active 2\.5, compiled 1\.5/.test(await text("#talk .rows")), "talk: the row has its new value");
bench.stop();
while (bench.time_ms < 30000) await bench.feed(bench.advance(20));
bench.run();
await press("#talk-restore");
expect(/2\.5 → 1\.5/.test(await text("#talk-restore-sure")) && /300 \(hex\)/.test(await text("#talk-restore-sure")) && !pages().includes(3), `talk: Restore asks first: ${await text("#talk-restore-sure")}`);
await press("#talk-restore-keep");
expect((await page.$("#talk-restore-sure")) === null && !pages().includes(3), "talk: no Restore where it was not confirmed");
await press("#talk-restore");
await press("#talk-restore-yes");
expect(/moves/.test(await said("moves")) && !pages().includes(3), `talk: ${await text("#talk-said")}`);
await page.setViewport({ width: 390, height: 844 });
await page.click("#language");
expect((await data()).wide <= 0 && /bergerak/.test(await text("#talk-said")), `nothing of talk is wider than 390 pixels (${(await data()).wide}): ${await text("#talk-said")}`);
await picture("talk_narrow_id");
await page.click("#language");
await page.setViewport({ width: 1180, height: 900 });
await page.click("#talk-listen");
await page.waitForFunction(() => window.fakePort.said.at(-1) === "L");
bench.stop();

// Settings as text, into another page's address.
await page.$eval("#settings", (input) => ((input.value = "rover;inertial.gyro_radps_rthz=0.02"), input.dispatchEvent(new Event("change"))));
await page.waitForFunction(() => document.body.dataset.second, { timeout: 60000 });
const second = (await data()).second;
await page.goto(`file://${process.cwd()}/nothing`).catch(() => {});
await page.goto(`${session.url(file)}#rover;inertial.gyro_radps_rthz=0.02`);
await untilState("ready");
await open(rover.log);
await page.waitForFunction((sha) => document.body.dataset.second === sha, { timeout: 60000 }, second).catch(() => {});
expect((await data()).second === second, `a link carries settings to the first log (${second.slice(0, 12)})`);

// A log of half an hour: its beginning at once, then all of it.
await open(long.file);
await page.waitForFunction(() => document.body.dataset.beginning, { timeout: 60000 });
expect((await data()).state === "busy" && (await page.$$eval("#views canvas", (all) => all.length)) > 3, `the beginning is shown while the rest is played: ${await text("#bits .warning")}`);
await picture("beginning");
await untilState("done");
expect((await data()).sha === long.sha && (await data()).different === "0", `a long log: the host's run to the bit (${(await data()).status})`);

// 390 pixels, dark, Indonesian.
await page.setViewport({ width: 390, height: 844 });
await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "dark" }]);
await page.click("#language");
await page.click("#lesson-start");
await page.waitForSelector("#lesson-figures", { timeout: 60000 });
await open(tables[0].file);
await page.waitForSelector("#tables-play");
expect((await data()).wide <= 0, `nothing of tables and lesson is wider than 390 pixels (${(await data()).wide})`);
await picture("more_narrow_dark_id");
await open(unknown.file);
await untilState("asks");
expect((await data()).wide <= 0, "nor are the offers");
await picture("ask_narrow_dark_id");
await end();
