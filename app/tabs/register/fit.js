// The fit: how well the points fit, which one does not, in which order they belong, and the error at the targets.
import { group, h, whenChanged } from "/static/js/dom.js";
import { numberInput, showNumber } from "/static/js/fields.js";
import { mm } from "/static/js/format.js";
import { fleWords, orderWords, roundedUp, rowWords } from "./words.js";
import { field } from "./beads.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ErrorsView, FitView, OrderView, OrdersView, RegistrationSection } from "/static/js/types.js" */

/** @type {Partial<Record<FitView["state"], string>>} of transforms that the points had no part in */
const FRE_WORDS = { given: "How far the points are off", refined: "How far the points are off" };

export class FitGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.state = h("p", { class: "words", id: "fit-state", role: "status" });
    this.figures = h("dl", { class: "facts", id: "fit-figures" });
    this.wrong = h("div", { class: "wrong-pair", id: "wrong-pair", hidden: true });
    this.cautions = h("div", { class: "fields", id: "fit-cautions" });
    this.orderButton = h("button", { type: "button", class: "wide", id: "match-order", title: "Find which measured point belongs to which bead, where nobody wrote it down", onclick: () => connection.send("order.find") }, "Match order");
    this.orders = h("div", { class: "fields", id: "orders", hidden: true });
    this.fitButton = h("button", { type: "button", class: "wide", id: "fit-pairs", onclick: () => connection.send("registration.fit_pairs") }, "Fit the points instead");
    this.element = group("3  Fit", null, this.state, this.figures, this.wrong, this.cautions, this.orderButton, this.orders, this.fitButton);
  }

  /** @param {RegistrationSection} registration */
  update(registration) {
    const { fit, orders, locked, made_from: madeFrom, pairs } = registration;
    this.changed([fit, orders, locked, madeFrom, pairs.length], () => this.render(registration));
  }

  /** @param {RegistrationSection} registration */
  render({ fit, orders, locked, made_from: madeFrom }) {
    this.state.textContent = fit.words;
    this.state.classList.toggle("caution", ["degenerate", "misfit", "inconsistent"].includes(fit.state));
    this.figures.replaceChildren(...figuresOf(fit));
    this.renderWrong(fit, locked);
    this.cautions.replaceChildren(...fit.cautions.map((text) => h("p", { class: "words caution" }, text)));
    const good = fit.state === "fitted" && !fit.wrong;
    this.orderButton.hidden = fit.used < 3;
    this.orderButton.classList.toggle("plain", good); // quiet: nothing speaks for another order
    this.orderButton.disabled = locked;
    this.fitButton.hidden = (madeFrom !== "given" && madeFrom !== "surface") || fit.used < 3;
    this.fitButton.disabled = locked;
    this.renderOrders(orders, locked);
  }

  /**
   * @param {FitView} fit
   * @param {boolean} locked
   */
  renderWrong({ wrong }, locked) {
    this.wrong.hidden = !wrong;
    if (!wrong) return;
    this.wrong.dataset.certainty = wrong.certainty;
    this.wrong.replaceChildren(h("p", { class: "words" }, wrong.words),
      h("button", { type: "button", id: "leave-out", disabled: locked, onclick: () => this.connection.send("pair.change", { pair_id: wrong.pair, enabled: false }) }, `Leave ‘${wrong.label}’ out`));
  }

  /**
   * @param {OrdersView | null} orders
   * @param {boolean} locked
   */
  renderOrders(orders, locked) {
    const found = this.orders.hidden && Boolean(orders);
    this.orders.hidden = !orders;
    if (!orders) return;
    const take = (/** @type {number} */ candidate) => orderCard(orders.candidates[candidate], candidate, orders.ambiguous ? orders.candidates.length : 1, locked, () => this.connection.send("order.take", { candidate }));
    const offered = orders.ambiguous ? [...orders.candidates.keys()].map(take) : orders.unchanged ? [] : [take(0)];
    const forget = h("button", { type: "button", class: "plain", onclick: () => this.connection.send("order.forget") }, offered.length ? "Leave the order as it is" : "Close");
    this.orders.replaceChildren(h("p", { class: orders.ambiguous ? "words caution" : "words" }, orders.words), ...offered, forget);
    if (found) (this.orders.querySelector(".order-card") ?? this.orders).scrollIntoView({ block: "nearest" });
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
  const name = count > 1 ? `Order ${index + 1} of ${count}` : "Another order";
  const moved = order.moves.filter(({ stays }) => !stays);
  const rows = moved.map(({ label, measured_at: at, measured }) => h("li", {}, h("strong", {}, label), " gets the place of ", h("strong", {}, at),
    h("span", { class: "row-sub" }, `at ${measured.map((value) => value.toFixed(1).replace("-", "−")).join(", ")} mm`)));
  const same = !moved.length;
  return h("div", { class: "order-card", "data-candidate": String(index) },
    h("p", { class: "order-head" }, h("span", {}, name), h("span", { class: "number", title: "How well the points fit in this order; not the error at the target" }, `FRE ${mm(order.fre_mm, 2)}`)),
    h("p", { class: "words" }, `${orderWords(order)}.`), same ? null : h("ul", { class: "order-moves" }, rows),
    h("button", { type: "button", class: "order wide", disabled: locked, onclick: take }, same ? "Keep this order" : "Take this order"));
}

/** @param {FitView} fit */
function figuresOf(fit) {
  if (fit.fre_mm === null) return [];
  /** @type {[string, string, string][]} */
  const rows = [
    [FRE_WORDS[fit.state] ?? "How well the points fit (FRE)", `${mm(fit.fre_mm, 2)} rms`, "Root mean square of the residuals. It is not the error at the target."],
    ["Mean residual", mm(fit.mean_residual_mm, 2), "Mean distance of the points under the fit"],
    ["Error of one measured point (FLE)", fleWords(fit), "Localisation error of one point, rms: what the error at the targets is computed from"],
  ];
  return rows.flatMap(([term, words, title]) => [h("dt", { title }, term), h("dd", { class: "number" }, words)]);
}

export class ErrorsGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = h("p", { class: "words strong", id: "error-words" });
    this.body = h("tbody");
    const head = h("thead", {}, h("tr", {}, h("th", { scope: "col" }, "Where"), h("th", { scope: "col", title: "Root mean square of the error" }, "rms"), h("th", { scope: "col", title: "The registration error is below this in 95 % of cases" }, "95 %")));
    this.table = h("table", { class: "points", id: "error-table", "aria-label": "Expected error of the registration, in mm" }, head, this.body);
    this.fle = numberInput("fle", 0.01, 50, 0.05, (value) => connection.send("registration.fle", { fle_mm: value }), () => connection.send("registration.fle", { fle_mm: null }));
    this.fle.placeholder = "estimated";
    this.ballWords = h("p", { class: "words", id: "ball-words" }, h("span", { class: "ball-swatch" }), "Balls about the targets, in the scene here and in Plan, whose rings are seen through bone. Registration error stays inside these balls in 95 % of cases; tool and tracking errors come on top.");
    this.element = group("4  Error where the tool works", null, this.words, this.table, this.ballWords,
      h("details", { class: "folded" }, h("summary", {}, "How exactly one point is measured"), h("div", { class: "fields" },
        h("p", { class: "words" }, "Estimated from the fit, which is rough with few points. State it where the tracker's error is known; skin that moves adds to it."), field("Localisation error, mm rms", this.fle))));
  }

  /** @param {RegistrationSection} registration */
  update({ errors, fle_stated_mm: stated, locked }) {
    this.changed([errors, stated, locked], () => this.render(errors, stated, locked));
  }

  /**
   * @param {ErrorsView} errors
   * @param {number | null} stated
   * @param {boolean} locked
   */
  render(errors, stated, locked) {
    this.words.textContent = errors.words;
    this.table.hidden = !errors.rows.length;
    this.ballWords.hidden = !errors.rows.some((row) => row.s_mm === null);
    this.body.replaceChildren(...errors.rows.map((row) => h("tr", { title: "Show it in the slices", onclick: () => this.connection.send("slice.cross", { position: row.position }) },
      h("td", {}, h("span", { class: row.s_mm === null ? "dot target" : "dot" }), rowWords(row)), h("td", {}, mm(row.rms_mm, 2)), h("td", {}, mm(roundedUp(row.within_95_mm), 2)))));
    showNumber(this.fle, stated);
    this.fle.disabled = locked;
  }
}
