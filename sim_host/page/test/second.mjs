// SPDX-License-Identifier: Apache-2.0
// node second.mjs PUPPETEER PAGE.html OUT CASES SEEN: the page from disk in another engine (BROWSER of session.mjs): a robot is driven with a fault, and each log has the host's hash.
// CASES as of browser.mjs. SEEN gets {robots: {robot: {hash_page, epochs_different}}, requests, console_errors}. Status 1 where something differs.
import { readFileSync, writeFileSync } from "node:fs";
import { session } from "./session.mjs";

const [modules, file, out, cases, result] = process.argv.slice(2);
const { page, expect, data, picture, settled, diagnosed, upload, heard, end } = await session(modules, file, out);
const until = (seconds) => page.waitForFunction((wanted) => parseFloat(document.querySelector("#play .clock").textContent) >= wanted, { timeout: 120000 }, seconds);
await page.select("#play-speed", "10");
await page.click("#play-go");
await until(10);
await page.click("[data-fault=gnss_jump]");
await until(25);
await page.click("#play-go");
await page.waitForFunction(() => document.body.dataset.played, { timeout: 60000 });
const said = await page.$$eval("#play .said [data-kind=refusal]", (all) => all.map(({ textContent }) => textContent).join(" "));
expect(/GNSS position: refused/.test(said), `driven, and the node refuses fixes that jump: ${said.slice(0, 60)}`);
await page.click("#play-look");
await settled();
expect((await data()).sha === (await data()).played && (await data()).different === "0", `the played run again: ${(await data()).sha?.slice(0, 12)}`);
const robots = {};
for (const { robot, log, sha } of JSON.parse(readFileSync(cases, "utf8"))) {
  await upload(log);
  await settled();
  await diagnosed();
  const seen = await data();
  robots[robot] = { hash_page: seen.sha, epochs_different: Number(seen.different) };
  expect(seen.sha === sha && seen.different === "0", `${robot}: hash of the host (${seen.sha?.slice(0, 12)}, ${seen.different} different)`);
  await picture(`firefox_${robot}`);
}
writeFileSync(result, JSON.stringify({ robots, requests: heard.requests.length, console_errors: heard.errors.length }));
await end();
