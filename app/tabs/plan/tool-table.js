// The table of tools: each of them simulated along the path.
import { note } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { fixed, sentence } from "/static/js/format.js";
import { JobList } from "/static/js/job-list.js";
import { stageWords } from "/static/js/jobs.js";
import { read, send, wasCancelled } from "/static/js/rest.js";
import { Roving } from "/static/js/roving.js";
import { draw, hintLine, html, iconTemplate, nothing, repeat, said } from "/static/js/template.js";
import { LEVEL_ICONS, UPDATING, isOld } from "/static/js/verdict-line.js";
import { pathKey, surroundingsKey } from "./same-path.js";
import { toolPicture } from "./tool-picture.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { EvaluationSection, JobEntry, JobPublic, PlanSection, ToolPublic, ToolTablePublic, ViewModel } from "/static/js/types.js" */

const SAME_MM = 0.006; // the verdict's figures are rounded
const HELP = "The plan's own tool as the card above judges it; each other tool with the directions of the shaft that suit it best. "
  + "Choosing one takes these directions over with it, as one edit.";

export class ToolTableGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.work = new JobList((job, error) => this.ended(job, error), {
      holds: (job) => this.isOf(job), words: (job) => sentence(stageWords(job)), begun: (job) => this.begun(job),
    });
    /** @type {ToolTablePublic | null} */
    this.table = null;
    this.askedOf = ""; // the path and its surroundings when the tools of the table were asked for
    /** @type {Map<string, { key: string, revision?: number }>} the same of jobs that run, with the plan's revision where it may be another */
    this.asked = new Map();
    /** @type {string | undefined} the open plan */
    this.of = undefined;
    this.pending = 0; // requests and answers that are on their way
    this.problem = "";
    this.element = h("div", { class: "fields" });
    this.roving = new Roving(this.element, "tbody tr", { first: '[aria-selected="true"]' });
  }

  /** @param {ViewModel} state */
  update(state) {
    const { plan, corridor } = state;
    if (this.of !== plan?.id) {
      this.of = plan?.id;
      this.table = null;
      this.problem = "";
      this.work.again();
    }
    const of = [plan?.id, keyOf(state), plan?.tool, plan?.locked, this.table?.id, this.busy, this.problem, corridor?.state, corridor?.verdict];
    this.changed(of, () => {
      draw(this.element, this.template(plan));
      this.roving.update();
    });
  }

  /** Whether the tools are compared along the path of the open plan. */
  get busy() {
    return this.pending > 0 || this.work.shown.length > 0;
  }

  /** @param {JobEntry} job */
  isOf({ kind, document_id: of }) {
    return kind === "tools" && this.of !== undefined && of === this.of;
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
    const { state } = this.connection;
    const waits = isOld(state.corridor);
    const earlier = keyOf(state) !== this.askedOf || isOther(state.corridor, tools.find(({ tool }) => tool === plan.tool.name));
    const words = waits ? UPDATING : earlier ? "Plan changed. Ask again." : "Click a tool to choose it.";
    return html`${hintLine("tools-words", words, HELP, earlier && !waits)}
      <table class=${earlier || waits ? "points earlier" : "points"} id="tool-table" aria-label="Tools along this path">
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
    const key = keyOf(this.connection.state);
    await this.during(async () => {
      /** @type {JobEntry} */
      const job = await send(`/api/v1/plans/${encodeURIComponent(plan.id)}/tools`, {});
      this.asked.set(job.id, { key });
      this.work.watch(job);
    });
  }

  /**
   * A comparison is seen for the first time; one that this page has not begun may be of another revision of the plan.
   * @param {JobEntry} job
   */
  begun(job) {
    const { plan } = this.connection.state;
    if (plan && !this.asked.has(job.id)) this.asked.set(job.id, { key: keyOf(this.connection.state), revision: plan.revision });
    queueMicrotask(() => this.update(this.connection.state));
  }

  /**
   * @param {JobEntry & Partial<JobPublic>} job
   * @param {unknown} error
   */
  async ended(job, error) {
    const asked = this.asked.get(job.id);
    this.asked.delete(job.id);
    if (!asked || !this.isOf(job)) return;
    await this.during(async () => {
      if (error) throw error;
      /** @type {ToolTablePublic} */
      const table = await read(`/api/v1/tool_tables/${encodeURIComponent(job.result ?? "")}`);
      if (!this.isOf(job)) return;
      this.table = table;
      this.askedOf = asked.revision === undefined || asked.revision === table.revision ? asked.key : "";
    });
    for (const part of ["table", "tbody tr"]) this.element.querySelector(part)?.scrollIntoView({ block: "nearest" });
  }

  /**
   * Do something for the open plan, and say why it could not be done.
   * @param {() => Promise<void>} act
   */
  async during(act) {
    const { of } = this;
    this.pending += 1;
    this.problem = "";
    this.update(this.connection.state);
    try {
      await act();
    } catch (error) {
      if (of === this.of) this.problem = wasCancelled(error) ? "The comparison was cancelled." : sentence(/** @type {Error} */ (error).message);
    }
    this.pending -= 1;
    this.update(this.connection.state);
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

/**
 * Whether the verdict on the plan says something else of its tool than the table: the shaft is directed otherwise since.
 * @param {EvaluationSection | undefined} corridor
 * @param {ToolPublic | undefined} tool the plan's
 */
function isOther(corridor, tool) {
  if (!tool || corridor?.state !== "current" || !corridor.verdict) return false;
  const { verdict, least_clearance_mm: least } = tool;
  return corridor.level !== verdict || !corridor.verdict.figures.some(({ value }) => value !== null && least !== null && Math.abs(value - least) < SAME_MM);
}

/** @param {ViewModel} state */
function keyOf(state) {
  return `${pathKey(state.plan?.points)}; ${surroundingsKey(state)}`;
}
