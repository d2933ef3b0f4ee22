// The page's end of the worker that owns the voxels: asks for pictures and values, and says how far the voxels are.
/** @import { Raster } from "./cut.js" */
/** @import { Triple } from "./grid.js" */
/** @import { Brush } from "./label-paint.js" */
/** @import { OverlayLook, Transform } from "./overlay.js" */
/** @import { Greys } from "./shade.js" */
/** @import { OutlineRequest } from "./slice-worker.js" */

/** @typedef {"none" | "loading" | "ready" | "failed"} LinkState */
/**
 * @typedef {{ kind: "progress", head: number, share: number } | { kind: "ready" | "outlined" | "laid" | "labelled", head: number }
 *   | { kind: "unlaid" | "unlabelled", head: number, words: string }
 *   | { kind: "failed", head: number, words: string } | { kind: "unoutlined", head: number, words: string }
 *   | { kind: "drawn", head: number, id: number, bitmap: ImageBitmap, ms: number }
 *   | { kind: "values", head: number, id: number, values: (number | null)[] }} Told
 */

const TRY_AGAIN_MS = 5000;

/**
 * Says `change` when its state or share is another one, `outlines` when the outlines are there, `unoutlined` when they did not come, `laid` when the second
 * volume is there or gone, and `unlaid` with `laidWords` when it cannot be had; `labelled` and `unlabelled` of a label.
 */
export class VolumeLink extends EventTarget {
  constructor() {
    super();
    this.worker = new Worker("/static/js/slices/slice-worker.js", { type: "module" });
    this.worker.onmessage = (/** @type {MessageEvent<Told>} */ { data }) => this.heard(data);
    this.worker.onerror = () => this.fail("the slices' worker could not be started");
    /** @type {LinkState} */
    this.state = "none";
    this.share = 0; // of the voxels that is there
    this.words = ""; // why they could not be loaded
    this.head = 0;
    this.caseId = "";
    /** @type {string[]} */
    this.volumes = [];
    this.next = 1;
    /** @type {Map<number, (answer: any) => void>} */
    this.waiting = new Map();
    this.laidWords = "";
    this.drawnMs = 0; // what the newest picture took in the worker
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  get ready() {
    return this.state === "ready";
  }

  /**
   * Whether what is drawn and read here is of this head: another one's voxels are ready until the new one is asked for.
   * @param {string | undefined} caseId
   */
  holds(caseId) {
    return this.ready && caseId === this.caseId;
  }

  /**
   * Bring the volumes of a head here; those of the one before are let go.
   * @param {string} caseId
   * @param {string[]} volumes the widest first
   */
  open(caseId, volumes) {
    clearTimeout(this.timer);
    this.caseId = caseId;
    this.volumes = volumes;
    this.head += 1;
    this.giveUp();
    this.tell("loading", 0);
    this.worker.postMessage({ kind: "open", head: this.head, caseId, volumes });
  }

  /** Load again what could not be loaded. */
  again() {
    if (this.state === "failed") this.open(this.caseId, this.volumes);
  }

  /** @param {OutlineRequest[]} outlines */
  outline(outlines) {
    this.worker.postMessage({ kind: "outlines", head: this.head, caseId: this.caseId, outlines });
  }

  /**
   * The picture of a view; null when another head was opened meanwhile, or the voxels are gone.
   * @param {string} view
   * @param {Raster} raster
   * @param {Greys} greys
   * @param {boolean} outlines
   * @param {OverlayLook | null} [overlay] of the second volume, where there is one
   * @returns {Promise<ImageBitmap | null>}
   */
  draw(view, raster, greys, outlines, overlay = null) {
    return this.ask({ kind: "draw", view, raster, greys, outlines, overlay });
  }

  /**
   * Lay a second volume over the first.
   * @param {string | null} caseId whose volume; null: none
   * @param {string | null} volume its name there; null: the widest
   * @param {Transform} transform
   */
  lay(caseId, volume, transform) {
    this.worker.postMessage({ kind: "overlay", head: this.head, caseId, volume, transform });
  }

  /**
   * Bring the voxels of a painted label here; null: none is shown.
   * @param {{ id: string, volume: string, colour: string } | null} label
   */
  showLabel(label) {
    const { id, volume, colour } = label ?? { id: null, volume: "", colour: "" };
    this.worker.postMessage({ kind: "label", head: this.head, caseId: this.caseId, labelId: id, volume, colour });
  }

  /**
   * What of the threshold is tinted; null: all.
   * @param {{ caseId: string, runs: Uint32Array, step: number } | null} kept
   */
  keep(kept) {
    if (kept && kept.caseId !== this.caseId) return; // found in the head before
    this.worker.postMessage({ kind: "keep", head: this.head, runs: kept?.runs ?? null, step: kept?.step ?? 1 });
  }

  /**
   * Paint a line into the label that is shown.
   * @param {Brush} brush
   * @param {Triple} start LPS mm
   * @param {Triple} end
   */
  paint(brush, start, end) {
    this.worker.postMessage({ kind: "paint", head: this.head, brush, start, end });
  }

  /**
   * The HU that is drawn at places, null where no voxel is.
   * @param {Triple[]} places LPS mm
   * @returns {Promise<(number | null)[] | null>}
   */
  read(places) {
    return this.ask({ kind: "read", places });
  }

  /**
   * @param {object} order
   * @returns {Promise<any>}
   */
  ask(order) {
    return new Promise((resolve) => {
      const id = this.next;
      this.next += 1;
      this.waiting.set(id, resolve);
      this.worker.postMessage({ ...order, head: this.head, id });
    });
  }

  /** @param {Told} told */
  heard(told) {
    if (told.head !== this.head) {
      if (told.kind === "drawn") told.bitmap.close();
    } else if (told.kind === "progress") this.tell("loading", told.share);
    else if (told.kind === "ready") this.tell("ready", 1);
    else if (told.kind === "failed") this.fail(told.words);
    else if (told.kind === "outlined") this.dispatchEvent(new Event("outlines"));
    else if (told.kind === "drawn") {
      this.drawnMs = told.ms;
      this.answer(told.id, told.bitmap);
    } else if (told.kind === "values") this.answer(told.id, told.values);
    else if (told.kind === "laid" || told.kind === "labelled") this.dispatchEvent(new Event(told.kind));
    else if (told.kind === "unlaid" || told.kind === "unlabelled") {
      this.laidWords = told.words;
      this.dispatchEvent(new Event(told.kind));
    } else if (told.kind === "unoutlined") {
      console.error(`The outlines could not be loaded: ${told.words}.`);
      this.dispatchEvent(new Event("unoutlined"));
    }
  }

  /**
   * @param {number} id
   * @param {unknown} answer
   */
  answer(id, answer) {
    this.waiting.get(id)?.(answer);
    this.waiting.delete(id);
  }

  /** No pending request is answered any more. */
  giveUp() {
    const asked = [...this.waiting.values()];
    this.waiting.clear();
    for (const answer of asked) answer(null);
  }

  /** @param {string} words */
  fail(words) {
    this.words = words;
    this.giveUp();
    this.tell("failed", 0);
    this.timer = setTimeout(() => this.again(), TRY_AGAIN_MS);
  }

  /**
   * @param {LinkState} state
   * @param {number} share
   */
  tell(state, share) {
    this.state = state;
    this.share = share;
    this.dispatchEvent(new Event("change"));
  }
}
