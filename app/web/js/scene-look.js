// How the scene is looked at: the standard views, and the popover ‘Layers’ with bone, skin, cut and slices.
import { byId, h } from "./dom.js";
import { JobLine } from "./job-line.js";
import { jobWatch } from "./jobs.js";
import { Popover } from "./popover.js";
import { Roving } from "./roving.js";
import { draw, html, live, nothing, unlessFocused } from "./template.js";

/** @import { Connection } from "./connection.js" */
/** @import { Entry } from "./palette.js" */
/** @import { WindowSwitch } from "./scene-layer/tool-window.js" */
/** @import { ViewFollower } from "./scene-layer/view-follower.js" */
/** @import { Commands, JobPublic, ViewModel, ViewSection } from "./types.js" */

/** @typedef {Commands["view.set"]} Look */
/** @typedef {Commands["view.camera"]["view"]} View */

/** @type {[View, string][]} */
const VIEWS = [["anterior", "Front"], ["left", "Left"], ["right", "Right"], ["superior", "Top"], ["oblique", "Oblique"], ["nose", "Nose"]];
/** @type {[NonNullable<Look["cut"]>, string][]} */
const CUTS = [["whole", "Whole"], ["left", "Cut left half"], ["right", "Cut right half"]];
/** @type {[NonNullable<Look["slices"]>, string][]} */
const SLICES = [["none", "No slices"], ["sagittal", "Sagittal CT"], ["coronal", "Coronal CT"], ["axial", "Axial CT"], ["all", "All three"]];

export class SceneLook {
  /**
   * @param {Connection} connection
   * @param {(view: View) => void} look turns the camera
   * @param {ViewFollower} follower
   * @param {WindowSwitch} window
   */
  constructor(connection, look, follower, window) {
    this.connection = connection;
    this.follower = follower;
    this.window = window;
    this.look = look;
    /** @type {ViewSection | null} as it is told, or asked for since */
    this.view = null;
    this.skinJob = new JobLine();
    this.toggle = h("button", { type: "button", id: "look-toggle", title: "Bone, skin, cut, CT slices" }, "Layers");
    this.views = h("div", { class: "tool-strip views", role: "toolbar", "aria-label": "Standard views" },
      VIEWS.map(([view, label]) => h("button", { type: "button", "data-view": view, onclick: () => look(view) }, label)), this.toggle);
    this.element = h("div", { class: "look", id: "look", role: "dialog", "aria-label": "Layers of the head" });
    this.caution = h("p", { class: "scene-caution", id: "skin-words", role: "status", hidden: true });
    this.popover = new Popover(this.element, { button: this.toggle, sides: ["below", "above"] });
    this.roving = new Roving(this.views, "button", { axis: "both" });
    this.roving.update();
    byId("view-tools").append(this.views, this.caution, this.element);
    jobWatch.addEventListener("change", () => this.followSkin());
  }

  /** The standard views and the layers, for the palette. @returns {Entry[]} */
  actions() {
    const { view } = this;
    if (!this.connection.state.case) return [];
    const layers = { group: "3D", name: "Layers: bone, skin, cut, slices", run: () => this.popover.show() };
    const views = VIEWS.map(([name, label]) => ({ group: "3D", name: `${label} view`, run: () => this.look(name) }));
    const cuts = CUTS.map(([cut, name]) => ({ group: "Layers", name, run: () => this.cut(cut) }));
    const skin = view?.skin.possible ? [{ group: "Layers", name: view.skin.shown ? "Hide the skin" : "Show the skin", run: () => this.send({ skin: !view.skin.shown }) }] : [];
    return [layers, ...views, ...cuts, ...skin];
  }

  /** @param {Look} look */
  send(look) {
    this.connection.send("view.set", look);
  }

  /** A cut shows the CT on its face, where there is one. @param {NonNullable<Look["cut"]>} cut */
  cut(cut) {
    this.send(this.connection.state.case?.has_volume ? { cut, slices: cut === "whole" ? "none" : "sagittal" } : { cut });
  }

  /** The skin of the open head is made once, when it is first shown. */
  async followSkin() {
    const job = jobWatch.items.find(({ kind, case_id: id }) => kind === "skin" && id === this.connection.state.case?.id);
    if (!job || job.id === this.skinJob.job) return;
    try {
      await this.skinJob.follow(/** @type {JobPublic} */ (job));
    } catch {
      // the section says why it could not be made
    }
  }

  /** @param {ViewModel} state */
  update({ view, case: open }) {
    if (!view) return;
    this.view = view;
    for (const button of this.views.querySelectorAll("button")) if (button.dataset.view === "nose") button.hidden = open?.sliced === false;
    const { words } = view.skin;
    if (this.caution.textContent !== words) this.caution.textContent = words;
    this.caution.hidden = !words;
    this.render(Boolean(open?.has_volume));
  }

  /** @param {boolean} slices whether there are some to show */
  render(slices = Boolean(this.connection.state.case?.has_volume)) {
    if (!this.view) return;
    const { opacity, skin, cut, slices: shown } = this.view;
    draw(this.element, html`
      <label class="field"><span class="field-label">${this.connection.state.case?.surface ?? "Bone"} <span class="number">${percent(opacity)}</span></span>
        <input type="range" id="bone-opacity" min="10" max="100" step="5" aria-label="Opacity of the surface, percent" .value=${unlessFocused(shareOf(opacity))} @input=${this.faded}></label>
      <div class="field" id="skin-field" ?hidden=${!skin.possible}>
        <div class="field-label"><label class="check"><input type="checkbox" id="skin" .checked=${live(skin.shown)} @change=${this.skinned}>Skin</label>
          <span class="number">${skin.shown ? percent(skin.opacity) : nothing}</span></div>
        <input type="range" id="skin-opacity" min="10" max="100" step="5" aria-label="Skin opacity, percent" ?hidden=${!skin.shown}
          .value=${unlessFocused(shareOf(skin.opacity))} @input=${this.skinFaded}>
        ${this.skinJob.element}
      </div>
      <label class="field"><span class="field-label">Cut</span><select id="cut" @change=${this.chosen}>${options(CUTS, cut)}</select></label>
      <label class="field" ?hidden=${!slices}><span class="field-label">CT slices in 3D</span>
        <select id="slices-in-scene" @change=${this.sliced}>${options(SLICES, shown)}</select></label>
      <label class="check" title="During a drive, 3D goes along with the tip"><input type="checkbox" id="follow-view" .checked=${live(this.follower.on)} @change=${this.followed}>Follow the tip</label>
      <label class="check" title="During a drive, bone before the tip gives way"><input type="checkbox" id="tool-window" .checked=${live(this.window.on)} @change=${this.opened}>Window to the tip</label>`);
  }

  opened = (/** @type {Event} */ { currentTarget }) => {
    this.window.set(/** @type {HTMLInputElement} */ (currentTarget).checked);
    this.render();
  };

  followed = (/** @type {Event} */ { currentTarget }) => {
    this.follower.set(/** @type {HTMLInputElement} */ (currentTarget).checked);
    this.render();
  };

  faded = (/** @type {Event} */ event) => {
    if (this.view) this.view = { ...this.view, opacity: shareIn(event) };
    this.render();
    this.send({ opacity: shareIn(event) });
  };

  skinFaded = (/** @type {Event} */ event) => {
    if (this.view) this.view = { ...this.view, skin: { ...this.view.skin, opacity: shareIn(event) } };
    this.render();
    this.send({ skin_opacity: shareIn(event) });
  };

  skinned = (/** @type {Event} */ { currentTarget }) => this.send({ skin: /** @type {HTMLInputElement} */ (currentTarget).checked });

  chosen = (/** @type {Event} */ { currentTarget }) => this.cut(/** @type {NonNullable<Look["cut"]>} */ (/** @type {HTMLSelectElement} */ (currentTarget).value));

  sliced = (/** @type {Event} */ { currentTarget }) => this.send({ slices: /** @type {Look["slices"]} */ (/** @type {HTMLSelectElement} */ (currentTarget).value) });
}

/**
 * @param {[string, string][]} choices
 * @param {string} chosen
 */
function options(choices, chosen) {
  return choices.map(([value, label]) => html`<option value=${value} .selected=${live(value === chosen)}>${label}</option>`);
}

/** @param {number} share 0 to 1 */
function shareOf(share) {
  return String(Math.round(share * 100));
}

/** @param {number} share 0 to 1 */
function percent(share) {
  return `${shareOf(share)} %`;
}

/** @param {Event} event of a slider in percent */
function shareIn({ currentTarget }) {
  return Number(/** @type {HTMLInputElement} */ (currentTarget).value) / 100;
}
