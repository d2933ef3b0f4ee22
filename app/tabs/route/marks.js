// Polyps and labels on the wall: put there by clicks or by a seed, renamed, moved and removed.
import { askName } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { heldNumber, ownNumber } from "/static/js/fields.js";
import { rovingRows } from "/static/js/roving.js";
import { placeWords } from "/static/js/slices/place-words.js";
import { draw, html, iconTool, repeat } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { MarkKindView, MarkView, RouteSection } from "/static/js/types.js" */

const SEED_HELP = "Ten polyps, one in each tenth.";
const MOST_SEED = 2 ** 31 - 1; // that the planner takes

export class MarksPart {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = h("div", { class: "fields" });
    this.roving = rovingRows(this.element);
    this.seed = ownNumber("polyp-seed", 0, MOST_SEED, 0, 1);
    for (const [name, words] of [["aria-label", "Seed"], ["title", SEED_HELP]]) this.seed.setAttribute(name, words);
    this.fitted = false; // the pathway is known, in whose tenths polyps are put
  }

  /** What the folded part says of itself. @param {RouteSection | null | undefined} route */
  static line(route) {
    const words = (route?.mark_kinds ?? []).map(({ kind, many }) => {
      const of = route?.marks.filter((mark) => mark.kind === kind).length ?? 0;
      return of && count(of, kind, many);
    });
    return { words: words.filter(Boolean).join(", "), mark: /** @type {const} */ ("") };
  }

  /**
   * @param {RouteSection | null | undefined} route
   * @param {boolean} fitted whether its pathway is known
   */
  update(route, fitted) {
    this.fitted = fitted;
    if (!route) {
      draw(this.element, html``);
      return;
    }
    this.seed.disabled = route.locked;
    const pick = (/** @type {MarkKindView} */ { kind: what, many }) => html`<button type="button" id=${`pick-${what}`} data-operation="route.mark.add" aria-pressed=${String(route.picking === what)} ?disabled=${route.locked}
      @click=${() => this.connection.send("route.pick", { what: route.picking === what ? "" : what })}>Click ${many}</button>`;
    draw(this.element, html`<div class="buttons even">${route.mark_kinds.map(pick)}</div>
      <div class="buttons even">${this.seed}
        <button type="button" id="seed-polyps" data-operation="route.mark.seed" title=${SEED_HELP} ?disabled=${route.locked || !this.fitted} @click=${this.seeded}>Polyps by seed</button></div>
      <ul class="list plain-rows" id="marks" aria-label="Polyps and labels" ?hidden=${!route.marks.length}>${repeat(route.marks, ({ id }) => id, (mark) => this.row(mark, route))}</ul>`);
    this.roving.update();
  }

  /**
   * @param {MarkView} mark
   * @param {RouteSection} route
   */
  row(mark, route) {
    const moving = route.picking === "move" && route.moving === mark.id;
    const move = () => this.connection.send("route.pick", moving ? { what: "" } : { what: "move", mark_id: mark.id });
    return html`<li class="row" aria-current=${String(moving)}><button type="button" class="row-main" title="A click on the wall moves it." ?disabled=${route.locked} data-operation="route.mark.move" @click=${move}
      ><span>${mark.name}</span><span class="row-sub">${placeWords(mark.at, 0)}</span></button>
      <div class="row-tools">${iconTool("pencil", "Rename", () => this.rename(mark), { operation: "route.mark.rename", off: route.locked })}
        ${iconTool("trash", "Remove", () => this.connection.send("route.mark.remove", { mark_id: mark.id }), { operation: "route.mark.remove", off: route.locked })}</div></li>`;
  }

  /** @param {MarkView} mark */
  async rename({ id, kind, name: before }) {
    const name = await askName(`Rename ${kind}`, before);
    if (name) this.connection.send("route.mark.rename", { mark_id: id, name });
  }

  seeded = () => this.connection.send("route.mark.seed", { seed: Math.round(heldNumber(this.seed) ?? 1) });
}
