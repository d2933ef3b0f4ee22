// The line below the title bar: what to do next. A tab that it names is a button that goes there.
import { inTwo } from "./brief.js";
import { byId } from "./dom.js";
import { sentence } from "./format.js";
import { partsOf } from "./hint-parts.js";
import { draw, html, more, nothing } from "./template.js";

/** @import { Connection } from "./connection.js" */
/** @import { TabEntry, TabSection } from "./types.js" */

export class HintLine {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.element = byId("hint");
    this.begun = false;
  }

  /**
   * @param {TabSection | null | undefined} step
   * @param {TabEntry[]} tabs
   */
  update(step, tabs) {
    if (!this.begun) this.element.replaceChildren(); // what index.html says until the planner is there
    this.begun = true;
    const others = tabs.filter(({ name }) => name !== step?.name && step?.available.includes(name));
    const [first, rest] = inTwo(sentence(step?.hint ?? ""));
    draw(this.element, html`${partsOf(first, others).map((part) => (typeof part === "string" ? part : html`<button type="button" class=${part.inline ? "inline" : ""}
      @click=${() => this.connection.send("step.set", { name: part.tab })}>${part.words}</button>`))}${rest ? html` ${more(rest)}` : nothing}`);
  }
}
