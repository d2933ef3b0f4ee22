// While a hand drives, drawing leaves the page's thread free for half of the time: the thread has to hear keys and pointer,
// and to say that it is awake. Slow frames make the pictures coarser first; then each frame is followed by as long a rest.

const SLOW_MS = 20; // with its rest, a frame of this length leaves 25 a second
const COARSE = 0.5; // of the resolution, where frames are slow
const LINGER_MS = 2000; // after the hand: keys that are tapped do not change the resolution each time

/** @typedef {(time: number) => void} Draw */
/** @typedef {(draw: Draw) => unknown} Frame a window's `requestAnimationFrame` */
/** @typedef {{ now: () => number, frame: Frame, later: (run: () => void, ms: number) => unknown }} Clock */

/** @type {Clock} */
const BROWSER = { now: () => performance.now(), frame: (draw) => requestAnimationFrame(draw), later: (run, ms) => setTimeout(run, ms) };

/** Says `scale` when the pictures are to have another resolution. */
export class FramePacing extends EventTarget {
  /** @param {Clock} clock */
  constructor(clock = BROWSER) {
    super();
    this.clock = clock;
    this.held = false;
    this.holds = 0; // how often that changed
    this.scale = 1; // of the resolution
    this.slow = false; // so was the newest frame
    this.restUntil = 0; // while something is held, no frame begins before
    this.marked = false; // the frame that comes is measured
    this.drawing = false; // a frame has begun
    this.planned = false; // what waits is handed over after a rest
    this.nextId = -1; // the browser's own are positive
    /** @type {Map<number, { draw: Draw, frame: Frame }>} not yet drawn */
    this.wishes = new Map();
    /** @type {number[]} those not yet handed over to the browser */
    this.waiting = [];
  }

  /** @param {boolean} on whether something is held that drives */
  hold(on) {
    if (on === this.held) return;
    this.held = on;
    this.holds += 1;
    const { holds } = this;
    if (on) this.choose();
    else this.clock.later(() => { if (holds === this.holds) this.choose(); }, LINGER_MS);
  }

  /** Coarse from the first slow frame on, as long as something is held. */
  choose() {
    const scale = this.held && (this.slow || this.scale < 1) ? COARSE : 1;
    if (scale === this.scale) return;
    this.scale = scale;
    this.dispatchEvent(new Event("scale"));
  }

  /**
   * Draw with the next frame that may be drawn; returns a number for `cancel`.
   * @param {Draw} draw
   * @param {Frame} [frame]
   */
  request(draw, frame = this.clock.frame) {
    const id = this.nextId--;
    this.wishes.set(id, { draw, frame });
    this.waiting.push(id);
    if (!this.held || !this.drawing) this.plan();
    return id;
  }

  /** @param {number} id */
  cancel(id) {
    this.wishes.delete(id);
  }

  plan() {
    if (this.planned || !this.waiting.length) return;
    const rest = this.held ? this.restUntil - this.clock.now() : 0;
    if (rest <= 0) {
      this.handOver();
      return;
    }
    this.planned = true;
    this.clock.later(() => {
      this.planned = false;
      this.handOver();
    }, rest);
  }

  /** What waits is drawn with the browser's next frame. */
  handOver() {
    this.mark();
    for (const id of this.waiting.splice(0)) {
      this.wishes.get(id)?.frame((time) => {
        const wish = this.wishes.get(id);
        this.wishes.delete(id);
        wish?.draw(time);
      });
    }
  }

  /** Measure the browser's next frame. */
  mark() {
    if (this.marked) return;
    this.marked = true;
    this.clock.frame(() => {
      const began = this.clock.now();
      this.marked = false;
      this.drawing = true;
      this.clock.later(() => this.drawn(this.clock.now() - began), 0); // after style, layout and paint
    });
  }

  /** @param {number} tookMs */
  drawn(tookMs) {
    this.drawing = false;
    this.slow = tookMs > SLOW_MS;
    this.restUntil = this.clock.now() + tookMs;
    if (this.held) this.choose();
    this.plan();
  }

  /**
   * Let a window inside this page, which draws by itself, keep pace.
   * @param {Window} inner
   */
  adopt(inner) {
    const frame = inner.requestAnimationFrame.bind(inner);
    const cancel = inner.cancelAnimationFrame.bind(inner);
    inner.requestAnimationFrame = (draw) => this.request(draw, frame);
    inner.cancelAnimationFrame = (id) => {
      if (id < 0) this.cancel(id);
      else cancel(id);
    };
  }
}

export const pacing = new FramePacing();
