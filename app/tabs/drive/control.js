// Who keeps the robot in its pathway: the three arms, a paper's parameters, and the values of single links.
import { behindLine, behindWords } from "/static/js/behind-wall.js";
import { fixed } from "/static/js/format.js";
import { NumberFields } from "/static/js/number-fields.js";
import { hintLine, html, nothing, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, DriveOptionsView, LinkValuesView, SnakeView } from "/static/js/types.js" */

/** @typedef {DriveOptionsView["arm"]} Arm */
/** Of every arm its name on the page, and what it is; in the order of the buttons. @type {Record<Arm, [string, string]>} */
const ARMS = {
  manual: ["Manual", "No help: your hand turns one joint."],
  guided: ["Guided", "Gentle forces lead your hand."],
  certified: ["Certified", "Stops the robot at its limit."],
};
const ARM_NAMES = /** @type {Arm[]} */ (Object.keys(ARMS));
const WITHOUT = "Without the certificate: nothing keeps the robot in its pathway.";
const HELP = "Manual: the paper’s ‘without’. Left and right, up and down turn one of the last two universal joints, the others follow the centreline. "
  + "Guided: the paper’s ‘with’. Forces on the hand, and no bound that holds; joints still have their range and speed, and in moving tissue the robot waits for the tissue. Without a force device the pull yields to the force. "
  + "Certified: ours. Every motion is certified to stay in the pathway, and stopped at its limit. Another arm ends the run, and the next begins at the entry.";
/** @param {SnakeView | null | undefined} snake */
const betweenHelp = (snake) => (snake?.behind ? ` Between vertices a link can be ${fixed(snake.behind.between_mm, 1)} mm deeper, in bends more.` : "");
/** @type {[NonNullable<DriveOptionsView["preset"]> | "", string][]} */
const PRESETS = [["", "Default"], ["kwok2013", "Kwok 2013"]];
const PRESET_HELP = "Printed parameters of the paper: its polar Hermite surface through four control bends, in place of our control that turns the view. "
  + "The robot stays that of the route. The run ends, and the next begins at the entry.";
/** @type {[1 | 2, string][]} */
const JOINTS = [[2, "Before last"], [1, "Last"]];
const LINKS_HELP = "b: how far the link may leave its pathway; empty: by the route. a: deviation from which on the guidance pulls. "
  + "k: how hard it pulls. Kwok 2013, (17) and (33), Table II. Another value ends the run.";
/** @type {[keyof LinkValuesView, string, string, string][]} field, sign, unit, spoken */
const COLUMNS = [["bound_mm", "b", "mm", "Bound"], ["threshold_mm", "a", "mm", "Threshold"], ["spring_n_per_mm", "k", "N/mm", "Spring"]];
const LEAST_BOUND_MM = 0.1, MOST = 50; // of the values that a drive takes
const fields = new NumberFields();

/**
 * @param {Connection} connection
 * @param {DriveOptionsView | undefined} options
 * @param {SnakeView | null | undefined} snake
 * @param {boolean} running whether this window's robot runs
 */
export function controlGroup(connection, options, snake, running) {
  if (!options) return nothing;
  const { arm, preset, open } = options;
  const choose = (/** @type {Event} */ { currentTarget }) => {
    const { value } = /** @type {HTMLSelectElement} */ (currentTarget);
    connection.send("drive.preset", { preset: /** @type {DriveOptionsView["preset"]} */ (value || null) });
  };
  return titled("Arm", null, html`
    <div class="segmented devices" role="group" aria-label="Arm">${ARM_NAMES.map((name) => html`<button type="button" data-arm=${name}
      aria-pressed=${String(name === arm)} ?disabled=${!open} @click=${() => connection.send("drive.arm", { arm: name })}>${ARMS[name][0]}</button>`)}</div>
    ${hintLine("arm-words", ARMS[arm][1], arm === "certified" ? `${HELP}${betweenHelp(snake)}` : HELP)}
    ${arm === "certified" && snake?.behind ? behindLine("certified-words", behindWords(snake.behind, snake.behind.bound_mm)) : nothing}
    ${arm === "certified" ? nothing : html`<p class="words uncertified" id="uncertified" role="status">${WITHOUT}</p>`}
    ${arm === "manual" ? joints(connection, snake, running) : nothing}
    ${arm === "guided" && snake?.yield_mm_per_s_per_n ? html`<p class="words" id="yield-words">Each newton of guidance moves your pull by ${fixed(snake.yield_mm_per_s_per_n, 0)} mm/s, assumed.</p>` : nothing}
    <div class="beside">${hintLine("preset-words", "Parameters", PRESET_HELP)}
      <select id="drive-preset" aria-label="Parameters" ?disabled=${!open} .value=${preset ?? ""} @change=${choose}>
        ${PRESETS.map(([name, label]) => html`<option value=${name} ?selected=${name === (preset ?? "")}>${label}</option>`)}</select></div>
    <details class="folded" id="link-values"><summary>Values by link</summary>${linkTable(connection, options)}</details>`);
}

/**
 * @param {Connection} connection
 * @param {SnakeView | null | undefined} snake
 * @param {boolean} running
 */
function joints(connection, snake, running) {
  return html`<div class="beside"><p class="words">Joint (J)</p><div class="segmented" role="group" aria-label="Joint of the hand">${JOINTS.map(([joint, label]) => html`
    <button type="button" data-joint=${joint} aria-pressed=${String((snake?.joint ?? 1) === joint)} ?disabled=${!running} @click=${() => connection.send("drive.joint", { joint })}>${label}</button>`)}</div></div>`;
}

/**
 * @param {Connection} connection
 * @param {DriveOptionsView} options
 */
function linkTable(connection, { links, open }) {
  const input = (/** @type {number} */ row, /** @type {keyof LinkValuesView} */ name, /** @type {string} */ spoken) => {
    const bound = name === "bound_mm", changed = (/** @type {number | null} */ value) => connection.send("drive.links", linkValues(links.map((link, at) => (at === row ? { ...link, [name]: value } : link))));
    return fields.of(`link-${row + 1}-${name}`, { low: bound ? LEAST_BOUND_MM : 0, high: MOST, value: links[row][name], off: !open, changed, emptied: bound ? () => changed(null) : undefined },
      { "data-value": name, "aria-label": `${spoken}, ${nameOf(row, links.length)}`, ...(bound ? { placeholder: "auto" } : {}) });
  };
  return html`${hintLine("links-words", "The five distal links.", LINKS_HELP)}<div class="field"><table class="link-values">
    <thead><tr><th scope="col">Link</th>${COLUMNS.map(([, sign, unit]) => html`<th scope="col"><i>${sign}</i> <span class="unit">${unit}</span></th>`)}</tr></thead>
    <tbody>${[...links.keys()].map((row) => html`<tr><th scope="row">${nameOf(row, links.length)}</th>${COLUMNS.map(([name, , , spoken]) => html`<td>${input(row, name, spoken)}</td>`)}</tr>`)}</tbody></table></div>
    <button type="button" id="links-usual" ?disabled=${!open} @click=${() => connection.send("drive.links", { bounds_mm: null, thresholds_mm: null, springs_n_per_mm: null })}>As printed</button>`;
}

/**
 * Of the distal links, counted from the tip.
 * @param {number} row
 * @param {number} count
 */
function nameOf(row, count) {
  return ["Last", "2nd last", "3rd last"][count - 1 - row] ?? `${count - row}th last`;
}

/**
 * What is sent of the table: all bounds at once, and none where all are by the route.
 * @param {LinkValuesView[]} links
 * @returns {Commands["drive.links"]}
 */
export function linkValues(links) {
  const of = (/** @type {keyof LinkValuesView} */ name) => /** @type {any} */ (links.map((link) => link[name] ?? (name === "bound_mm" ? null : NaN)));
  const bounds = of("bound_mm");
  return {
    bounds_mm: bounds.every((/** @type {number | null} */ bound) => bound === null) ? null : bounds,
    thresholds_mm: of("threshold_mm"), springs_n_per_mm: of("spring_n_per_mm"),
  };
}
