// The picture of a scope in a canvas of its own: a surface, a light at the lens, and the plan laid over. WebGL2, no library.
import { drawsInSoftware } from "../graphics.js";
import { Bumps } from "./bumps.js";
import { readMesh } from "./mesh-file.js";
import { PlanOverlay } from "./plan-overlay.js";
import { IN_TISSUE, TISSUE_FRAGMENT } from "./shaders.js";
import { TaskLabels } from "./task-labels.js";
import { Tissue } from "./tissue.js";
/** @import { Lens } from "./lens.js" */
/** @import { Look } from "./looks.js" */
/** @import { Quality } from "./shaders.js" */

const DARK = [0.01, 0.003, 0.003]; // where nothing is

export class Renderer {
  /**
   * Throws where the browser has no WebGL2.
   * @param {HTMLCanvasElement} canvas square
   * @param {Look} look
   */
  constructor(canvas, look) {
    this.canvas = canvas;
    this.look = look;
    this.software = drawsInSoftware();
    const gl = canvas.getContext("webgl2", { antialias: !this.software, alpha: false, powerPreference: "high-performance" });
    if (!gl) throw new Error("This browser has no WebGL2.");
    this.gl = gl;
    this.overlay = new PlanOverlay(gl);
    this.bumps = new Bumps(gl);
    this.labels = new TaskLabels(gl);
    /** @type {Tissue | null} */
    this.tissue = null;
    this.inTissue = false; // the lens is behind the wall, from where it sees the wall from outside, or nothing
  }

  /** @param {ArrayBuffer} data the file of a surface */
  load(data) {
    const file = readMesh(data);
    this.unload();
    this.tissue = new Tissue(this.gl, file);
  }

  unload() {
    this.tissue?.remove();
    this.tissue = null;
  }

  /** @param {number} size of the picture, px */
  resize(size) {
    if (this.canvas.width === size) return;
    this.canvas.width = this.canvas.height = size;
  }

  /**
   * @param {Lens} lens
   * @param {Quality} quality
   * @param {string} [fragment] the text of another shader of the tissue
   */
  draw(lens, quality, fragment = TISSUE_FRAGMENT[quality]) {
    const { gl, canvas } = this;
    gl.viewport(0, 0, canvas.width, canvas.height);
    const [red, green, blue] = this.inTissue ? IN_TISSUE : DARK;
    gl.clearColor(red, green, blue, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.tissue?.draw(lens, this.look, fragment);
    this.bumps.draw(lens);
    this.labels.draw(lens);
    this.overlay.draw(lens, canvas.width);
  }

  /**
   * The round picture with words below it, as a file. The browser clears a canvas once its task is over, so it is drawn anew.
   * @param {Lens} lens
   * @param {string} words
   * @returns {Promise<Blob>}
   */
  picture(lens, words) {
    this.draw(lens, "full");
    const size = this.canvas.width;
    const line = Math.max(18, Math.round(size / 24));
    const page = document.createElement("canvas");
    [page.width, page.height] = [size, size + 2 * line];
    const ink = page.getContext("2d");
    if (!ink) throw new Error("This browser draws no pictures.");
    ink.fillRect(0, 0, page.width, page.height);
    ink.save();
    ink.beginPath();
    ink.arc(size / 2, size / 2, size / 2, 0, 2 * Math.PI);
    ink.clip();
    ink.drawImage(this.canvas, 0, 0);
    ink.restore();
    ink.fillStyle = "#e8ebef";
    ink.textAlign = "center";
    ink.font = `${Math.round(0.7 * line)}px system-ui, sans-serif`;
    ink.fillText(words, size / 2, size + 1.3 * line, size);
    return new Promise((done, failed) => {
      page.toBlob((blob) => { if (blob) done(blob); else failed(new Error("The picture could not be saved.")); }, "image/png");
    });
  }
}
