// A button that acts as long as it is held down, by pointer or by key, and lets go whatever happens.
import { h } from "./dom.js";
import { LET_GO } from "./keys.js";

export function holdButton(label, keys, onchange) {
  let down = false;
  const press = () => {
    if (down || button.disabled) return;
    down = true;
    onchange(true);
  };
  const release = () => {
    if (!down) return;
    down = false;
    onchange(false);
  };
  const button = h("button", {
    type: "button", class: "hold", title: `Hold. Key: ${keys}`,
    onpointerdown: (event) => { button.setPointerCapture(event.pointerId); press(); },
    onpointerup: release, onpointercancel: release, onlostpointercapture: release, onblur: release,
    onkeydown: (event) => { if ((event.key === " " || event.key === "Enter") && !event.repeat) press(); },
    onkeyup: (event) => { if (event.key === " " || event.key === "Enter") release(); },
  }, label);
  window.addEventListener(LET_GO, release);
  button.letGo = release; // for whoever disables the button: a disabled one may not hear the pointer come up
  return button;
}
