// The second volume over the slices: which one, its transform and its opacity, which the plan stores.
import { clearErrors, confirm, note } from "../dialogs.js";
import { fillOptions, h, whenChanged } from "../dom.js";
import { heldNumber, numberInput, showNumber } from "../fields.js";
import { when } from "../format.js";
import { OWN, PRESETS } from "./grey-values.js";
import { FARTHEST_MM, IDENTITY, transformOf } from "./overlay.js";
import { poseOf, transformOfPose } from "./rigid-pose.js";
/** @import { Connection } from "../connection.js" */
/** @import { SecondVolumeSection, ViewModel } from "../types.js" */
/** @import { OverlayLook, Transform } from "./overlay.js" */
/** @import { VolumeLink } from "./volume-link.js" */

/** @typedef {SecondVolumeSection["choices"][number]} Choice */

/** @type {[string, string, string][]} what a number of the pose moves, its name, its unit */
const POSE = [
  ["x", "To the left", "mm"], ["y", "To the back", "mm"], ["z", "Up", "mm"],
  ["about-x", "About the left axis", "°"], ["about-y", "About the back axis", "°"], ["about-z", "About the upward axis", "°"],
];

/** Says `change` when the pictures have to be drawn anew. */
export class OverlayControls extends EventTarget {
  /**
   * @param {VolumeLink} link
   * @param {Connection} connection
   */
  constructor(link, connection) {
    super();
    this.link = link;
    this.connection = connection;
    /** @type {Transform} */
    this.transform = IDENTITY;
    this.here = false; // the second volume is drawn
    this.greys = { window: PRESETS[0].window, level: PRESETS[0].level };
    this.locked = true;
    /** @type {Choice[]} */
    this.choices = [];
    this.shown = ""; // what of the plan is shown
    this.told = ""; // what the plan was last asked to keep
    this.pending = 0; // edits that the planner has not answered: what it told before them is older than what is shown
    this.asked = ""; // what the worker was asked to lay
    this.changed = whenChanged();
    // Volumes of other heads stand apart, with the day on which they came in: one of another patient is easily taken.
    this.own = h("optgroup", { label: "This head" });
    this.others = h("optgroup", { label: "Other heads" });
    this.choice = h("select", { id: "overlay-case", "data-operation": "second_volume.lay second_volume.none", onchange: () => this.chosen() }, h("option", { value: "" }, "None"), this.own, this.others);
    /** @type {HTMLInputElement} */
    this.opacity = h("input", { type: "range", id: "overlay-opacity", min: 0, max: 100, step: 1, value: 50, oninput: () => this.faded(), onchange: () => this.keep() });
    this.opacityWords = h("span", { class: "number" }, "50 %");
    this.window = h("select", { id: "overlay-window", onchange: () => this.windowed() });
    /** @type {HTMLInputElement} */
    this.place = h("input", { type: "text", id: "overlay-transform", autocomplete: "off", placeholder: "16 numbers; empty: one frame", title: "16 numbers, row by row, LPS mm", onchange: () => this.placed() });
    this.pose = POSE.map(([name, label, unit]) => this.poseInput(`overlay-${name}`, `${label}, ${unit}`, unit === "mm"));
    const numbers = (/** @type {number} */ from, /** @type {string} */ words) => h("div", { class: "field" }, h("span", { class: "field-label" }, words),
      h("div", { class: "three" }, this.pose.slice(from, from + 3)));
    const labelled = (/** @type {(string | Node)[]} */ words, /** @type {HTMLElement} */ control) => h("label", { class: "field" }, h("span", { class: "field-label" }, ...words), control);
    this.placing = h("details", { id: "overlay-placing" }, h("summary", {}, "Placing"), h("div", { class: "fields" },
      numbers(0, "Left, back, up, mm"), numbers(3, "About these axes, °"), labelled(["Transform"], this.place)));
    this.more = h("div", { class: "fields", hidden: true }, labelled(["Opacity ", this.opacityWords], this.opacity), labelled(["Grey values"], this.window), this.placing);
    this.words = h("p", { class: "words caution", role: "status", hidden: true });
    this.offered = false; // there is a volume to choose
    this.caution = ""; // why the plan's second volume is not shown
    this.element = h("div", { class: "fields overlay-controls" }, labelled(["Volume"], this.choice), this.words, this.more);
    link.addEventListener("laid", () => { this.here = this.choice.value !== ""; this.say(); });
    link.addEventListener("unlaid", () => this.refused());
  }

  /**
   * One of the six numbers of the pose.
   * @param {string} id
   * @param {string} words
   * @param {boolean} shift in mm, else a turn in degrees
   */
  poseInput(id, words, shift) {
    const most = shift ? FARTHEST_MM : 360;
    const input = numberInput(id, -most, most, shift ? 0.5 : 1, () => this.posed());
    input.setAttribute("aria-label", words);
    input.title = words;
    return input;
  }

  /** How the second volume is drawn; null while there is none. @returns {OverlayLook | null} */
  get look() {
    return this.here ? { opacity: Number(this.opacity.value) / 100, greys: this.greys } : null;
  }

  /** @returns {Choice | undefined} */
  get picked() {
    return this.choices.find((one) => keyOf(one) === this.choice.value);
  }

  /** @param {ViewModel} state */
  update({ second_volume: second }) {
    const laid = second?.laid ?? null;
    this.locked = second?.locked ?? true;
    this.changed(second, () => {
      this.choices = second?.choices ?? [];
      fillOptions(this.own, this.choices.filter((one) => one.other_head === null).map((one) => [keyOf(one), one.name]));
      fillOptions(this.others, this.choices.filter((one) => one.other_head !== null).map((one) => [keyOf(one), dated(one)]));
      for (const group of [this.own, this.others]) group.hidden = !group.childElementCount;
      for (const control of [this.choice, this.place, ...this.pose]) control.disabled = this.locked;
      this.choice.title = this.locked ? "The plan is locked" : "";
      this.offered = Boolean(this.choices.length || laid);
      this.element.hidden = !this.offered;
      this.caution = cautionOf(second);
      this.words.hidden = !this.caution;
      this.words.textContent = this.caution;
    });
    const key = JSON.stringify(laid);
    if (key !== this.shown && !this.pending) {
      this.shown = key;
      this.show(second?.known && !laid?.to_confirm ? laid : null);
    }
    this.lay();
  }

  /** What the plan keeps. @param {SecondVolumeSection["laid"]} laid */
  show(laid) {
    this.choice.value = laid ? keyOf(laid) : "";
    if (laid) {
      this.transform = laid.transform;
      if (document.activeElement !== this.opacity) this.opacity.value = String(Math.round(laid.opacity * 100));
      this.opacityWords.textContent = `${this.opacity.value} %`;
      this.greys = { window: laid.window, level: laid.level };
      if (document.activeElement !== this.place) this.write();
      this.showPose();
    }
    this.windows();
    this.say();
  }

  /** The choices of grey values: the usual ones, and what fits this volume. */
  windows() {
    const { window, level } = this.greys;
    const usual = PRESETS.filter(({ name }) => name !== OWN);
    const known = usual.find((one) => one.window === window && one.level === level);
    const own = this.picked?.window !== null && this.picked !== undefined;
    fillOptions(this.window, [...usual.map(({ name, label }) => /** @type {const} */ ([name, label])), ...(own || !known ? [/** @type {const} */ ([OWN, "Its own range"])] : [])]);
    this.window.value = known?.name ?? OWN;
  }

  /** Have the worker load the chosen overlay, once. */
  lay() {
    const picked = this.picked;
    this.more.hidden = !picked;
    const key = JSON.stringify([this.link.head, this.choice.value, picked ? this.transform : null]);
    if (key === this.asked) return;
    this.asked = key;
    if (!picked) this.here = false;
    this.link.lay(picked ? picked.case : null, picked?.volume ?? null, this.transform);
  }

  /** Another head is open: what its plan lays over it is told next. */
  forget() {
    this.choice.value = this.place.value = "";
    this.transform = IDENTITY;
    this.here = false;
    this.more.hidden = true;
    this.shown = "";
  }

  async chosen() {
    if (this.picked?.other_head && !await this.samePatient(this.picked)) {
      this.shown = "";
      this.update(this.connection.state);
      return;
    }
    const picked = this.picked;
    if (picked?.window !== null && picked?.level !== null && picked) this.greys = { window: picked.window, level: picked.level };
    this.windows();
    this.lay();
    this.keep();
    this.say();
  }

  /** Ask whether a volume of another head shows this patient. @param {Choice} other */
  samePatient(other) {
    const open = this.connection.state.case;
    return confirm("Is this the same patient?",
      `‘${dated(other)}’ is another head than the open one${open ? `, ‘${open.name}’` : ""}. Lay it over only if both show the same patient.`,
      "Same patient");
  }

  faded() {
    this.opacityWords.textContent = `${this.opacity.value} %`;
    this.say();
  }

  windowed() {
    const preset = PRESETS.find(({ name }) => name === this.window.value && name !== OWN);
    const picked = this.picked;
    if (preset) this.greys = { window: preset.window, level: preset.level };
    else if (picked && picked.window !== null && picked.level !== null) this.greys = { window: picked.window, level: picked.level };
    this.keep();
    this.say();
  }

  /** The 16 numbers as they are in force; none where both volumes have one frame. */
  write() {
    this.place.value = sameNumbers(this.transform, IDENTITY) ? "" : this.transform.map(String).join(" ");
    this.place.removeAttribute("aria-invalid");
  }

  /** The six numbers as they are in force, to a thousandth; the one that is being typed stays. */
  showPose() {
    poseOf(this.transform).forEach((value, at) => showNumber(this.pose[at], value + 0));
  }

  /** One of the six numbers was typed: the others are those in force, to the last digit. */
  posed() {
    const now = poseOf(this.transform);
    const typed = this.pose.map((input, at) => (heldNumber(input) === Number(now[at].toFixed(3)) ? now[at] : Number(heldNumber(input))));
    this.lie(transformOfPose(typed).map(String).join(" "), () => { this.showPose(); });
    this.write();
  }

  placed() {
    this.lie(this.place.value, () => { this.place.setAttribute("aria-invalid", "true"); });
  }

  /**
   * Lay it by this transform; what was wrong with an earlier one is no news then.
   * @param {string} words
   * @param {() => void} otherwise where it cannot be used
   */
  lie(words, otherwise) {
    try {
      this.transform = transformOf(words);
    } catch (error) {
      otherwise();
      note(error instanceof Error ? error.message : String(error), { error: true });
      return;
    }
    clearErrors();
    this.place.removeAttribute("aria-invalid");
    this.showPose();
    this.lay();
    this.keep();
  }

  /** Keep in the plan what is shown; a locked plan stays as it is. */
  keep() {
    if (this.locked) return;
    const picked = this.picked;
    const laid = picked ? { case: picked.case, volume: picked.volume, transform: this.transform, opacity: Number(this.opacity.value) / 100, ...this.greys, other_head: picked.other_head !== null } : null;
    const key = JSON.stringify(laid);
    if (key === (this.pending ? this.told : this.shown)) return;
    this.told = key;
    if (!laid) {
      this.answered(this.connection.request("second_volume.none"));
      return;
    }
    const { case: caseId, ...rest } = laid;
    this.answered(this.connection.request("second_volume.lay", { case_id: caseId, ...rest }));
  }

  /**
   * Show what the plan keeps once the newest edit is answered: an answer to an earlier one would take the newer back.
   * @param {Promise<unknown>} request
   */
  async answered(request) {
    this.pending += 1;
    try {
      await request;
    } catch (error) {
      note(error instanceof Error ? error.message : String(error), { error: true });
    }
    this.pending -= 1;
    if (this.pending) return;
    this.shown = "";
    this.update(this.connection.state);
  }

  refused() {
    this.here = false;
    note(`That volume cannot be laid over this head: ${this.link.laidWords}.`, { error: true });
    this.choice.value = "";
    this.lay();
    this.say();
  }

  say() {
    this.dispatchEvent(new Event("change"));
  }
}

/** @param {{ case: string, volume: string | null }} volume */
function keyOf({ case: caseId, volume }) {
  return `${caseId} ${volume ?? ""}`;
}

/** @param {SecondVolumeSection | null | undefined} second */
function cautionOf(second) {
  if (!second?.laid || (second.known && !second.laid.to_confirm)) return "";
  return second.known ? "Second volume is of another head: choose it again to confirm." : "Second volume is missing: deleted, or in another data folder.";
}

/** @param {Choice} choice of another head */
function dated({ name, other_head: imported }) {
  return imported ? `${name} · imported ${when(imported)}` : name;
}

/**
 * @param {ArrayLike<number>} a
 * @param {ArrayLike<number>} b
 */
function sameNumbers(a, b) {
  return a.length === b.length && Array.from(a).every((value, index) => value === b[index]);
}
