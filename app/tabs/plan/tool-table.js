// The table of tools: each of them simulated along the path.
import { note } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { fixed, sentence } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { read, send } from "/static/js/rest.js";
import { Roving } from "/static/js/roving.js";
import { draw, hintLine, html, iconTemplate, nothing, repeat, said } from "/static/js/template.js";
import { LEVEL_ICONS } from "/static/js/verdict-line.js";
import { pathKey, surroundingsKey } from "./same-path.js";
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
    this.askedOf = ""; // the path and its surroundings when the tools were asked for
    /** @type {string | undefined} the plan that it is of */
    this.of = undefined;
    this.busy = false;
    this.problem = "";
    this.element = h("div", { class: "fields" });
    this.roving = new Roving(this.element, "tbody tr", { first: '[aria-selected="true"]' });
  }

  /** @param {ViewModel} state */
  update(state) {
    const { plan } = state;
    if (this.of !== plan?.id && !this.busy) {
      this.table = null;
      this.problem = "";
    }
    const of = [plan?.id, keyOf(state), plan?.tool, plan?.locked, this.table?.id, this.busy, this.problem];
    this.changed(of, () => {
      draw(this.element, this.template(plan));
      this.roving.update();
    });
  }

  /** @param {PlanSection | null | undefined} plan */
  template(plan) {
    const { table } = this;
    return html`<button type="button" class="wide" id="which-tool" data-command="which-tool" ?disabled=${(plan?.points.length ?? 0) < 2} aria-disabled=${String(this.busy)}
        @click=${() => this.measure()}>Which tool?</button>
      ${this.work.element}
      ${this.problem ? html`<p class="words" role="status">${said(this.problem)}</p>` : nothing}
      ${plan && table ? this.answer(plan, table) : nothing}`;
  }

  /**
   * @param {PlanSection} plan
   * @param {ToolTablePublic} table
   */
  answer(plan, { tools }) {
    const earlier = keyOf(this.connection.state) !== this.askedOf;
    return html`${hintLine("tools-words", earlier ? "Plan changed. Ask again." : "Click a tool to choose it.", HELP, earlier)}
      <table class=${earlier ? "points earlier" : "points"} id="tool-table" aria-label="Tools along this path">
        <thead><tr><th scope="col">Tool</th><th scope="col">Fit</th><th scope="col">Bone<span class="unit">mm</span></th><th scope="col">Tissue<span class="unit">mm</span></th></tr></thead>
        <tbody>${repeat(tools, ({ tool }) => tool, (tool) => this.row(tool, plan.tool.name, earlier))}</tbody>
      </table>`;
  }

  /**
   * @param {ToolPublic} tool
   * @param {string} chosen name of the plan's tool
   * @param {boolean} earlier
   */
  row(tool, chosen, earlier) {
    const choose = () => this.choose(tool, earlier);
    const keys = (/** @type {KeyboardEvent} */ event) => {
      if (event.key !== "Enter" && event.key !== " ") return;
      event.preventDefault();
      choose();
    };
    const why = tool.reaches ? "" : sentence(tool.reason);
    return html`<tr data-tool=${tool.tool} data-level=${tool.verdict} tabindex="-1" aria-selected=${String(tool.tool === chosen)}
      title=${why || "Choose this tool"} @click=${choose} @keydown=${keys}>
      <td>${toolPicture(tool)}<span class="tool-title">${tool.title}</span></td>
      <td><span class="way-verdict"><span class="card-icon">${iconTemplate(LEVEL_ICONS[tool.verdict])}</span>${tool.word}</span>${tool.stop ? html`<span class="tool-stop">${tool.stop}</span>` : nothing}${why ? html`<span class="visually-hidden">${why}</span>` : nothing}</td>
      <td>${fixed(tool.least_clearance_mm, 2)}</td><td>${fixed(tool.tissue_mm, 0)}</td>
    </tr>`;
  }

  async measure() {
    const { plan } = this.connection.state;
    if (!plan || this.busy) return;
    this.askedOf = keyOf(this.connection.state);
    this.of = plan.id;
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
    for (const part of ["table", "tbody tr"]) this.element.querySelector(part)?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {ToolPublic} tool
   * @param {boolean} earlier
   */
  async choose({ tool }, earlier) {
    const { plan } = this.connection.state;
    if (!this.table || !plan || tool === plan.tool.name) return;
    if (plan.locked) note("Unlock to change the tool.", { error: true });
    else if (earlier) note("Plan changed. Ask again.", { error: true });
    else {
      const wish = { tool, revision: plan.revision };
      await send(`/api/v1/tool_tables/${encodeURIComponent(this.table.id)}/use`, wish).catch((error) => note(sentence(error.message), { error: true }));
    }
  }
}

/** @param {ViewModel} state */
function keyOf(state) {
  return `${pathKey(state.plan?.points)}; ${surroundingsKey(state)}`;
}
