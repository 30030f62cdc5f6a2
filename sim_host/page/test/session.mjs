// SPDX-License-Identifier: Apache-2.0
// A page from disk in a headless browser (BROWSER: chromium, firefox), with what tests ask of it. Requests to a network and messages on the console are failures.
import { createRequire } from "node:module";
import { mkdirSync } from "node:fs";
import { resolve } from "node:path";

/** A port of Web Serial that the test feeds: window.fakePort.feed(["320#0011", ...]) writes frames as an adapter does. Frames of the page go to window.onSent, where there is one. */
function fakeSerial() {
  // A port that was closed is not opened again: each choice gives another one.
  Object.defineProperty(navigator, "serial", { value: { requestPort: async () => (window.fakePort = made()) } });
  const made = () => {
    const port = { said: [], open: async () => {}, close: async () => {} };
    port.readable = new ReadableStream({ start: (controller) => (port.input = controller) });
    port.writable = new WritableStream({ write: (chunk) => {
      for (const command of new TextDecoder().decode(chunk).split("\r").filter(Boolean)) port.said.push(command), port.input.enqueue(new TextEncoder().encode("\r")), command[0] === "t" && window.onSent?.(command);
    } });
    port.feed = (frames) => {
      const bytes = new TextEncoder().encode(frames.map((frame) => frame.split("#")).map(([id, data]) => `t${id}${data.length / 2}${data}\r`).join(""));
      for (let at = 0; at < bytes.length; at += 4093) port.input.enqueue(bytes.slice(at, at + 4093));
    };
    return port;
  };
}

const LAUNCHED = {
  chromium: { executablePath: "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu", "--disable-background-networking"] },
  firefox: { browser: "firefox", executablePath: "/usr/bin/firefox-esr", extraPrefsFirefox: { "layout.css.prefers-color-scheme.content-override": 1 } },
};

export async function session(modules, file, out, { serial = false, width = 1180, height = 900 } = {}) {
  const puppeteer = createRequire(`${resolve(modules)}/`)("puppeteer-core"), failures = [], heard = { requests: [], errors: [] };
  mkdirSync(out, { recursive: true });
  const browser = await puppeteer.launch({ ...LAUNCHED[process.env.BROWSER ?? "chromium"], headless: true, timeout: 120000, protocolTimeout: 240000 });
  const newPage = async () => {
    const made = await browser.newPage();
    made.on("pageerror", ({ message }) => heard.errors.push(message));
    made.on("console", (message) => heard.errors.push(`${message.type()}: ${message.text()}`));
    made.on("request", (request) => /^(file|blob|data):/.test(request.url()) || heard.requests.push(request.url()));
    return made;
  };
  const page = await newPage();
  if (serial) await page.evaluateOnNewDocument(fakeSerial);
  const expect = (is, what) => {
    console.log(`${is ? "ok  " : "FAIL"} ${what}`);
    if (!is) failures.push(what);
  };
  const untilState = (state) => page.waitForFunction((wanted) => [wanted, "failed"].includes(document.body.dataset.state), { timeout: 120000 }, state);
  /** Until what was begun a moment ago has ended. */
  const settled = async () => {
    await page.waitForFunction(() => document.body.dataset.state === "busy").catch(() => {});
    await untilState("done");
  };
  const diagnosed = () => page.waitForFunction(() => document.body.dataset.diagnosed, { timeout: 60000 });
  const upload = async (...paths) => {
    await page.evaluate(() => ["diagnosed", "state"].forEach((name) => delete document.body.dataset[name]));
    await (await page.$("#file")).uploadFile(...paths);
  };
  await page.setViewport({ width, height });
  if (!process.env.BROWSER) await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: "light" }]);
  await page.goto(session.url(file));
  await untilState("ready");
  return {
    browser, page, newPage, expect, untilState, settled, diagnosed, upload, heard,
    data: () => page.evaluate(() => ({ ...document.body.dataset, status: document.getElementById("status").textContent, wide: document.documentElement.scrollWidth - innerWidth })),
    picture: (name) => page.screenshot({ path: `${out}/${name}.png`, fullPage: true }),
    end: async () => {
      expect(heard.requests.length === 0, `no request to a network ${heard.requests.slice(0, 3)}`);
      expect(heard.errors.length === 0, `no message on the console ${heard.errors.slice(0, 3)}`);
      await browser.close();
      process.exit(failures.length > 0 ? 1 : 0);
    },
  };
}
session.url = (file) => `file://${resolve(file)}`;
