// How the lumen moves: amplitude and period of breathing and of peristalsis, which belong to the route.
import { numberOf } from "/static/js/fields.js";
import { html, nothing, unlessFocused } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { RouteSection } from "/static/js/types.js" */

/**
 * @param {Connection} connection
 * @param {RouteSection | null | undefined} route
 */
export function tissueGroup(connection, route) {
  if (!route) return nothing;
  const moves = [route.breathing_mm ? "breathes" : "", route.peristalsis ? "peristalsis" : ""].filter(Boolean).join(", ") || "still";
  const [breathing, breath, wave, waves] = ["breathing-mm", "breathing-s", "peristalsis-percent", "peristalsis-s"];
  const breathe = () => connection.send("route.breathing", { breathing_mm: typed(breathing), period_s: typed(breath) });
  const narrow = () => connection.send("route.peristalsis", { share: typed(wave) / 100, period_s: typed(waves) });
  const field = (/** @type {string} */ id, /** @type {string} */ label, /** @type {number} */ value, /** @type {() => void} */ send, /** @type {string} */ operation) => html`
    <label class="field"><span class="field-label">${label}</span><input type="text" inputmode="decimal" id=${id} data-operation=${operation} ?disabled=${route.locked}
      .value=${unlessFocused(String(Math.round(100 * value) / 100))} @change=${send}></label>`;
  return html`<details class="folded" id="tissue"><summary>Tissue motion: ${moves}</summary><div class="fields two">
    ${field(breathing, "Breathing, mm", route.breathing_mm, breathe, "route.breathing")}
    ${field(breath, "Breath, s", route.breathing_period_s, breathe, "route.breathing")}
    ${field(wave, "Peristalsis, %", 100 * route.peristalsis, narrow, "route.peristalsis")}
    ${field(waves, "Wave, s", route.peristalsis_period_s, narrow, "route.peristalsis")}</div></details>`;
}

/** @param {string} id of a field */
function typed(id) {
  return numberOf(/** @type {HTMLInputElement} */ (document.getElementById(id)).value);
}
