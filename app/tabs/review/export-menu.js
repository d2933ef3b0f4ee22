// The open run as a file for other programs.
import { note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { Popover } from "/static/js/popover.js";
import { saveFrom } from "/static/js/rest.js";
import { Roving } from "/static/js/roving.js";
import { draw, html } from "/static/js/template.js";

const FORMATS = [
  ["csv", "Table (CSV)", "Every step, with units"],
  ["about.json", "About the table", "Versions, frame, what its numbers mean"],
  ["parquet", "Table (Parquet)", "The same, smaller and bit by bit"],
  ["mcap", "Foxglove (MCAP)", "Head, plan and moving tool in 3D"],
  ["py", "Python script", "Sets up this scene, replays the run"],
];

export class ExportMenu {
  constructor() {
    /** @type {string | null} */
    this.run = null;
    this.formats = FORMATS.map(([format]) => format);
    this.saving = "";
    this.button = h("button", { type: "button", id: "export-run" }, "Export");
    this.element = h("div", { class: "export-menu", id: "export-menu", role: "dialog", "aria-label": "Export of the run" });
    this.popover = new Popover(this.element, { button: this.button, sides: ["right", "above", "below"] });
    this.roving = new Roving(this.element, "button", { axis: "both" });
    this.render();
  }

  /**
   * @param {string | null} run id of the open one
   * @param {string[]} formats that it is exported in
   */
  of(run, formats) {
    this.run = run;
    if (formats.join() === this.formats.join()) return;
    this.formats = formats;
    this.render();
  }

  render() {
    draw(this.element, html`<ul class="exports">${FORMATS.filter(([format]) => this.formats.includes(format)).map(([format, name, words]) => html`<li class="export"><button type="button" data-format=${format} aria-busy=${String(this.saving === format)}
      @click=${() => this.save(format)}>${this.saving === format ? "Being made …" : name}</button><span class="row-sub" aria-hidden="true">${words}</span></li>`)}</ul>`);
    this.roving.update();
  }

  /** @param {string} format */
  async save(format) {
    const { run } = this;
    if (!run || this.saving) return;
    this.turn(format);
    try {
      note(`Downloading ${await saveFrom(`/api/v1/runs/${encodeURIComponent(run)}/export?format=${format}`)}`);
    } catch (error) { // such as an extra that is not installed
      note(error instanceof Error ? error.message : String(error), { error: true });
    } finally {
      this.turn("");
    }
  }

  /** @param {string} format that is being made, '' for none */
  turn(format) {
    this.saving = format;
    this.render();
  }
}
