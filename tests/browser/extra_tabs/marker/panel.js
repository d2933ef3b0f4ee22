// Marker: a button, and where the marker lies.
import { h } from "/static/js/dom.js";
import { draw, html, titled } from "/static/js/template.js";

export default class MarkerPanel {
  constructor({ connection }) {
    this.connection = connection;
    this.element = h("div", { class: "group" });
  }

  update({ marker }) {
    draw(this.element, titled("Marker", null, html`
      <p class="words" id="marker-words">${marker ? `Laid ${marker.laid} times.` : "Not laid yet."}</p>
      <button type="button" id="lay-marker" @click=${() => this.connection.send("marker.lay")}>Lay the marker</button>`));
  }
}
