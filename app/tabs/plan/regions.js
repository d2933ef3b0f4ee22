// Protected structures and bone to be removed: drawn by clicks, listed, and changed.
import { h, whenChanged } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { field, heldNumber, ownNumber } from "/static/js/fields.js";
import { draw, html, iconTool, nothing, repeat, said } from "/static/js/template.js";
import { RegionFields } from "./region-fields.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, DrawingView, RegionView, RegionsSection, RemovedBoneSection, ViewModel } from "/static/js/types.js" */
/** @typedef {RegionView["purpose"]} Purpose */
/** @typedef {Commands["region.draw"]["kind"]} Kind */
/** @typedef {NonNullable<Commands["region.draw"]["free_side"]>} Side */

/** @type {[Side, string][]} */
const SIDES = [["I", "below"], ["S", "above"], ["A", "in front"], ["P", "behind"], ["R", "to the right"], ["L", "to the left"]];
/** @type {Record<Purpose, { prefix: string, title: string, none: string, kinds: [Kind, string][] }>} prefix: of the ids */
const PURPOSES = {
  spare: {
    prefix: "protect", title: "Protected structures", none: "The tool keeps away from these.",
    kinds: [["sphere", "Sphere"], ["capsules", "Chain of points"], ["box", "Box"], ["half_space", "Half-space"], ["patch", "Patch of bone"]],
  },
  remove: {
    prefix: "remove", title: "Bone removal", none: "Walls to open first.",
    kinds: [["sphere", "Sphere"], ["capsule", "Capsule"], ["box", "Box"]],
  },
};

export class RegionsGroup {
  /**
   * @param {Connection} connection
   * @param {Purpose} purpose
   */
  constructor(connection, purpose) {
    this.connection = connection;
    this.purpose = purpose;
    this.words = PURPOSES[purpose];
    this.changed = whenChanged();
    /** @type {Kind} of what is drawn next */
    this.kind = "sphere";
    /** @type {Side} on which the tool stays */
    this.side = "I";
    this.size = ownNumber(`${this.words.prefix}-size`, 0.1, 200, 0.5, 3);
    this.sizeField = field("Radius", "mm", this.size);
    this.fields = new RegionFields(connection, this.words.prefix);
    this.body = h("div", { class: "fields" });
    this.element = h("div", { class: "group" }, h("div", { class: "group-head" }, h("h2", {}, this.words.title)), this.body);
  }

  /** @param {ViewModel} state */
  update({ regions, removed_bone: removed }) {
    this.changed([regions, Boolean(regions), removed, this.kind], () => this.render(regions ?? null, removed ?? null));
  }

  /**
   * @param {RegionsSection | null} regions
   * @param {RemovedBoneSection | null} removed
   */
  render(regions, removed) {
    const items = (regions?.items ?? []).filter((item) => item.purpose === this.purpose);
    const selected = items.find((item) => item.id === regions?.selected);
    const drawing = regions?.drawing?.purpose === this.purpose ? regions.drawing : null;
    const frozen = !regions || regions.locked;
    this.size.disabled = frozen || drawing !== null;
    const label = this.sizeField.querySelector("span span");
    if (label) label.textContent = this.kind === "box" ? "Edge" : "Radius";
    this.fields.render(selected, frozen);
    draw(this.body, html`
      ${this.structures(regions, frozen)}
      ${items.length ? nothing : html`<p class="empty">${this.words.none}</p>`}
      <ul class="list two-lines" id="${this.words.prefix}-list">${repeat(items, ({ id }) => id, (item) => this.row(item, removed, item === selected))}</ul>
      ${this.purpose === "remove" && items.length ? html`<p class="words" id="remove-total" role="status">${removed ? removed.words : "Counting bone …"}</p>` : nothing}
      ${this.drawing(drawing, frozen)}`);
  }

  /**
   * A row, with the fields of the region below it where it is the selected one.
   * @param {RegionView} item
   * @param {RemovedBoneSection | null} removed
   * @param {boolean} selected
   */
  row(item, removed, selected) {
    const send = (/** @type {"region.select" | "region.delete"} */ type) => this.connection.send(type, { region_id: item.id });
    const bone = removed?.items.find(({ id }) => id === item.id)?.words;
    const pressed = (/** @type {KeyboardEvent} */ event) => {
      const upon = /** @type {Element} */ (event.target).matches(".row-main, .row-tools button"); // and not in a field below
      if (event.key !== "Delete" || !upon || this.connection.state.regions?.locked) return;
      event.preventDefault();
      event.stopPropagation();
      send("region.delete");
    };
    return html`<li class=${selected ? "row with-fields" : "row"} aria-current=${String(selected)} @keydown=${pressed}>
      <button type="button" class="row-main" @click=${() => send("region.select")}><i class=${this.purpose === "spare" ? "swatch" : "swatch net"}
        style=${`background-color: ${item.colour}`}></i><span title=${item.name}>${item.name}</span><span class="row-sub">${[item.sub, bone].filter(Boolean).join(" · ")}</span></button>
      <div class="row-tools">${iconTool("trash", "Delete", () => send("region.delete"), { operation: "region.delete" })}</div>
      ${selected ? this.fields.element : nothing}
    </li>`;
  }

  /**
   * The structures of the head, any of which is protected by choosing it.
   * @param {RegionsSection | null} regions
   * @param {boolean} frozen
   */
  structures(regions, frozen) {
    const known = this.purpose === "spare" ? regions?.structures ?? [] : [];
    const choose = (/** @type {Event} */ { currentTarget }) => {
      const list = /** @type {HTMLSelectElement} */ (currentTarget);
      const structure = list.value;
      list.value = "";
      if (structure) this.connection.send("region.structure", { structure });
    };
    return known.length ? html`<select id="protect-structure" data-operation="region.structure" aria-label="Structure of this head" ?disabled=${frozen} @change=${choose}>
      <option value="">Protect a structure …</option>${repeat(known, ({ id }) => id, ({ id, name }) => html`<option value=${id}>${name}</option>`)}</select>` : nothing;
  }

  /**
   * What is drawn next, and how.
   * @param {DrawingView | null} drawing that has begun
   * @param {boolean} frozen
   */
  drawing(drawing, frozen) {
    const { prefix, kinds } = this.words, held = frozen || drawing !== null;
    const option = (/** @type {string} */ chosen) => (/** @type {[string, string]} */ [value, words]) => html`<option value=${value} ?selected=${value === chosen}>${words}</option>`;
    const chooseKind = (/** @type {Event} */ { currentTarget }) => {
      this.kind = /** @type {Kind} */ (/** @type {HTMLSelectElement} */ (currentTarget).value);
      this.update(this.connection.state);
    };
    const chooseSide = (/** @type {Event} */ { currentTarget }) => { this.side = /** @type {Side} */ (/** @type {HTMLSelectElement} */ (currentTarget).value); };
    const places = drawing?.places.length ?? 0;
    return html`<div class="buttons even">
        <label class="field"><span class="field-label">Shape</span><select id="${prefix}-kind" ?disabled=${held} @change=${chooseKind}>${kinds.map(option(this.kind))}</select></label>
        ${this.kind === "half_space" ? html`<label class="field"><span class="field-label">Tool side</span><select id="${prefix}-side" ?disabled=${held} @change=${chooseSide}>${SIDES.map(option(this.side))}</select></label>` : this.sizeField}
      </div>
      <div class="buttons even">
        <button type="button" id="${prefix}-draw" ?disabled=${frozen} title=${drawing ? "Esc" : "The next click places it"} @click=${() => this.draw()}>${drawing ? "Cancel" : "Draw"}</button>
        ${drawing?.kind === "capsules" ? html`<button type="button" class="primary" id="${prefix}-done" title="Enter" ?disabled=${!places} @click=${() => this.connection.send("region.done")}>Done</button>` : nothing}
      </div>
      <p class="words" role="status" ?hidden=${!drawing}>${drawing ? said(`${drawing.words}${places ? ` ${count(places, "place", "places")} so far.` : ""}`) : nothing}</p>`;
  }

  draw() {
    if (this.connection.state.regions?.drawing) {
      this.connection.send("region.cancel");
      return;
    }
    const size = Number(heldNumber(this.size));
    const sizes_mm = this.kind === "box" ? [size / 2, size / 2, size / 2] : [size];
    this.connection.send("region.draw", { purpose: this.purpose, kind: this.kind, sizes_mm, free_side: this.side });
  }
}
