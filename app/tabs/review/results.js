// The results of the open plan's assignment: a row a run, a column a criterion.
import { assignment, limitWords, resultsAddress, valueWords } from "/static/js/assignments.js";
import { h } from "/static/js/dom.js";
import { whenShort } from "/static/js/format.js";
import { download } from "/static/js/rest.js";
import { draw, html, nothing } from "/static/js/template.js";

/** @import { RunResultPublic } from "/static/js/types.js" */

export class ResultsTable {
  /** @param {(run: string) => void} open */
  constructor(open) {
    this.open = open;
    this.element = h("div", { class: "review-compare", id: "results" });
    assignment.addEventListener("change", () => this.render());
  }

  render() {
    const { open, results } = assignment;
    draw(this.element, !open || !results ? html`` : html`
      <p class="words"><strong>${results.name}</strong>: ${results.passed} of ${results.wanted} passed${results.complete ? ", complete" : ""}</p>
      ${results.runs.length ? html`<table class="compare results"><thead><tr><th scope="col">Run</th>${results.criteria.map((one) => html`<th scope="col">${one.label}<span class="compare-sub">${limitWords(one)}</span></th>`)}<th scope="col">Passed</th></tr></thead>
      <tbody>${results.runs.map((run) => this.row(run))}</tbody></table>` : html`<p class="empty">No run of it yet.</p>`}
      <div class="buttons"><button type="button" id="save-results" ?disabled=${!results.runs.length} @click=${() => download(resultsAddress(open.id))}>Save CSV</button></div>`);
  }

  /** @param {RunResultPublic} run */
  row(run) {
    return html`<tr><th scope="row"><button type="button" class="plain" title="Open this run" @click=${() => this.open(run.run)}>${whenShort(run.recorded)}</button></th>
      ${run.criteria.map((one) => html`<td class="number" data-passed=${String(one.passed)}>${valueWords(one)}</td>`)}
      <td data-passed=${String(run.passed)} title=${run.trouble || nothing}>${run.passed ? "✓" : "✗"}${run.trouble ? html`<span class="compare-sub">${run.trouble.split(":")[0]}</span>` : nothing}</td></tr>`;
  }
}
