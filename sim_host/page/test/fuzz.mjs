// SPDX-License-Identifier: Apache-2.0
// node fuzz.mjs PUPPETEER PAGE.html OUT COUNT LOG...: logs, tables, archives, names and addresses that nobody meant, dropped on the page. No script of theirs runs, no tab dies, and each
// ends in a state of the page with a sentence; what traps in the module is named as a trap. The seed is fixed. Status 1 where something differs.
import { readFileSync } from "node:fs";
import { session } from "./session.mjs";

const [modules, file, out, count, ...logs] = process.argv.slice(2);
const { page, browser, expect, end } = await session(modules, file, out);
const seeds = logs.map((name) => readFileSync(name).subarray(0, 9000).toString("base64"));
let died = 0;
page.on("error", () => died++);
await page.exposeFunction("scriptRan", () => expect(false, "a script of an input ran"));

/** In the page: one input after another, each dropped as a file is. */
const dropped = (first, last, logs) => page.evaluate(async (first, last, logs) => {
  const raw = logs.map((text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)));
  const bad = ["<img src=x onerror=scriptRan()>", "<script>scriptRan()</script>", "javascript:scriptRan()", "\u202e\u0000\ufeff", "'\"><svg onload=scriptRan()>", "__proto__", "constructor", "%00", "9".repeat(400), "1e999", "-1", "nan", "\u{1F600}"];
  const heads = ["time,gyro_x,gyro_y,gyro_z,acc_x,acc_y,acc_z\n", "\"Time (s)\",\"Gyroscope x (rad/s)\"\n", "time,seconds_elapsed,z,y,x\n", "t;lat;lon\n", "date Mon Jan 1\nbase hex timestamps absolute\n", "PK\u0003\u0004", "(1.0) can0 300#0011223344556677\n"];
  const seen = {};
  for (let i = first; i < last; i++) {
    let state = (i * 2654435761) >>> 0;
    const draw = (n) => (state = (Math.imul(state ^ (state >>> 15), 2246822519) + 0x9e3779b9) >>> 0) % n;
    let bytes;
    if (i % 3 !== 2) {
      bytes = raw[draw(raw.length)].slice(0, 200 + draw(4000));
      for (let n = draw(20); n > 0; n--) {
        const at = draw(bytes.length);
        if (draw(3) === 0) bytes[at] = draw(256);
        else if (draw(2) === 0) bytes[at] = "0123456789ABCDEF#().\n \r-"[draw(24)].charCodeAt(0);
        else bytes.copyWithin(at, draw(bytes.length), Math.min(bytes.length, at + draw(60)));
      }
      if (draw(9) === 0) bytes = new Uint8Array([...bytes, ...new TextEncoder().encode(`\n${bad[draw(bad.length)]}\n`)]);
    } else {
      let text = heads[draw(heads.length)];
      for (let row = draw(30); row > 0; row--) text += `${Array.from({ length: 1 + draw(8) }, () => (draw(7) === 0 ? bad[draw(bad.length)] : String(draw(1000) / 100 - 3))).join(draw(9) ? "," : ";")}\n`;
      bytes = new TextEncoder().encode(text);
    }
    const name = draw(2) ? `${bad[draw(bad.length)]}.${["log", "csv", "zip", "html"][draw(4)]}` : ["run.log", "a.csv", "b.zip"][draw(3)];
    const data = new DataTransfer();
    data.items.add(new File([bytes], name));
    document.body.dataset.state = "fuzz";
    dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
    const began = performance.now();
    while (["fuzz", "busy"].includes(document.body.dataset.state) && performance.now() - began < 20000) await new Promise((done) => setTimeout(done, 2));
    if (performance.now() - began > 15000) (seen.slow ??= []).push(`${i} ${name}`);
    const { state: ended } = document.body.dataset, said = document.getElementById("status").textContent;
    seen[ended] = (seen[ended] ?? 0) + 1;
    if (/trap of WebAssembly/.test(said)) (seen.traps ??= []).push(`${i}: ${said}`);
    if (said === "" || (ended === "failed" && said.length < 8)) (seen.silent ??= []).push(i);
    if (document.querySelector("main img, main script, main svg, main iframe")) (seen.markup ??= []).push(i);
    // What the user would press.
    for (const button of ["#tables:not([hidden]) #tables-play", "#ask:not([hidden]) [data-offer]"]) if (draw(4) === 0) document.querySelector(button)?.click();
    while (document.body.dataset.state === "busy" && performance.now() - began < 40000) await new Promise((done) => setTimeout(done, 2));
  }
  return seen;
}, first, last, logs);

const total = {}, step = 25; // a call of the browser's protocol has its own time limit
for (let i = 0; i < Number(count); i += step) {
  const seen = await dropped(i, Math.min(i + step, Number(count)), seeds);
  for (const [name, value] of Object.entries(seen)) total[name] = Array.isArray(value) ? [...(total[name] ?? []), ...value] : (total[name] ?? 0) + value;
}
console.log(JSON.stringify({ ...total, traps: total.traps?.length ?? 0 }));
for (const one of (total.traps ?? []).slice(0, 5)) console.log(`trap ${one}`);
expect(!total.busy && !total.fuzz && !total.slow, `each of ${count} inputs ends (${JSON.stringify({ failed: total.failed, done: total.done, asks: total.asks, tables: total.tables, slow: total.slow })})`);
expect(!total.markup && !total.silent, `no markup of an input, and a sentence for each ${(total.silent ?? []).slice(0, 5)}`);
expect((total.failed ?? 0) > 0.1 * count && (total.done ?? 0) + (total.asks ?? 0) > 0.05 * count && (total.tables ?? 0) > 0.01 * count, "inputs of all kinds were among them");
expect(died === 0, "no tab died");
const addresses = ["<script>scriptRan()</script>", "rover;a=<img src=x onerror=scriptRan()>", "javascript:scriptRan()", "rover;gnss.sigma_scale=1e999", "rover;gnss.sigma_scale=1000", "%E0%A4%A", "rover;__proto__=1", "nobody;a=1", `rover;${"gnss.sigma_scale=1;".repeat(900)}`];
for (const address of addresses) {
  const other = await browser.newPage();
  await other.exposeFunction("scriptRan", () => expect(false, "a script of an address ran"));
  await other.goto(`${session.url(file)}#${address}`);
  const state = await other.waitForFunction(() => ["ready", "done", "failed"].includes(document.body.dataset.state) && document.body.dataset.state, { timeout: 60000 }).then((handle) => handle.jsonValue(), () => "none");
  expect(state === "ready" || state === "done", `address ${address.slice(0, 40)}: ${state}`);
  await other.close();
}
await end();
