// Patient: the open head, and in parts that fold: other heads, import, structures, how they are made, second volumes.
import { byId, h } from "/static/js/dom.js";
import { count } from "/static/js/format.js";
import { JobList } from "/static/js/job-list.js";
import { FoldedParts } from "/static/js/step-list.js";
import { keepStill } from "/static/js/still-list.js";
import { chosen } from "./files-in.js";
import { HeadFacts } from "./head-facts.js";
import { HeadsList } from "./heads-list.js";
import { ImportGroup } from "./import.js";
import { LumenOfCt } from "./lumen-of-ct.js";
import { OverlaysGroup } from "./overlays.js";
import { PaintGroup } from "./paint.js";
import { SegmentGroup } from "./segment.js";
import { StructuresGroup } from "./structures.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Line } from "/static/js/step-list.js" */
/** @import { CaseSection, ViewModel } from "/static/js/types.js" */

/** @type {CaseSection["parts"]} parts that only some kinds of cases have */
const OF_KINDS = ["structures", "threshold", "paint", "overlays", "lumen"];
const OPEN_AT_FIRST = ["heads", "import", "structures"];

export default class PatientPanel {
  /** @param {Parts} parts */
  constructor({ connection }) {
    this.connection = connection;
    this.jobs = new JobList((job, error) => this.import.ended(job, error));
    this.facts = new HeadFacts();
    this.heads = new HeadsList(connection);
    this.import = new ImportGroup(connection, this.jobs, () => this.overlays.nameNewest());
    this.structures = new StructuresGroup(connection, (files) => this.import.take(chosen(files), true));
    this.overlays = new OverlaysGroup((files) => this.import.takeOverlay(chosen(files), this.overlays.describe.input.checked));
    this.paint = new PaintGroup(connection, this.jobs); // first: it knows which of the jobs are its own
    this.segment = new SegmentGroup(this.jobs);
    this.lumen = new LumenOfCt(this.jobs);
    const steps = [
      { name: "heads", title: "Cases", content: this.heads.element },
      { name: "import", title: "Import", content: this.import.element },
      { name: "structures", title: "Structures", content: this.structures.element },
      { name: "threshold", title: "Threshold", content: this.segment.element },
      { name: "paint", title: "Paint", content: this.paint.element },
      { name: "overlays", title: "Second volumes", content: this.overlays.element },
      { name: "lumen", title: "Another lumen", content: this.lumen.element },
    ];
    this.parts = new FoldedParts({ label: "Parts of Patient", steps, kept: "patient", open: OPEN_AT_FIRST });
    this.element = h("div", { class: "drop" }, this.facts.element, this.parts.element);
    this.import.acceptDrops(this.element);
    keepStill(this.heads.element, [byId("first-task"), this.facts.element], () => byId("panel"));
  }

  /** @param {ViewModel} state */
  update(state) {
    this.facts.update(state);
    this.heads.update(state);
    this.structures.update(state);
    this.overlays.update(state);
    this.segment.update(state.case, state.slices?.cross);
    this.paint.update(state);
    this.lumen.update(state.case, state.slices?.cross);
    this.jobs.look();
    const has = state.case?.parts ?? OF_KINDS;
    const none = state.case?.has_volume ? [] : ["lumen"]; // it is found in a CT
    this.parts.show(linesOf(state), [...OF_KINDS.filter((part) => !has.includes(part)), ...none]);
  }
}

/**
 * What each part holds, beside its name.
 * @param {ViewModel} state
 * @returns {Record<string, Line>}
 */
function linesOf({ cases, structures, painted, case: open }) {
  const line = (/** @type {string} */ words) => ({ words, mark: /** @type {const} */ ("") });
  const few = (/** @type {number} */ items, /** @type {string} */ one, /** @type {string} */ several) => line(items ? count(items, one, several) : "None");
  return {
    heads: few((cases?.items ?? []).filter(({ deleted }) => !deleted).length, "case", "cases"),
    structures: few(structures?.items.length ?? 0, "structure", "structures"),
    paint: few(painted?.items.length ?? 0, "label", "labels"),
    overlays: few(open?.overlays.length ?? 0, "volume", "volumes"),
  };
}
