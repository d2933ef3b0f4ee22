// Patient: which head is open, which others there are, and how a new one comes in.
import { fillListRow, group, h, iconButton, keyed, listRow, whenChanged } from "/static/js/dom.js";
import { count, fixed, sentence, when } from "/static/js/format.js";
import { FRAME_QUESTION, askChoices, askName, clearErrors, note, noteDone, whenReady } from "/static/js/dialogs.js";
import { JobList } from "/static/js/job-list.js";
import { missing, post, remove, upload, wasCancelled } from "/static/js/rest.js";

/** @import { Parts } from "/static/js/panel.js" */
/** @import { Row } from "/static/js/dom.js" */
/** @import { Question } from "/static/js/dialogs.js" */
/** @import { CaseEntry, CaseSection, JobPublic, ViewModel } from "/static/js/types.js" */

// What a file may leave unsaid, by the word that the planner has for it.
/** @type {Record<string, Question>} */
const QUESTIONS = {
  frame: FRAME_QUESTION,
  unit: { name: "units", label: "Unit", options: [["mm", "Millimetres"], ["m", "Metres"]] },
};
const READABLE = /\.(nrrd|nii|nii\.gz|mha|zip|ply|stl|obj)$/i;
/**
 * Files that look like a head and are only a part of one; the last one is every other file.
 * @type {[RegExp, string][]}
 */
const PARTS = [
  [/\.nhdr$/i, "the voxels lie in a second file, which this one only names. Save the volume as one .nrrd file."],
  [/\.mhd$/i, "the voxels lie in a second file, which this one only names. Save the volume as one .mha file."],
  [/\.(dcm|ima)$/i, "one DICOM slice is not a volume. Put every slice of the series into one .zip file."],
  [/./, "a head is imported from .nrrd, .nii, .nii.gz, .mha, a .zip of DICOM slices, .ply, .stl or .obj."],
];

export default class PatientPanel {
  /** @param {Parts} parts */
  constructor({ connection }) {
    this.connection = connection;
    this.changedCase = whenChanged();
    this.changedCases = whenChanged();
    this.facts = h("dl", { class: "facts" });
    this.caseWords = h("p", { class: "words" });
    this.uncertainty = h("p", { class: "words", id: "uncertainty" });
    this.list = h("ul", { class: "list" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(this.connection.state) });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".nrrd,.nii,.gz,.mha,.zip,.ply,.stl,.obj", onchange: () => this.chosen() });
    this.importButton = h("button", { type: "button", class: "wide", onclick: () => this.chooser.click() }, "Import a head …");
    this.progressBar = h("div");
    this.progressWords = h("p", { class: "words" });
    /** @type {Map<string, string>} what this page's imports were chosen as, by their job */
    this.fileNames = new Map();
    this.jobs = new JobList((job, error) => this.ended(job, error));
    this.progress = h("div", { hidden: true }, this.progressWords, h("div", { class: "progress" }, this.progressBar));
    this.element = h("div", {},
      group("This head", null, this.facts, this.caseWords, this.uncertainty),
      group("Heads", null, this.list, h("label", { class: "check" }, this.showDeleted, "Show deleted heads")),
      group("Import", null,
        h("p", { class: "words" }, "A CT volume (NRRD, NIfTI, MHA, a zip of DICOM slices) or a bone surface (PLY, STL, OBJ). It stays on this computer."),
        this.importButton, this.chooser, this.progress, this.jobs.element));
  }

  /** @param {ViewModel} state */
  update(state) {
    this.changedCase([state.case], () => this.renderCase(state.case));
    this.changedCases([state.cases, this.showDeleted.checked, state.case?.id], () => this.renderCases(state));
  }

  /** @param {CaseSection | null | undefined} open */
  renderCase(open) {
    if (!open) {
      this.facts.replaceChildren();
      this.uncertainty.hidden = true;
      this.caseWords.textContent = "No head is open. Choose one below.";
      return;
    }
    const spacing = open.spacing_mm ? open.spacing_mm.map((value) => fixed(value, 2)).join(" × ") : "no CT, surface only";
    const facts = [
      ["Name", open.name],
      ["Voxel size, mm", spacing],
      ["Frame", open.frame.assumed ? `${open.frame.name}, assumed` : open.frame.name],
      ...open.surfaces.map((surface) => [surfaceName(surface.name), [count(surface.triangles, "triangle", "triangles"), surface.words].filter(Boolean).join("; ")]),
    ];
    if (open.beads) facts.push(["Markers", count(open.beads, "bead", "beads")]);
    this.facts.replaceChildren(...facts.flatMap(([term, value]) => [h("dt", {}, term), h("dd", {}, value)]));
    const assumed = open.frame.assumed && !open.notes.length; // of a case that is older than its notes
    const doubts = assumed ? ["The file did not name its frame or its unit; LPS or millimetres were assumed. Check left and right."] : open.notes;
    this.caseWords.textContent = open.loading ?? doubts.join(" ");
    this.caseWords.className = doubts.length ? "words caution" : "words";
    this.uncertainty.textContent = open.uncertainty ? `${sentence(open.uncertainty)}; the margin has to cover that.` : "";
    this.uncertainty.hidden = !open.uncertainty;
  }

  /** @param {ViewModel} state */
  renderCases(state) {
    const shown = (state.cases?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    keyed(this.list, shown, (item) => `${item.id} ${item.deleted}`, (item) => this.row(item), (row, item) => {
      const open = item.id === state.case?.id;
      fillListRow(row, item, when(item.created), open);
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
          const name = await askName("Rename this head", before);
          if (name) this.connection.send("case.rename", { case_id: id, name });
        }),
        iconButton("trash", "Delete", () => this.remove(row.item.id), { "data-tool": "delete" }),
      ];
    /** @type {Row<CaseEntry>} */
    const row = listRow(deleted, () => send("case.open"), tools);
    return row;
  }

  /** @param {string} id */
  remove(id) {
    const fields = { case_id: id };
    noteDone(this.connection.request("case.delete", fields), "The head was deleted.",
      { label: "Restore", run: () => this.connection.send("case.restore", fields) });
  }

  async chosen() {
    const file = this.chooser.files?.[0];
    this.chooser.value = "";
    if (!file) return;
    if (READABLE.test(file.name)) await this.send(file);
    else note(`‘${file.name}’: ${PARTS.find(([ending]) => ending.test(file.name))?.[1]}`, { error: true });
  }

  /** @param {File} file */
  async send(file) {
    const form = new FormData();
    form.append("file", file);
    clearErrors();
    this.importButton.disabled = true;
    this.progress.hidden = false;
    try {
      /** @type {JobPublic} */
      const job = await upload("/api/cases", form, (part) => this.uploading(file.name, part));
      this.fileNames.set(job.id, file.name);
      this.jobs.watch(job);
    } catch (error) {
      note(`‘${file.name}’: ${/** @type {Error} */ (error).message}`, { error: true });
    } finally {
      this.importButton.disabled = false;
      this.progress.hidden = true;
    }
  }

  /**
   * What came of a job: a new head, a question, or why there is none. What a dry run gives, the Plan step shows.
   * @param {JobPublic} job
   * @param {unknown} error
   */
  async ended(job, error) {
    const name = `‘${this.fileNames.get(job.id) ?? job.subject}’`;
    if (wasCancelled(error)) {
      note(job.kind === "import" ? `The import of ${name} was cancelled. Nothing of it is kept.` : `The dry run of ${name} was cancelled.`);
    } else if (job.kind === "import") {
      try {
        if (error) await this.answer(job, name, error);
        else if (job.result) this.offer(job.result);
      } catch (reason) {
        note(`${name}: ${/** @type {Error} */ (reason).message}`, { error: true });
      }
    }
  }

  /**
   * A head that came in is offered: whatever is open, or runs, stays until somebody chooses.
   * @param {string} caseId
   */
  offer(caseId) {
    const open = () => this.connection.send("case.open", { case_id: caseId });
    if (!this.connection.state.case) open();
    note("The head was imported. It is in the list of heads.", this.connection.state.case ? { action: { label: "Open it", run: open } } : {});
  }

  /**
   * Answer what an import's file does not say; the file stays with the planner. Throws what is no such question.
   * @param {JobPublic} job
   * @param {string} name
   * @param {unknown} error
   */
  async answer(job, name, error) {
    const questions = missing(error).map((word) => QUESTIONS[word]);
    if (!(error instanceof Error) || !questions.length) throw error;
    if (this.connection.state.rehearsal?.state === "running") await whenReady(`${name} does not say all that is needed.`, "Answer");
    const answer = await askChoices(`What ${name} does not say`, error.message, questions, "Import");
    const path = `/api/jobs/${encodeURIComponent(job.id)}`;
    if (!answer) {
      await remove(`${path}/upload`);
      return;
    }
    const again = await post(`${path}/answer`, answer);
    this.fileNames.set(again.id, this.fileNames.get(job.id) ?? job.subject);
    this.jobs.watch(again);
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

/** @param {string} name */
function surfaceName(name) {
  /** @type {Record<string, string | undefined>} */
  const words = { bone: "Bone for control", skull: "Skull for display", skin: "Skin for display", display: "Skull for display", skull_half: "Half skull for display" };
  return words[name] ?? name;
}
