// The task of a drive: chosen before it starts, and how far it is while it is driven.
import { fixed } from "/static/js/format.js";
import { NumberFields } from "/static/js/number-fields.js";
import { hintLine, html, nothing, repeat, said, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { DriveTaskView, LabelsNowView, TaskNowView } from "/static/js/types.js" */

const HELP = "Study I of Kwok 2013, with the arm that is chosen above. A polyp counts as viewed while it is in the square frame, 15 ± 7 mm away and within 20° of the "
  + "picture’s middle; its colour goes from blue to bright yellow as the view gets better. Held for 7 s without a break, it is done: a green tick, and a ring where it was. "
  + "The polyps are drawn by the seed where this robot can view them: the first search takes minutes. Reset or Cancel ends the task.";
const LABELS_HELP = "Study II of Kwok 2013, with the arm that is chosen above, from a fixed base. On each label lies a yellow object along the arrow. While X or the right mouse button "
  + "is held and the marker is at most 2 mm from the object’s near end, it is shortened; at the arrow’s tip the label is done. The way of the tool is drawn in 3D, red where it cuts. "
  + "The labels are drawn by the seed where this robot can trace them. Reset or Cancel ends the task.";
/** @type {Record<NonNullable<DriveTaskView["task"]>, string>} */
const NAMES = { polyps: "Polyps", labels: "Labels" };
const HALF_MM = 10; // of an arrow
const NEAR_MM = 8, FAR_MM = 22; // between which a polyp is viewed
const USUAL_HOLD_S = 7;
const MOST_SEED = 2 ** 31 - 1;
const fields = new NumberFields();

/**
 * @param {Connection} connection
 * @param {DriveTaskView | undefined} task
 */
export function taskGroup(connection, task) {
  if (!task) return nothing;
  const { now } = task;
  const send = (/** @type {Partial<Pick<DriveTaskView, "task" | "places" | "seed">>} */ changed) => {
    const { task: chosen, places, seed } = { ...task, ...changed };
    connection.send("drive.task", { task: chosen, places, seed });
  };
  const cancel = task.task && html`<button type="button" class="plain" id="cancel-task" ?disabled=${!task.open} @click=${() => send({ task: null })}>Cancel</button>`;
  return titled("Task", cancel, html`
    <div class="segmented devices" role="group" aria-label="Task">${[null, ...task.offered].map((name) => html`<button type="button" data-task=${name ?? "none"}
      aria-pressed=${String(name === task.task)} ?disabled=${!task.open} @click=${() => { if (name !== task.task) send({ task: name }); }}>${name === null ? "None" : NAMES[name]}</button>`)}</div>
    ${task.task === "labels" ? html`${task.labels ? labelProgress(task.labels) : nothing}${labelWords()}${choice(task, send)}` : nothing}
    ${task.task === "polyps" ? html`${now ? progress(now, connection.state.rehearsal?.state === "ready") : nothing}${instructions(now)}${drawnFrom(now)}${choice(task, send)}` : nothing}`);
}

/** @param {TaskNowView | null} now */
function instructions(now) {
  const hold = now?.hold_s ?? USUAL_HOLD_S;
  const end = now?.end_name ? `in the ${now.end_name} colon` : now ? `at ${fixed(now.end_mm, 0)} mm` : "at a set depth"; // known once the robot is in
  return html`<p class="words">Insert the robot and find the blue polyps.</p>
    <p class="words">Hold each in the frame for ${fixed(hold, hold % 1 ? 1 : 0)} s, 15\u00a0±\u00a07\u00a0mm away.</p>
    ${hintLine("task-end", `The task ends ${end}.`, HELP)}`;
}

/**
 * How many are done, ticked; with each one more the line is drawn anew, so that its colour shows it for a moment.
 * @param {number} done
 * @param {string} words
 */
function count(done, words) {
  return repeat([done], (number) => number, () => html`<dt class=${done ? "ticked" : ""}>${done ? "✓ " : ""}${words}</dt>`);
}

function labelWords() {
  return html`<p class="words">Turn the camera to the start of an arrow.</p>
    <p class="words">Hold X and follow the arrow to its tip.</p>
    ${hintLine("task-end", "The task ends when all labels are done.", LABELS_HELP)}`;
}

/** @param {LabelsNowView} now */
function labelProgress({ labels, traced, aimed, cutting, completed, words }) {
  const one = aimed === null ? null : labels[aimed - 1], left = one ? HALF_MM - one.end_mm : 0;
  const state = completed ? "" : !one ? "No label" : left <= 0 ? `Label ${aimed} done` : `Label ${aimed}: ${fixed(left, 0)} mm to go`;
  return html`<dl class="facts" id="label-facts">${count(traced, completed ? "All done" : `${traced} of ${labels.length} done`)}<dd class=${cutting ? "cutting" : ""}>${state}</dd></dl>
    <div class="progress"><div style=${`width: ${((100 * traced) / labels.length).toFixed(1)}%`}></div></div>
    ${words ? html`<p class="words caution" role="status">${said(words)}</p>` : nothing}`;
}

/** Where the polyps of this drive were drawn. @param {TaskNowView | null} now */
function drawnFrom(now) {
  if (now === null || now.viewable_share === null) return nothing;
  return html`<p class="words" id="task-drawn">Drawn from the viewable ${fixed(100 * now.viewable_share, 0)} % of the wall.</p>`;
}

/** Why the polyp in the picture is not viewed: 15 ± 7 mm, ± 20°. @param {TaskNowView["seen"]} seen */
function aside(seen) {
  if (seen === null) return "None in clear view"; // a fold may hide the middle of one whose rim is seen
  const { distance_mm: away, angle_deg: off } = seen;
  if (away > FAR_MM) return `Too far, ${fixed(away, 0)}\u00a0mm`;
  return away < NEAR_MM ? `Too near, ${fixed(away, 0)}\u00a0mm` : `${fixed(off, 0)}° off centre`;
}

/**
 * @param {TaskNowView} now
 * @param {boolean} waits the robot has not been driven: what it sees is not looked at
 */
function progress(now, waits) {
  const { of, cleared, held_s: held, hold_s: hold, viewed, completed } = now;
  const words = completed ? "End reached" : cleared === of ? "All viewed" : `${cleared} of ${of} viewed`; // no number: those in 3D are by place
  const share = hold > 0 ? Math.min(1, held / hold) : 0;
  return html`<dl class="facts" id="task-facts">${count(cleared, words)}<dd>${viewed ? `${fixed(held, 1)} of ${fixed(hold, hold % 1 ? 1 : 0)} s` : waits || cleared === of || completed ? "" : aside(now.seen)}</dd></dl>
    <div class="progress"><div style=${`width: ${(100 * share).toFixed(1)}%`}></div></div>
    ${now.words ? html`<p class="words caution" role="status">${said(now.words)}</p>` : nothing}`;
}

/**
 * Which polyps: another choice ends the run.
 * @param {DriveTaskView} task
 * @param {(changed: { places?: DriveTaskView["places"], seed?: number }) => void} send
 */
function choice({ task, places, seed, marks, open }, send) {
  const place = (/** @type {Event} */ { currentTarget }) => send({ places: /** @type {DriveTaskView["places"]} */ (/** @type {HTMLSelectElement} */ (currentTarget).value) });
  const input = () => fields.of("task-seed", { low: 0, high: MOST_SEED, value: seed, off: !open, changed: (value) => send({ seed: Math.round(value) }) }, { inputmode: "numeric" });
  return html`${task === "polyps" && (marks || places === "route") ? html`<div class="beside"><span class="words">Polyps</span><select id="task-places" aria-label="Polyps" ?disabled=${!open} .value=${places} @change=${place}>
      <option value="seed" ?selected=${places === "seed"}>Drawn by seed</option><option value="route" ?selected=${places === "route"}>${`Of the route: ${marks}`}</option></select></div>` : nothing}
    ${task === "labels" || places === "seed" ? html`<div class="field"><label class="beside"><span class="words">Seed</span>${input()}</label></div>` : nothing}`;
}
