// Why no way was found, where it ends, and what can be done about it there.
import { note, noteEdit } from "/static/js/dialogs.js";
import { send } from "/static/js/rest.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { hintLine, html, nothing } from "/static/js/template.js";
import { removalBall } from "./removal.js";
import { itemAt } from "./same-path.js";
import { ARRIVES_MM } from "./way-figures.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PathSearch } from "./suggestion.js" */
/** @import { NonePublic, PlanSection, SuggestionPublic } from "/static/js/types.js" */

const SEARCHED_MM = 2; // a way is longer than this
const LONGEST_NAME = 120;

/**
 * @param {SuggestionPublic} suggestion that has found none
 * @param {NonePublic} none
 * @param {PlanSection} plan
 * @param {boolean} earlier it was asked of an earlier path
 * @param {{ end: () => void, remove: () => void, show: () => void }} does
 */
export function noWay(suggestion, none, plan, earlier, { end, remove, show }) {
  const target = itemAt(plan.targets, suggestion.target);
  const shortens = none.gap_mm > ARRIVES_MM && target && Math.hypot(...none.ends_at.map((value, axis) => value - suggestion.entry[axis])) >= SEARCHED_MM;
  const help = html`The search ends ${placeWords(none.ends_at)}: ${none.reason}. It looked through ${none.searched}. A thinner tool or another entry may make a way too.`;
  return html`<div id="no-way">
    ${hintLine("suggest-words", earlier ? "Plan changed. Suggest again." : `No way to ${target?.label ?? "it"}: ${none.short}.`, help, true)}
    <div class="buttons even">
      ${shortens ? html`<button type="button" id="end-there" title="A target where the way ends" ?disabled=${plan.locked} @click=${end}>End there</button>` : nothing}
      <button type="button" id="remove-there" title="Where the way ends" ?disabled=${plan.locked} @click=${remove}>Remove bone there</button>
    </div>
    <button type="button" class="plain" @click=${show}>Show the place</button>
  </div>`;
}

/**
 * A target where the way ends, as one edit, and look for the way to there; the target of the search stays.
 * @param {Connection} connection
 * @param {PathSearch} search
 */
export async function endThere(connection, search) {
  const { plan } = connection.state;
  const { none, target } = search.suggestion ?? {};
  const wanted = plan && target && itemAt(plan.targets, target);
  if (!wanted || !none) return;
  const label = `before ${wanted.label}`.slice(0, LONGEST_NAME);
  /** @type {Promise<{ id: string }>} */
  const added = send(`/api/v1/plans/${encodeURIComponent(plan.id)}/targets`, { position: none.ends_at, label });
  noteEdit(connection, "plan", added, `Added ‘${label}’ where the way ends.`);
  const made = await added.catch(() => null);
  if (made) search.look(connection.state.plan, made.id, none.ends_at);
}

/**
 * Mark a ball of bone to be removed where the way ends, which the tool passes, as one edit.
 * @param {Connection} connection
 * @param {PathSearch} search
 */
export async function removeThere(connection, search) {
  const { plan } = connection.state;
  const { none, target } = search.suggestion ?? {};
  if (!plan || !none || !target) return;
  const { position, radius } = removalBall(none.ends_at, target, plan.tool.shaft_radius_mm, plan.margin_mm);
  try { // a click without the drawing that it belongs to would add a point
    await connection.request("region.draw", { purpose: "remove", kind: "sphere", sizes_mm: [radius] });
  } catch (error) {
    note(/** @type {Error} */ (error).message, { error: true });
    return;
  }
  noteEdit(connection, "plan", connection.request("pick.slice", { position }), "Check its size, then suggest again.");
}
