// The tools of a scope's picture: the tilt of its lens, its turn, the horizon, and saving. Kept by the browser.
import { h, iconButton } from "../dom.js";
import { keep, recall } from "../remember.js";
import { ANGLES } from "./lens.js";

/** @import { LensSettings } from "./lens.js" */

const TURN_PER_PX = 0.5; // degrees
const TURN_KEY = 5; // degrees

export class ScopeTools {
  /**
   * @param {HTMLElement} picture by which the lens is turned
   * @param {(moves: boolean) => void} changed
   * @param {() => void} save
   */
  constructor(picture, changed, save) {
    this.changed = changed;
    /** @type {LensSettings} */
    this.settings = { angle: Number(recall("scope-angle", ANGLES.map(String), "0")), turn: 0, level: recall("scope-level", ["on", "off"], "on") === "on" };
    this.angleButtons = ANGLES.map((angle) => h("button", { type: "button", "data-angle": String(angle), title: `Lens tilted by ${angle}°`, onclick: () => this.choose({ angle }) }, `${angle}°`));
    this.levelButton = h("button", { type: "button", id: "scope-level", title: "Keep the head upright in the picture", onclick: () => this.choose({ level: !this.settings.level }) }, "Level");
    this.saveButton = iconButton("download", "Save this picture", save, { id: "scope-save", disabled: true });
    this.element = h("div", { class: "scope-tools" }, h("div", { class: "segmented", role: "group", "aria-label": "Tilt of the lens" }, this.angleButtons), this.levelButton, this.saveButton);
    picture.addEventListener("pointerdown", (event) => picture.setPointerCapture(event.pointerId));
    picture.addEventListener("pointermove", (event) => { if (!this.element.hidden && picture.hasPointerCapture(event.pointerId)) this.turn(this.settings.turn + TURN_PER_PX * event.movementX); });
    picture.addEventListener("dblclick", () => this.turn(0));
    picture.addEventListener("keydown", (event) => this.key(event));
    this.show();
  }

  /** @param {Partial<LensSettings>} settings */
  choose(settings) {
    const { turn } = this.settings;
    Object.assign(this.settings, settings);
    keep("scope-angle", String(this.settings.angle));
    keep("scope-level", this.settings.level ? "on" : "off");
    this.show();
    this.changed(turn !== this.settings.turn);
  }

  /** @param {number} turn degrees */
  turn(turn) {
    this.choose({ turn: ((turn + 540) % 360) - 180 });
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const way = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!way || this.element.hidden || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    this.turn(this.settings.turn + way * TURN_KEY);
  }

  show() {
    for (const button of this.angleButtons) button.setAttribute("aria-pressed", String(Number(button.dataset.angle) === this.settings.angle));
    this.levelButton.setAttribute("aria-pressed", String(this.settings.level));
  }
}
