// Popovers: what a button opens upon the page. Escape closes the one that was opened last, and gives the focus back.

/** @typedef {{ left: number, top: number, right: number, bottom: number }} Box px of the window */
/** @typedef {"left" | "right" | "above" | "below"} Side */

const APART_PX = 6; // from what it belongs to
const EDGE_PX = 8; // from the window's edges
const FIRST = "[autofocus], button:not([tabindex='-1']), input, select, [tabindex='0']";

/** @type {Popover[]} those that are open, oldest first */
const open = [];

/**
 * Where a popover stands: at the first side of the box with room for it, else at the last one, within the window.
 * @param {Box} box
 * @param {{ width: number, height: number }} size
 * @param {{ width: number, height: number }} view
 * @param {readonly Side[]} sides the best one first
 */
export function placeBeside(box, { width, height }, view, sides) {
  const [right, bottom] = [view.width - EDGE_PX - width, view.height - EDGE_PX - height];
  /** @type {Record<Side, [number, number, boolean]>} x, y, and whether there is room */
  const ways = {
    left: [box.left - APART_PX - width, box.top, box.left - APART_PX - width >= EDGE_PX],
    right: [box.right + APART_PX, box.top, box.right + APART_PX <= right],
    above: [box.left, box.top - APART_PX - height, box.top - APART_PX - height >= EDGE_PX],
    below: [box.left, box.bottom + APART_PX, box.bottom + APART_PX <= bottom],
  };
  const side = sides.find((one) => ways[one][2]) ?? sides[sides.length - 1];
  const [x, y] = ways[side];
  return { x: Math.max(EDGE_PX, Math.min(x, right)), y: Math.max(EDGE_PX, Math.min(y, bottom)) };
}

export class Popover {
  /**
   * @param {HTMLElement} element what is shown; it gets the `popover` attribute
   * @param {{ sides?: readonly Side[], button?: HTMLElement, home?: HTMLElement, beside?: HTMLElement }} [options]
   *   button: opens and closes it; without one it is opened by `show`, and a press elsewhere leaves it open.
   *   home: gets the focus where what had it is out of sight. beside: what it stands beside, where that is not the button
   */
  constructor(element, { sides = [], button, home = button, beside = button } = {}) {
    this.element = element;
    this.sides = sides;
    this.home = home;
    this.beside = beside;
    /** @type {HTMLElement[]} that open and close it */
    this.buttons = [];
    /** @type {HTMLElement | null} what had the focus when it was opened */
    this.before = null;
    element.popover = button ? "auto" : "manual";
    element.classList.add("popover");
    element.addEventListener("beforetoggle", (event) => this.turned(/** @type {ToggleEvent} */ (event).newState === "open"));
    element.addEventListener("keydown", (event) => this.pressed(event));
    window.addEventListener("keydown", closeLast, { capture: true }); // once, however many popovers there are
    window.addEventListener("resize", () => this.place());
    if (!button) return;
    this.openedBy(button, home, beside);
    window.addEventListener("blur", () => this.element.hidePopover()); // the scene took the press
  }

  /**
   * Let a button open and close it, at that one where there are several.
   * @param {HTMLElement} button
   * @param {HTMLElement} [home]
   * @param {HTMLElement} [beside]
   */
  openedBy(button, home = button, beside = button) {
    /** @type {HTMLButtonElement} */ (button).popoverTargetElement = this.element;
    button.setAttribute("aria-expanded", "false");
    button.addEventListener("click", () => Object.assign(this, { home, beside })); // before it opens
    this.buttons.push(button);
  }

  get isOpen() {
    return this.element.matches(":popover-open");
  }

  show() {
    if (!this.isOpen) this.element.showPopover();
  }

  hide() {
    const held = this.element.contains(document.activeElement);
    this.element.hidePopover();
    if (!held) return;
    const back = this.before?.checkVisibility() ? this.before : this.home;
    back?.focus({ preventScroll: true });
  }

  /**
   * Before it is opened or closed, however that is done.
   * @param {boolean} on
   */
  turned(on) {
    for (const button of this.buttons) button.setAttribute("aria-expanded", String(on));
    const at = open.indexOf(this);
    if (at >= 0) open.splice(at, 1);
    if (!on) return;
    open.push(this);
    this.before = /** @type {HTMLElement | null} */ (document.activeElement);
    requestAnimationFrame(() => { // it has a size by then, and is not drawn yet
      this.place();
      if (this.isOpen && !this.element.contains(document.activeElement)) /** @type {HTMLElement | null} */ (this.element.querySelector(FIRST))?.focus();
    });
  }

  place() {
    if (!this.isOpen || !this.beside) return;
    const { offsetWidth: width, offsetHeight: height } = this.element;
    const { x, y } = placeBeside(this.beside.getBoundingClientRect(), { width, height }, { width: innerWidth, height: innerHeight }, this.sides);
    Object.assign(this.element.style, { left: `${x}px`, top: `${y}px` });
  }

  /** @param {KeyboardEvent} event a field within may have used it */
  pressed(event) {
    if (event.key !== "Escape" || event.defaultPrevented) return;
    this.hide();
    event.preventDefault();
    event.stopPropagation();
  }
}

/** @param {KeyboardEvent} event */
function closeLast(event) {
  const last = open[open.length - 1];
  if (event.key !== "Escape" || !last || last.element.contains(/** @type {Node} */ (event.target)) || document.querySelector("dialog[open]")) return;
  const listed = document.querySelector('[popover="auto"]:popover-open');
  if (listed && listed !== last.element) return; // it is closed by the browser, and was opened later: a press elsewhere closes it
  event.preventDefault();
  event.stopImmediatePropagation();
  last.hide();
}
