// Which target a path is to lead to.

/** @import { PlanSection } from "/static/js/types.js" */

/** The target that this window has added to a plan since a path of it was chosen. */
export class NewTarget {
  constructor() {
    this.id = "";
    /** @type {string | undefined} the path */
    this.path = undefined;
    /** @type {Set<string>} */
    this.known = new Set();
  }

  /**
   * @param {PlanSection | null | undefined} plan
   * @param {string | undefined} path
   */
  follow(plan, path) {
    const targets = plan?.targets ?? [], last = targets.at(-1);
    const other = path !== this.path;
    if (other) this.id = "";
    else if (last && plan?.selected === last.id && !this.known.has(last.id)) this.id = last.id; // an edit of this window selects what it adds
    this.path = path;
    this.known = new Set(targets.map(({ id }) => id));
  }
}

/**
 * The target that is wanted, else the one nearest to the path's end, or where no path is drawn the newest.
 * @param {PlanSection | null | undefined} plan
 * @param {string} id
 */
export function targetOf(plan, id) {
  const named = (/** @type {string | null | undefined} */ wanted) => plan?.targets.find((one) => one.id === wanted);
  return named(id) ?? named(plan?.nearest_target) ?? plan?.targets.at(-1);
}
