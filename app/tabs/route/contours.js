// Contours by hand: those of the pathway in a list, and the chosen one's place and radius; it is also dragged in 3D.
import { fixed } from "/static/js/format.js";
import { h, whenChanged } from "/static/js/dom.js";
import { complain, numberInput, numberOf, putBack, showNumber, showText, textInput, whyNoNumber } from "/static/js/fields.js";
import { rovingRows } from "/static/js/roving.js";
import { placeOf, placeWords } from "/static/js/slices/place-words.js";
import { draw, html, nothing, repeat, said } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ContourList, ContourView, RouteSection } from "/static/js/types.js" */

const RADII_HELP = "One radius, or three and more around the centre.";
const LEAST_MM = 0.5, MOST_MM = 150, MOST_RADII = 72, LONGEST_MM = 1e4; // that the planner takes

export class ContourPart {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "fields" });
    this.roving = rovingRows(this.element);
    this.at_mm = NaN; // of the chosen contour
    this.radii = textInput("contour-radius", whyNoRadii, (text) => this.connection.send("route.contour.resize", { at_mm: this.at_mm, radii_mm: radiiIn(text) }));
    this.centre = textInput("contour-centre", whyNoPlace, (text) => this.connection.send("route.contour.move", { at_mm: this.at_mm, to: placeOf(text) }));
    this.radii.dataset.operation = "route.contour.resize";
    this.centre.dataset.operation = "route.contour.move";
    this.at = numberInput("contour-at", 0, LONGEST_MM, 0, () => {}, () => {}); // where another one is to be
    for (const [input, operation] of /** @type {const} */ ([[this.radii, "resize"], [this.centre, "move"]])) input.dataset.operation = `route.contour.${operation}`;
    this.radii.title = RADII_HELP;
    for (const [name, words] of [["aria-label", "New contour at, mm"], ["placeholder", "At, mm"]]) this.at.setAttribute(name, words);
    this.changed = whenChanged();
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
    this.at.disabled = route.locked;
    draw(this.element, html`
      ${list.words ? html`<p class="words caution" id="contour-words">${said(list.words)}</p>` : nothing}
      ${list.items.length ? nothing : html`<p class="words">Contours come with the pathway.</p>`}
      <ul class="list plain-rows contours" id="contours" aria-label="Contours" ?hidden=${!list.items.length}>
        ${repeat(list.items, ({ at_mm }) => at_mm, (one, index) => this.row(one, index === list.chosen))}</ul>
      ${chosen && list.chosen !== null ? this.editor(chosen, route, list.chosen === 0 || list.chosen === list.items.length - 1) : nothing}
      <div class="buttons even" ?hidden=${!list.items.length}>
        ${this.at}
        <button type="button" id="add-contour" data-operation="route.contour.add" ?disabled=${route.locked} @click=${this.add}>Add</button>
        <button type="button" id="fitted-again" data-operation="route.contour.clear" title="Take back all by hand." ?disabled=${route.locked || !list.by_hand} @click=${() => this.connection.send("route.contour.clear")}>Fitted again</button>
      </div>`);
    this.roving.update();
    this.changed([list.chosen, chosen?.at_mm, route.id], () => this.inSight());
  }

  /** The chosen contour is seen in its list, which has fifty. */
  inSight() {
    const list = this.element.querySelector("#contours"), row = list?.querySelector("[aria-current=true]");
    if (!list || !row) return;
    const [around, at] = [list.getBoundingClientRect(), row.getBoundingClientRect()];
    if (at.top < around.top || at.bottom > around.bottom) list.scrollTop += at.top - around.top - (around.height - at.height) / 2;
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
    if (at_mm !== this.at_mm) for (const input of [this.radii, this.centre]) putBack(input); // what was wrong was of another one
    this.at_mm = at_mm;
    showText(this.radii, one.radii_mm.map((value) => String(Number(value.toFixed(1)))).join(" "));
    showText(this.centre, placeWords(one.centre).replace(" mm", ""));
    this.radii.disabled = route.locked;
    this.centre.disabled = route.locked || end;
    this.centre.title = end ? "It stays at the end of the way." : "Or drag it in 3D.";
    return html`<div class="fields two" id="contour-editor">
      <label class="field"><span class="field-label">Radius, mm</span>${this.radii}</label>
      <label class="field"><span class="field-label">Centre, mm</span>${this.centre}</label></div>
      <div class="buttons"><button type="button" id="remove-contour" data-operation="route.contour.remove" ?disabled=${route.locked || end} @click=${() => this.connection.send("route.contour.remove", { at_mm })}>Remove contour</button></div>`;
  }

  /** @param {number | null} at_mm */
  choose(at_mm) {
    this.connection.send("route.contour.choose", { at_mm });
  }

  /** A place along the way that was clicked in the plot: the contour there is chosen, another one may come there. @param {number} at_mm */
  picked(at_mm) {
    showNumber(this.at, at_mm, 0);
    this.choose(Math.max(at_mm, 0));
  }

  /** The part is folded: nothing is edited. */
  folded() {
    if ((this.connection.state.route_contours?.chosen ?? null) !== null) this.choose(null);
  }

  add = () => {
    const why = whyNoNumber(this.at.value, 0, LONGEST_MM);
    complain(this.at, why && "Say where along the way, in mm.");
    if (!why) this.connection.send("route.contour.add", { at_mm: numberOf(this.at.value) });
  };
}

/** @param {string} text */
function radiiIn(text) {
  return text.split(/[;\s]+/u).filter(Boolean).map(numberOf);
}

/**
 * Why a text is no radius, nor radii around a contour; '' where it is.
 * @param {string} text
 */
export function whyNoRadii(text) {
  const parts = text.split(/[;\s]+/u).filter(Boolean);
  if (!parts.length) return whyNoNumber("", LEAST_MM, MOST_MM);
  if (parts.length === 2) return RADII_HELP;
  if (parts.length > MOST_RADII) return `${MOST_RADII} radii at most.`;
  return parts.map((part) => whyNoNumber(part, LEAST_MM, MOST_MM)).find(Boolean) ?? "";
}

/**
 * Why a text is no place; '' where it is.
 * @param {string} text
 */
export function whyNoPlace(text) {
  try {
    placeOf(text);
    return "";
  } catch (error) {
    return error instanceof Error ? error.message : String(error);
  }
}

/** @param {ContourView} one */
function radiusWords({ radii_mm }) {
  const [low, high] = [Math.min(...radii_mm), Math.max(...radii_mm)];
  return radii_mm.length > 1 ? `${fixed(low, 1)} to ${fixed(high, 1)} mm` : `${fixed(low, 1)} mm`;
}
