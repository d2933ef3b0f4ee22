// Contours by hand: those of the pathway in a list, and the chosen one's place and radius; it is also dragged in 3D.
import { fixed } from "/static/js/format.js";
import { h } from "/static/js/dom.js";
import { numberOf } from "/static/js/fields.js";
import { note } from "/static/js/dialogs.js";
import { rovingRows } from "/static/js/roving.js";
import { readPlace, threeIn } from "/static/js/typed-place.js";
import { draw, html, nothing, repeat, said, unlessFocused } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ContourList, ContourView, RouteSection } from "/static/js/types.js" */

const RADII_HELP = "One radius, or three and more around the centre.";

export class ContourPart {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "fields" });
    this.roving = rovingRows(this.element);
    this.addAt = ""; // what is typed where another one is to be
  }

  /** What the folded part says of itself. @param {ContourList | undefined} list */
  static line(list) {
    const beyond = list?.items.some((one) => one.by_hand && (one.behind_mm ?? 0) > 1);
    const words = list?.by_hand ? `${list.by_hand} by hand` : "";
    return { words, mark: /** @type {"caution" | ""} */ (beyond ? "caution" : "") };
  }

  /**
   * @param {ContourList | undefined} list
   * @param {RouteSection | null | undefined} route
   */
  update(list, route) {
    if (!list || !route) {
      draw(this.element, html``);
      return;
    }
    const chosen = list.chosen === null ? null : list.items[list.chosen];
    draw(this.element, html`
      ${list.words ? html`<p class="words caution" id="contour-words">${said(list.words)}</p>` : nothing}
      ${list.items.length ? nothing : html`<p class="words">Contours come with the pathway.</p>`}
      <ul class="list plain-rows contours" id="contours" aria-label="Contours" ?hidden=${!list.items.length}>
        ${repeat(list.items, ({ at_mm }) => at_mm, (one, index) => this.row(one, index === list.chosen))}</ul>
      ${chosen && list.chosen !== null ? this.editor(chosen, route, list.chosen === 0 || list.chosen === list.items.length - 1) : nothing}
      <div class="buttons even" ?hidden=${!list.items.length}>
        <input type="text" inputmode="decimal" id="contour-at" aria-label="New contour at, mm" placeholder="At, mm" ?disabled=${route.locked} .value=${unlessFocused(this.addAt)} @change=${this.typedAt}>
        <button type="button" id="add-contour" data-operation="route.contour.add" ?disabled=${route.locked} @click=${this.add}>Add</button>
        <button type="button" id="fitted-again" data-operation="route.contour.clear" title="Take back all by hand." ?disabled=${route.locked || !list.by_hand} @click=${() => this.connection.send("route.contour.clear")}>Fitted again</button>
      </div>`);
    this.roving.update();
  }

  /**
   * @param {ContourView} one
   * @param {boolean} chosen
   */
  row(one, chosen) {
    const behind = one.behind_mm !== null && one.behind_mm > 1 ? ` · ${fixed(one.behind_mm, 1)} mm behind wall` : "";
    const kind = one.by_hand ? (one.radii_mm.length > 1 ? "polar, by hand" : "by hand") : "";
    return html`<li class="row" aria-current=${String(chosen)}><button type="button" class="row-main" @click=${() => this.choose(chosen ? null : one.at_mm)}
      ><span class="number">${fixed(one.at_mm, 0)} mm</span><span class="row-sub">radius ${radiusWords(one)}${kind ? ` · ${kind}` : ""}${one.by_hand ? behind : ""}</span></button></li>`;
  }

  /**
   * @param {ContourView} one
   * @param {RouteSection} route
   * @param {boolean} end the first or the last, which stays where it is
   */
  editor(one, route, end) {
    const { at_mm } = one;
    const resize = (/** @type {Event} */ { currentTarget }) => {
      const radii_mm = /** @type {HTMLInputElement} */ (currentTarget).value.split(/[;\s]+/u).filter(Boolean).map(numberOf);
      this.connection.send("route.contour.resize", { at_mm, radii_mm });
    };
    const move = (/** @type {Event} */ { currentTarget }) => {
      const texts = threeIn(/** @type {HTMLInputElement} */ (currentTarget).value), to = texts && readPlace(texts).place;
      if (to) this.connection.send("route.contour.move", { at_mm, to });
      else note("A centre is three numbers: x y z.", { error: true });
    };
    const centre = one.centre.map((value) => value.toFixed(1)).join(" ");
    return html`<div class="fields two" id="contour-editor">
      <label class="field"><span class="field-label">Radius, mm</span><input type="text" id="contour-radius" data-operation="route.contour.resize" title=${RADII_HELP} ?disabled=${route.locked}
        .value=${unlessFocused(one.radii_mm.join(" "))} @change=${resize}></label>
      <label class="field"><span class="field-label">Centre, LPS mm</span><input type="text" id="contour-centre" data-operation="route.contour.move" title=${end ? "It stays at the end of the way." : "Or drag it in 3D."} ?disabled=${route.locked || end}
        .value=${unlessFocused(centre)} @change=${move}></label></div>
      <div class="buttons"><button type="button" id="remove-contour" data-operation="route.contour.remove" ?disabled=${route.locked || end} @click=${() => this.connection.send("route.contour.remove", { at_mm })}>Remove contour</button></div>`;
  }

  /** @param {number | null} at_mm */
  choose(at_mm) {
    this.connection.send("route.contour.choose", { at_mm });
  }

  /** A place along the way that was clicked in the plot: the contour there is chosen, another one may come there. @param {number} at_mm */
  picked(at_mm) {
    this.addAt = at_mm.toFixed(0);
    this.choose(Math.max(at_mm, 0));
  }

  /** The part is folded: nothing is edited. */
  folded() {
    if ((this.connection.state.route_contours?.chosen ?? null) !== null) this.choose(null);
  }

  typedAt = (/** @type {Event} */ { currentTarget }) => {
    this.addAt = /** @type {HTMLInputElement} */ (currentTarget).value;
  };

  add = () => {
    const at_mm = numberOf(this.addAt);
    if (Number.isFinite(at_mm)) this.connection.send("route.contour.add", { at_mm });
    else note("Say where: so many mm along the way.", { error: true });
  };
}

/** @param {ContourView} one */
function radiusWords({ radii_mm }) {
  const [low, high] = [Math.min(...radii_mm), Math.max(...radii_mm)];
  return radii_mm.length > 1 ? `${fixed(low, 1)} to ${fixed(high, 1)} mm` : `${fixed(low, 1)} mm`;
}
