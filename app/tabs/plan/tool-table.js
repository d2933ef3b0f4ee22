// The table of tools: each of them simulated along the path.
import { note } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { fixed, mm, sentence } from "/static/js/format.js";
import { hintLine } from "/static/js/hint-line.js";
import { JobLine } from "/static/js/job-line.js";
import { read, send } from "/static/js/rest.js";
import { moveFocus } from "/static/js/roving.js";
import { draw, html, iconTemplate, nothing, repeat } from "/static/js/template.js";
import { LEVELS } from "/static/js/verdict-card.js";
import { pathKey } from "./same-path.js";
import { toolPicture } from "./tool-picture.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanSection, ToolPublic, ToolTablePublic, ViewModel } from "/static/js/types.js" */

const HELP = "The plan's own tool as the card above judges it; each other tool with the directions of the shaft that suit it best. "
  + "Choosing one takes these directions over with it, as one edit.";

export class ToolTableGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.work = new JobLine();
    /** @type {ToolTablePublic | null} */
    this.table = null;
    this.askedOf = ""; // the path when the tools were asked for
    this.busy = false;
    this.problem = "";
    this.element = h("div", { class: "fields" });
  }

  /** @param {ViewModel} state */
  update({ plan }) {
    if (this.table && this.table.plan_id !== plan?.id) this.table = null;
    const of = [plan?.id, plan?.points.map((point) => point.position), plan?.tool, plan?.locked, this.table?.id, this.busy, this.problem];
    this.changed(of, () => draw(this.element, this.template(plan)));
  }

  /** @param {PlanSection | null | undefined} plan */
  template(plan) {
    const { table } = this;
    return html`<button type="button" class="wide" id="which-tool" ?disabled=${(plan?.points.length ?? 0) < 2} aria-disabled=${String(this.busy)}
        @click=${() => this.measure()}>Which tool?</button>
      ${this.work.element}
      ${this.problem ? html`<p class="words" role="status">${this.problem}</p>` : nothing}
      ${plan && table ? this.answer(plan, table) : nothing}`;
  }

  /**
   * @param {PlanSection} plan
   * @param {ToolTablePublic} table
   */
  answer(plan, { tools }) {
    const earlier = pathKey(plan.points) !== this.askedOf;
    const chosen = Math.max(tools.findIndex(({ tool }) => tool === plan.tool.name), 0);
    return html`${hintLine("tools-words", earlier ? "Path changed since. Ask again." : "Click a tool to choose it.", HELP, earlier)}
      <table class=${earlier ? "points earlier" : "points"} id="tool-table" aria-label="Tools along this path">
        <thead><tr><th scope="col">Tool</th><th scope="col">Fit</th><th scope="col">Bone<span class="unit">mm</span></th><th scope="col">Tissue<span class="unit">mm</span></th></tr></thead>
        <tbody>${repeat(tools, ({ tool }) => tool, (tool, number) => this.row(tool, number === chosen, plan.tool.name, earlier))}</tbody>
      </table>`;
  }

  /**
   * @param {ToolPublic} tool
   * @param {boolean} tabbed the Tab key stops at it
   * @param {string} chosen name of the plan's tool
   * @param {boolean} earlier
   */
  row(tool, tabbed, chosen, earlier) {
    const { word, icon } = LEVELS[tool.verdict];
    const choose = () => this.choose(tool, earlier);
    const keys = (/** @type {KeyboardEvent} */ event) => {
      if (moveFocus(event, [.../** @type {NodeListOf<HTMLElement>} */ (this.element.querySelectorAll("tbody tr"))]) !== null) return;
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      choose();
    };
    const why = tool.reaches ? "" : sentence(`${tool.reached_mm === null ? "" : `${fixed(tool.reached_mm, 0)} of ${mm(tool.length_mm, 0)}: `}${tool.reason}`);
    return html`<tr data-tool=${tool.tool} data-level=${tool.verdict} tabindex=${tabbed ? 0 : -1} aria-selected=${String(tool.tool === chosen)}
      title=${why || "Choose this tool"} @click=${choose} @keydown=${keys}>
      <td>${toolPicture(tool)}<span class="tool-title">${tool.title}</span></td>
      <td><span class="way-verdict"><span class="card-icon">${iconTemplate(icon)}</span>${word}</span>${why ? html`<span class="tool-stop">${stopOf(tool)}</span><span class="visually-hidden">${why}</span>` : nothing}</td>
      <td>${fixed(tool.least_clearance_mm, 2)}</td><td>${fixed(tool.tissue_mm, 0)}</td>
    </tr>`;
  }

  async measure() {
    const { plan } = this.connection.state;
    if (!plan || this.busy) return;
    this.askedOf = pathKey(plan.points);
    this.busy = true;
    this.problem = "";
    this.update(this.connection.state);
    try {
      const found = await this.work.run(`/api/v1/plans/${encodeURIComponent(plan.id)}/tools`, {});
      this.table = found ? await read(`/api/v1/tool_tables/${encodeURIComponent(found)}`) : null;
      if (!found) this.problem = "The comparison was cancelled.";
    } catch (error) {
      this.problem = sentence(/** @type {Error} */ (error).message);
    } finally {
      this.busy = false;
      this.update(this.connection.state);
    }
    this.element.querySelector("tbody tr")?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {ToolPublic} tool
   * @param {boolean} earlier
   */
  async choose({ tool }, earlier) {
    const { plan } = this.connection.state;
    if (!this.table || !plan || tool === plan.tool.name) return;
    if (plan.locked) note("Locked. Unlock to change the tool.", { error: true });
    else if (earlier) note("Path changed since. Ask which tool again.", { error: true });
    else {
      const wish = { tool, revision: plan.revision };
      await send(`/api/v1/tool_tables/${encodeURIComponent(this.table.id)}/use`, wish).catch((error) => note(sentence(error.message), { error: true }));
    }
  }
}

/**
 * What stops a tool, in two words.
 * @param {ToolPublic} tool
 */
function stopOf({ pierces, reached_mm: reached }) {
  if (pierces) return "pierces";
  return reached === null ? "at entry" : `at ${mm(reached, 0)}`;
}
