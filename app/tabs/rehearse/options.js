// What else holds the tool: the options of a rehearsal, where its remote centre is, and what the dry run makes of them.
import { fillOptions, h, group, keyed, whenChanged } from "/static/js/dom.js";
import { fixed } from "/static/js/format.js";
import { say } from "/static/js/said.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { CentreSection, OptionView, OptionsSection, TubeSection, ViewModel } from "/static/js/types.js" */

const MM = "mm"; // of a place that is no path point
const ENTRY = "entry";
const STEP_MM = 0.5;
const TUBE_MM = 2; // radius of a tube that is switched on first

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
    this.shownTube = h("span", { class: "number" });
    /** @type {HTMLInputElement} */
    this.tube = h("input", {
      type: "range", id: "tube-mm", value: TUBE_MM, "aria-label": "Radius of the tube in mm",
      oninput: () => this.showTube(Number(this.tube.value)), onchange: () => this.send(this.chosenPlace()),
    });
    this.tubeField = h("label", { class: "field", id: "tube", hidden: true }, h("span", { class: "field-label" }, h("span", {}, "Radius"), this.shownTube), this.tube);
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
    this.tubeField.hidden = !options?.tube;
    const isFrozen = (/** @type {string} */ option) => Boolean(options?.items.find(({ name }) => name === option)?.refusal);
    if (options?.centre) this.renderCentre(options.centre, isFrozen("remote_centre"));
    if (options?.tube) this.renderTube(options.tube, isFrozen("tube_mm"));
  }

  /**
   * @param {TubeSection} tube
   * @param {boolean} frozen
   */
  renderTube({ radius_mm: radius, lo, hi, step }, frozen) {
    Object.assign(this.tube, { min: String(lo), max: String(hi), step: String(step), disabled: frozen });
    if (this.tube.matches(":active")) return;
    this.tube.value = String(radius);
    this.showTube(radius);
  }

  /** @param {number} radius */
  showTube(radius) {
    this.shownTube.textContent = `${fixed(radius, 1)} mm`;
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
      name === "remote_centre" ? this.centre : name === "tube_mm" ? this.tubeField : null);
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
    const wanted = { soft_tissue: on("soft_tissue"), remote_centre: on("remote_centre"), speed_limit: on("speed_limit"), tube_mm: on("tube_mm") ? Number(this.tube.value) : null };
    this.connection.send("rehearsal.options", { ...wanted, ...place });
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
