// Groups of the panel that can be folded away, and whether they are is remembered by the browser.
import { h } from "/static/js/dom.js";
import { keep, recall } from "/static/js/remember.js";

/**
 * Let a titled part of the panel fold; the first time it is open or not as `open` says. Its tools stay beside the title.
 * @param {string} key
 * @param {HTMLElement} group as `group` makes one
 * @param {boolean} open
 */
export function folding(key, group, open) {
  const head = group.querySelector(".group-head");
  const tools = head?.querySelector(".buttons");
  const summary = h("summary", { class: "group-head" }, head?.querySelector("h2"));
  head?.remove();
  const details = h("details", { open: recall(`fold-${key}`, ["open", "shut"], open ? "open" : "shut") === "open" },
    summary, h("div", { class: "fold-body" }, ...group.children));
  details.addEventListener("toggle", () => keep(`fold-${key}`, details.open ? "open" : "shut"));
  tools?.classList.add("fold-tools");
  tools?.addEventListener("click", () => { details.open = true; });
  group.classList.add("folding");
  group.replaceChildren(details, ...(tools ? [tools] : []));
  return group;
}
