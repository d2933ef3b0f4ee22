// The first task of a newcomer: three steps that tick themselves off, shown until they are done or put away.
import { byId, h } from "./dom.js";
import { keep, recall } from "./remember.js";
import { TOUCHED } from "./scene.js";

/** @import { ViewModel } from "./types.js" */

const STEPS = [
  "Drag to turn the head; the wheel zooms.",
  "Choose a point, or click in a slice.",
  "In Rehearse: Start, then hold ↑ to the end.",
];

export class FirstTask {
  constructor() {
    this.steps = STEPS.map((words) => h("li", {}, words));
    this.button = h("button", { type: "button", class: "plain", id: "first-task-hide", onclick: () => this.hide() }, "Hide");
    this.box = byId("first-task");
    this.box.append(h("div", { class: "group-head" }, h("h2", {}, "First steps"), this.button), h("ol", { class: "three-steps" }, this.steps));
    this.done = [false, false, false];
    window.addEventListener(TOUCHED, () => this.tick(0));
    byId("slices").addEventListener("pointerdown", () => this.tick(1));
    byId("panel-content").addEventListener("click", ({ target }) => { if (target instanceof Element && target.closest("table.points tbody tr")) this.tick(1); });
    this.wanted = recall("first-task", ["done"], "") !== "done";
    this.asked = false; // called back by its button: shown on Plan and Register too
    this.box.hidden = true; // until the tab is known
    this.render();
  }

  /** Once more, from its beginning. */
  again() {
    this.done = [false, false, false];
    this.wanted = this.asked = true;
    this.box.hidden = false;
    byId("panel").scrollTop = 0;
    this.render();
    this.button.focus();
  }

  hide() {
    const held = this.box.contains(document.activeElement);
    this.wanted = this.asked = false;
    this.box.hidden = true;
    keep("first-task", "done");
    if (held) byId("panel").focus();
  }

  /**
   * Of two lists of steps one is enough: Plan and Register have their own, and a study tells what is next. In Review, and in a lumen,
   * nothing of it can be done.
   * @param {ViewModel} state
   */
  update(state) {
    this.box.hidden = !this.wanted || Boolean(state.study) || state.case?.parts.includes("structures") === false || (["plan", "register", "review"].includes(state.step?.name ?? "") && !this.asked);
    if (state.rehearsal?.phase === "done") this.tick(2);
  }

  /** @param {number} index */
  tick(index) {
    if (!this.wanted || this.done[index]) return;
    this.done[index] = true;
    this.render();
    if (this.done.every(Boolean)) this.hide();
  }

  render() {
    const next = this.done.indexOf(false);
    this.steps.forEach((step, index) => {
      step.classList.toggle("done", this.done[index]);
      if (index === next) step.setAttribute("aria-current", "step");
      else step.removeAttribute("aria-current");
    });
  }
}
