// Import of heads, structures and second volumes: files chosen or dropped, their upload, and the answers to what they do not say.
import { h } from "/static/js/dom.js";
import { count, fixed } from "/static/js/format.js";
import { FRAME_QUESTION, askChoices, clearErrors, confirm, note, whenReady } from "/static/js/dialogs.js";
import { PlannerError, missing, remove, send, seriesOf, upload, wasCancelled } from "/static/js/rest.js";
import { draw, filesButton, html, nothing, said } from "/static/js/template.js";
import { ACCEPTED, chosen, dropped, formOf, isSegmentation, leftOutWords, refusal, sorted, uploadWords } from "./files-in.js";
import { descriptionCheck } from "./overlays.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Question } from "/static/js/dialogs.js" */
/** @import { JobList } from "/static/js/job-list.js" */
/** @import { SeriesFacts } from "/static/js/rest.js" */
/** @import { Found } from "./files-in.js" */
/** @import { ImportAnswer, JobEntry, JobPublic } from "/static/js/types.js" */

// What a file may leave unsaid, by the word that the planner has for it.
/** @type {Record<string, Question>} */
const QUESTIONS = {
  frame: FRAME_QUESTION,
  unit: { name: "units", label: "Unit", options: [["mm", "Millimetres"], ["m", "Metres"], ["um", "Micrometres"]] },
};

const DROP = "Drop files here. They stay on this computer. Images can identify the patient: an export that holds them asks first. A CT (DICOM, NRRD, NIfTI, MetaImage), a surface of bone or of a lumen (PLY, STL, OBJ, GLB, VTK, VTP), a segmentation of the open head, or the zip of a saved case.";
const LUMEN_HELP = "Wall, label map, or CT with air.";
const HEAD = { id: "import-head", input: "head-files", words: "Import head …", accept: ACCEPTED };
const LUMEN = { id: "import-lumen", input: "lumen-file", words: "Import lumen …", accept: ACCEPTED, title: LUMEN_HELP };
const FOLDER = { id: "import-folder", input: "folder", words: "Folder …", folder: true };

export class ImportGroup {
  /**
   * @param {Connection} connection
   * @param {JobList} jobs
   * @param {() => void} nameNewest asks for a name of the second volume that came last
   */
  constructor(connection, jobs, nameNewest) {
    this.connection = connection;
    this.jobs = jobs;
    this.nameNewest = nameNewest;
    this.describe = descriptionCheck();
    /** @type {{ name: string, part: number } | null} what is on its way to the planner */
    this.sending = null;
    /** @type {Map<string, string>} what this page's imports were chosen as, by their job */
    this.fileNames = new Map();
    this.form = h("div", { class: "fields" });
    this.progress = h("div", { class: "import-progress" });
    this.element = h("div", { class: "fields" }, this.progress, this.jobs.element, this.form, this.describe.element);
    this.draw();
  }

  draw() {
    const { sending } = this, part = `${Math.round(100 * (sending?.part ?? 0))}`;
    const take = (/** @type {File[]} */ files) => this.take(chosen(files));
    const takeLumen = (/** @type {File[]} */ files) => this.take(chosen(files), false, true);
    draw(this.form, html`
      <p class="words">${said(DROP)}</p>
      <div class="buttons even">${filesButton({ ...HEAD, disabled: sending !== null }, take)}${filesButton({ ...FOLDER, disabled: sending !== null }, take)}</div>
      <div class="buttons">${filesButton({ ...LUMEN, disabled: sending !== null }, takeLumen)}</div>`);
    draw(this.progress, html`${sending ? html`<p class="words">${sending.name}: uploading, ${part} %</p>
      <div class="progress"><div style=${`width: ${part}%`}></div></div>` : nothing}`);
    this.progress.hidden = !sending;
  }

  /**
   * Files dropped on the panel are imported; elsewhere on the page the browser must not open them in its place.
   * @param {HTMLElement} panel
   */
  acceptDrops(panel) {
    const mark = (/** @type {boolean} */ over) => panel.classList.toggle("dropping", over);
    window.addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      const here = event.target instanceof Node && panel.contains(event.target);
      event.dataTransfer.dropEffect = here ? "copy" : "none";
      mark(here);
    });
    window.addEventListener("dragleave", () => mark(false));
    window.addEventListener("drop", async (event) => {
      if (!event.dataTransfer?.types.includes("Files")) return;
      event.preventDefault();
      mark(false);
      if (!(event.target instanceof Node && panel.contains(event.target))) return;
      try {
        await this.take(await dropped(event.dataTransfer));
      } catch (error) {
        note(`Cannot be read: ${/** @type {Error} */ (error).message}`, { error: true });
      }
    });
  }

  /**
   * Import what was chosen or dropped: a head, or a segmentation of the open one.
   * @param {Found[]} found
   * @param {boolean} [intoOpen] whether it was said to be a segmentation
   * @param {boolean} [lumen] whether it was said to be the wall of a lumen
   */
  async take(found, intoOpen = false, lumen = false) {
    const what = await sorted(found);
    const [name, why] = [uploadWords(what.files), refusal(what.files)];
    if (why) {
      note(`${name}: ${why}`, { error: true });
      return;
    }
    tellLeftOut(what.leftOut);
    const open = this.connection.state.case;
    const structures = open && !lumen && (intoOpen || isSegmentation(what.files));
    const address = structures ? `/api/v1/cases/${encodeURIComponent(open.id)}/structures` : "/api/v1/cases";
    await this.send(address, name, formOf(what, !structures && this.describe.input.checked, lumen));
  }

  /**
   * Import a second volume of the open head.
   * @param {Found[]} found
   * @param {boolean} described named by its series description
   */
  async takeOverlay(found, described) {
    const what = await sorted(found);
    const open = this.connection.state.case;
    tellLeftOut(what.leftOut);
    if (open) await this.send(`/api/v1/cases/${encodeURIComponent(open.id)}/overlays`, uploadWords(what.files), formOf(what, described));
  }

  /**
   * @param {string} address
   * @param {string} name
   * @param {FormData} form
   */
  async send(address, name, form) {
    clearErrors();
    this.uploading({ name, part: 0 });
    this.progress.scrollIntoView({ block: "nearest" });
    try {
      /** @type {JobPublic} */
      const job = await upload(address, form, (part) => this.uploading({ name, part }));
      this.fileNames.set(job.id, name);
      this.jobs.watch(job);
      this.jobs.element.scrollIntoView({ block: "nearest" }); // its line may lie below the fold
    } catch (error) {
      note(`${name}: ${/** @type {Error} */ (error).message}`, { error: true });
    } finally {
      this.uploading(null);
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
      else note(`${name} is made. Protect it in Plan.`);
    } else if (wasCancelled(error)) {
      note(imports ? `Import of ${name} cancelled. Nothing of it is kept.` : `Simulation of ${name} cancelled.`);
    } else if (imports) {
      try {
        if (error) await this.answer(job, name, error);
        else if (job.kind === "structures") note("Segmentation imported.");
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
    const action = { label: "Name it …", run: this.nameNewest };
    note("Volume imported. Show it under ‘Second volume’.", { action });
  }

  /**
   * A head that came in is offered: whatever is open, or runs, stays until somebody chooses.
   * @param {string} caseId
   */
  offer(caseId) {
    const open = () => this.connection.send("case.open", { case_id: caseId });
    if (!this.connection.state.case) open();
    note("Case imported.", this.connection.state.case ? { action: { label: "Open it", run: open } } : {});
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
    const again = await send(`${path}/answer`, answer);
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
    const { series: number, ...rest } = answer;
    return /** @type {ImportAnswer} */ (number ? { ...rest, series: Number(number) } : rest);
  }

  /** @param {{ name: string, part: number } | null} sending part in [0, 1] */
  uploading(sending) {
    this.sending = sending;
    this.draw();
  }
}

/** @param {Found[]} leftOut */
function tellLeftOut(leftOut) {
  const words = leftOutWords(leftOut);
  if (words) note(words, { stay: true });
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
