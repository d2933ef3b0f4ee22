// What a person may switch on to notice nearness without reading it: the picture's edge darkens, and a soft tone rises.
import { h } from "../dom.js";
import { LET_GO } from "../keys.js";
import { keep, recall } from "../remember.js";

/** @import { NearnessView, ViewModel } from "../types.js" */

const NEAR_MM = 1; // above the margin: from here on they rise
const [LOW_HZ, HIGH_HZ] = [330, 660];
const LOUDEST = 0.06; // of the full scale
const SMOOTH_S = 0.08; // nothing clicks
const FADED_MS = 1000; // after which nothing is left of a tone that was let go

/** @typedef {"vignette" | "tone"} Cue */
/** @type {[Cue, string, string][]} */
const CUES = [["vignette", "Vignette", "Darken the edge near bone and structures"], ["tone", "Tone", "A tone that rises near bone and structures"]];

/**
 * How near the tool is to what it keeps from: 0 from 1 mm above the margin on, 1 at the margin.
 * @param {NearnessView[] | undefined} structures
 */
export function closeness(structures = []) {
  const left = Math.min(Infinity, ...structures.map(({ clearance_mm: clearance, margin_mm: margin }) => clearance - margin));
  return Math.min(1, Math.max(0, 1 - left / NEAR_MM));
}

export class NearnessCues {
  constructor() {
    this.vignette = h("div", { class: "scope-vignette" });
    this.tone = new Tone();
    /** @type {Record<Cue, boolean>} */
    this.on = { vignette: recallCue("vignette"), tone: recallCue("tone") };
    this.near = 0;
    this.buttons = CUES.map(([cue, name, title]) => h("button", { type: "button", id: `scope-${cue}`, title, onclick: () => this.turn(cue) }, name));
    window.addEventListener(LET_GO, () => { // hidden, left or disconnected: no frame comes that would lower them
      this.near = 0;
      this.show();
    });
    this.show();
  }

  /** @param {Cue} cue */
  turn(cue) {
    this.on[cue] = !this.on[cue];
    keep(`scope-${cue}`, this.on[cue] ? "on" : "off");
    this.show();
  }

  /**
   * @param {ViewModel} state
   * @param {boolean} shown whether the picture is in sight
   */
  update({ step, rehearsal, nearness }, shown) {
    const drives = shown && step?.name === "rehearse" && rehearsal?.state === "running";
    this.near = drives ? closeness(nearness) : 0;
    this.show();
  }

  show() {
    const { on, near } = this;
    CUES.forEach(([cue], index) => this.buttons[index].setAttribute("aria-pressed", String(on[cue])));
    this.vignette.style.opacity = String(on.vignette ? near : 0);
    this.tone.set(on.tone ? near : 0);
  }
}

/** A sine that is silent at 0, and at most soft; while it is silent it costs nothing. */
class Tone {
  constructor() {
    /** @type {{ context: AudioContext, pitch: AudioParam, gain: AudioParam } | null} made when it is first heard: a browser allows that after a press */
    this.made = null;
    this.near = 0;
    this.failed = false; // this browser or machine plays nothing
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.resting = undefined;
  }

  /** @param {number} near */
  set(near) {
    if (this.failed || near === this.near) return;
    this.near = near;
    this.made ??= this.make();
    if (!this.made) return;
    const { context, pitch, gain } = this.made;
    clearTimeout(this.resting);
    if (near > 0 && context.state === "suspended") context.resume().catch(() => {}); // it is asked for again with the next
    if (near === 0) this.resting = setTimeout(() => context.suspend(), FADED_MS);
    pitch.setTargetAtTime(LOW_HZ * (HIGH_HZ / LOW_HZ) ** near, context.currentTime, SMOOTH_S);
    gain.setTargetAtTime(LOUDEST * near, context.currentTime, SMOOTH_S);
  }

  make() {
    try {
      return makeTone();
    } catch (error) {
      this.failed = true;
      console.error("no tone can be played:", error);
      return null;
    }
  }
}

function makeTone() {
  const context = new AudioContext();
  const source = new OscillatorNode(context, { type: "sine", frequency: LOW_HZ });
  const volume = new GainNode(context, { gain: 0 });
  source.connect(volume).connect(context.destination);
  source.start();
  return { context, pitch: source.frequency, gain: volume.gain };
}

/** @param {Cue} cue */
function recallCue(cue) {
  return recall(`scope-${cue}`, ["on", "off"], "off") === "on";
}
