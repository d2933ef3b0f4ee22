// Suggested paths and the table of tools.
import { clearErrors, note, noteEdit } from "/static/js/dialogs.js";
import { fillOptions, group, h, whenChanged } from "/static/js/dom.js";
import { fixed, mm, sentence } from "/static/js/format.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { JobLine } from "/static/js/job-line.js";
import { read } from "/static/js/rest.js";
import { pathKey, samePath } from "./same-path.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { AlternativePublic, PlanSection, ShaftSection, SuggestionPublic, ToolPublic, ToolTablePublic, ViewModel } from "/static/js/types.js" */

const ORDER = "First are those that fit, then those that are tight; of these the one with the shortest tool in soft tissue, then the least deep, then the widest of bone.";
const NOT_READY = "Add the first path point at a nostril, and a target.";
const EARLIER_WAYS = "Found for an earlier path, whose points have changed since. Use one of these ways, or suggest a path again.";
const EARLIER_TOOLS = "Driven along an earlier path, whose points have changed since. Ask again for this one.";

export class SuggestGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.changedShown = whenChanged();
    this.changedStanding = whenChanged();
    this.work = new JobLine();
    /** @type {SuggestionPublic | null} */
    this.suggestion = null;
    this.askedOf = ""; // the path when the ways were asked for
    this.found = ""; // what was found, in words
    this.words = h("p", { class: "words", id: "suggest-words" });
    /** @type {HTMLSelectElement} */
    this.target = h("select", { id: "suggest-target" });
    this.button = h("button", { type: "button", class: "wide", id: "suggest", "data-command": "suggest", onclick: () => this.look() }, "Suggest a path");
    this.list = h("ul", { class: "list", id: "alternatives", "aria-label": "Suggested paths" });
    this.useButton = h("button", { type: "button", class: "wide primary", id: "use-suggestion", "data-command": "suggestion.use", hidden: true, onclick: () => this.use() }, "Use this path");
    this.element = group("Suggest a path", null, h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, "Target")), this.target), this.button,
      this.work.element, this.words, this.list, this.useButton);
  }

  /** @param {ViewModel} state */
  update({ plan, shaft }) {
    this.changed([plan?.id, plan?.points[0]?.id, plan?.ghost, plan?.targets, plan?.locked], () => this.renderEnds(plan));
    this.changedShown([shaft?.shown, plan?.id, plan?.locked], () => this.renderShown(plan, shaft));
    this.changedStanding([plan?.points.map((point) => point.position), this.suggestion?.id], () => this.renderStanding(plan));
  }

  /** @param {PlanSection | null | undefined} plan */
  renderEnds(plan) {
    if (this.suggestion && this.suggestion.plan_id !== plan?.id) this.forget();
    const targets = plan?.targets ?? [];
    fillOptions(this.target, targets.map((target) => [target.id, target.label]));
    this.target.disabled = targets.length < 2;
    this.button.disabled = !entryOf(plan) || !targets.length;
    if (!this.suggestion) this.words.textContent = this.button.disabled ? NOT_READY : `From ${plan?.points[0]?.label ?? "the place that you clicked"}, with the chosen tool.`;
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {ShaftSection | undefined} shaft
   */
  renderShown(plan, shaft) {
    const shown = shaft?.shown ?? null;
    for (const button of this.list.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset.shown === shown));
    this.useButton.hidden = !shown || !this.suggestion?.alternatives.length;
    this.useButton.disabled = Boolean(plan?.locked);
    this.useButton.title = plan?.locked ? "The plan is locked." : "";
  }

  /**
   * Which way the path follows; where it is neither one of them nor the path they were asked for, they are of an earlier one.
   * @param {PlanSection | null | undefined} plan
   */
  renderStanding(plan) {
    const { suggestion } = this;
    if (!suggestion || !plan) return;
    const followed = suggestion.alternatives.findIndex((one) => samePath(plan.points, one.points));
    const earlier = followed < 0 && pathKey(plan.points) !== this.askedOf;
    this.list.querySelectorAll("li").forEach((row, number) => row.setAttribute("aria-current", String(number === followed)));
    this.list.classList.toggle("earlier", earlier);
    this.words.classList.toggle("caution", earlier || Boolean(suggestion.none));
    if (earlier) this.words.textContent = suggestion.none ? `${this.found} Asked of an earlier path.` : EARLIER_WAYS;
    else this.words.textContent = followed < 0 ? this.found : `The path follows way ${followed + 1}. Choose another one to see it in the head.`;
  }

  async look() {
    const { plan } = this.connection.state;
    const target = plan?.targets.find((one) => one.id === this.target.value) ?? plan?.targets[0];
    const entry = entryOf(plan);
    if (!plan || !target || !entry) return;
    clearErrors();
    this.forget();
    this.askedOf = pathKey(plan.points);
    this.button.disabled = true;
    this.words.textContent = "";
    try {
      const found = await this.work.run(`/api/v1/plans/${encodeURIComponent(plan.id)}/suggestions`, { entry, target: target.position });
      this.words.textContent = found ? "" : "The search was cancelled.";
      if (found) this.show(await read(`/api/v1/suggestions/${encodeURIComponent(found)}`));
    } catch (error) {
      this.words.textContent = sentence(/** @type {Error} */ (error).message);
    } finally {
      this.button.disabled = false;
    }
  }

  /** @param {SuggestionPublic} suggestion */
  show(suggestion) {
    this.suggestion = suggestion;
    const { none, alternatives } = suggestion;
    this.found = none
      ? `No way found: ${none.reason}. It ends ${mm(none.gap_mm)} from the target, at ${placeWords(none.ends_at)}. Looked through: ${none.searched}.`
      : `${alternatives.length > 1 ? `Choose one to see it in the head. ${ORDER}` : "Choose it to see it in the head."}`;
    this.list.replaceChildren(...alternatives.map((one, number) => this.row(one, number)));
    this.renderStanding(this.connection.state.plan);
    if (alternatives.length) this.preview(0);
  }

  /**
   * @param {AlternativePublic} one
   * @param {number} number
   */
  row(one, number) {
    const key = `${this.suggestion?.id} ${number}`;
    const shown = () => this.preview(number);
    // a pointer that rests is not asking, though the list may move below it
    const pointed = (/** @type {PointerEvent} */ { movementX, movementY }) => {
      if ((movementX || movementY) && this.connection.state.shaft?.shown !== key) shown();
    };
    return h("li", {}, h("button", {
      type: "button", class: "alternative", "data-shown": key, "aria-pressed": "false", onclick: shown, onpointermove: pointed,
    }, h("span", { class: "name" }, `Way ${number + 1}`), h("span", { class: one.verdict === "fits" ? "words" : "words caution", title: one.words }, figures(one))));
  }

  /** @param {number} number */
  preview(number) {
    if (this.suggestion) this.connection.send("suggestion.show", { suggestion_id: this.suggestion.id, alternative: number });
  }

  use() {
    const number = Number(this.connection.state.shaft?.shown?.split(" ")[1]);
    if (!this.suggestion || Number.isNaN(number)) return;
    const done = this.connection.request("suggestion.use", { suggestion_id: this.suggestion.id, alternative: number });
    noteEdit(this.connection, "plan", done, "The path follows the suggestion.");
    // the list stays, so that nothing jumps
    this.list.querySelectorAll("button")[number]?.focus({ preventScroll: true });
  }

  /** Show no suggestion any more. */
  forget() {
    if (this.connection.state.shaft?.shown) this.connection.send("suggestion.hide");
    this.suggestion = null;
    this.list.replaceChildren();
    this.words.classList.remove("caution");
    this.found = this.words.textContent = "";
  }
}

export class ToolTableGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.changedStanding = whenChanged();
    this.work = new JobLine();
    /** @type {ToolTablePublic | null} */
    this.table = null;
    this.askedOf = ""; // the path when the drives were asked for
    this.words = h("p", { class: "words", id: "tools-words" });
    this.button = h("button", { type: "button", class: "wide", id: "which-tool", "data-command": "which-tool", onclick: () => this.measure() }, "Which tool?");
    this.body = h("tbody");
    const columns = ["Tool", "Bone", "Soft tissue"].map((name) => h("th", { scope: "col" }, name));
    this.rows = h("table", { class: "points", id: "tool-table", "aria-label": "Tools along this path", hidden: true }, h("thead", {}, h("tr", {}, columns)), this.body);
    this.element = h("div", { class: "fields" }, this.button, this.work.element, this.words, this.rows);
  }

  /** @param {ViewModel} state */
  update({ plan }) {
    this.changed([plan?.id, (plan?.points.length ?? 0) > 1], () => {
      this.button.disabled = !plan || plan.points.length < 2;
      if (this.table && this.table.plan_id !== plan?.id) this.show(null);
    });
    this.changedStanding([plan?.points.map((point) => point.position), plan?.tool, this.table?.id], () => this.renderStanding(plan));
  }

  /**
   * Whether the table is of the path as it is, and which of its tools is chosen.
   * @param {PlanSection | null | undefined} plan
   */
  renderStanding(plan) {
    if (!this.table || !plan) return;
    const earlier = pathKey(plan.points) !== this.askedOf;
    this.words.textContent = earlier ? EARLIER_TOOLS : "Each tool driven along this path. Click one to choose it.";
    this.words.classList.toggle("caution", earlier);
    this.rows.classList.toggle("earlier", earlier);
    for (const row of this.body.rows) row.setAttribute("aria-selected", String(row.dataset.tool === plan.tool.name));
  }

  async measure() {
    const { plan } = this.connection.state;
    if (!plan) return;
    this.askedOf = pathKey(plan.points);
    this.button.disabled = true;
    this.words.textContent = "";
    try {
      const found = await this.work.run(`/api/v1/plans/${encodeURIComponent(plan.id)}/tools`, {});
      this.show(found ? await read(`/api/v1/tool_tables/${encodeURIComponent(found)}`) : null);
      if (!found) this.words.textContent = "The drives were cancelled.";
    } catch (error) {
      this.words.textContent = sentence(/** @type {Error} */ (error).message);
    } finally {
      this.button.disabled = false;
    }
  }

  /** @param {ToolTablePublic | null} table */
  show(table) {
    this.table = table;
    this.rows.hidden = !table;
    this.words.textContent = "";
    this.words.classList.remove("caution");
    this.body.replaceChildren(...(table?.tools ?? []).map((tool) => this.row(tool)));
    this.renderStanding(this.connection.state.plan);
  }

  /** @param {ToolPublic} tool */
  row(tool) {
    const choose = () => {
      if (this.connection.state.plan?.locked) note("The plan is locked. Unlock it to choose another tool.", { error: true });
      else this.connection.send("plan.tool", { name: tool.tool });
    };
    const bone = tool.least_clearance_mm === null ? "–" : mm(tool.least_clearance_mm, 2);
    const tissue = tool.tissue_mm === null ? "not known" : mm(tool.tissue_mm, 0);
    const name = h("button", { type: "button", class: "plain", title: "Choose this tool", onclick: choose }, tool.title);
    const short = tool.reaches ? null : h("p", { class: "words caution" }, `${tool.reached_mm === null ? "" : `${mm(tool.reached_mm, 0)} of ${mm(tool.length_mm, 0)}: `}${tool.reason}`);
    return h("tr", { "data-tool": tool.tool }, h("td", {}, name, short), h("td", {}, bone), h("td", {}, tissue));
  }
}

/**
 * Where the tool goes in: the first path point, or the place of a click that is not added yet.
 * @param {PlanSection | null | undefined} plan
 */
function entryOf(plan) {
  return plan?.points[0]?.position ?? (plan?.ghost?.kind === "point" ? plan.ghost.position : null);
}

/** @param {AlternativePublic} one */
function figures(one) {
  const tissue = one.tissue_mm === null || one.tissue_depth_mm === null ? "soft tissue not known" : `soft tissue ${mm(one.tissue_mm, 0)}, ${mm(one.tissue_depth_mm)} deep`;
  const ends = one.short_of_target_mm > 0.5 ? `; ends ${mm(one.short_of_target_mm)} before the target` : "";
  return `${one.short}. ${mm(one.nearest_clearance_mm, 2)} to ${one.nearest} (margin ${fixed(one.margin_mm, 2)}); ${tissue}${ends}`;
}
