// SPDX-License-Identifier: Apache-2.0
// node browser.mjs PUPPETEER PAGE.html OUT JSON: opens the page from disk in a headless Chromium and does what a user does. JSON: cases
// [{robot, log, sha, crc, epochs, settings: [{path, value, sha}]}], hashes as the host's programs have them. A picture of each view goes to
// OUT. Status 1 where something differs, with a line for each.
import { createRequire } from "node:module";
import { readFileSync, mkdirSync } from "node:fs";
import { resolve } from "node:path";

const [modules, file, out, cases] = process.argv.slice(2);
const puppeteer = createRequire(`${resolve(modules)}/`)("puppeteer-core");
mkdirSync(out, { recursive: true });

const failures = [];
const expect = (is, what) => {
  console.log(`${is ? "ok  " : "FAIL"} ${what}`);
  if (!is) failures.push(what);
};

const browser = await puppeteer.launch({ executablePath: "/usr/bin/chromium", headless: true, args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking"], timeout: 120000, protocolTimeout: 240000 });
const page = await browser.newPage();
const heard = { requests: [], errors: [] };
page.on("pageerror", ({ message }) => heard.errors.push(message));
page.on("console", (message) => heard.errors.push(`${message.type()}: ${message.text()}`));
page.on("request", (request) => /^(file|blob|data):/.test(request.url()) || heard.requests.push(request.url()));

const until = (state) => page.waitForFunction((wanted) => [wanted, "failed"].includes(document.body.dataset.state), { timeout: 120000 }, state);
const data = () => page.evaluate(() => ({ ...document.body.dataset, status: document.getElementById("status").textContent, wide: document.documentElement.scrollWidth - innerWidth }));
const picture = (name) => page.screenshot({ path: `${out}/${name}.png`, fullPage: true });
const drawn = () => page.evaluate(() => [...document.querySelectorAll("canvas")].filter((canvas) => canvas.width > 0).map((canvas) => {
  const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data, colours = new Set();
  for (let i = 0; i < pixels.length; i += 4 * 7) colours.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
  return colours.size;
}));

async function open({ robot, log, sha, crc, epochs }) {
  await page.evaluate(() => delete document.body.dataset.diagnosed);
  const began = Date.now();
  await (await page.$("#file")).uploadFile(log);
  await page.waitForFunction(() => document.body.dataset.state === "busy").catch(() => {});
  await until("done");
  const took = Date.now() - began, seen = await data();
  expect(seen.sha === sha && seen.crc === crc, `${robot}: hash and CRC of the host (${seen.sha?.slice(0, 12)}, ${seen.crc}; ${took} ms; ${seen.status})`);
  expect(seen.different === "0", `${robot}: ${epochs} epochs as recorded`);
  await page.waitForFunction(() => document.body.dataset.diagnosed, { timeout: 60000 });
  expect((await page.$eval("#robot", (select) => select.selectedOptions[0].textContent)) === robot, `${robot}: recognised by its parameters`);
  expect((await drawn()).every((colours) => colours > 3), `${robot}: every picture has been drawn`);
}

async function change({ path, value, sha }, before) {
  await page.focus("#numbers input[type=search]");
  await page.$eval("#numbers input[type=search]", (input, text) => ((input.value = text), input.dispatchEvent(new Event("input"))), path);
  await page.$eval(`[data-path="${path}"]`, (input, text) => ((input.value = text), input.dispatchEvent(new Event("change"))), value);
  await page.waitForFunction(() => document.body.dataset.state === "busy").catch(() => {});
  await until("done");
  const seen = await data(), words = await page.$eval("#effect", (p) => p.textContent).catch(() => "");
  const same = sha === before;
  expect(same ? seen.second === "" && /no effect/.test(words) : seen.second === sha, `${path} = ${value}: ${same ? "said to have no effect" : "hash of the host"} (${words})`);
}

const { width, height } = { width: 1180, height: 900 };
await page.setViewport({ width, height });
await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }]);
await page.goto(`file://${resolve(file)}`);
await until("ready");
await picture("open");
for (const one of JSON.parse(readFileSync(cases, "utf8"))) {
  await open(one);
  await picture(one.robot);
  for (const setting of one.settings) {
    await change(setting, one.sha);
    await picture(`${one.robot}_${setting.path}`);
    await page.click("#numbers .buttons button");
    await until("done");
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

expect(heard.requests.length === 0, `no request to a network ${heard.requests.slice(0, 3)}`);
expect(heard.errors.length === 0, `no message on the console ${heard.errors.slice(0, 3)}`);
await browser.close();
process.exit(failures.length > 0 ? 1 : 0);
