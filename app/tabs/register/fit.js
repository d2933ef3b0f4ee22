// The fit: how well the points fit, which one does not, in which order they belong, and the error at the targets.
import { h } from "/static/js/dom.js";
import { numberInput, showNumber } from "/static/js/fields.js";
import { mm } from "/static/js/format.js";
import { ListFilter } from "/static/js/list-filter.js";
import { Roving } from "/static/js/roving.js";
import { draw, html, nothing, said } from "/static/js/template.js";
import { fleWords, orderWords, roundedUp, rowWords } from "./words.js";
import { field } from "./beads.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ErrorsView, FitView, OrderView, OrdersView, RegistrationSection } from "/static/js/types.js" */

const BALLS = "Error stays inside these balls in 95 %. Tool and tracking errors come on top. The balls lie about the targets, in the scene here and in Plan; their rings are seen through bone.";
const STATED = "State it where the tracker's error is known. Else it is estimated from the fit, which is rough with few points. Skin that moves adds to it.";
/** @type {Partial<Record<FitView["state"], string>>} of transforms that the points had no part in */
const FRE_WORDS = { given: "Points off by", refined: "Points off by" };

export class FitGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.found = false; // whether orders are shown already
    this.element = h("div", { class: "fields" });
  }

  /** @param {RegistrationSection} registration */
  update({ fit, orders, locked, made_from: madeFrom }) {
    const bad = ["degenerate", "misfit", "inconsistent"].includes(fit.state);
    const good = fit.state === "fitted" && !fit.wrong; // quiet: nothing speaks for another order
    const given = madeFrom === "given" || madeFrom === "surface";
    draw(this.element, html`
      <p class=${bad ? "words caution" : "words"} id="fit-state" role="status" ?hidden=${fit.state === "fitted"}>${said(fit.words)}</p>
      <dl class="facts" id="fit-figures">${figures(fit)}</dl>
      ${this.wrong(fit, locked)}
      <div class="fields" id="fit-cautions">${fit.cautions.map((text) => html`<p class="words caution">${said(text)}</p>`)}</div>
      <button type="button" class=${good ? "wide plain" : "wide"} id="match-order" data-command="order.find" title="Which point belongs to which bead"
        ?hidden=${fit.used < 3} ?disabled=${locked} @click=${() => this.connection.send("order.find")}>Match order</button>
      <div class="fields" id="orders" ?hidden=${!orders}>${orders ? this.orders(orders, locked) : nothing}</div>
      <button type="button" class="wide" id="fit-pairs" data-operation="registration.fit_pairs" ?hidden=${!given || fit.used < 3} ?disabled=${locked}
        @click=${() => this.connection.send("registration.fit_pairs")}>Fit points</button>`);
    if (orders && !this.found) for (const part of ["#orders", ".order-card", "button.order"]) this.element.querySelector(part)?.scrollIntoView({ block: "nearest" });
    this.found = Boolean(orders);
  }

  /**
   * @param {FitView} fit
   * @param {boolean} locked
   */
  wrong({ wrong }, locked) {
    if (!wrong) return nothing;
    return html`<div class="wrong-pair" id="wrong-pair" data-certainty=${wrong.certainty}>
      <p class="words">${said(wrong.words)}</p>
      <button type="button" id="leave-out" ?disabled=${locked}
        @click=${() => this.connection.send("pair.change", { pair_id: wrong.pair, enabled: false })}>Leave out</button>
    </div>`;
  }

  /**
   * @param {OrdersView} orders
   * @param {boolean} locked
   */
  orders({ candidates, ambiguous, unchanged, words }, locked) {
    const offered = ambiguous ? candidates : unchanged ? [] : candidates.slice(0, 1);
    const take = (/** @type {number} */ candidate) => this.connection.send("order.take", { candidate });
    return html`<p class=${ambiguous ? "words caution" : "words"}>${said(words)}</p>
      ${offered.map((order, index) => orderCard(order, index, offered.length, locked, () => take(index)))}
      <button type="button" class="plain" @click=${() => this.connection.send("order.forget")}>${offered.length ? "Leave order" : "Close"}</button>`;
  }
}

/**
 * One order: which point gets which measured place, how well all of them fit then, and the button that takes it.
 * @param {OrderView} order
 * @param {number} index
 * @param {number} count of the orders to choose from
 * @param {boolean} locked
 * @param {() => void} take
 */
function orderCard(order, index, count, locked, take) {
  const moved = order.moves.filter(({ stays }) => !stays);
  const rows = moved.map(({ label, measured_at: at, measured }) => html`<li><strong>${label}</strong> gets the place of <strong>${at}</strong><span
    class="row-sub">at ${measured.map((value) => value.toFixed(1).replace("-", "−")).join(", ")} mm</span></li>`);
  return html`<div class="order-card" data-candidate=${index}>
    <p class="order-head"><span>${count > 1 ? `Order ${index + 1} of ${count}` : "Another order"}</span><span
      class="number" title="Not the error at the target">FRE ${mm(order.fre_mm, 2)}</span></p>
    <p class="words">${orderWords(order)}.</p>
    ${moved.length ? html`<ul class="order-moves">${rows}</ul>` : nothing}
    <button type="button" class="order wide" ?disabled=${locked} @click=${take}>${moved.length ? "Take order" : "Keep order"}</button>
  </div>`;
}

/** @param {FitView} fit */
function figures(fit) {
  if (fit.fre_mm === null) return nothing;
  /** @type {[string, string, string][]} */
  const rows = [
    [FRE_WORDS[fit.state] ?? "Fit error (FRE)", `${mm(fit.fre_mm, 2)} rms`, "Not the error at the target"],
    ["Mean residual", mm(fit.mean_residual_mm, 2), "Mean distance of the points"],
    ["Point error (FLE)", fleWords(fit), "Gives the target error"],
  ];
  return rows.map(([term, words, title]) => html`<dt title=${title}>${term}</dt><dd class="number">${words}</dd>`);
}

export class ErrorsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.fle = numberInput("fle", 0.01, 50, 0.05, (value) => connection.send("registration.fle", { fle_mm: value }), () => connection.send("registration.fle", { fle_mm: null }));
    this.fle.placeholder = "estimated";
    this.fle.dataset.operation = "registration.fle";
    this.fleField = field("Point error, mm rms", this.fle);
    this.filter = new ListFilter("places", () => { if (this.registration) this.update(this.registration); });
    /** @type {RegistrationSection | undefined} */
    this.registration = undefined;
    this.element = h("div", { class: "fields" });
    this.roving = new Roving(this.element, "td > button");
  }

  /** @param {RegistrationSection} registration */
  update(registration) {
    this.registration = registration;
    const { errors, fle_stated_mm: stated, locked } = registration;
    const shown = this.filter.of(errors.rows, rowWords);
    draw(this.element, html`
      <p class="words strong" id="error-words">${said(errors.words)}</p>
      ${this.filter.field(errors.rows.length)}
      <table class="points" id="error-table" aria-label="Expected error of the registration, in mm" ?hidden=${!errors.rows.length}>
        <thead><tr>
          <th scope="col">Where</th><th scope="col" title="Root mean square">rms</th>
          <th scope="col" title="Below this in 95 % of cases">95 %</th>
        </tr></thead>
        <tbody>${shown.map((row) => this.row(row))}</tbody>
      </table>
      <p class="words" id="ball-words" ?hidden=${!errors.rows.some((row) => row.s_mm === null)}><span class="ball-swatch"></span>${said(BALLS)}</p>
      <details class="folded"><summary>Point error</summary><div class="fields">
        <p class="words">${said(STATED)}</p>${this.fleField}
      </div></details>`);
    this.roving.update();
    showNumber(this.fle, stated);
    this.fle.disabled = locked;
  }

  /** @param {ErrorsView["rows"][number]} row */
  row(row) {
    return html`<tr title=${row.s_mm === null ? "Show it" : "The worst of the path"} @click=${() => this.connection.send("slice.cross", { position: row.position })}>
      <td><span class=${row.s_mm === null ? "dot target" : "dot"}></span><button type="button" class="row-main">${rowWords(row)}</button></td><td>${mm(row.rms_mm, 2)}</td><td>${mm(roundedUp(row.within_95_mm), 2)}</td>
    </tr>`;
  }
}
