// What the status bar says of the snake robot: how far its task is, depth, the landmark that it passed, the link nearest to its bound, how deep the deepest one is behind the wall, force, and what holds it.
import { holdingWords, reading } from "/static/js/status.js";
import { LIMIT_WORDS, cautions } from "./limits.js";

/** @import { ViewModel } from "/static/js/types.js" */

export class SnakeStatus {
  constructor() {
    this.done = reading("Task");
    this.depth = reading("Depth");
    this.passed = reading("Past", "minor");
    this.deviation = reading("Deviation");
    this.bound = reading("Bound");
    this.behind = reading("Behind wall", "minor");
    this.force = reading("Force");
    this.holding = reading("Held by", "fill");
    for (const { element } of [this.deviation, this.behind]) element.title = LIMIT_WORDS;
    this.elements = [this.done, this.depth, this.passed, this.deviation, this.bound, this.behind, this.force, this.holding].map(({ element }) => element);
  }

  /** @param {ViewModel} state */
  update({ rehearsal, snake, drive_task: task }) {
    const nearest = snake?.nearest, done = doneWords(task);
    this.done.element.hidden = !done;
    this.done.say(done);
    this.depth.element.hidden = Boolean(snake?.fixed);
    this.depth.set(snake?.depth_mm, 0, "mm");
    this.passed.element.hidden = !snake?.passed;
    this.passed.say(snake?.passed ?? "");
    this.deviation.set(nearest?.deviation_mm, 1, "mm");
    this.bound.set(nearest?.bound_mm, 1, "mm");
    this.behind.element.hidden = !snake?.deepest;
    this.behind.set(snake?.deepest?.depth_mm, 1, "mm");
    const { deviation, behind } = cautions(snake);
    this.deviation.element.classList.toggle("caution", deviation);
    this.behind.element.classList.toggle("caution", behind);
    this.force.set(rehearsal?.force_n, 2, "N");
    this.holding.say(holdingWords(rehearsal ?? {}, "At the entry, not started"));
  }
}

/** How many polyps or labels of a task are done; '' without one. @param {ViewModel["drive_task"]} task */
export function doneWords(task) {
  if (task?.now) return `${task.now.cleared} of ${task.now.of} polyps`;
  return task?.labels ? `${task.labels.traced} of ${task.labels.labels.length} labels` : "";
}
