// The open head: what its files state, and how far its surfaces may be off.
import { h } from "/static/js/dom.js";
import { count, fixed } from "/static/js/format.js";
import { draw, html, nothing, said } from "/static/js/template.js";

/** @import { CaseSection, ViewModel } from "/static/js/types.js" */

const ASSUMED = "Frame or unit was assumed (LPS, mm). Check left and right.";

export class HeadFacts {
  constructor() {
    this.element = h("div", { class: "group" });
  }

  /** @param {ViewModel} state */
  update({ case: open }) {
    draw(this.element, open ? this.facts(open) : html`<p class="words">Choose a case below.</p>`);
  }

  /** @param {CaseSection} open */
  facts(open) {
    const facts = [
      open.spacing_mm ? ["Voxel size", `${open.spacing_mm.map((value) => fixed(value, 2)).join(" × ")} mm`] : ["Size", `${open.size_mm.map((value) => fixed(value, 0)).join(" × ")} mm, surface only`],
      ["Coordinates", open.frame.assumed ? `${open.frame.name}, assumed` : open.frame.name],
      ...(open.landmarks.length ? [["Landmarks", open.landmarks.map(({ name }) => name).join(", ")]] : []),
      ...(open.beads ? [["Markers", count(open.beads, "bead", "beads")]] : []),
    ];
    const surfaces = open.surfaces.map(({ name, triangles, words }) => [surfaceName(name), [count(triangles, "triangle", "triangles"), words].filter(Boolean).join("; ")]);
    const doubts = open.frame.assumed && !open.notes.length ? [ASSUMED] : open.notes; // of a case that is older than its notes
    return html`
      <div class="group-head"><h2>${open.name}</h2></div>
      <dl class="facts">${listed(facts)}</dl>
      <p class=${doubts.length ? "words caution" : "words"}>${said(open.loading ?? doubts.join(" "))}</p>
      <p class="words" id="uncertainty" ?hidden=${!open.uncertainty}>${open.uncertainty ? said(`${open.uncertainty}.`) : nothing}</p>
      <details id="surface-facts" ?hidden=${!surfaces.length}><summary>Surfaces</summary><dl class="facts">${listed(surfaces)}</dl></details>`;
  }
}

/** @param {string[][]} facts */
function listed(facts) {
  return facts.map(([term, value]) => html`<dt>${term}</dt><dd>${value}</dd>`);
}

/** @param {string} name */
function surfaceName(name) {
  /** @type {Record<string, string | undefined>} */
  const words = { bone: "Bone", skull: "Skull", skin: "Skin", display: "Skull", skull_half: "Half skull", lumen: "Wall" };
  return words[name] ?? name;
}
