// Patient: the open head, the list of others, and the import of new ones.
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { count, fixed, when } from "/static/js/format.js";
import { FRAME_QUESTION, askChoices, askForImages, askName, clearErrors, confirm, note, noteDone, whenReady } from "/static/js/dialogs.js";
import { JobList } from "/static/js/job-list.js";
import { PlannerError, download, missing, post, remove, seriesOf, upload, wasCancelled } from "/static/js/rest.js";
import { line, say } from "/static/js/said.js";
import { ACCEPTED, chosen, dropped, formOf, isSegmentation, leftOutWords, refusal, sorted, uploadWords } from "./files-in.js";
import { OverlaysGroup, descriptionCheck } from "./overlays.js";
import { PaintGroup } from "./paint.js";
import { SegmentGroup } from "./segment.js";
import { StructuresGroup } from "./structures.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { Question } from "/static/js/dialogs.js" */
/** @import { SeriesFacts } from "/static/js/rest.js" */
/** @import { Found } from "./files-in.js" */
/** @import { CaseEntry, CaseSection, ImportAnswer, JobEntry, JobPublic, ViewModel } from "/static/js/types.js" */

// What a file may leave unsaid, by the word that the planner has for it.
/** @type {Record<string, Question>} */
const QUESTIONS = {
  frame: FRAME_QUESTION,
  unit: { name: "units", label: "Unit", options: [["mm", "Millimetres"], ["m", "Metres"], ["um", "Micrometres"]] },
};
export default class PatientPanel {
  /** @param {Parts} parts */
  constructor({ connection }) {
    this.connection = connection;
    this.changedCase = whenChanged();
    this.changedCases = whenChanged();
    this.facts = h("dl", { class: "facts" });
    this.caseWords = h("p", { class: "words" });
    this.uncertainty = h("p", { class: "words", id: "uncertainty" });
    this.list = h("ul", { class: "list", id: "cases", "aria-label": "Heads" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(this.connection.state) });
    /** @type {HTMLInputElement} */
    this.chooser = h("input", { type: "file", hidden: true, multiple: true, accept: ACCEPTED, onchange: () => this.chosen(this.chooser) });
    /** @type {HTMLInputElement} */
    this.folderChooser = h("input", { type: "file", hidden: true, webkitdirectory: true, id: "folder", onchange: () => this.chosen(this.folderChooser) });
    this.importButton = h("button", { type: "button", onclick: () => this.chooser.click() }, "Import head …");
    this.folderButton = h("button", { type: "button", id: "import-folder", onclick: () => this.folderChooser.click() }, "Folder …");
    this.saveButton = h("button", { type: "button", class: "wide", id: "save-case", title: "Head, plans and registrations as one zip", onclick: () => save(connection.state.case) }, "Save head …");
    this.surfaceFacts = h("dl", { class: "facts" });
    this.surfaces = h("details", { id: "surface-facts" }, h("summary", {}, "Surfaces"), this.surfaceFacts);
    this.describe = descriptionCheck();
    this.progressBar = h("div");
    this.progressWords = h("p", { class: "words" });
    /** @type {Map<string, string>} what this page's imports were chosen as, by their job */
    this.fileNames = new Map();
    this.jobs = new JobList((job, error) => this.ended(job, error));
    this.progress = h("div", { hidden: true }, this.progressWords, h("div", { class: "progress" }, this.progressBar));
    this.structures = new StructuresGroup(connection, (files) => this.take(chosen(files), true));
    this.overlays = new OverlaysGroup((files) => this.takeOverlay(chosen(files)));
    this.paint = new PaintGroup(connection, this.jobs); // first: it knows which of the jobs are its own
    this.segment = new SegmentGroup(this.jobs);
    this.element = h("div", { class: "drop" }, this.chooser, this.folderChooser,
      group("This head", null, this.facts, this.caseWords, this.uncertainty, this.surfaces),
      this.structures.element,
      this.overlays.element,
      group("Heads", null, this.list, h("label", { class: "check" }, this.showDeleted, "Show deleted"), this.saveButton),
      group("Import", null,
        line("Drop files or a folder here. They stay on this computer. A CT (DICOM, NRRD, NIfTI, MetaImage), a bone surface (PLY, STL, OBJ, GLB, VTK, VTP), a segmentation of the open head, or the zip of a saved head."),
        line("Images can identify the patient. An export that holds them asks first."),
        h("div", { class: "buttons even" }, this.importButton, this.folderButton), this.describe.element, this.progress, this.jobs.element),
      this.segment.element, this.paint.element);
    this.acceptDrops();
  }

  /** Files dropped on the panel are imported; elsewhere on the page the browser must not open them in its place. */
  acceptDrops() {
    const mark = (/** @type {boolean} */ over) => this.element.classList.toggle("dropping", over);
    window.addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      const here = event.target instanceof Node && this.element.contains(event.target);
      event.dataTransfer.dropEffect = here ? "copy" : "none";
      mark(here);
    });
    window.addEventListener("dragleave", () => mark(false));
    window.addEventListener("drop", async (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      mark(false);
      if (!(event.target instanceof Node && this.element.contains(event.target))) return;
      try {
        await this.take(await dropped(event.dataTransfer));
      } catch (error) {
        note(`Cannot be read: ${/** @type {Error} */ (error).message}`, { error: true });
      }
    });
  }

  /** @param {ViewModel} state */
  update(state) {
    this.changedCase([state.case], () => this.renderCase(state.case));
    this.structures.update(state);
    this.overlays.update(state);
    this.segment.update(state.case, state.slices?.cross);
    this.paint.update(state);
    this.jobs.look();
    this.changedCases([state.cases, this.showDeleted.checked, state.case?.id], () => this.renderCases(state));
  }

  /** @param {CaseSection | null | undefined} open */
  renderCase(open) {
    this.saveButton.disabled = !open;
    if (!open) {
      this.facts.replaceChildren();
      this.uncertainty.hidden = this.surfaces.hidden = true;
      say(this.caseWords, "No head is open. Choose one below.");
      return;
    }
    const spacing = open.spacing_mm ? `${open.spacing_mm.map((value) => fixed(value, 2)).join(" × ")} mm` : "no CT, surface only";
    const frame = open.frame.name === "LPS" ? "LPS: mm to the left, back and up" : open.frame.name;
    const facts = [
      ["Name", open.name],
      ["Voxel size", spacing],
      ["Coordinates", open.frame.assumed ? `${frame}, assumed` : frame],
    ];
    if (open.beads) facts.push(["Markers", count(open.beads, "bead", "beads")]);
    this.facts.replaceChildren(...listed(facts));
    this.surfaces.hidden = !open.surfaces.length;
    this.surfaceFacts.replaceChildren(...listed(open.surfaces.map((surface) => [
      surfaceName(surface.name), [count(surface.triangles, "triangle", "triangles"), surface.words].filter(Boolean).join("; "),
    ])));
    const assumed = open.frame.assumed && !open.notes.length; // of a case that is older than its notes
    const doubts = assumed ? ["Frame or unit was assumed (LPS, mm). Check left and right."] : open.notes;
    say(this.caseWords, open.loading ?? doubts.join(" "));
    this.caseWords.className = doubts.length ? "words caution" : "words";
    say(this.uncertainty, open.uncertainty ? `${open.uncertainty}; the margin covers it.` : "");
    this.uncertainty.hidden = !open.uncertainty;
  }

  /** @param {ViewModel} state */
  renderCases(state) {
    const shown = (state.cases?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    keyed(this.list, shown, (item) => `${item.id} ${item.deleted}`, (item) => this.row(item), (row, item) => {
      const open = item.id === state.case?.id;
      fillListRow(row, item, item.unreadable || when(item.created), open);
      const trash = row.querySelector("[data-tool=delete]");
      if (trash) Object.assign(trash, { disabled: open, title: open ? "The open head cannot be deleted" : "Delete" });
    });
  }

  /**
   * @param {CaseEntry} item
   * @returns {Row<CaseEntry>}
   */
  row({ deleted }) {
    const send = (/** @type {"case.open" | "case.restore"} */ type) => this.connection.send(type, { case_id: row.item.id });
    const tools = deleted
      ? [iconButton("restore", "Restore", () => send("case.restore"))]
      : [
        iconButton("pencil", "Rename", async () => {
          const { id, name: before } = row.item;
          const name = await askName("Rename head", before);
          if (name) this.connection.send("case.rename", { case_id: id, name });
        }),
        iconButton("download", "Save head (zip)", () => save(row.item)),
        iconButton("trash", "Delete", () => this.remove(row.item.id), { "data-tool": "delete" }),
      ];
    /** @type {Row<CaseEntry>} */
    const row = listRow(deleted, () => send("case.open"), tools);
    return row;
  }

  /** @param {string} id */
  remove(id) {
    const fields = { case_id: id };
    noteDone(this.connection.request("case.delete", fields), "Head deleted.",
      { label: "Restore", run: () => this.connection.send("case.restore", fields) });
  }

  /** @param {HTMLInputElement} chooser */
  async chosen(chooser) {
    const found = chosen(chooser.files ?? []);
    chooser.value = "";
    if (found.length) await this.take(found);
  }

  /**
   * Import what was chosen or dropped: a head, or a segmentation of the open one.
   * @param {Found[]} found
   * @param {boolean} [intoOpen] whether it was said to be a segmentation
   */
  async take(found, intoOpen = false) {
    const what = await sorted(found);
    const [name, why] = [uploadWords(what.files), refusal(what.files)];
    if (why) {
      note(`${name}: ${why}`, { error: true });
      return;
    }
    tellLeftOut(what.leftOut);
    const open = this.connection.state.case;
    const structures = open && (intoOpen || isSegmentation(what.files));
    const address = structures ? `/api/v1/cases/${encodeURIComponent(open.id)}/structures` : "/api/v1/cases";
    await this.send(address, name, formOf(what, !structures && this.describe.input.checked));
  }

  /**
   * Lay what was chosen over the open head.
   * @param {Found[]} found
   */
  async takeOverlay(found) {
    const what = await sorted(found);
    const open = this.connection.state.case;
    tellLeftOut(what.leftOut);
    if (open) await this.send(`/api/v1/cases/${encodeURIComponent(open.id)}/overlays`, uploadWords(what.files), formOf(what, this.overlays.describe.input.checked));
  }

  /**
   * @param {string} address
   * @param {string} name
   * @param {FormData} form
   */
  async send(address, name, form) {
    clearErrors();
    this.importButton.disabled = this.folderButton.disabled = true;
    this.progress.hidden = false;
    try {
      /** @type {JobPublic} */
      const job = await upload(address, form, (part) => this.uploading(name, part));
      this.fileNames.set(job.id, name);
      this.jobs.watch(job);
    } catch (error) {
      note(`${name}: ${/** @type {Error} */ (error).message}`, { error: true });
    } finally {
      this.importButton.disabled = this.folderButton.disabled = false;
      this.progress.hidden = true;
    }
  }

  /**
   * What came of a job: a new head, a question, or why there is none. What a dry run gives, the Plan tab shows.
   * @param {JobEntry & Partial<JobPublic>} job
   * @param {unknown} error
   */
  async ended(job, error) {
    const name = this.fileNames.get(job.id) ?? `‘${job.subject}’`;
    const imports = job.kind === "import" || job.kind === "structures" || job.kind === "overlay";
    if (job.kind === "segmentation") {
      if (wasCancelled(error)) note(`Segmentation of ${name} cancelled.`);
      else if (error) note(`${name}: ${/** @type {Error} */ (error).message}`, { error: true });
      else note(`${name} is a structure now. Protect it in Plan.`);
    } else if (wasCancelled(error)) {
      note(imports ? `Import of ${name} cancelled. Nothing of it is kept.` : `Simulation of ${name} cancelled.`);
    } else if (imports) {
      try {
        if (error) await this.answer(job, name, error);
        else if (job.kind === "structures") note("Segmentation imported. Its labels are structures now.");
        else if (job.kind === "overlay") this.offerName();
        else if (job.result) this.offer(job.result);
      } catch (reason) {
        note(`${name}: ${/** @type {Error} */ (reason).message}`, { error: true });
      }
    }
  }

  /**
   * A volume has a plain name, since names of files may tell of the patient: another one can be given.
   */
  offerName() {
    const action = { label: "Name it …", run: () => this.overlays.nameNewest() };
    note("Volume imported. Lay it over under ‘Second volume’ at the slices.", { action });
  }

  /**
   * A head that came in is offered: whatever is open, or runs, stays until somebody chooses.
   * @param {string} caseId
   */
  offer(caseId) {
    const open = () => this.connection.send("case.open", { case_id: caseId });
    if (!this.connection.state.case) open();
    note("Head imported.", this.connection.state.case ? { action: { label: "Open it", run: open } } : {});
  }

  /**
   * Answer what an import's file does not say; the file stays with the planner. Throws what is no such question.
   * @param {JobEntry} job
   * @param {string} name
   * @param {unknown} error
   */
  async answer(job, name, error) {
    const open = missing(error);
    if (!(error instanceof Error) || !open.length) throw error;
    if (this.connection.state.rehearsal?.state === "running") await whenReady(`${name}: a question before the import.`, "Answer");
    const answer = await (open.includes("into") ? this.askInto(name) : this.askWhatIsMissing(name, error, open));
    const path = `/api/v1/jobs/${encodeURIComponent(job.id)}`;
    if (!answer) {
      await remove(`${path}/upload`);
      return;
    }
    const again = await post(`${path}/answer`, answer);
    this.fileNames.set(again.id, this.fileNames.get(job.id) ?? `‘${job.subject}’`);
    this.jobs.watch(again);
  }

  /**
   * A segmentation was sent as a head: it belongs to the open one, perhaps.
   * @param {string} name
   * @returns {Promise<ImportAnswer | null>}
   */
  async askInto(name) {
    const { case: open } = this.connection.state;
    if (!open) {
      note(`${name} is a segmentation. Open its head and import it there.`, { error: true });
      return null;
    }
    const sure = await confirm(`${name} is a segmentation`, `Its labels become structures of the open head, ‘${open.name}’.`, "Import into it");
    return sure ? { into: open.id } : null;
  }

  /**
   * @param {string} name
   * @param {Error} error
   * @param {string[]} open the words for what is missing
   * @returns {Promise<ImportAnswer | null>}
   */
  async askWhatIsMissing(name, error, open) {
    const series = seriesOf(error);
    const questions = open.map((word) => (word === "series" ? seriesQuestion(series) : QUESTIONS[word]));
    const why = error instanceof PlannerError && error.code === "answer_unusable" ? `${error.message} ` : "";
    const words = series.length ? `${why}Choose one of its ${series.length} series to plan on.` : error.message;
    const answer = await askChoices(series.length ? `Which series of ${name}` : `What ${name} does not say`, words, questions, "Import");
    if (!answer) return null;
    const { series: number, ...said } = answer;
    return /** @type {ImportAnswer} */ (number ? { ...said, series: Number(number) } : said);
  }

  /**
   * @param {string} name
   * @param {number} part in [0, 1]
   */
  uploading(name, part) {
    this.progressBar.style.width = `${Math.round(part * 100)}%`;
    this.progressWords.textContent = `${name}: uploading, ${Math.round(part * 100)} %`;
  }
}

/** @param {Found[]} leftOut */
function tellLeftOut(leftOut) {
  const words = leftOutWords(leftOut);
  if (words) note(words, { stay: true });
}

/** @param {string[][]} facts */
function listed(facts) {
  return facts.flatMap(([term, value]) => [h("dt", {}, term), h("dd", {}, value)]);
}

/** @param {string} name */
function surfaceName(name) {
  /** @type {Record<string, string | undefined>} */
  const words = { bone: "Bone that stops the tool", skull: "Skull as drawn", skin: "Skin as drawn", display: "Skull as drawn", skull_half: "Half skull as drawn" };
  return words[name] ?? name;
}

/**
 * One of several series, by what a person knows it by.
 * @param {SeriesFacts[]} series
 * @returns {Question}
 */
function seriesQuestion(series) {
  const options = series.map((one) => [String(one.number), [
    one.modality,
    one.description,
    count(one.slices, "slice", "slices"),
    `${one.columns} × ${one.rows}`,
    one.spacing_mm.length ? `${one.spacing_mm.map((value) => fixed(value, 2)).join(" × ")} mm` : "",
  ].filter(Boolean).join(" · ")]);
  return { name: "series", label: "Series", options };
}

/**
 * A head with all that belongs to it, as one file.
 * @param {{ id: string, name: string, images: boolean } | null | undefined} head
 */
async function save(head) {
  if (!head || (head.images && !await askForImages(head.name))) return;
  download(`/api/v1/cases/${encodeURIComponent(head.id)}/archive?with_images=true`);
  note(`‘${head.name}’ is being packed. The browser saves it as a zip with scan, structures, plans and registrations.`);
}
