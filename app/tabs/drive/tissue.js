// How the lumen moves: amplitude and period of breathing and of peristalsis, which belong to the route.
import { heldNumber } from "/static/js/fields.js";
import { NumberFields } from "/static/js/number-fields.js";
import { html, nothing } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RouteSection } from "/static/js/types.js" */

/** What a route takes. @type {Record<"breathing" | "period" | "percent", [number, number]>} */
const RANGES = { breathing: [0, 20], period: [1, 60], percent: [0, 90] };
const BREATHES = { "data-operation": "route.breathing" }, NARROWS = { "data-operation": "route.peristalsis" };
const fields = new NumberFields();

/**
 * @param {Connection} connection
 * @param {RouteSection | null | undefined} route
 * @param {boolean} [live] a robot is there, whose tissue moves as it did at its start
 */
export function tissueGroup(connection, route, live = false) {
  if (!route) return nothing;
  const moves = [route.breathing_mm ? "breathes" : "", route.peristalsis ? "peristalsis" : ""].filter(Boolean).join(", ") || "still";
  const field = (/** @type {string} */ id, /** @type {string} */ label, /** @type {[number, number]} */ [low, high], /** @type {number} */ value, /** @type {() => void} */ changed, /** @type {Record<string, string>} */ marks) => {
    const input = fields.of(id, { low, high, value: Math.round(100 * value) / 100, off: route.locked, changed }, marks);
    const shown = html`<label class="field"><span class="field-label">${label}</span>${input}</label>`;
    return { shown, get value() { return heldNumber(input) ?? value; } };
  };
  const breathe = () => connection.send("route.breathing", { breathing_mm: breathing.value, period_s: breath.value });
  const narrow = () => connection.send("route.peristalsis", { share: peristalsis.value / 100, period_s: wave.value });
  const breathing = field("breathing-mm", "Breathing, mm", RANGES.breathing, route.breathing_mm, breathe, BREATHES);
  const breath = field("breathing-s", "Breath, s", RANGES.period, route.breathing_period_s, breathe, BREATHES);
  const peristalsis = field("peristalsis-percent", "Peristalsis, %", RANGES.percent, 100 * route.peristalsis, narrow, NARROWS);
  const wave = field("peristalsis-s", "Wave, s", RANGES.period, route.peristalsis_period_s, narrow, NARROWS);
  return html`<details class="folded" id="tissue"><summary>Tissue motion: ${moves}</summary><div class="fields two">
    ${breathing.shown}${breath.shown}${peristalsis.shown}${wave.shown}</div>${live ? html`<p class="words" id="tissue-next">A change counts from the next run.</p>` : nothing}</details>`;
}
