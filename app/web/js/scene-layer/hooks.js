// viser's canvas as the page around it reaches it: the one module that knows how. viser is pinned for its sake, and each
// hook has a browser test. Nothing of three.js is imported: two copies of it would not know each other's objects.

/** @typedef {any} Three an object of the frame's three.js, whose types the page does not have */
/** @typedef {(camera: Three) => void} Watcher called before each drawn frame, with the camera of that very frame */

const LOOK_MS = 50;
const PATIENCE_MS = 30_000;

export class SceneHooks {
  /**
   * Wait until viser has its canvas. Throws where that cannot be reached, as with another version of viser.
   * @param {Window & { vfixScenes?: Three[] }} frame
   * @param {() => boolean} wanted whether a caller still waits
   * @returns {Promise<SceneHooks | null>} null when nobody waits any more
   */
  static async attach(frame, wanted) {
    const end = performance.now() + PATIENCE_MS;
    while (wanted()) {
      const scene = (frame.vfixScenes ?? []).find((it) => it.__r3f?.root?.getState?.().gl);
      const state = scene?.__r3f.root.getState();
      if (state?.controls?.setOrbitPoint && rootOf(scene)) return new SceneHooks(scene);
      if (performance.now() > end) throw new Error("The scene's canvas cannot be reached; is viser the pinned version?");
      await new Promise((go) => { setTimeout(go, LOOK_MS); });
    }
    return null;
  }

  /** @param {Three} scene */
  constructor(scene) {
    this.scene = scene;
    this.getState = scene.__r3f.root.getState;
    this.root = rootOf(scene);
    /** @type {Set<Watcher>} */
    this.watchers = new Set();
    this.paused = false;
    /** @type {HTMLCanvasElement | null} gets a copy of every frame */
    this.copied = null;
    /** @type {number | null} how long the newest frame took that was copied, ms */
    this.tookMs = null;
    /** @type {number | null} pixels of the canvas to one CSS pixel, while they are fewer for a time */
    this.density = null;
    const { gl } = this.getState();
    const draw = gl.render.bind(gl);
    gl.render = (/** @type {Three} */ drawn, /** @type {Three} */ camera) => {
      if (this.paused) return;
      const began = performance.now();
      if (drawn === scene) for (const watch of this.watchers) watch(camera);
      draw(drawn, camera);
      if (drawn !== scene || !this.copied) return;
      copy(gl.domElement, this.copied); // in this task: what is drawn is gone after it
      this.tookMs = performance.now() - began; // the copy waits for what is drawn
    };
    const setSize = gl.setSize.bind(gl);
    gl.setSize = (/** @type {unknown[]} */ ...size) => {
      setSize(...size);
      if (this.paused && !this.copied) draw(scene, this.camera); // another size or resolution empties the canvas
    };
  }

  /** @returns {Three} */
  get camera() { return this.getState().camera; }

  /** @returns {Three} */
  get controls() { return this.getState().controls; }

  /** @returns {{ width: number, height: number }} of the canvas, CSS px */
  get size() { return this.getState().size; }

  /** Frames come on demand. */
  redraw() { this.getState().invalidate(); }

  /**
   * A hidden scene is not drawn; its frame would continue otherwise.
   * @param {boolean} on
   */
  draw(on) {
    this.paused = !on; // the viewer restarts its loop when the frame's size changes
    this.getState().setFrameloop(on ? "demand" : "never");
    if (on) this.redraw();
  }

  /**
   * Draw with a share of the resolution for a time, up to 1, which is that of viser.
   * @param {number} share
   */
  resolve(share) {
    const { viewport, setDpr } = this.getState();
    const whole = this.density ?? viewport.dpr;
    this.density = share < 1 ? whole : null;
    if (viewport.dpr !== whole * share) setDpr(whole * share);
  }

  /**
   * A place in the patient, LPS mm, in the world of three.js.
   * @param {ArrayLike<number>} position
   * @returns {Three}
   */
  world(position) {
    const Vector3 = this.camera.position.constructor;
    return new Vector3(position[0], position[1], position[2]).applyMatrix4(this.root.matrixWorld);
  }

  /**
   * Where on the canvas a place of the patient is, px; null behind the camera.
   * @param {ArrayLike<number>} position
   * @param {Three} [camera]
   */
  project(position, camera = this.camera) {
    const place = this.world(position).applyMatrix4(camera.matrixWorldInverse);
    if (place.z >= 0) return null;
    place.applyMatrix4(camera.projectionMatrix);
    const { width, height } = this.size;
    return { x: ((place.x + 1) / 2) * width, y: ((1 - place.y) / 2) * height };
  }

  /**
   * Every object of the scene.
   * @param {(object: Three) => void} visit
   */
  each(visit) { this.scene.traverse(visit); }
}

/**
 * @param {HTMLCanvasElement} from
 * @param {HTMLCanvasElement} to
 */
function copy(from, to) {
  [to.width, to.height] = [from.width, from.height];
  to.getContext("2d")?.drawImage(from, 0, 0);
}

/**
 * viser's root group turns z up (LPS) into y up (three.js): a quarter of a turn, where each part of the quaternion is a half.
 * @param {Three} scene
 */
function rootOf(scene) {
  /** @type {Three} */
  let found = null;
  scene.traverse((/** @type {Three} */ object) => {
    if (!found && object.isGroup && Math.abs(Math.abs(object.quaternion.x) - 0.5) < 1e-6) found = object;
  });
  return found;
}
