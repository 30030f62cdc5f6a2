// SPDX-License-Identifier: Apache-2.0
// What the page says of a log in words: its bits, what is wrong with it, and what became of one measurement.
import { element, replace } from "./dom.js";
import { say } from "./texts.js";

/** The replay beside the log's own node; `note`: how it was played. */
export function renderBits(body, { result }, note) {
  const compared = result.epochs_compared ?? 0, same = compared > 0 && result.epochs_different === 0;
  const verdict = compared === 0 ? say("bits.none") : same ? say("bits.same", compared) : say("bits.differ", result.epochs_different, compared, result.first_difference);
  const warnings = [result.first_malformed, result.cut_off, result.first_gap, result.first_wrong_length].filter(Boolean).join("; ");
  replace(body,
    element("p", { class: same ? "good" : compared === 0 ? "note" : "bad", id: "same" }, verdict),
    result.other_numbers ? element("p", { class: "warning" }, say("bits.numbers")) : null,
    note ? element("p", { class: "warning" }, note) : null,
    result.wrong && same ? element("p", { class: "warning" }, result.wrong) : null,
    warnings ? element("p", { class: "warning" }, say("open.warnings", warnings)) : null,
    element("p", { class: "hash" }, say("bits.hash", result.estimates_sha256)), element("p", { class: "hash" }, say("bits.crc", result.state_crc_last)));
}

/** `found` of the doctor; null while it works. */
export function renderFindings(body, found) {
  if (!found) return replace(body, element("p", { class: "note" }, say("findings.wait")));
  if (found.failed) return replace(body, element("p", { class: "warning" }, say("findings.failed", found.failed)));
  if (found.findings.length === 0) return replace(body, element("p", { class: "good" }, say("findings.none")));
  replace(body, element("ol", {}, found.findings.map(({ code, cause, evidence, change }) =>
    element("li", { "data-code": code }, element("strong", {}, cause), element("p", {}, `${say("findings.evidence")}: ${evidence}`),
      element("p", { class: "change" }, `${say("findings.change")}: ${change}`)))));
}

/** `one` of Run.sources; `onOpen(one)` is to open its update. */
export function renderWhy(body, run, one, onOpen) {
  if (!one) return replace(body, element("p", { class: "note" }, say("why.nothing")));
  const faults = run.faults(one.time), named = [...Array(16).keys()].filter((bit) => (faults >> bit) & 1).map((bit) => say(`fault.${bit}`)), mode = run.mode(one.time);
  replace(body,
    element("p", {}, say("why.when", say(`source.${one.source}`), one.time.toFixed(2), say(`verdict.${one.verdict}`))),
    element("p", {}, say(`check.${one.failed}`)),
    Number.isNaN(one.ratio) ? null : element("p", {}, say("why.ratio", one.ratio.toFixed(2))),
    mode ? element("p", {}, say("why.mode", say(`word.${mode}`), say(`mode.${mode}`))) : null,
    named.length > 0 ? element("p", {}, say("why.faults", named.join(", "))) : null,
    element("button", { id: "open-update", onclick: () => onOpen(one) }, say("why.open")));
}

/** A source in a line: how many of its measurements were refused, and the largest of them over its gate. */
export function sourceLine(run, name) {
  const all = run.sources.get(name), refused = all.filter((one) => one.refused), most = refused.reduce((top, { ratio }) => (ratio > top ? ratio : top), 0);
  return say("innovation.line", say(`source.${name}`), all.length, refused.length, most > 0 ? most.toFixed(1) : "–");
}
