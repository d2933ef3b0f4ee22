// Words at places of the scene, as text of the page over the frame: sharp at every size, and in the page's type.
import { h } from "../dom.js";

import { ASIDE_PX, clearOf, isIn, laidOut } from "./label-layout.js";

/** @import { Box, LabelRequest } from "./label-layout.js" */
/** @import { SceneHooks, Three } from "./hooks.js" */
/** @import { LabelView } from "../types.js" */

/** @typedef {{ element: HTMLElement, kind: string, position: number[], width: number, height: number }} Entry with the size of its words, px */

const BEHIND = -0.3; // of the cosine between a letter and the eye, from the middle of the head: bone is before it
const IN_FRONT = 0.92; // it would lie upon the face, and says nothing there
const HIDDEN = -0.1; // the same cosine of a bead on the skin, or of an opening: the head is before it

export class SceneLabels {
  /**
   * @param {SceneHooks} hooks
   * @param {HTMLElement} box over the frame, of its size
   */
  constructor(hooks, box) {
    this.hooks = hooks;
    this.box = box;
    /** @type {Entry[]} */
    this.shown = [];
    /** @type {Box[]} */
    this.cards = []; // what lies upon the scene: words are not read below it
    this.resized = new ResizeObserver(() => this.measure());
    for (const one of [box, ...this.upon()]) this.resized.observe(one);
    hooks.watchers.add((camera) => this.place(camera));
  }

  /** @param {LabelView[]} labels */
  show(labels) {
    labels.forEach(({ kind, words, position }, index) => {
      const entry = this.shown[index] ?? this.add();
      Object.assign(entry, { kind, position });
      const name = `scene-label ${kind}`;
      const same = entry.element.textContent === words && entry.element.className === name;
      if (!same) {
        entry.element.textContent = words;
        entry.element.className = name;
      }
      if ((isBead(kind) || isOpening(kind) || kind === LETTER) && (!same || !entry.width)) [entry.width, entry.height] = [entry.element.offsetWidth, entry.element.offsetHeight];
    });
    for (const { element } of this.shown.splice(labels.length)) element.remove();
    this.place(this.hooks.camera);
  }

  add() {
    const entry = { element: h("span"), kind: "", position: /** @type {number[]} */ ([]), width: 0, height: 0 };
    this.box.append(entry.element);
    this.shown.push(entry);
    return entry;
  }

  upon() {
    return [...(this.box.parentElement?.querySelectorAll(".overlay-top > :not([popover]), .legend, .scale") ?? [])];
  }

  /** Where that lies; it has another size, or the view has. */
  measure() {
    const origin = this.box.getBoundingClientRect();
    this.cards = this.upon().filter((card) => card.checkVisibility()).map((card) => {
      const { left, top, right, bottom } = card.getBoundingClientRect();
      return { left: left - origin.left, top: top - origin.top, right: right - origin.left, bottom: bottom - origin.top };
    });
    this.place(this.hooks.camera);
  }

  /**
   * How much places look towards the eye, seen from the middle of the head, about which the letters stand: from −1 to 1.
   * @param {Three} camera
   * @returns {(position: number[]) => number}
   */
  facing(camera) {
    const letters = this.shown.filter(({ kind }) => kind === LETTER);
    if (!letters.length) return () => 0;
    const middle = [0, 1, 2].map((axis) => letters.reduce((sum, { position }) => sum + position[axis], 0) / letters.length);
    const centre = this.hooks.world(middle);
    const eye = camera.position.clone().sub(centre).normalize();
    return (position) => this.hooks.world(position).sub(centre).normalize().dot(eye);
  }

  /** @param {Three} camera */
  place(camera) {
    const facing = this.facing(camera);
    const beads = this.beadCorners(camera, facing);
    for (const entry of this.shown) {
      const { element, kind, position } = entry;
      const cosine = kind === LETTER ? facing(position) : 0;
      const hidden = (kind === LETTER && (cosine < BEHIND || cosine > IN_FRONT)) // only letters at the head's sides are read
        || (isOpening(kind) && facing(position) < HIDDEN);
      const place = isBead(kind) || hidden ? null : this.hooks.project(position, camera);
      const isCut = kind === RIGHT && place !== null && place.x < entry.width + ASIDE_PX; // it is on the left of its place
      const seen = isIn(place, this.hooks.size) && !isCut ? place : null;
      const at = isBead(kind) ? beads.get(entry) ?? null : seen && kind === LETTER ? clearOf(seen, entry, this.hooks.size, this.cards) : seen;
      element.style.visibility = at ? "visible" : "hidden";
      if (at) element.style.translate = `${at.x.toFixed(1)}px ${at.y.toFixed(1)}px`;
    }
  }

  /**
   * Where the words of beads stand; of those on the skin the ones behind the head are left out, but for the chosen one.
   * @param {Three} camera
   * @param {(position: number[]) => number} facing
   */
  beadCorners(camera, facing) {
    const entries = this.shown.filter(({ kind }) => isBead(kind));
    const requests = entries.map(({ kind, position, width, height }) => {
      const first = kind === CHOSEN;
      const at = kind !== BEAD || facing(position) > HIDDEN ? this.hooks.project(position, camera) : null;
      /** @type {LabelRequest | null} */
      const request = at && { ...at, width, height, first, away: this.hooks.world(position).distanceTo(camera.position) };
      return request;
    });
    const corners = laidOut(requests, this.hooks.size, this.cards);
    return new Map(entries.map((entry, index) => [entry, corners[index]]));
  }

  clear() {
    this.resized.disconnect();
    this.show([]);
  }
}

const LETTER = "letter"; // of a side of the patient
const BEAD = "bead"; // on the skin
const CHOSEN = "bead chosen";
const INSIDE = "bead inside"; // of a lumen, whose wall is seen through
const RIGHT = "opening right";

/** @param {string} kind */
function isBead(kind) {
  return kind === BEAD || kind === CHOSEN || kind === INSIDE;
}

/** @param {string} kind */
function isOpening(kind) {
  return kind.startsWith("opening");
}
