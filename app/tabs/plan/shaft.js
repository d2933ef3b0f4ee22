// The shaft's direction at the selected point.
import { h, whenChanged } from "/static/js/dom.js";
import { field, numberInput, putBack, showNumber } from "/static/js/fields.js";
import { draw, html, nothing } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ShaftSection, ViewModel } from "/static/js/types.js" */

export class ShaftGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    /** @type {string | null} whose roll the field shows */
    this.point = null;
    this.roll = numberInput("shaft-roll", -360, 360, 5, (value) => this.setRoll(value), () => this.setRoll(null));
    this.roll.dataset.operation = "shaft.roll";
    this.roll.placeholder = "free";
    this.rollField = field("Roll of the bend", "°", this.roll);
    this.element = h("div", { class: "fields", id: "shaft", hidden: true });
  }

  /** @param {ViewModel} state */
  update({ shaft, plan }) {
    this.changed([shaft, plan?.locked], () => {
      const frozen = !shaft?.point || Boolean(plan?.locked);
      this.element.hidden = !shaft?.point;
      this.roll.disabled = frozen;
      if (this.point !== (shaft?.point ?? null)) putBack(this.roll); // what was typed for another point is not of this one
      this.point = shaft?.point ?? null;
      showNumber(this.roll, shaft?.roll_deg ?? null);
      draw(this.element, this.content(shaft, frozen));
    });
  }

  /**
   * @param {ShaftSection | undefined} shaft
   * @param {boolean} frozen
   */
  content(shaft, frozen) {
    const aiming = Boolean(shaft?.aiming), aimed = Boolean(shaft?.words);
    return html`<p class="words" title=${aimed ? "Drag the ringed ball to turn it" : nothing}>${shaft?.words || "Shaft direction is free."}</p>
      <div class="buttons even">
        <button type="button" id="aim-shaft" data-command="shaft.aim" aria-pressed=${String(aiming)} title="It passes the next click" ?disabled=${frozen} @click=${() => this.aim()}>${aiming ? "Cancel" : "Aim shaft"}</button>
        <button type="button" id="clear-shaft" data-operation="shaft.clear" ?disabled=${frozen || !aimed} @click=${() => this.act("shaft.clear")}>Free shaft</button>
      </div>
      <div ?hidden=${!shaft?.bent || !aimed}>${this.rollField}</div>`;
  }

  aim() {
    if (this.connection.state.shaft?.aiming) this.connection.send("shaft.aim_off");
    else this.act("shaft.aim");
  }

  /** @param {"shaft.aim" | "shaft.clear"} type */
  act(type) {
    const point = this.connection.state.shaft?.point;
    if (point) this.connection.send(type, { item_id: point });
  }

  /** @param {number | null} degrees */
  setRoll(degrees) {
    const point = this.connection.state.shaft?.point;
    if (point) this.connection.send("shaft.roll", { item_id: point, roll_deg: degrees });
  }
}
