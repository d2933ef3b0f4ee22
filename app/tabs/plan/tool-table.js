// The table of tools: each of them driven along the path.
import { note } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { mm, sentence } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { read } from "/static/js/rest.js";
import { pathKey } from "./same-path.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanSection, ToolPublic, ToolTablePublic, ViewModel } from "/static/js/types.js" */

const EARLIER_TOOLS = "Path changed since. Ask again.";

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
    this.button = h("button", { type: "button", class: "wide", id: "which-tool", onclick: () => this.measure() }, "Which tool?");
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
    this.words.textContent = earlier ? EARLIER_TOOLS : "Click a tool to choose it.";
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
      if (this.connection.state.plan?.locked) note("Locked. Unlock to change the tool.", { error: true });
      else this.connection.send("plan.tool", { name: tool.tool });
    };
    const bone = tool.least_clearance_mm === null ? "–" : mm(tool.least_clearance_mm, 2);
    const tissue = tool.tissue_mm === null ? "not known" : mm(tool.tissue_mm, 0);
    const name = h("button", { type: "button", class: "plain", title: "Choose this tool", onclick: choose }, tool.title);
    const short = tool.reaches ? null : h("p", { class: "words caution" }, `${tool.reached_mm === null ? "" : `${mm(tool.reached_mm, 0)} of ${mm(tool.length_mm, 0)}: `}${tool.reason}`);
    return h("tr", { "data-tool": tool.tool }, h("td", {}, name, short), h("td", {}, bone), h("td", {}, tissue));
  }
}
