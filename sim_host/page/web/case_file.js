// SPDX-License-Identifier: Apache-2.0
// Page, log and changed numbers as one HTML file: what a report of a mistake needs. The log lies gzipped beside the module.
import { base64Of, unpacked } from "./packing.js";

/** The page as it was read, before a script has changed it. */
const PRISTINE = document.documentElement.cloneNode(true);
for (const saved of PRISTINE.querySelectorAll("#saved, #saved-log")) saved.remove();

function stored(id, text) {
  const script = document.createElement("script");
  script.type = "application/octet-stream";
  script.id = id;
  script.textContent = text;
  return script;
}

/** `numbers` {path: [value of each element]}, `described` [[row, element, value]] of a recording's form: a blob of the file. */
export async function caseFile(log, robot, numbers, described = []) {
  const page = PRISTINE.cloneNode(true), body = page.querySelector("body");
  const gzipped = await new Response(log.stream().pipeThrough(new CompressionStream("gzip"))).blob();
  body.prepend(stored("saved", await base64Of(new Blob([JSON.stringify({ name: log.name, robot, numbers, described })]))), stored("saved-log", await base64Of(gzipped)));
  return new Blob([`<!doctype html>\n${page.outerHTML}\n`], { type: "text/html" });
}

/** What the file was saved with: {log, robot, numbers, described}, or null. */
export async function savedCase() {
  const about = document.getElementById("saved");
  if (!about) return null;
  const bytes = Uint8Array.from(atob(about.textContent), (c) => c.charCodeAt(0));
  const { name, robot, numbers, described } = JSON.parse(new TextDecoder().decode(bytes));
  const rows = Array.isArray(described) ? described.filter((one) => Array.isArray(one) && one.length === 3 && one.every(Number.isFinite)) : [];
  return { log: new File([await unpacked("saved-log")], String(name)), robot: String(robot), numbers, described: rows };
}
