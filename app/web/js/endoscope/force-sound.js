// The force on the hand as a tone, for a hand that feels nothing: 220 Hz where it begins, 440 Hz from 2 N on.
import { LEAST_N, RED_N } from "./guidance-arc.js";

export const [LOW_HZ, HIGH_HZ] = [220, 440];
const LOUDEST = 0.12; // of full scale
const SMOOTH_S = 0.03;
const SILENT_MS = 300; // without news of a force

/**
 * Pitch and loudness of a force; null where there is none to hear.
 * @param {number} force N
 */
export function toneOf(force) {
  if (!(force >= LEAST_N)) return null;
  const share = Math.min(1, (force - LEAST_N) / (RED_N - LEAST_N));
  return { hz: LOW_HZ + share * (HIGH_HZ - LOW_HZ), gain: LOUDEST * (0.3 + 0.7 * share) };
}

export class ForceSound {
  /** @param {() => AudioContext} make */
  constructor(make = () => new AudioContext()) {
    this.make = make;
    this.on = false;
    /** @type {{ context: AudioContext, tone: OscillatorNode, gain: GainNode } | null} */
    this.parts = null;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /**
   * After a press of the person's: a browser plays nothing before.
   * @param {boolean} on
   */
  turn(on) {
    this.on = on;
    if (on && !this.parts) this.parts = this.begun();
    if (on) this.parts?.context.resume();
    else this.hear(0);
  }

  begun() {
    const context = this.make(), tone = context.createOscillator(), gain = context.createGain();
    tone.type = "sine";
    gain.gain.value = 0;
    tone.connect(gain).connect(context.destination);
    tone.start();
    return { context, tone, gain };
  }

  /** @param {number} force N, on the hand now */
  hear(force) {
    if (!this.parts) return;
    const { context, tone, gain } = this.parts, heard = this.on ? toneOf(force) : null;
    if (heard) tone.frequency.setTargetAtTime(heard.hz, context.currentTime, SMOOTH_S);
    gain.gain.setTargetAtTime(heard?.gain ?? 0, context.currentTime, SMOOTH_S);
    clearTimeout(this.timer);
    if (heard) this.timer = setTimeout(() => this.hear(0), SILENT_MS);
  }
}

/** The page's one; off until it is switched on. */
export const forceSound = new ForceSound();
