// Loads the pictures of a CT slice.
import { svg } from "./dom.js";
/** @import { Connection } from "./connection.js" */
/** @import { StateWithSlices } from "./slices.js" */
/** @import { AxisName } from "./slices/port.js" */
/** @import { SlicePlane } from "./types.js" */

/** @typedef {{ caseId: string, plane: SlicePlane, addresses: string[], key: string }} Job pictures of one plane; key: their addresses */

const TRY_AGAIN_MS = 3000;

/** Fetches the pictures of the newest wanted plane; at most one plane is being fetched, and a failure shows none. */
export class Loader {
  /**
   * @param {SVGGElement} coming holds pictures while they load
   * @param {Connection} connection
   * @param {(plane: SlicePlane, images: SVGImageElement[] | null, caseId: string) => void} shown images: null where they could not be loaded
   */
  constructor(coming, connection, shown) {
    this.coming = coming;
    this.connection = connection;
    this.shown = shown;
    /** @type {Job | null} */
    this.wanted = null;
    /** @type {Job | null} */
    this.loading = null;
    /** @type {string | null} key of the newest job that has ended */
    this.done = null;
    this.missing = false; // what that job could not load
    /** @type {number | undefined} */
    this.timer = undefined;
  }

  /**
   * @param {string} caseId
   * @param {SlicePlane} plane
   * @param {string[]} addresses
   */
  want(caseId, plane, addresses) {
    this.wanted = { caseId, plane, addresses, key: addresses.join(" ") };
    if (!this.loading && this.wanted.key !== this.done) this.load(this.wanted);
  }

  /** Ask once more for what could not be loaded; without a line that waits for the next one. */
  again() {
    if (!this.missing || this.loading || !this.wanted || !this.connection.connected) return;
    this.load(this.wanted);
  }

  clear() {
    clearTimeout(this.timer);
    this.wanted = this.loading = this.done = null;
    this.missing = false;
    this.coming.replaceChildren();
  }

  /** @param {Job} job */
  async load(job) {
    clearTimeout(this.timer);
    this.loading = job;
    let images = null;
    try {
      images = await Promise.all(job.addresses.map((address) => picture(address, this.coming)));
    } catch {
      this.timer = setTimeout(() => this.again(), TRY_AGAIN_MS);
    }
    if (this.loading !== job) return; // another head was opened
    this.loading = null;
    this.missing = images === null;
    this.done = job.key;
    this.shown(job.plane, images, job.caseId);
    this.coming.replaceChildren();
    if (this.wanted && this.wanted.key !== job.key) this.load(this.wanted);
  }
}

/**
 * Pictures of a slice as the planner draws them, the wide one first.
 * @param {StateWithSlices} state
 * @param {AxisName} axis
 */
export function addressesOf(state, axis) {
  const { window, level, planes } = state.slices;
  const address = `/api/v1/cases/${encodeURIComponent(state.case.id)}/slices/${axis}`
    + `?position_mm=${planes[axis].position.toFixed(3)}&window=${window}&level=${level}`;
  const fine = planes[axis].detail && state.case.detail;
  return fine ? [address, `${address}&volume=${encodeURIComponent(fine)}`] : [address];
}

/**
 * The element of a picture, once it is loaded.
 * @param {string} address
 * @param {SVGGElement} coming
 * @returns {Promise<SVGImageElement>}
 */
function picture(address, coming) {
  return new Promise((resolve, reject) => {
    const element = svg("image", { preserveAspectRatio: "none" });
    element.addEventListener("load", () => resolve(element));
    element.addEventListener("error", () => reject(new Error("The picture could not be loaded.")));
    element.setAttribute("href", address);
    coming.append(element);
  });
}
