// Parts of a panel one below the other, each folded to one line with its name and result: numbered steps, or what is rare.
// Their names are one tab stop: ↑ ↓ Home End go from one to the other, Enter opens.
import { h } from "./dom.js";
import { keep, recall } from "./remember.js";
import { Roving } from "./roving.js";
import { draw, html, iconTemplate, nothing } from "./template.js";

/** @typedef {{ words: string, mark: "done" | "caution" | "", pill?: string }} Line the result of a step, mark: 'done', 'caution' where somebody should look, '' where there is nothing yet; pill: a word of caution beside it */
/** @typedef {{ name: string, title: string, content: HTMLElement | HTMLElement[] }} Step */
/** @typedef {{ open: readonly string[], marked?: string, lines?: Record<string, Line>, hidden?: readonly string[] }} Shown marked: the step that comes next */

const MARKS = /** @type {const} */ ({ done: "fits", caution: "tight" }); // icons

export class StepList {
  /**
   * Contents stay in the document while they are folded: what is folded is found and pressed by its name all the same.
   * @param {{ label: string, steps: Step[], numbered?: boolean, chosen: (name: string, open: boolean) => void }} options
   *   chosen: somebody opened or closed a step, which `update` shows
   */
  constructor({ label, steps, numbered = true, chosen }) {
    this.label = label;
    this.steps = steps;
    this.numbered = numbered;
    this.chosen = chosen;
    /** @type {Shown} */
    this.shown = { open: [] };
    this.element = h("div", { class: "step-list" });
    this.roving = new Roving(this.element, ".step > summary", { first: ".step[open] > summary" });
  }

  /** @param {Shown} shown */
  update(shown) {
    this.shown = shown;
    draw(this.element, html`<div class=${this.numbered ? "steps-numbered" : "steps-plain"} role="group" aria-label=${this.label}>${this.steps.map((step, index) => this.step(step, index))}</div>`);
    this.roving.update();
  }

  /**
   * @param {Step} step
   * @param {number} index
   */
  step({ name, title, content }, index) {
    const open = this.shown.open.includes(name);
    const line = this.shown.lines?.[name];
    const next = this.shown.marked === name;
    return html`<details class="step" data-step-name=${name} data-mark=${line?.mark || nothing} ?hidden=${this.shown.hidden?.includes(name)} ?open=${open} @toggle=${this.toggled}>
      <summary @click=${this.pressed}>
        ${this.numbered ? html`<span class="step-number" aria-hidden="true">${line?.mark ? iconTemplate(MARKS[line.mark]) : index + 1}</span>` : nothing}
        <h2>${title}${this.numbered && line?.mark === "done" ? html`<span class="visually-hidden">, done</span>` : nothing}</h2>${next ? html`<span class="step-next" title="Comes next"><span class="visually-hidden">comes next</span></span>` : nothing}
        <span class="step-line" title=${line?.words || nothing}>${line?.words ?? ""}</span>${line?.pill ? html`<span class="pill">${line.pill}</span>` : nothing}
      </summary>
      <div class="step-body">${content}</div>
    </details>`;
  }

  pressed = (/** @type {MouseEvent} */ event) => {
    event.preventDefault(); // it is open once `update` says so
    const name = nameOf(/** @type {HTMLElement} */ (event.currentTarget));
    const open = !this.shown.open.includes(name);
    this.chosen(name, open);
    if (open) this.bringIntoSight(name);
  };

  /** Opened from elsewhere, such as by the palette or by a search of the browser for what is within. */
  toggled = (/** @type {Event} */ { currentTarget }) => {
    const details = /** @type {HTMLDetailsElement} */ (currentTarget);
    const name = details.dataset.stepName ?? "";
    if (details.open !== this.shown.open.includes(name)) this.chosen(name, details.open);
  };

  /**
   * Scroll until a step is in sight from its name on, as much of it as there is room for.
   * @param {string} name
   */
  bringIntoSight(name) {
    const step = this.find(name);
    step?.scrollIntoView({ block: "nearest" });
    step?.querySelector("summary")?.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {string} name
   * @returns {HTMLElement | null}
   */
  find(name) {
    return this.element.querySelector(`[data-step-name="${name}"]`);
  }
}

/** Parts any of which may be open; the browser remembers which. */
export class FoldedParts extends StepList {
  /**
   * @param {{ label: string, steps: Step[], kept?: string, open?: readonly string[] }} options
   *   kept: what the browser remembers them under, open: those that are so at first
   */
  constructor({ label, steps, kept = "fold", open = [] }) {
    super({ label, steps, numbered: false, chosen: (name, unfolded) => this.unfold(name, unfolded) });
    this.kept = kept;
    this.unfolded = new Set(steps.map(({ name }) => name).filter((name) => recall(`${kept}-${name}`, ["open", "shut"], open.includes(name) ? "open" : "shut") === "open"));
  }

  /**
   * @param {Record<string, Line>} lines
   * @param {readonly string[]} [hidden] parts that there is nothing in
   */
  show(lines, hidden = []) {
    this.update({ open: [...this.unfolded], lines, hidden });
  }

  /**
   * @param {string} name
   * @param {boolean} open
   */
  unfold(name, open) {
    if (open) this.unfolded.add(name);
    else this.unfolded.delete(name);
    keep(`${this.kept}-${name}`, open ? "open" : "shut");
    this.update({ ...this.shown, open: [...this.unfolded] });
    if (open) this.bringIntoSight(name);
  }
}

/** @param {HTMLElement} summary */
function nameOf(summary) {
  return summary.parentElement?.dataset.stepName ?? "";
}
