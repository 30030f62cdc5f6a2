// SPDX-License-Identifier: Apache-2.0
// node browser.mjs PUPPETEER PAGE.html OUT CASES SEEN: opens the page from disk in a headless Chromium and does what a user does. CASES: a file
// [{robot, log, sha, crc, epochs, settings: [{path, value, sha}]}], hashes as the host's programs have them. A picture of each view goes to
// OUT. SEEN gets {robots: {robot: {hash_page, epochs_different, cpu_s}}, play: {robot, hash_page, epochs, script, log}, requests, console_errors};
// script and log are files that the page saved. Status 1 where something differs, with a line for each.
import { existsSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { session } from "./session.mjs";

const [modules, file, out, cases, result] = process.argv.slice(2);
const { browser, page, newPage, expect, data, picture, untilState, settled, diagnosed, upload, heard, end } = await session(modules, file, out);
const seenOf = { robots: {}, play: null };
await picture("open");

const drawn = () => page.evaluate(() => [...document.querySelectorAll("canvas")].filter((canvas) => canvas.width > 0).map((canvas) => {
  // A copy: a canvas of the page that is read out again and again would be warned about.
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d", { willReadFrequently: true }), colours = new Set();
  copy.drawImage(canvas, 0, 0);
  const pixels = copy.getImageData(0, 0, canvas.width, canvas.height).data;
  for (let i = 0; i < pixels.length; i += 4 * 7) colours.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
  return colours.size;
}));

/** Seconds of CPU of the page's processes. */
const system = await browser.target().createCDPSession();
const cpu = async () => (await system.send("SystemInfo.getProcessInfo")).processInfo.filter(({ type }) => type === "renderer").reduce((sum, { cpuTime }) => sum + cpuTime, 0);

/** A button that saves a file: its path. */
async function saved(button, name) {
  const path = join(dirname(resolve(result)), name);
  rmSync(path, { force: true });
  await page.click(button);
  for (let i = 0; i < 200 && !existsSync(path); i++) await new Promise((done) => setTimeout(done, 50));
  return path;
}

/** Drives, breaks two things, hears what the node says, saves the run and looks at it. */
async function play() {
  const until = (seconds) => page.waitForFunction((wanted) => parseFloat(document.querySelector("#play .clock").textContent) >= wanted, { timeout: 120000 }, seconds);
  const heard = (kind, words) => page.waitForFunction((kind, words) => [...document.querySelectorAll(`#play .said [data-kind=${kind}]`)].some((li) => li.textContent.includes(words)), { timeout: 60000 }, kind, words).then(() => true, () => false);
  await system.send("Browser.setDownloadBehavior", { behavior: "allow", downloadPath: dirname(resolve(result)) });
  await page.select("#play-speed", "10");
  await page.focus("#play canvas");
  await page.keyboard.press("Space");
  await until(20);
  expect(await heard("mode", "nominal"), "play: 20 s are driven, and the node says that it is nominal");
  await page.click("[data-fault=gnss_jump]");
  expect(await heard("refusal", "GNSS position: refused"), "play: the node refuses fixes that jump");
  await picture("play");
  await until(45);
  expect(await heard("ended", "fixes jump 100 m"), "play: the end of a fault is said");
  await page.click("[data-fault=slip_left]");
  expect(await heard("fault", "a wheel slips"), "play: the node says that a wheel slips");
  await until(60);
  await page.click("#play-go");
  await page.waitForFunction(() => document.body.dataset.played, { timeout: 60000 });
  const seen = await data(), summary = await page.$eval("#play .summary", (p) => p.textContent);
  expect(parseFloat(summary.match(/[\d.]+ %/)) > 50, `play: ${summary}`);
  expect((await drawn()).every((colours) => colours > 3), "play: path and errors have been drawn");
  seenOf.play = { robot: "rover", hash_page: seen.played, epochs: Number(seen.playedEpochs), script: await saved("#play-script", "rover_1.faults"), log: await saved("#play-log", "rover_1.log") };
  await page.click("#play-look");
  await settled();
  const looked = await data();
  expect(looked.sha === seen.played && looked.different === "0", `play: looked at, it is the run that was played (${looked.sha?.slice(0, 12)}, ${looked.different} different)`);
  await diagnosed();
  await picture("play_looked_at");
}

async function open({ robot, log, sha, crc, epochs }) {
  const began = Date.now(), before = await cpu();
  await upload(log);
  await settled();
  const took = Date.now() - began, seen = await data();
  seenOf.robots[robot] = { hash_page: seen.sha, epochs_different: Number(seen.different), cpu_s: (await cpu()) - before };
  expect(seen.sha === sha && seen.crc === crc, `${robot}: hash and CRC of the host (${seen.sha?.slice(0, 12)}, ${seen.crc}; ${took} ms; ${seen.status})`);
  expect(seen.different === "0", `${robot}: ${epochs} epochs as recorded`);
  await diagnosed();
  expect((await page.$eval("#robot", (select) => select.selectedOptions[0].textContent)) === robot, `${robot}: recognised by its parameters`);
  expect((await drawn()).every((colours) => colours > 3), `${robot}: every picture has been drawn`);
}

async function change({ path, value, sha }, before) {
  await page.focus("#numbers input[type=search]");
  await page.$eval("#numbers input[type=search]", (input, text) => ((input.value = text), input.dispatchEvent(new Event("input"))), path);
  await page.$eval(`[data-path="${path}"]`, (input, text) => ((input.value = text), input.dispatchEvent(new Event("change"))), value);
  await settled();
  const seen = await data(), words = await page.$eval("#effect", (p) => p.textContent).catch(() => "");
  const same = sha === before;
  expect(same ? seen.second === "" && /no effect/.test(words) : seen.second === sha, `${path} = ${value}: ${same ? "said to have no effect" : "hash of the host"} (${words})`);
}

/** Page, log and numbers in one file, opened by somebody else. */
async function passOn(robot) {
  const file = await saved("#save-case", "raw.html"), before = await data(), other = await newPage();
  await other.goto(`file://${file}`);
  await other.waitForFunction((second) => document.body.dataset.second === second, { timeout: 120000 }, before.second).catch(() => {});
  const { sha, second } = await other.evaluate(() => ({ ...document.body.dataset }));
  expect(sha === before.sha && second === before.second && second !== "", `${robot}: saved as one file, both runs are in it (${second?.slice(0, 12)})`);
  await other.close();
}

await play();
for (const one of JSON.parse(readFileSync(cases, "utf8"))) {
  await open(one);
  await picture(one.robot);
  for (const setting of one.settings) {
    await change(setting, one.sha);
    await picture(`${one.robot}_${setting.path}`);
    if ((await data()).second !== "") await passOn(one.robot);
    await page.click("#numbers .buttons button");
    await untilState("done");
  }
}
// The keyboard: to the next refusal, and what is said of it.
const refusals = await page.evaluate(() => document.querySelector("#timeline canvas") !== null);
if (refusals) {
  await page.focus("#timeline canvas");
  await page.keyboard.press("n");
  const why = await page.$eval("#why .body", (body) => body.textContent);
  expect(why.length > 0, `n shows why: ${why.slice(0, 120)}`);
}
await page.setViewport({ width: 390, height: 844 });
await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "dark" }]);
await page.click("#language");
await new Promise((done) => setTimeout(done, 300));
expect((await page.evaluate(() => document.documentElement.lang)) === "id", "Indonesian");
expect((await page.$$eval("#views canvas", (all) => all.length)) >= 4, "the pictures are there at 390 pixels");
expect((await data()).wide <= 0, "nothing is wider than 390 pixels");
await picture("narrow_dark_id");

writeFileSync(result, JSON.stringify({ ...seenOf, requests: heard.requests.length, console_errors: heard.errors.length }));
await end();
