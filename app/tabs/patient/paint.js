// Painting on the slices: labels of the open head, the brush, undo, and the structure that comes of a label.
import { askName, confirm, note, noteDone } from "/static/js/dialogs.js";
import { fillOptions, group, h, iconButton, whenChanged } from "/static/js/dom.js";
import { letterOf } from "/static/js/letters.js";
import { paintBrush } from "/static/js/paint-brush.js";
import { send } from "/static/js/rest.js";
import { say } from "/static/js/said.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { JobList } from "/static/js/job-list.js" */
/** @import { JobPublic, LabelEntry, ViewModel } from "/static/js/types.js" */

const STATES = {
  none: "Make a structure to protect.",
  made: "Structure is up to date.",
  changed: "Painted since: make again.",
};

export class PaintGroup {
  /**
   * @param {Connection} connection
   * @param {JobList} jobs
   */
  constructor(connection, jobs) {
    this.connection = connection;
    this.jobs = jobs;
    this.changedItems = whenChanged();
    /** @type {LabelEntry[]} */
    this.items = [];
    this.caseId = ""; // of the head that they are of
    this.chosen = "";
    this.naming = ""; // the name of a label that was asked for and is not there yet
    /** @type {HTMLSelectElement} */
    this.label = h("select", { id: "paint-label", onchange: () => this.choose(this.label.value) });
    /** @type {HTMLInputElement} */
    this.colour = h("input", { type: "color", class: "swatch", id: "paint-colour", "aria-label": "Colour of the label", title: "Colour", onchange: () => this.change({ colour: this.colour.value }) });
    this.start = h("select", { id: "paint-start" });
    this.make = h("button", { type: "button", id: "paint-new", "data-operation": "label.new", onclick: () => this.create() }, "New label …");
    this.hold = h("button", { type: "button", class: "wide", id: "paint-hold", "data-operation": "label.stroke", onclick: () => paintBrush.set({ held: !paintBrush.held }) }, "Paint");
    this.modes = this.segments("mode", [["paint", "Paint"], ["erase", "Erase"]], "What the brush does");
    this.brushes = this.segments("brush", [["disc", "Disc"], ["ball", "Ball"]], "Shape of the brush");
    this.radiusWords = h("span", { class: "number" });
    /** @type {HTMLInputElement} */
    this.radius = h("input", { type: "range", id: "paint-radius", min: 0.5, max: 15, step: 0.1, value: "2", oninput: () => paintBrush.set({ radius: Number(this.radius.value) }) });
    this.undo = iconButton("undo", "Undo the newest stroke (Ctrl+Z)", () => this.step("label.undo"), { id: "paint-undo", "data-operation": "label.undo" });
    this.redo = iconButton("redo", "Redo (Ctrl+Shift+Z)", () => this.step("label.redo"), { id: "paint-redo", "data-operation": "label.redo" });
    this.lock = iconButton("lock", "Lock", () => this.change({ locked: !this.item?.locked }));
    this.rename = iconButton("pencil", "Rename", () => this.askName(), { "data-operation": "label.change" });
    this.trash = iconButton("trash", "Delete", () => this.remove(), { "data-operation": "label.delete" });
    this.surface = h("button", { type: "button", class: "wide", id: "paint-surface", onclick: () => this.makeSurface() }, "Make structure");
    /** @type {Set<string>} jobs that make a surface of a label, begun here */
    this.begun = new Set();
    this.working = jobs.beside((job) => this.begun.has(job.id));
    jobs.addEventListener("change", () => { this.surface.disabled = !this.working.hidden; });
    this.files = ["seg.nrrd", "nii.gz"].map((form) => h("a", { class: "button", download: "", "data-form": form }, `.${form}`));
    this.words = h("p", { class: "words", id: "paint-words" });
    this.tools = h("div", { class: "paint-tools" }, this.hold, this.modes, this.brushes,
      h("div", { class: "field" }, h("label", { class: "field-label", for: "paint-radius" }, "Radius", this.radiusWords), this.radius),
      this.surface, this.working,
      h("div", { class: "field" }, h("span", { class: "field-label" }, "Save the label"), h("div", { class: "buttons even" }, this.files)));
    this.element = group("Paint", [this.undo, this.redo, this.lock, this.rename, this.trash], this.words, h("div", { class: "fields" },
      h("div", { class: "field" }, h("label", { class: "field-label", for: "paint-label" }, "Label"), h("div", { class: "structure-end" }, this.label, this.colour)),
      h("div", { class: "field" }, h("label", { class: "field-label", for: "paint-start" }, "Begin with"), this.start), this.make, this.tools));
    this.element.id = "paint";
    paintBrush.addEventListener("change", () => this.showBrush());
    // The brush could not be deactivated while another tab is shown.
    new ResizeObserver(() => this.offer()).observe(this.element);
    window.addEventListener("keydown", (event) => this.key(event), true);
    this.showBrush();
  }

  /**
   * @param {"mode" | "brush"} name
   * @param {[string, string][]} options
   * @param {string} words
   */
  segments(name, options, words) {
    return h("div", { class: "segmented", role: "group", "aria-label": words }, options.map(([value, label]) =>
      h("button", { type: "button", "data-value": value, onclick: () => paintBrush.set({ [name]: value }) }, label)));
  }

  get item() {
    return this.items.find((item) => item.id === this.chosen) ?? null;
  }

  /** @param {ViewModel} state */
  update(state) {
    const structures = state.structures?.items ?? [];
    const starts = structures.map(({ id, name }) => /** @type {[string, string]} */ ([id, name]));
    this.changedItems([state.painted, state.case?.id, state.case?.has_volume, starts], () => {
      const before = new Set(this.items.map(({ id }) => id));
      this.items = state.painted?.items ?? [];
      this.caseId = state.case?.id ?? "";
      const made = this.items.find(({ id, name }) => !before.has(id) && name === this.naming);
      if (made) [this.chosen, this.naming] = [made.id, ""];
      if (!this.item) this.chosen = "";
      fillOptions(this.label, [["", this.items.length ? "None" : "None yet"], ...this.items.map(({ id, name }) => /** @type {[string, string]} */ ([id, name]))]);
      this.label.value = this.chosen;
      const start = this.start.value;
      fillOptions(this.start, [["", "Nothing"], ["bone", "Bone"], ...starts]);
      this.start.value = [...this.start.options].some(({ value }) => value === start) ? start : "";
      this.render(Boolean(state.case?.has_volume));
      if (made) paintBrush.set({ held: true });
    });
  }

  /** @param {boolean} hasVolume */
  render(hasVolume) {
    const { item } = this;
    this.make.disabled = this.start.disabled = !hasVolume;
    this.label.disabled = !this.items.length;
    this.tools.hidden = this.colour.hidden = !item;
    for (const button of [this.undo, this.redo, this.lock, this.rename, this.trash]) button.hidden = !item;
    this.undo.disabled = !item?.can_undo;
    this.redo.disabled = !item?.can_redo;
    this.lock.setAttribute("aria-pressed", String(Boolean(item?.locked)));
    this.lock.title = item?.locked ? "Unlock" : "Lock";
    this.hold.disabled = this.colour.disabled = Boolean(item?.locked);
    if (item && document.activeElement !== this.colour) this.colour.value = item.colour;
    for (const link of this.files) link.setAttribute("href", `/api/v1/labels/${encodeURIComponent(this.chosen)}/file?form=${link.dataset.form}`);
    if (!hasVolume) say(this.words, "No CT to paint on.");
    else if (!item) say(this.words, "");
    else say(this.words, item.unreadable || (item.locked ? `‘${item.name}’ is locked.` : STATES[item.surface]));
    this.words.classList.toggle("caution", Boolean(item && (item.unreadable || item.surface === "changed")));
    this.offer();
  }

  /** What the slices show and paint on: nothing while the group is not shown. */
  offer() {
    const { item } = this;
    const shown = item && !item.unreadable && this.element.offsetParent !== null;
    if (!shown) paintBrush.set({ label: null });
    else paintBrush.set({ label: { id: item.id, caseId: this.caseId, colour: item.colour, volume: item.volume, revision: item.revision, locked: item.locked } });
  }

  showBrush() {
    const { held, mode, brush, radius } = paintBrush;
    this.hold.setAttribute("aria-pressed", String(held));
    this.hold.textContent = held ? "Stop painting" : "Paint";
    for (const [segments, value] of /** @type {[HTMLElement, string][]} */ ([[this.modes, mode], [this.brushes, brush]])) {
      for (const button of segments.querySelectorAll("button")) button.setAttribute("aria-pressed", String(button.dataset.value === value));
    }
    this.radius.value = String(radius);
    this.radiusWords.textContent = `${radius.toFixed(1)} mm`;
  }

  /** @param {string} id */
  choose(id) {
    this.chosen = id;
    this.render(true);
  }

  async create() {
    const from = this.start.value ? this.start.selectedOptions[0].textContent ?? "" : "";
    const name = await askName("New label", from ? `${from}, painted` : "Label");
    if (!name) return;
    this.naming = name;
    this.ask("label.new", { name, structure_id: this.start.value || null });
  }

  /** @param {{ name?: string, colour?: string, locked?: boolean }} what */
  change(what) {
    if (this.item) this.ask("label.change", { label_id: this.chosen, ...what });
  }

  /** @param {"label.undo" | "label.redo"} type */
  step(type) {
    if (this.item) this.ask(type, { label_id: this.chosen });
  }

  async askName() {
    const name = this.item && await askName("Rename label", this.item.name);
    if (name) this.change({ name });
  }

  async remove() {
    const { item } = this;
    if (!item || !await confirm(`Delete ‘${item.name}’?`, "The structure that was made of it stays.", "Delete")) return;
    const fields = { label_id: item.id };
    noteDone(this.connection.request("label.delete", fields), "Label deleted.",
      { label: "Restore", run: () => this.connection.send("label.restore", fields) });
  }

  /**
   * @template {"label.new" | "label.change" | "label.undo" | "label.redo"} T
   * @param {T} type
   * @param {any} fields
   */
  ask(type, fields) {
    this.connection.request(/** @type {any} */ (type), fields).catch((error) => note(error.message, { error: true }));
  }

  async makeSurface() {
    this.surface.disabled = true;
    try {
      /** @type {JobPublic} */
      const job = await send(`/api/v1/labels/${encodeURIComponent(this.chosen)}/surface`, {});
      this.begun.add(job.id);
      this.jobs.watch(job);
    } catch (error) {
      this.surface.disabled = false;
      note(error instanceof Error ? error.message : String(error), { error: true });
    }
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const typing = event.target instanceof HTMLInputElement && event.target.type !== "range";
    if (!(event.ctrlKey || event.metaKey) || typing || event.repeat || !paintBrush.label || document.querySelector("dialog[open]")) return;
    const letter = letterOf(event);
    const again = letter === "Y" || (letter === "Z" && event.shiftKey);
    if (!again && letter !== "Z") return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (again ? this.item?.can_redo : this.item?.can_undo) this.step(again ? "label.redo" : "label.undo");
  }
}
