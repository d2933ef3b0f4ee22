// Named versions of a plan: saved, compared with the plan as it is, and gone back to.
import { askName, noteDone, noteEdit } from "/static/js/dialogs.js";
import { h, whenChanged } from "/static/js/dom.js";
import { whenExactly } from "/static/js/format.js";
import { draw, html, iconTool, nameRow, nothing, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { VersionView, VersionsSection, ViewModel } from "/static/js/types.js" */

export class Versions {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.element = h("div", { class: "fields" });
  }

  /** @param {ViewModel} state */
  update({ versions }) {
    this.changed([versions, Boolean(versions)], () => draw(this.element, this.list(versions)));
  }

  /** @param {VersionsSection | null | undefined} versions */
  list(versions) {
    const items = versions?.items ?? [];
    return html`<button type="button" class="wide" id="save-version" data-operation="version.save" ?disabled=${!versions} @click=${() => this.save()}>Save version</button>
      <ul class="list two-lines plain-rows" id="versions" ?hidden=${!items.length}>${repeat(items, ({ id }) => id, (version) => this.row(version, versions))}</ul>
      ${items.length ? nothing : html`<p class="empty">A version keeps the plan as it is.</p>`}
      ${this.changes(versions)}`;
  }

  /**
   * What changed since the version that is compared, and the way back to it.
   * @param {VersionsSection | null | undefined} versions
   */
  changes(versions) {
    const { compared = null, changes = [], differs = false, locked = false } = versions ?? {};
    const words = changes.length ? changes : ["No changes since then."];
    return html`<ul class="changes" id="version-changes" ?hidden=${!compared}>${words.map((text) => html`<li>${text}</li>`)}</ul>
      <button type="button" class="wide" id="go-back" data-operation="version.go_back" ?hidden=${!compared} ?disabled=${locked || !differs}
        title=${changes.length && !differs ? "Only settings differ" : nothing} @click=${() => this.goBack()}>Go back</button>`;
  }

  /**
   * @param {VersionView} version
   * @param {VersionsSection | null | undefined} versions
   */
  row(version, versions) {
    const tools = [
      iconTool("pencil", "Rename", () => this.rename(version), { operation: "version.rename" }),
      iconTool("trash", "Delete", () => this.remove(version), { operation: "version.delete" }),
    ];
    const compare = () => this.connection.send("version.compare", { version_id: version.id });
    return nameRow(version, whenExactly(version.created), compare, tools, version.id === versions?.compared);
  }

  async save() {
    const name = await askName("Save this version of the plan", `Version ${(this.connection.state.versions?.items.length ?? 0) + 1}`);
    if (name) this.connection.send("version.save", { name });
  }

  /** @param {VersionView} version */
  async rename(version) {
    const name = await askName(`Rename ${version.name}`, version.name);
    if (name) this.connection.send("version.rename", { version_id: version.id, name });
  }

  /** @param {VersionView} version */
  remove(version) {
    const fields = { version_id: version.id };
    noteDone(this.connection.request("version.delete", fields), `Version ‘${version.name}’ was deleted.`,
      { label: "Restore", run: () => this.connection.send("version.restore", fields) });
  }

  goBack() {
    const compared = this.connection.state.versions?.compared;
    if (!compared) return;
    noteEdit(this.connection, "plan", this.connection.request("version.go_back", { version_id: compared }), "Back to this version.");
  }
}
