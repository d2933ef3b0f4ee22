// The shaft's direction at the selected point.
import { h, whenChanged } from "/static/js/dom.js";
import { numberInput, putBack, showNumber } from "/static/js/fields.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { ViewModel } from "/static/js/types.js" */

export class ShaftGroup {
  /** @param {Connection} connection */
  constructor(connection) {
    this.connection = connection;
    this.changed = whenChanged();
    this.words = h("p", { class: "words", id: "shaft-words" });
    this.aimButton = h("button", { type: "button", id: "aim-shaft", "data-command": "shaft.aim", onclick: () => this.aim() }, "Aim the shaft here");
    this.clearButton = h("button", { type: "button", id: "clear-shaft", "data-operation": "shaft.clear", onclick: () => this.act("shaft.clear") }, "Leave it open");
    /** @type {string | null} whose roll the field shows */
    this.point = null;
    this.roll = numberInput("shaft-roll", -360, 360, 5, (value) => this.setRoll(value), () => this.setRoll(null));
    this.roll.dataset.operation = "shaft.roll";
    this.roll.placeholder = "open";
    this.rollField = h("label", { class: "field" }, h("span", { class: "field-label" }, h("span", {}, "Roll of the bend"), h("span", {}, "°")), this.roll);
    this.element = h("div", { class: "fields", id: "shaft" }, this.words, h("div", { class: "buttons even" }, this.aimButton, this.clearButton), this.rollField);
  }

  /** @param {ViewModel} state */
  update({ shaft, plan }) {
    this.changed([shaft, plan?.locked], () => {
      const frozen = !shaft?.point || Boolean(plan?.locked);
      this.element.hidden = !shaft?.point;
      this.words.textContent = shaft?.words ? `${shaft.words} Drag the ringed ball at its end in the head to turn it.` : "The plan leaves the shaft's direction here open.";
      this.aimButton.textContent = shaft?.aiming ? "Cancel aiming" : "Aim the shaft here";
      this.aimButton.setAttribute("aria-pressed", String(Boolean(shaft?.aiming)));
      this.aimButton.disabled = frozen;
      this.clearButton.disabled = frozen || !shaft?.words;
      this.rollField.hidden = !shaft?.bent || !shaft.words;
      this.roll.disabled = frozen;
      if (this.point !== (shaft?.point ?? null)) putBack(this.roll); // what was typed for another point is not of this one
      this.point = shaft?.point ?? null;
      showNumber(this.roll, shaft?.roll_deg ?? null);
    });
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
