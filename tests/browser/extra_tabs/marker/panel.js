// Marker: a button, and where the marker lies.
import { group, h } from "/static/js/dom.js";

export default class MarkerPanel {
  constructor({ connection }) {
    this.words = h("p", { class: "words", id: "marker-words" });
    const lay = h("button", { type: "button", id: "lay-marker", onclick: () => connection.send("marker.lay") }, "Lay the marker");
    this.element = h("div", {}, group("Marker", null, this.words, lay));
  }

  update({ marker }) {
    this.words.textContent = marker ? `Laid ${marker.laid} times.` : "Not laid yet.";
  }
}
