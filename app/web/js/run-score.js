// The score of a run as rows of a panel, and its holds, each of which opens its moment.
import { fixed, sentence } from "./format.js";
import { UNCERTIFIED, duration, errorOf, millimetres, modeWord } from "./runs.js";
import { html, more, nothing } from "./template.js";

/** @import { HoldPublic, RunTitle, ScorePublic, TaskItemPublic } from "./types.js" */

const SHORTEST_S = 0.05; // a hold that was shorter nobody has felt
const MOST_HOLDS = 5, MOST_UNFOLDED = 12;
const PLANNING = "planning"; // the kind of a hold by the computer, not by the lumen
/** @type {Record<string, string>} */
const HELP = {
  "Time driven": "Counts while the robot is led; with polyps always, but for pauses.",
  Smoothness: "Spectral arc length; 0 is smoothest. Compare equal tasks only.",
  "Deviation, largest": "How far the last links were outside the pathway.",
  Depth: "The deepest place of the tip.",
  Held: "While the hand pushed and the robot did not follow.",
};

/** @typedef {{ name: string, value: string, worse?: boolean, folded?: boolean }} Fact worse: something to look at. folded: with all others, not among the first */

/**
 * Mode of a run, and in colour that it had no certificate.
 * @param {string | null} mode
 * @param {boolean} uncertified
 * @param {string} [beside] figures of what its certificate does not speak of
 */
export function modeLine(mode, uncertified, beside = "") {
  return html`<p class="run-mode" data-uncertified=${String(uncertified)}><strong>${modeWord(mode)}</strong>${uncertified ? html`<span class="pill">${UNCERTIFIED}</span>` : nothing}${beside ? html`<span class="certified-of">${beside}</span>` : nothing}</p>`;
}

/**
 * What is worth saying of a run, in the order in which it is read.
 * @param {ScorePublic} score
 * @returns {Fact[]}
 */
export function factsOf(score) {
  const { path_error_mm: path, target_error_mm: target } = score;
  /** @type {Fact[]} */
  const facts = [{ name: "Time", value: duration(score.time_s) }];
  if (path) facts.push({ name: "Tip error, mean", value: millimetres(path.robot_frame.mean) }, { name: "Tip error, largest", value: millimetres(path.robot_frame.max) });
  if (target) facts.push({ name: "Target error, mean", value: millimetres(target.robot_frame.mean) });
  if (score.angle_deg !== null) facts.push({ name: "Angle covered", value: `${fixed(score.angle_deg, 0)}°` });
  for (const [name, least] of Object.entries(score.least_clearance_mm)) facts.push({ name: `Nearest to ${name}`, value: `${least >= score.reach_mm - 1e-6 ? "≥ " : ""}${millimetres(least)}`, worse: least < 0 });
  if (score.contacts) facts.push({ name: "Contacts", value: `${score.contacts}, ${fixed(score.max_depth_mm, 1)} mm deep`, worse: true });
  else if (!score.certified) facts.push({ name: "Contacts", value: "none" });
  if (score.mode !== "freehand") facts.push({ name: "Held", value: duration(score.held_s) }); // nothing holds a free hand
  if (score.spectral_arc_length !== null) facts.push({ name: "Smoothness", value: fixed(score.spectral_arc_length, 2) });
  return facts;
}

/** The figures that decide, and all of them where some are folded. @param {Fact[]} facts */
export function scoreFacts(facts) {
  const first = facts.filter(({ folded }) => !folded);
  if (first.length === facts.length) return factList(facts);
  return html`${factList(first)}<details class="folded all-figures"><summary>All figures</summary>${factList(facts)}</details>`;
}

/** @param {Fact[]} facts */
function factList(facts) {
  return html`<dl class="facts run-facts">${facts.map(({ name, value, worse }) => html`<dt>${name}${HELP[name] ? more(HELP[name]) : nothing}</dt><dd class=${worse ? "worse" : ""}>${value}</dd>`)}</dl>`;
}

/**
 * The learning curve of runs, and what the line of the teacher is; nothing of a single run.
 * @param {RunTitle[]} last oldest first
 * @param {RunTitle | null} teacher
 * @param {{ element: HTMLElement }} curve
 */
export function learningPart(last, teacher, curve) {
  if (last.length < 2) return nothing;
  const level = errorOf(teacher);
  return html`<div class="learning-part"><h3>Tip error of the last ${last.length} completed runs</h3>${curve.element}
    ${level === null ? nothing : html`<p class="plot-keys teacher-key"><span><i class="dashed"></i>teacher <span class="number">${millimetres(level)}</span></span></p>`}</div>`;
}

/**
 * The holds that were felt, the longest first.
 * @param {{ holds: HoldPublic[] }} score
 */
export function feltHolds({ holds }) {
  return holds.filter(isFelt).sort((a, b) => b.held_s - a.held_s);
}

/** @param {HoldPublic} hold */
function isFelt({ kind, duration_s: length }) {
  return kind === "contact" || length >= SHORTEST_S;
}

/**
 * The lines of a list of holds: those by the computer as one, with their number and total. What was held is counted as in
 * the score, without the interruptions of a hold.
 * @param {HoldPublic[]} holds
 * @returns {{ hold: HoldPublic, words: string, length_s: number }[]}
 */
export function holdLines(holds) {
  const planning = holds.filter(({ kind }) => kind === PLANNING);
  return holds.flatMap((hold) => {
    if (hold.kind !== PLANNING) return [{ hold, words: sentence(hold.reason), length_s: hold.held_s }];
    if (hold !== planning[0]) return [];
    const times = planning.length > 1 ? `, ${planning.length} times` : "";
    return [{ hold, words: `Waiting for the computer${times}`, length_s: inAll(planning) }];
  });
}

/** @param {Iterable<HoldPublic>} holds s */
function inAll(holds) {
  return [...holds].reduce((sum, { held_s: held }) => sum + held, 0);
}

/**
 * The polyps or labels of a task by their numbers, each with when it was done; those that were not stand out.
 * @param {TaskItemPublic[]} items
 * @param {(t: number) => void} open
 */
export function itemList(items, open) {
  return html`<ul class="run-holds task-items" aria-label="Polyps and labels">${items.map(({ name, done_s: at, share }) => html`<li>
    <button type="button" class="plain" title="Show this moment" ?disabled=${at === null} @click=${() => open(at ?? 0)}><span>${name}</span><span class=${at === null ? "worse" : "number"}>${at !== null ? duration(at) : share > 0 ? `${Math.floor(100 * share)} % cut` : "missed"}</span></button></li>`)}</ul>`;
}

/**
 * A list of holds, or of contacts of a free hand; each is a button that goes there. Its times add up to those of the score.
 * @param {{ holds: HoldPublic[] }} score
 * @param {(hold: HoldPublic) => void} open
 * @param {number | null} [most] the others are in Review; null: in Review, where they are folded
 */
export function holdList(score, open, most = MOST_HOLDS) {
  const lines = holdLines(feltHolds(score)), shown = most ?? MOST_UNFOLDED;
  const unfelt = score.holds.filter((hold) => !isFelt(hold)), rest = lines.slice(shown).reduce((sum, { length_s: length }) => sum + length, 0);
  const brief = inAll(unfelt) < SHORTEST_S ? nothing : html`<p class="words quiet">Brief holds: ${unfelt.length}, ${duration(inAll(unfelt))}</p>`; // less is none in tenths
  if (!lines.length) return brief;
  const list = (/** @type {ReturnType<typeof holdLines>} */ of) => html`<ul class="run-holds" aria-label="Holds">${of.map(({ hold, words, length_s: length }) => html`<li>
    <button type="button" class="plain" title="Show this moment" @click=${() => open(hold)}><span>${words}</span><span class="number">${duration(length)}</span></button></li>`)}</ul>`;
  const left = lines.length - shown;
  if (left <= 0) return html`${list(lines)}${brief}`;
  return html`${list(lines.slice(0, shown))}${most === null
    ? html`<details class="folded"><summary>${left} more</summary>${list(lines.slice(shown))}</details>` : html`<p class="words quiet">${left} more in Review, ${duration(rest)}</p>`}${brief}`;
}
