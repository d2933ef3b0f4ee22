// The points of the path, or the targets: a table whose rows are one tab stop, and the tools of the selected one below it.
import { h } from "/static/js/dom.js";
import { askName } from "/static/js/dialogs.js";
import { Roving } from "/static/js/roving.js";
import { sideWords } from "/static/js/slices/place-words.js";
import { draw, html, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ItemEntry, PlanSection } from "/static/js/types.js" */

const AXES = [["R/L", "Right or left, mm"], ["A/P", "Front or back, mm"], ["S/I", "Up or down, mm"]];

export class ItemsTable {
  /**
   * @param {Connection} connection
   * @param {"point" | "target"} kind
   * @param {HTMLElement} about what else there is to say of the selected one, hidden by itself where there is nothing
   */
  constructor(connection, kind, about) {
    this.connection = connection;
    this.kind = kind;
    this.about = about;
    this.element = h("div", { class: "items" });
    this.roving = new Roving(this.element, "tr[data-item]", { first: "[aria-selected=true]" });
  }

  /** @param {PlanSection | null | undefined} plan */
  update(plan) {
    const items = (this.kind === "point" ? plan?.points : plan?.targets) ?? [];
    const [name, words] = this.kind === "point" ? ["Point", "Points of the path, in mm"] : ["Target", "Targets, in mm"];
    const selected = items.some(({ id }) => id === plan?.selected);
    this.element.hidden = !items.length;
    draw(this.element, html`<table class="points" id=${`${this.kind}s-table`} aria-label=${words}>
        <thead><tr><th scope="col">${name}</th>${AXES.map(([axis, title]) => html`<th scope="col" title=${title}>${axis}</th>`)}</tr></thead>
        <tbody>${repeat(items, ({ id }) => id, (item) => this.row(item, plan))}</tbody>
      </table>
      ${selected ? nothing : html`<div hidden>${this.kind === "point" ? this.tools(undefined, plan) : nothing}${this.about}</div>`}`);
    this.roving.update();
  }

  /**
   * @param {ItemEntry} item
   * @param {PlanSection | null | undefined} plan
   */
  row(item, plan) {
    const selected = item.id === plan?.selected;
    return html`<tr data-item=${item.id} aria-selected=${String(selected)} title="Double-click to rename" @click=${() => this.send("item.select", item)}
        @dblclick=${() => this.rename(item)} @keydown=${(/** @type {KeyboardEvent} */ event) => this.key(event, item)}>
        <td title=${item.label}><span class=${this.kind === "target" ? "dot target" : "dot"}></span><span>${item.label}</span></td>
        ${item.position.map((value, axis) => html`<td>${sideWords(value, axis)}</td>`)}
      </tr>${selected ? html`<tr class="of-selected" aria-selected="true"><td colspan="4"><div class="fields">${this.tools(item, plan)}${this.about}</div></td></tr>` : nothing}`;
  }

  /**
   * @param {ItemEntry | undefined} item the selected one; its tools alone have the ids that keys go by
   * @param {PlanSection | null | undefined} plan
   */
  tools(item, plan) {
    const frozen = !item || Boolean(plan?.locked);
    const id = (/** @type {string} */ name) => (item ? name : nothing);
    return html`<div class="buttons even">
      ${this.kind === "point" ? html`<button type="button" id=${id("insert")} data-command="point.insert_after" title="A point half way" ?disabled=${frozen || item === plan?.points.at(-1)}
        @click=${() => this.send("point.insert_after", item)}>Insert after</button>` : nothing}
      <button type="button" id=${id("rename-item")} data-operation="item.rename" title="F2" ?disabled=${frozen} @click=${() => this.rename(item)}>Rename</button>
      <button type="button" id=${id("delete-item")} data-operation="item.delete" title="Del" ?disabled=${frozen} @click=${() => this.remove(item)}>Delete</button></div>`;
  }

  /**
   * @param {"item.select" | "item.delete" | "point.insert_after"} type
   * @param {ItemEntry | undefined} item
   */
  send(type, item) {
    if (item) this.connection.send(type, { item_id: item.id });
  }

  /** @param {ItemEntry | undefined} item */
  async rename(item) {
    const label = item && await askName(`Rename ${item.label}`, item.label);
    if (item && label) this.connection.send("item.rename", { item_id: item.id, label });
  }

  /** @param {ItemEntry | undefined} item */
  remove(item) {
    /** @type {HTMLElement | null} */ (this.element.querySelector(`[data-item="${item?.id}"]`))?.focus(); // which hands it to the next row
    this.send("item.delete", item);
  }

  /**
   * @param {KeyboardEvent} event
   * @param {ItemEntry} item
   */
  key(event, item) {
    const { plan } = this.connection.state;
    if (event.key === "Enter") this.send("item.select", item);
    if (event.key === "F2") this.rename(item);
    if (["Delete", "Backspace"].includes(event.key) && !plan?.locked && !plan?.ghost) this.send("item.delete", item);
  }
}
