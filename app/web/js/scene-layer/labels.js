// Words at places of the scene, as text of the page over the frame: sharp at every size, and in the page's type.
import { h } from "../dom.js";

/** @import { SceneHooks, Three } from "./hooks.js" */
/** @import { LabelView } from "../types.js" */

const EDGE_PX = 6;
const BEHIND = -0.3; // of the cosine between a letter and the eye, from the middle of the head: bone is before it
const IN_FRONT = 0.92; // it would lie upon the face, and says nothing there

export class SceneLabels {
  /**
   * @param {SceneHooks} hooks
   * @param {HTMLElement} box over the frame, of its size
   */
  constructor(hooks, box) {
    this.hooks = hooks;
    this.box = box;
    /** @type {{ element: HTMLElement, kind: string, position: number[] }[]} */
    this.shown = [];
    hooks.watchers.add((camera) => this.place(camera));
  }

  /** @param {LabelView[]} labels */
  show(labels) {
    labels.forEach(({ kind, words, position }, index) => {
      const entry = this.shown[index] ?? this.add();
      Object.assign(entry, { kind, position });
      if (entry.element.textContent !== words) entry.element.textContent = words;
      const name = `scene-label ${kind}`;
      if (entry.element.className !== name) entry.element.className = name;
    });
    for (const { element } of this.shown.splice(labels.length)) element.remove();
    this.place(this.hooks.camera);
  }

  add() {
    const entry = { element: h("span"), kind: "", position: /** @type {number[]} */ ([]) };
    this.box.append(entry.element);
    this.shown.push(entry);
    return entry;
  }

  /**
   * Letters stand around the head: only those at its sides are read.
   * @param {Three} camera
   */
  hiddenLetters(camera) {
    const letters = this.shown.filter(({ kind }) => kind === "letter");
    const middle = [0, 1, 2].map((axis) => letters.reduce((sum, { position }) => sum + position[axis], 0) / letters.length);
    const centre = this.hooks.world(middle);
    const eye = camera.position.clone().sub(centre).normalize();
    return new Set(letters.filter(({ position }) => {
      const cosine = this.hooks.world(position).sub(centre).normalize().dot(eye);
      return cosine < BEHIND || cosine > IN_FRONT;
    }));
  }

  /** @param {Three} camera */
  place(camera) {
    const hidden = this.hiddenLetters(camera);
    const { width, height } = this.hooks.size;
    for (const entry of this.shown) {
      const { element, position } = entry;
      const at = hidden.has(entry) ? null : this.hooks.project(position, camera);
      const seen = at && at.x > EDGE_PX && at.y > EDGE_PX && at.x < width - EDGE_PX && at.y < height - EDGE_PX;
      element.style.visibility = seen ? "visible" : "hidden";
      if (seen) element.style.translate = `${at.x.toFixed(1)}px ${at.y.toFixed(1)}px`;
    }
  }

  clear() {
    this.show([]);
  }
}
