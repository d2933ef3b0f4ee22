// The paths of a plan, of which one is chosen.
import { h, whenChanged } from "/static/js/dom.js";
import { askName, noteEdit } from "/static/js/dialogs.js";
import { count } from "/static/js/format.js";
import { draw, html, iconTool, nameRow, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { PathView, PathsSection, ViewModel } from "/static/js/types.js" */

export class PathsList {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields part" });
  }

  /** @param {ViewModel} state */
  update({ paths }) {
    this.changed([paths, Boolean(paths)], () => draw(this.element, this.list(paths)));
  }

  /** @param {PathsSection | null | undefined} paths */
  list(paths) {
    const items = paths?.items ?? [];
    return html`<div class="group-head" ?hidden=${items.length < 2}><h3>Paths</h3></div>
      <ul class=${items.length > 1 ? "list two-lines plain-rows" : "list two-lines plain-rows single"} id="paths">${repeat(items, ({ id }) => id, (path) => this.row(path, paths))}</ul>`;
  }

  /**
   * @param {PathView} path
   * @param {PathsSection | null | undefined} paths
   */
  row(path, paths) {
    const locked = Boolean(paths?.locked);
    const send = (/** @type {"path.choose" | "path.duplicate"} */ type) => this.connection.send(type, { path_id: path.id });
    const tools = [
      iconTool("pencil", "Rename", () => this.rename(path), { operation: "path.rename", off: locked }),
      iconTool("copy", "Duplicate", () => send("path.duplicate"), { operation: "path.duplicate", off: locked }),
      iconTool("trash", "Delete", () => this.remove(path), { operation: "path.delete", off: locked || (paths?.items.length ?? 0) < 2 }),
    ];
    return nameRow(path, `${count(path.points, "point", "points")} · ${path.tool}`, () => send("path.choose"), tools, path.id === paths?.chosen);
  }

  /** @param {PathView} path */
  async rename(path) {
    const name = await askName(`Rename ${path.name}`, path.name);
    if (name) this.connection.send("path.rename", { path_id: path.id, name });
  }

  /** @param {PathView} path */
  remove(path) {
    noteEdit(this.connection, "plan", this.connection.request("path.delete", { path_id: path.id }), `${path.name} was deleted.`);
  }
}
