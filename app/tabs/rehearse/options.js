// What else holds the tool: the options of a rehearsal, where its remote centre is, and what the dry run makes of them.
import { fillOptions, h, group, keyed, whenChanged } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { say } from "/static/js/said.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { CentreSection, LengthSection, OptionView, OptionsSection, ViewModel } from "/static/js/types.js" */

const MM = "mm"; // of a place that is no path point
const ENTRY = "entry";
const STEP_MM = 0.5;
/** @typedef {{ name: string, id: string, label: string, spoken: string, mm: number }} Length */
/** @type {Length[]} mm: of one that is switched on first */
const LENGTHS = [
  { name: "tube_mm", id: "tube", label: "Radius", spoken: "Radius of the tube in mm", mm: 2 },
  { name: "stop_mm", id: "stop", label: "Past the end", spoken: "Depth stop in mm past the end of the path", mm: 2 },
];

/** The length of an option that has one. */
class LengthField {
  /**
   * @param {Length} length
   * @param {() => void} send
   */
  constructor({ id, label, spoken, mm }, send) {
    this.shown = h("span", { class: "number" });
    /** @type {HTMLInputElement} */
    this.input = h("input", { type: "range", id: `${id}-mm`, value: mm, "aria-label": spoken, oninput: () => this.show(this.mm), onchange: send });
    this.element = h("label", { class: "field", id, hidden: true }, h("span", { class: "field-label" }, h("span", {}, label), this.shown), this.input);
  }

  get mm() {
    return Number(this.input.value);
  }

  /**
   * @param {LengthSection | undefined} length
   * @param {boolean} frozen
   */
  render(length, frozen) {
    this.element.hidden = !length;
    if (!length) return;
    Object.assign(this.input, { min: String(length.lo), max: String(length.hi), step: String(length.step), disabled: frozen });
    if (this.input.matches(":active")) return;
    this.input.value = String(length.mm);
    this.show(length.mm);
  }

  /** @param {number} mm */
  show(mm) {
    this.shown.textContent = `${fixed(mm, 1)} mm`;
  }
}

export class OptionsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.options = h("div", { class: "fields", id: "options" });
    this.place = h("select", { id: "centre-place", onchange: () => this.choosePlace() });
    this.shownMm = h("span", { class: "number" });
    /** @type {HTMLInputElement} */
    this.mm = h("input", {
      type: "range", id: "centre-mm", min: 0, step: STEP_MM, "aria-label": "Remote centre in mm along the path",
      oninput: () => this.showMm(Number(this.mm.value)), onchange: () => this.send({ centre_mm: Number(this.mm.value) }),
    });
    this.trouble = h("p", { class: "words caution", role: "status", id: "centre-trouble", hidden: true });
    this.centre = h("div", { class: "field", id: "centre", hidden: true },
      h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, "Remote centre")), this.place),
      h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, "Along the path"), this.shownMm), this.mm),
      this.trouble);
    /** @type {Map<string, LengthField>} */
    this.lengths = new Map(LENGTHS.map((length) => [length.name, new LengthField(length, () => this.send(this.chosenPlace()))]));
    this.words = h("p", { class: "words caution", role: "status", id: "option-words", hidden: true });
    this.element = group("Limits", null, this.options, this.words);
  }

  /** @param {ViewModel} state */
  update({ options }) {
    this.changed([options], () => this.render(options));
  }

  /** @param {OptionsSection | undefined} options */
  render(options) {
    keyed(this.options, options?.items ?? [], (item) => item.name, (item) => this.option(item), fillOption);
    say(this.words, options?.words ?? "");
    this.words.hidden = !options?.words;
    this.centre.hidden = !options?.centre;
    const isFrozen = (/** @type {string} */ option) => Boolean(options?.items.find(({ name }) => name === option)?.refusal);
    if (options?.centre) this.renderCentre(options.centre, isFrozen("remote_centre"));
    for (const [name, field] of this.lengths) field.render(options?.lengths[name], isFrozen(name));
  }

  /**
   * @param {CentreSection} centre
   * @param {boolean} frozen
   */
  renderCentre(centre, frozen) {
    fillOptions(this.place, [...centre.choices, { value: MM, label: "A place in between" }].map(({ value, label }) => [value, label]));
    this.place.value = centre.chosen;
    this.place.disabled = this.mm.disabled = frozen;
    this.mm.max = String(centre.length_mm);
    if (!this.mm.matches(":active") && centre.at_mm !== null) {
      this.mm.value = String(centre.at_mm);
      this.showMm(centre.at_mm);
    }
    say(this.trouble, centre.trouble);
    this.trouble.hidden = !centre.trouble;
  }

  /** @param {number} at */
  showMm(at) {
    this.shownMm.textContent = `${fixed(at, 1)} mm`;
  }

  choosePlace() {
    const { value } = this.place;
    if (value === MM) this.send({ centre_mm: Number(this.mm.value) });
    else this.send(value === ENTRY ? {} : { centre_point: value });
  }

  /**
   * @param {OptionView} item
   * @returns {Row<OptionView>}
   */
  option({ name, label }) {
    const box = h("input", { type: "checkbox", "data-option": name, "aria-describedby": `option-${name}`, onchange: () => this.send(this.chosenPlace()) });
    const element = h("div", { class: "field" }, h("label", { class: "check" }, box, label), h("p", { class: "words", id: `option-${name}` }),
      name === "remote_centre" ? this.centre : this.lengths.get(name)?.element ?? null);
    return Object.assign(element, { item: /** @type {any} */ (null) }); // `keyed` puts it there
  }

  /** The place that is in force, as a command says it. */
  chosenPlace() {
    const { options } = this.connection.state;
    if (!options?.centre) return {};
    const { chosen, at_mm: at } = options.centre;
    if (chosen === MM) return at === null ? {} : { centre_mm: at };
    return chosen === ENTRY ? {} : { centre_point: chosen };
  }

  /** @param {{ centre_point?: string, centre_mm?: number }} place */
  send(place) {
    const on = (/** @type {string} */ name) => Boolean(this.options.querySelector(`[data-option="${name}"]:checked`));
    const length = (/** @type {string} */ name) => (on(name) ? this.lengths.get(name)?.mm ?? null : null);
    const wanted = { soft_tissue: on("soft_tissue"), remote_centre: on("remote_centre"), speed_limit: on("speed_limit") };
    this.connection.send("rehearsal.options", { ...wanted, tube_mm: length("tube_mm"), stop_mm: length("stop_mm"), ...place });
  }
}

/**
 * @param {HTMLElement} element
 * @param {OptionView} item
 */
function fillOption(element, item) {
  const box = element.querySelector("input");
  const words = element.querySelector("p");
  if (!box || !words) return;
  box.checked = item.on;
  box.disabled = item.refusal !== "";
  say(words, item.refusal || item.words);
}
