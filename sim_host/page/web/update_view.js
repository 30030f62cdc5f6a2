// SPDX-License-Identifier: Apache-2.0
// One update of the flashed filter, opened: prior, innovation, S, gain, posterior, in numbers and as ellipses, beside the textbook's equations.
import { element, replace, colour, sized } from "./dom.js";
import { apart, byTheBook, ellipse, plane, stateNames } from "./equations.js";
import { decimal, say } from "./texts.js";

export const short = (x) => decimal(x === 0 ? "0" : Math.abs(x) >= 1e4 || Math.abs(x) < 1e-3 ? x.toExponential(2) : String(+x.toPrecision(4)));

function table(heads, rows, label) {
  return element("div", { class: "wide", tabindex: "0", role: "region", "aria-label": label }, element("table", {}, element("caption", {}, label),
    element("thead", {}, element("tr", {}, heads.map((head) => element("th", { scope: "col" }, head)))),
    element("tbody", {}, rows.map(([name, ...cells]) => element("tr", {}, element("th", { scope: "row" }, name), cells.map((cell) => element("td", {}, cell)))))));
}
const matrix = (values, n, label) => table(["", ...Array.from({ length: n }, (_, i) => `${i + 1}`)], Array.from({ length: n }, (_, r) => [`${r + 1}`, ...Array.from({ length: n }, (_, c) => short(values[r * n + c]))]), label);

/** Tables and picture of an update that Tasks.updates or Tasks.lesson gave. */
export function renderUpdate(parent, update) {
  const { states: n, components: m, at, moved, prior, posterior, h, noise, nu, s } = update, book = byTheBook(update), used = update.verdict === "Accepted";
  const names = stateNames(n)?.map((name) => say(`axis.${name}`)) ?? Array.from({ length: n }, (_, i) => `x${i + 1}`), sigma = (p, i) => Math.sqrt(Math.max(0, p[i * n + i]));
  const measured = Array.from({ length: m }, (_, c) => `${c + 1}`);
  const far = book ? apart(update, book) : null, canvas = plane(n) ? element("canvas", { role: "img", "aria-label": say("update.picture") }) : null;
  replace(parent,
    element("p", { class: used ? "good" : "bad" }, say("update.what", update.model, say(`verdict.${update.verdict}`), short(update.nis), update.gate < 1e29 ? say("update.gate", short(update.gate)) : say("update.nogate"))),
    canvas, canvas && element("p", { class: "note" }, say(isDirect(update, plane(n)) ? "update.legend" : "update.legend.plane")),
    table(["", "ν = z − h(x⁻)", "R", "S", "σ = √S", "ν/σ"], measured.map((name, c) => [name, short(nu[c]), short(noise[c]), short(s[c * m + c]), short(Math.sqrt(s[c * m + c])), short(nu[c] / Math.sqrt(s[c * m + c]))]), say("update.innovation")),
    m > 1 && matrix(s, m, "S = H P⁻ Hᵀ + R") || null,
    table(["", "x⁻", "σ⁻", ...measured.map((name) => `H ${name}`), ...measured.map((name) => `K ${name}`), "K ν", "x⁺ − x⁻", "x⁺", "σ⁺"],
      names.map((name, i) => [name, short(at[i]), short(sigma(prior, i)), ...measured.map((_, c) => short(h[c * n + i])), ...measured.map((_, c) => (book ? short(book.k[i * m + c]) : "–")), book ? short(book.dx[i]) : "–", short(moved[i]), short(at[i] + moved[i]), short(sigma(posterior, i))]), say("update.states")),
    n <= 4 && matrix(prior, n, "P⁻") || null, n <= 4 && matrix(posterior, n, "P⁺") || null,
    element("ol", { class: "equations" }, ["S = H P⁻ Hᵀ + R", "K = P⁻ Hᵀ S⁻¹", "ν = z − h(x⁻)", "x⁺ = x⁻ + K ν", "P⁺ = P⁻ − K S Kᵀ"].map((text) => element("li", {}, text))),
    far ? element("p", { class: used && far.p < 1e-3 ? "good" : "note", id: "update-apart" }, say(used ? "update.apart" : "update.unused", short(far.p), short(far.x))) : null);
  if (canvas) draw(canvas, update, plane(n));
}

/** Whether the measurement is of the two places themselves. */
const isDirect = ({ states: n, components: m, h }, [i, j]) => m >= 2 && Math.abs(h[i] - 1) < 1e-6 && Math.abs(h[n + j] - 1) < 1e-6;

/** In each half another scale: with the innovation, where the measurement is of the two places themselves, and without it. */
function draw(canvas, { states: n, components: m, moved, prior, posterior, h, nu, s, verdict }, [i, j]) {
  const [context, width, height] = sized(canvas, 260), before = ellipse(prior, n, [i, j]), after = ellipse(posterior, n, [i, j]);
  const direct = isDirect({ states: n, components: m, h }, [i, j]), seen = direct ? ellipse(s, m, [0, 1]) : null;
  context.fillStyle = colour("paper");
  context.fillRect(0, 0, width, height);
  const halves = direct ? [true, false] : [false], wide = width / halves.length, step = Math.hypot(moved[i], moved[j]);
  halves.forEach((whole, k) => {
    const reach = Math.max(before.long, after.long, step, whole ? Math.max(seen.long, Math.hypot(nu[0], nu[1])) : 0, 1e-9);
    const scale = (Math.min(wide, height) / 2 - 14) / (1.1 * reach), x = (value) => wide * (k + 0.5) + value * scale, y = (value) => height / 2 - value * scale;
    const one = ({ long, short: other, angle }, dx, dy, ink, dash = []) => {
      context.strokeStyle = ink;
      context.lineWidth = 2;
      context.setLineDash(dash);
      context.beginPath();
      context.ellipse(x(dx), y(dy), long * scale, other * scale, -angle, 0, 2 * Math.PI);
      context.stroke();
      context.setLineDash([]);
    };
    one(before, 0, 0, colour("first"));
    one(after, moved[i], moved[j], colour("second"));
    if (whole) {
      one(seen, 0, 0, colour("faint"), [5, 4]);
      context.fillStyle = colour(verdict === "Accepted" ? "fix" : "bad");
      context.fillRect(x(nu[0]) - 4, y(nu[1]) - 4, 8, 8);
    }
    context.fillStyle = colour("faint");
    context.font = "11px system-ui, sans-serif";
    const left = wide * k + 14;
    context.fillText(`${short(reach)} m`, left, height - 12);
    context.fillRect(left, height - 8, reach * scale, 2);
    const [across, up] = [i, j].map((state) => (stateNames(n) ? say(`axis.${stateNames(n)[state]}`) : `x${state + 1}`));
    context.fillText(`${across} →`, Math.min(wide * (k + 1) - context.measureText(`${across} →`).width - 6, x(1.1 * reach)), y(0) + 4);
    context.fillText(`${up} ↑`, x(0) + 4, 12);
  });
}
