// Light or dark: the system's setting, until the user chooses here.
import { barButton, byId } from "./dom.js";
import { keep, recall } from "./remember.js";

/** The theme has changed; `detail` is "light" or "dark". */
export const THEMED = "vfix:theme";

const THEMES = ["light", "dark"];

export class Theme {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: light)");
    this.chosen = recall("theme", THEMES, "");
    this.button = barButton("theme", "", "", () => this.turn(), { id: "theme" });
    byId("layouts").after(this.button);
    this.system.addEventListener("change", () => this.render());
    this.render();
  }

  get now() {
    return this.chosen || (this.system.matches ? "light" : "dark");
  }

  /** What turning it makes. */
  get words() {
    return this.now === "light" ? "Dark theme" : "Light theme";
  }

  turn() {
    this.chosen = this.now === "light" ? "dark" : "light";
    keep("theme", this.chosen);
    this.render();
  }

  render() {
    const { now } = this;
    document.documentElement.dataset.theme = now;
    this.button.title = this.words;
    this.button.setAttribute("aria-label", this.words);
    /** @type {HTMLElement} */ (this.button.lastElementChild).textContent = now === "light" ? "Dark" : "Light";
    window.dispatchEvent(new CustomEvent(THEMED, { detail: now }));
  }
}
