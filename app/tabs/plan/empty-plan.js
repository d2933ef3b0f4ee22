// What an empty plan says: three steps to a path, the one that is next in front.
import { h } from "/static/js/dom.js";

/** @import { PlanSection } from "/static/js/types.js" */

const STEPS = [
  "Click where the tool goes in: at the nostril, in a slice or on the head.",
  "Click on, further in, along the dark air. Two points make a path, and the verdict follows by itself.",
  "Choose ‘Target’ above and click what is to be inspected.",
];

export class EmptyPlan {
  constructor() {
    this.steps = STEPS.map((words) => h("li", {}, words));
    this.element = h("ol", { class: "three-steps", id: "empty-plan", hidden: true }, this.steps);
  }

  /** @param {PlanSection | null | undefined} plan */
  update(plan) {
    const points = plan?.points.length ?? 0;
    this.element.hidden = !plan || points > 1;
    this.steps.forEach((step, index) => {
      step.classList.toggle("done", index < points);
      if (index === points) step.setAttribute("aria-current", "step");
      else step.removeAttribute("aria-current");
    });
  }
}
