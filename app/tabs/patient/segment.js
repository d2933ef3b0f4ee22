// Segmentation: a structure out of the open head's CT, by a threshold that the slices show while it is chosen.
import { fillOptions, group, h } from "/static/js/dom.js";
import { note } from "/static/js/dialogs.js";
import { heldNumber, ownNumber, showNumber } from "/static/js/fields.js";
import { fixed } from "/static/js/format.js";
import { send } from "/static/js/rest.js";
import { say } from "/static/js/said.js";
import { thresholdPreview } from "/static/js/threshold-preview.js";
import { CropBox } from "./crop-box.js";
import { IslandPreview } from "./island-preview.js";

/** @import { JobList } from "/static/js/job-list.js" */
/** @import { CaseSection, JobPublic } from "/static/js/types.js" */

const [LOWEST, HIGHEST] = [-1100, 3100]; // HU, ends of the sliders: there an end is open, and nothing is left out
const [EVERY_LOW, EVERY_HIGH] = [-2000, 10_000]; // HU of an open end, as the planner has it
/** @type {Record<string, { words: string, name: string, low: number, high: number, least?: number }>} least: island, mm³ */
const PRESETS = {
  bone: { words: "Bone", name: "Bone", low: 250, high: HIGHEST },
  thin_bone: { words: "Thin bone", name: "Thin bone", low: 120, high: HIGHEST },
  soft_tissue: { words: "Soft tissue", name: "Soft tissue", low: -300, high: 119 },
  air: { words: "Air in the body", name: "Air", low: LOWEST, high: -301, least: 100 },
  mucosa: { words: "Mucosa", name: "Mucosa", low: -300, high: 119 },
  unseen_bone: { words: "Unseen thin bone", name: "Bone not seen", low: -300, high: 249 },
};
const CONFINED = ["air", "mucosa", "unseen_bone"]; // to a part of the head that the planner finds
const ISLANDS = [["all", "Keep all"], ["largest", "Largest only"], ["least", "Drop small ones"]];

export class SegmentGroup {
  /** @param {JobList} jobs */
  constructor(jobs) {
    this.jobs = jobs;
    /** @type {CaseSection | null} */
    this.case = null;
    this.asking = false; // the planner has not answered yet
    this.preset = h("select", { id: "segment-preset", onchange: () => this.choosePreset() });
    fillOptions(this.preset, Object.entries(PRESETS).map(([key, { words }]) => [key, words]));
    this.low = this.slider("segment-low", PRESETS.bone.low);
    this.high = this.slider("segment-high", PRESETS.bone.high);
    this.tint = h("input", { type: "checkbox", id: "segment-tint", onchange: () => this.publish() });
    this.islands = h("select", { id: "segment-islands", onchange: () => this.showParts() });
    fillOptions(this.islands, /** @type {[string, string][]} */ (ISLANDS));
    this.least = ownNumber("segment-least", 0, 1e6, 1, 10, () => this.publish());
    this.least.setAttribute("aria-label", "Smallest island in cubic millimetres");
    this.leastField = this.field("Smallest island, mm³", this.least);
    this.crop = new CropBox(() => this.publish());
    this.smooth = ownNumber("segment-smooth", 0, 3, 0.1, 0);
    this.name = h("input", { type: "text", id: "segment-name", maxLength: 80, value: PRESETS.bone.name });
    this.button = h("button", { type: "button", class: "wide", id: "segment-make", onclick: () => this.make() }, "Make structure");
    this.working = jobs.beside((job) => job.kind === "segmentation");
    jobs.addEventListener("change", () => this.showBusy());
    this.words = h("p", { class: "words" });
    this.keptWords = h("p", { class: "words", id: "segment-kept", role: "status" });
    this.kept = new IslandPreview((words) => { this.keptWords.textContent = words; });
    this.element = group("Segment", null, this.words, h("div", { class: "fields" },
      this.field("Tissue", this.preset), this.low.field, this.high.field,
      h("label", { class: "check" }, this.tint, "Show in slices"),
      this.field("Islands", this.islands), this.leastField, this.keptWords,
      this.crop.label, this.crop.fields,
      this.field("Smoothing, mm", this.smooth), this.field("Name", this.name), this.button, this.working));
    this.element.id = "segment";
    this.element.addEventListener("change", () => this.rests());
    this.showParts();
    // The tint could not be switched off while another tab is shown.
    this.seen = false;
    new ResizeObserver(() => this.turned()).observe(this.element);
  }

  /**
   * @param {string} words
   * @param {HTMLElement} control
   */
  field(words, control) {
    return h("div", { class: "field" }, h("label", { class: "field-label", for: control.id }, words), control);
  }

  /**
   * @param {string} id
   * @param {number} value
   */
  slider(id, value) {
    const words = h("span", { class: "number" });
    const input = h("input", { type: "range", id, min: LOWEST, max: HIGHEST, step: 1, value: String(value), oninput: () => this.moved(id) });
    const label = h("label", { class: "field-label", for: id }, id.endsWith("low") ? "From" : "To", words);
    return { input, words, field: h("div", { class: "field" }, label, input) };
  }

  /**
   * @param {CaseSection | null | undefined} open
   * @param {number[] | null | undefined} cross where the crosshair stands, LPS mm
   */
  update(open, cross) {
    this.crop.cross = cross ?? null;
    if (open?.id !== this.case?.id) this.tint.checked = false;
    this.case = open ?? null;
    this.showBusy();
    say(this.words, open && !open.has_volume
      ? "No CT to segment."
      : "Thin bone may be invisible; ‘Unseen thin bone’ fills it in.");
    this.publish();
  }

  choosePreset() {
    const { low, high, name, least } = PRESETS[this.preset.value];
    this.islands.value = least ? "least" : "all";
    if (least) showNumber(this.least, least);
    [this.low.input.value, this.high.input.value, this.name.value] = [String(low), String(high), name];
    this.tint.checked = true;
    this.showParts();
  }

  /** @param {string} id */
  moved(id) {
    const [low, high] = [this.low.input, this.high.input];
    if (Number(low.value) > Number(high.value)) {
      if (id === low.id) high.value = low.value;
      else low.value = high.value;
    }
    this.tint.checked = true;
    this.showParts();
  }

  showParts() {
    const [low, high] = [Number(this.low.input.value), Number(this.high.input.value)];
    this.low.words.textContent = low <= LOWEST ? "no limit" : `${fixed(low, 0)} HU`;
    this.high.words.textContent = high >= HIGHEST ? "no limit" : `${fixed(high, 0)} HU`;
    this.leastField.hidden = this.islands.value !== "least";
    this.publish();
  }

  /** The group came into sight, went out of it, or has another size: what is looked at again is counted in full. */
  turned() {
    const [before, now] = [this.seen, this.element.offsetParent !== null];
    this.seen = now;
    this.publish();
    if (now && !before) this.rests();
  }

  /** What the slices tint: nothing while the group is not shown. */
  publish() {
    const shown = this.tint.checked && Boolean(this.case?.has_volume) && this.element.offsetParent !== null;
    const range = shown ? { low: Number(this.low.input.value), high: Number(this.high.input.value) } : null;
    if (range?.low !== thresholdPreview.value?.low || range?.high !== thresholdPreview.value?.high) thresholdPreview.set(range);
    this.kept.want(this.case?.id ?? "", this.keptWish(shown));
  }

  /** A control was let go of: islands are told in full. */
  rests() {
    const shown = this.tint.checked && Boolean(this.case?.has_volume);
    if (this.case) this.kept.full(this.case.id, this.keptWish(shown));
  }

  /**
   * What the planner is asked about a threshold that is not kept whole; null where it is, or is not shown.
   * @param {boolean} shown
   */
  keptWish(shown) {
    const { preset, low_hu, high_hu, crop_mm, largest, least_mm3 } = this.request();
    const request = { preset, low_hu, high_hu, crop_mm, largest, least_mm3 };
    const whole = !request.largest && !request.least_mm3 && !request.crop_mm && !CONFINED.includes(request.preset);
    return shown && !whole ? request : null;
  }

  /** What the planner takes. */
  request() {
    const [low, high] = [Number(this.low.input.value), Number(this.high.input.value)];
    return {
      name: this.name.value.trim(),
      preset: this.preset.value,
      low_hu: low <= LOWEST ? EVERY_LOW : low,
      high_hu: high >= HIGHEST ? EVERY_HIGH : high,
      crop_mm: this.crop.box,
      largest: this.islands.value === "largest",
      least_mm3: this.islands.value === "least" ? Number(heldNumber(this.least)) : 0,
      smooth_mm: Number(heldNumber(this.smooth)),
    };
  }

  async make() {
    if (!this.case) return;
    const request = this.request();
    this.asking = true;
    this.showBusy();
    try {
      /** @type {JobPublic} */
      const job = await send(`/api/v1/cases/${encodeURIComponent(this.case.id)}/segment`, request);
      this.jobs.watch(job);
    } catch (error) {
      note(/** @type {Error} */ (error).message, { error: true });
    } finally {
      this.asking = false;
      this.showBusy();
    }
  }

  /** One surface is made at a time; its progress is shown below the button. */
  showBusy() {
    this.button.disabled = !this.case?.has_volume || this.asking || !this.working.hidden;
  }
}
