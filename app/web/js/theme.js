// Light or dark: as the system has it, until somebody chooses here.
import { byId, h, icon } from "./dom.js";
import { keep, recall } from "./remember.js";

/** The theme has changed; `detail` is "light" or "dark". */
export const THEMED = "vfix:theme";

const THEMES = ["light", "dark"];

export class Theme {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: light)");
    this.chosen = recall("theme", THEMES, "");
    this.button = h("button", { type: "button", class: "icon plain", id: "theme", onclick: () => this.turn() }, icon("theme"));
    byId("layouts").after(this.button);
    this.system.addEventListener("change", () => this.render());
    this.render();
  }

  get now() {
    return this.chosen || (this.system.matches ? "light" : "dark");
  }

  turn() {
    this.chosen = this.now === "light" ? "dark" : "light";
    keep("theme", this.chosen);
    this.render();
  }

  render() {
    const { now } = this;
    document.documentElement.dataset.theme = now;
    const words = now === "light" ? "Dark theme" : "Light theme";
    this.button.title = words;
    this.button.setAttribute("aria-label", words);
    window.dispatchEvent(new CustomEvent(THEMED, { detail: now }));
  }
}
