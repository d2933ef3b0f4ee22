// Tube: start, the handle, a pad that moves the point across the tube, and buttons along it.
import { group, h } from "/static/js/dom.js";
import { holdButton } from "/static/js/hold.js";
import { LET_GO } from "/static/js/keys.js";

export default class TubePanel {
  constructor({ connection, keys }) {
    this.words = h("p", { class: "words", id: "tube-words" });
    this.start = h("button", { type: "button", id: "tube-start", onclick: () => connection.send("rehearsal.start") }, "Start");
    this.lease = h("button", { type: "button", id: "tube-lease", onclick: () => connection.send("rehearsal.take") }, "Take over the handle");
    this.onward = holdButton("Onward", "↑", (down) => {
      connection.send("drive", { direction: down ? 1 : 0 });
      keys.hold("onward", down);
    });
    this.onward.id = "tube-onward";
    const axes = (x, y) => connection.send("axes", { camera_x: x, camera_y: y });
    const letGo = () => {
      axes(0, 0);
      keys.hold("pad", false);
    };
    const pull = (event) => {
      const box = this.pad.getBoundingClientRect();
      const share = (at, from, size) => Math.max(-1, Math.min(1, 2 * (at - from) / size - 1));
      if (event.buttons) axes(share(event.clientX, box.left, box.width), share(event.clientY, box.top, box.height));
    };
    this.pad = h("div", {
      id: "tube-pad", style: "height: 120px; border: 1px solid; touch-action: none",
      onpointerdown: (event) => { this.pad.setPointerCapture(event.pointerId); keys.hold("pad", true); pull(event); },
      onpointermove: pull, onpointerup: letGo, onpointercancel: letGo,
    });
    window.addEventListener(LET_GO, letGo);
    this.element = h("div", {}, group("Tube", null, this.words, this.start, this.lease, this.pad, this.onward));
  }

  update({ rehearsal }) {
    const { state, mine, holder, can_take } = rehearsal ?? {};
    this.words.textContent = mine ? "This window holds the handle." : `${holder ?? "Nobody"} holds the handle.`;
    this.start.disabled = state === "running" || !(mine || can_take);
    this.lease.disabled = !can_take;
    this.onward.disabled = !(mine && state === "running");
  }
}
