// What is laid into the scene of the open run and the one beside it: their swept volumes, and how near bone was passed.
import { h } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { JobLine } from "/static/js/job-line.js";
import { CONTACT, scaleGradient } from "/static/js/near-scale.js";
import { replay } from "/static/js/replay.js";
import { readBytes } from "/static/js/rest.js";
import { draw, html, live, nothing } from "/static/js/template.js";
import { readSwept } from "./swept-file.js";

/** @import { SweptFile } from "./swept-file.js" */

const MM3_PER_CM3 = 1000;

/** @typedef {{ id: string, ghost: boolean, name: string }} Shown a run */

export class InScene {
  constructor() {
    this.swept = false;
    this.near = false;
    this.trouble = "";
    this.asked = 0; // counts requests: what an earlier one has made is not shown
    /** @type {Shown[]} the open run first */
    this.runs = [];
    /** @type {Map<string, SweptFile>} by run */
    this.files = new Map();
    this.job = new JobLine();
    this.box = h("div", { class: "fields" });
    this.element = h("div", { class: "group", id: "in-scene", hidden: true }, h("h2", {}, "In 3D"), this.box, this.job.element);
    this.render();
  }

  /** @param {Shown[]} runs the open one first, at most one beside */
  of(runs) {
    const same = runs.length === this.runs.length && runs.every(({ id }, index) => id === this.runs[index].id);
    this.runs = runs;
    this.element.hidden = !runs.length;
    if (same) return;
    for (const id of this.files.keys()) if (!runs.some((run) => run.id === id)) this.files.delete(id);
    this.load();
  }

  /** @param {"swept" | "near"} what */
  turn(what) {
    this[what] = !this[what];
    this.load();
  }

  /** Runs whose file is needed for what is switched on. */
  wanted() {
    return this.runs.filter(({ ghost }) => this.swept || (this.near && !ghost));
  }

  /** Make or fetch what is not known yet, one after another, and show it. */
  async load() {
    const request = ++this.asked;
    this.trouble = "";
    this.show();
    try {
      for (const { id } of this.wanted()) {
        if (this.files.has(id)) continue;
        const path = `/api/v1/runs/${encodeURIComponent(id)}/swept`;
        if (await this.job.run(path, {}) === null) { // cancelled
          if (request === this.asked) Object.assign(this, { swept: false, near: false });
          break;
        }
        const { data } = await readBytes(path, "");
        if (data) this.files.set(id, readSwept(data));
        if (request !== this.asked) return;
        this.show();
      }
    } catch (error) {
      if (request === this.asked) this.trouble = error instanceof Error ? error.message : String(error);
    }
    if (request === this.asked) this.show();
  }

  /** What is known of what is switched on. */
  show() {
    const main = this.files.get(this.runs[0]?.id ?? "");
    const bodies = this.swept ? this.runs.flatMap(({ id, ghost }) => { const file = this.files.get(id); return file ? [{ key: id, ghost, mesh: file.body }] : []; }) : [];
    replay.lay(bodies, this.near && main ? main.near : null);
    this.render();
  }

  /** Nothing is shown any more, as after the tab was left; what is switched on stays so. */
  hide() {
    this.asked += 1;
    this.job.leave();
    replay.lay([], null);
    this.runs = [];
  }

  render() {
    const main = this.files.get(this.runs[0]?.id ?? "");
    draw(this.box, html`
      <label class="check"><input type="checkbox" id="show-swept" .checked=${live(this.swept)} @change=${() => this.turn("swept")}>Swept volume</label>
      ${this.swept ? html`<p class="plot-keys swept-keys">${this.runs.map(({ id, ghost, name }) => { const file = this.files.get(id); return file ? html`<span data-ghost=${String(ghost)}><i></i>${name} <span class="number">${fixed(file.volume / MM3_PER_CM3, 1)} cm³</span></span>` : nothing; })}</p>` : nothing}
      <label class="check"><input type="checkbox" id="show-near" .checked=${live(this.near)} @change=${() => this.turn("near")}>Near passes on bone</label>
      ${this.near && main ? scale(main) : nothing}
      ${this.trouble ? html`<p class="words caution" role="status">${this.trouble}</p>` : nothing}`);
  }
}

/** The colours of near passes. @param {SweptFile} file */
function scale({ near: { reach }, least }) {
  const middle = reach / 2;
  return html`<div class="near-scale" role="img" aria-label="Colours from 0 mm, red, to ${fixed(reach, 0)} mm, bone">
    <div class="near-bar" style="background: ${scaleGradient(reach)}"></div>
    <div class="near-ticks number"><span>0</span><span>${fixed(middle, 1)}</span><span>${fixed(reach, 0)} mm</span></div>
    ${least < 0 ? html`<span class="near-contact"><i style="background: ${CONTACT}"></i>tool in bone</span>` : nothing}</div>`;
}
