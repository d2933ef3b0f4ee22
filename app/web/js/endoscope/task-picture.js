// What the picture shows of a task: the polyps and their aiming frame, or the labels with the marker, and what is done.
import { whenChanged } from "../dom.js";
import { plus } from "../slices/vectors.js";
import { AimFrame, AimMarker } from "./aim-frame.js";
import { markerColour } from "./bumps.js";
import { DoneMarks } from "./done-marks.js";
import { LabelPointer, wayTo } from "./label-way.js";
import { HALF_MM } from "./task-labels.js";

/** @import { Lens } from "./lens.js" */
/** @import { Renderer } from "./renderer.js" */
/** @import { LabelsNowView, TaskNowView } from "../types.js" */

export class TaskPicture {
  /**
   * @param {() => Renderer | null} renderer
   * @param {() => void} changed the picture is to be drawn
   */
  constructor(renderer, changed) {
    this.renderer = renderer;
    this.changed = changed;
    this.aim = new AimFrame();
    this.marker = new AimMarker();
    this.way = new LabelPointer();
    this.done = new DoneMarks(() => {
      this.mark();
      changed();
    });
    /** @type {TaskNowView | null} */
    this.polyps = null;
    /** @type {LabelsNowView | null} */
    this.labels = null;
    this.elements = [this.aim.element, this.marker.element, this.way.element];
    this.changedPolyps = whenChanged();
    this.changedLabels = whenChanged();
  }

  /** The renderer is another one, which has nothing yet. */
  forget() {
    this.changedPolyps = whenChanged();
    this.changedLabels = whenChanged();
  }

  /**
   * @param {TaskNowView | null} polyps
   * @param {LabelsNowView | null} labels
   */
  show(polyps, labels) {
    Object.assign(this, { polyps, labels });
    this.aim.show(polyps);
    this.marker.show(labels);
    this.done.follow(polyps?.polyps.map(({ cleared }) => cleared) ?? labels?.labels.map(({ end_mm: end }) => end >= HALF_MM) ?? []);
    this.changedPolyps([polyps?.polyps], () => {
      const renderer = this.renderer(), left = (polyps?.polyps ?? []).filter(({ cleared }) => !cleared);
      if (renderer) renderer.bumps.all = left.map(({ at, colour }) => ({ at, radius: polyps?.radius_mm ?? 0, colour: markerColour(colour) }));
      this.mark();
      this.changed();
    });
    this.changedLabels([labels?.labels], () => {
      this.renderer()?.labels.set(labels?.labels ?? []);
      this.mark();
      this.changed();
    });
  }

  /** Where the camera looks. @param {Lens | null} lens */
  look(lens) {
    this.way.show(lens && this.labels ? wayTo(lens, this.labels.labels) : null);
  }

  /** A ring where a polyp was, and for a moment a tick, as at the tip of a label's arrow: what is left of that has its own colour. */
  mark() {
    const polyps = (this.polyps?.polyps ?? []).map(({ at, cleared }) => ({ at, done: cleared }));
    const labels = (this.labels?.labels ?? []).map(({ centre, along, end_mm: end }) => ({ at: plus(centre, along, HALF_MM), done: end >= HALF_MM })); // where the eyes are then
    const marks = [...polyps, ...labels];
    const fresh = marks.filter(({ done }, index) => done && this.done.fresh.has(index));
    this.renderer()?.overlay.setDone(polyps.filter((one) => one.done && !fresh.includes(one)).map(({ at }) => at), fresh.map(({ at }) => at));
  }
}
