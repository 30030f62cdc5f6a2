// SPDX-License-Identifier: Apache-2.0
// What the page says of a log in words: its bits, what is wrong with it, and what became of one measurement.
import { element, replace } from "./dom.js";
import { times } from "./run.js";
import { languageNow, say } from "./texts.js";
import { shortest } from "./numbers.js";
import { codeText } from "./texts_rows.js";
import { doctorText } from "./texts_doctor.js";

/** A share of refusals up to which they are outliers as every sensor has them. */
const FEW = 0.02;

/** What became of a measurement; where a check has failed, its reason follows and is the only one. */
export const verdictOf = ({ verdict, failed }) => say(`verdict.${verdict === "Stale" && failed !== "None" ? "Rejected" : verdict}`);

/** The replay beside the log's own node; `note`: how it was played. */
export function renderBits(body, { result }, note) {
  const compared = result.epochs_compared ?? 0, same = compared > 0 && result.epochs_different === 0;
  const verdict = compared === 0 ? say("bits.none") : same ? say("bits.same", compared) : say("bits.differ", result.epochs_different, compared, result.first_difference);
  const warnings = [result.first_malformed, result.cut_off, result.first_gap, result.first_wrong_length].filter(Boolean).join("; ");
  replace(body,
    element("p", { class: same ? "good" : compared === 0 ? "note" : "bad", id: "same" }, verdict),
    result.began_with?.length ? element("p", { class: "note", id: "began" }, say(result.began_exact === false ? "bits.began_part" : "bits.began", settingText(result.began_with))) : null,
    result.other_numbers ? element("p", { class: "warning" }, say("bits.numbers")) : null,
    note ? element("p", { class: "warning" }, note) : null,
    result.wrong && same ? element("p", { class: "warning" }, result.wrong) : null,
    warnings ? element("p", { class: "warning" }, say("open.warnings", warnings)) : null,
    element("p", { class: "hash" }, say("bits.hash", result.estimates_sha256)), element("p", { class: "hash" }, say("bits.crc", result.state_crc_last)));
}

/** A finding in words that can be followed: a factor that is rounded to nothing gives way to the code's own advice. `codes` of the description. */
export function followable({ code, cause, evidence, change, remedies }, codes) {
  const nothing = /\b0\.0+ times|\bby 0\.0+\b/;
  return { code, cause, evidence: nothing.test(evidence) ? "" : evidence, change: nothing.test(change) ? codes.find(({ name }) => name === code)?.change ?? "" : change, remedies: remedies ?? [] };
}
const settingText = (remedy) => remedy.map(({ path, values }) => `${path} = ${values.map((value) => shortest(value, "float")).join(" ")}`).join(", ");

/** A sentence of the doctor, marked as English where it is. */
const said = (words) => element("span", { lang: doctorText(words).own ? languageNow() : "en" }, doctorText(words).text);

function finding({ code, cause, evidence, change, remedies }, onTry) {
  const own = codeText(code, cause), remedy = change && (own.remedy === "" || doctorText(change).own) ? null : own.remedy;
  return element("li", { "data-code": code }, element("strong", {}, own.cause), evidence ? element("p", {}, `${say("findings.evidence")}: `, said(evidence)) : null, element("div", { class: "seen" }),
    remedy ? element("p", { class: "change" }, `${say("findings.change")}: ${remedy}`) : null,
    change ? element("p", { class: remedy ? "note" : "change" }, remedy ? null : `${say("findings.change")}: `, said(change)) : null,
    remedies.length > 1 ? element("p", { class: "note" }, say("findings.several")) : null,
    remedies.map((remedy) => element("p", {}, element("button", { "data-try": code, onclick: () => onTry(remedy) }, say("findings.try", settingText(remedy))))));
}

/** What is said where the doctor finds nothing: a node that refuses much of a source contradicts "agree". */
function nothingFound(run, onShow) {
  const sources = run.mostlyRefused();
  if (sources.length === 0) return [element("p", { class: "good" }, say("findings.none"))];
  return [element("p", { class: "warning", id: "mostly-refused" }, say("findings.mostly")),
    element("ol", {}, sources.map(({ source, refused, all }) => element("li", { "data-source": source }, element("strong", {}, say("findings.source", say(`source.${source}`), refused, all)),
      element("p", { class: "change" }, say("findings.check")), element("p", {}, element("button", { onclick: () => onShow(source) }, say("findings.show"))))))];
}

/** `found` of the doctor, null while it works; `other` {maker, shown, choose()} where the log was made by another robot than is shown; `onTry(remedy)` plays the log with other parameters, `onShow(source)` shows a source's innovations. */
export function renderFindings(body, found, run, codes, other, { onTry, onShow }) {
  const [refused, all] = run.refusedOf(), counted = refused === 0 ? null : element("p", { class: "note", id: "refused" }, say(refused <= FEW * all ? "findings.refused" : "findings.many", refused, all));
  const wrong = other ? element("li", { "data-code": "other_robot" }, element("strong", {}, say("findings.robot", other.maker, other.shown)), element("p", {}, element("button", { onclick: other.choose }, say("findings.choose", other.maker)))) : null;
  const untold = found?.untold ? element("p", { class: "note", id: "untold" }, say("findings.untold", doctorText(found.untold).text)) : null;
  const list = (...items) => element("ol", {}, wrong, ...items);
  if (!found) return replace(body, wrong && list(), element("p", { class: "note" }, say("findings.wait")), counted);
  if (found.failed) return replace(body, wrong && list(), element("p", { class: "warning" }, say("findings.failed", found.failed)), counted);
  if (found.findings.length === 0) return replace(body, wrong ? list() : nothingFound(run, onShow), untold, counted);
  replace(body, list(found.findings.map((one) => finding(followable(one, codes), onTry))), untold, counted);
}

/** `one` of Run.sources, or {time, source, word} of a stretch of the time line; `onOpen(one)` is to open its update. */
export function renderWhy(body, run, one, onOpen) {
  if (!one) return replace(body, element("p", { class: "note" }, say("why.nothing")));
  const faults = run.faults(one.time), named = [...Array(16).keys()].filter((bit) => (faults >> bit) & 1).map((bit) => say(`fault.${bit}`)), mode = run.mode(one.time);
  replace(body,
    element("p", {}, one.word ? say("why.state", say(`source.${one.source}`), one.time.toFixed(2), say(`word.${one.word}`)) : say("why.when", say(`source.${one.source}`), one.time.toFixed(2), verdictOf(one))),
    one.word ? null : element("p", {}, say(`check.${one.failed}`)),
    one.word || Number.isNaN(one.ratio) ? null : element("p", {}, say("why.ratio", times(one.ratio, 2))),
    mode ? element("p", {}, say("why.mode", say(`word.${mode}`), say(`mode.${mode}`))) : null,
    named.length > 0 ? element("p", {}, say("why.faults", named.join(", "))) : null,
    one.word ? null : element("button", { id: "open-update", onclick: () => onOpen(one) }, say("why.open")));
}

/** A source in a line: how many of its measurements were refused, and the largest of them over its gate. */
export function sourceLine(run, name) {
  const all = run.sources.get(name), refused = all.filter((one) => one.refused), most = refused.reduce((top, { ratio }) => (ratio > top ? ratio : top), 0);
  return say("innovation.line", say(`source.${name}`), all.length, refused.length) + (most > 0 ? say("innovation.far", times(most)) : "");
}
