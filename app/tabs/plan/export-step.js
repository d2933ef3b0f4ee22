// Step 7: the plan as files, and a plan from a file.
import { askChoices, askForImages, note } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { download } from "/static/js/rest.js";
import { draw, filesButton, html } from "/static/js/template.js";
import { importPlan } from "./plan-import.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PlanSection, ViewModel } from "/static/js/types.js" */

const SCAN_WORDS = "A scan can identify its patient.";
const SCAN_QUESTION = { name: "scan", label: "The pictures show", options: [["without", "outlines of bone only"], ["with", "the scan as well"]] };
const FORMATS = [
  ["json", "Plan (JSON)", "Everything"],
  ["report", "Printable report", "Verdict and pictures"],
  ["csv", "Table (CSV)", "Points and targets, in mm"],
  ["mrk.json", "Slicer markups", "Points, targets, clearance"],
  ["slicer", "Slicer folder", "Plan, head and CT"],
];

export class ExportStep {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields" });
  }

  /** @param {ViewModel} state */
  update({ plan, case: head }) {
    this.changed([Boolean(plan), Boolean(head)], () => draw(this.element, html`
      <ul class="exports">${FORMATS.map(([format, name, words]) => html`<li class="export"><button type="button" data-format=${format} ?disabled=${!plan}
        @click=${() => this.save(format)}>${name}</button><span class="row-sub" aria-hidden="true">${words}</span></li>`)}</ul>
      <div class="buttons">${filesButton({ id: "import-plan", input: "plan-file", words: "Import plan …", disabled: !head, accept: ".json,.csv,.fcsv", title: "From vfix, Slicer or a table" },
        ([file]) => importPlan(this.connection, file))}</div>`));
  }

  /** @param {string} format */
  async save(format) {
    const { plan, plan_use: use, case: head } = this.connection.state;
    if (!plan || (format === "slicer" && head?.images && !await askForImages(head.name))) return;
    if (format === "report") {
      await this.report(plan);
      return;
    }
    const path = `/api/v1/plans/${encodeURIComponent(plan.id)}/export`;
    download(format === "slicer" ? `${path}/slicer?with_images=true` : `${path}?format=${encodeURIComponent(format)}`);
    note(format === "slicer" ? "Making the Slicer folder …" : `Downloading ${plan.name}.${format}`);
    if (use?.registration && format === "json") note("Without registration: save the head for that.", { stay: true });
  }

  /**
   * The report to print. With the scan in its pictures where that shows nobody, or where the user wants it.
   * @param {PlanSection} plan
   */
  async report({ id, name }) {
    const { case: head } = this.connection.state;
    const answer = head?.images ? await askChoices("Printable report", SCAN_WORDS, [SCAN_QUESTION], "Save") : { scan: "with" };
    if (!answer) return;
    download(`/api/v1/plans/${encodeURIComponent(id)}/report/page?with_images=${answer.scan === "with"}`);
    note(`Downloading ${name}.html`);
  }
}
