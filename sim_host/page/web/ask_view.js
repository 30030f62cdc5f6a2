// SPDX-License-Identifier: Apache-2.0
// A log of a robot that the page does not know: what is in it, and which robots are near. Nothing is played until one is chosen.
import { element, replace } from "./dom.js";
import { robotsFor } from "./tables.js";
import { say } from "./texts.js";

const OFFERED = 3;

/** `identity` of the log; `onChoose(number)`. */
export function renderAsk(parent, robots, identity, onChoose) {
  const { inputs, config, duration_s: duration, base, frames } = identity, order = robotsFor(robots, inputs);
  const words = (sensors) => sensors.map((sensor) => say(`source.${sensor}`)).join(", ") || "–";
  const all = element("select", { id: "ask-other", "aria-label": say("ask.other") }, order.map(({ number }) => element("option", { value: number }, robots[number].name)));
  replace(parent, element("h2", {}, say("ask.title")),
    element("p", { class: "warning" }, config === undefined ? say("ask.silent") : say("ask.unknown", config.toString(16).padStart(8, "0"))),
    element("p", {}, say("ask.log", frames, duration.toFixed(1), base.toString(16))),
    inputs.length > 0 ? element("ul", {}, inputs.map(({ sensor, samples, rate_hz }) => element("li", {}, say("ask.input", say(`source.${sensor}`), samples, (rate_hz ?? 0).toFixed(1))))) : element("p", { class: "bad" }, say("ask.nothing")),
    element("p", {}, say("ask.nearest")),
    order.slice(0, OFFERED).map(({ number, taken, left, missing, useless }) => element("div", { class: "offer" },
      element("button", { "data-offer": robots[number].name, onclick: () => onChoose(number) }, say("ask.play", robots[number].name)),
      element("span", { class: "note" }, useless ? say("ask.useless") : `${say("ask.takes", words(taken))}${left.length > 0 ? ` ${say("ask.leaves", words(left))}` : ""}${missing.length > 0 ? ` ${say("ask.missing", words(missing))}` : ""}`))),
    element("div", { class: "offer" }, all, element("button", { onclick: () => onChoose(Number(all.value)) }, say("ask.other"))),
    element("p", { class: "note" }, say("ask.numbers")));
  parent.hidden = false;
}
