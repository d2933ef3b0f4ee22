// Study: whose turn it is, and the one thing that is next: consent, a trial, or a questionnaire.
import { note } from "/static/js/dialogs.js";
import { h } from "/static/js/dom.js";
import { closeStudy, openStudy } from "/static/js/led-study.js";
import { download } from "/static/js/rest.js";
import { draw, filesButton, hintLine, html, iconTool, nothing, repeat, titled } from "/static/js/template.js";

/** @import { Connection } from "/static/js/connection.js" */
/** @import { Commands, LedStudyView, LumenTrialView, TrialView, ViewModel } from "/static/js/types.js" */

/** @type {[string, string, string][]} name, low end, high end; in the order of the planner's */
const SCALES = [
  ["Mental demand", "low", "high"], ["Physical demand", "low", "high"], ["Temporal demand", "low", "high"],
  ["Performance", "perfect", "failure"], ["Effort", "low", "high"], ["Frustration", "low", "high"],
];
const MIDDLE = 50;
const TLX_HELP = "NASA-TLX without weights: six scales of 0 to 100 in steps of 5. Each has to be moved or clicked once.";
const TRIAL_HELP = "Begin opens the plan in Rehearse, in its mode and view, or the route in Drive, in its arm with its task. "
  + "Press Finish run there at the end, unless the task ends it; the run becomes the trial, and this tab comes back.";
/** @type {Commands["rehearsal.options"]} */
const NO_LIMITS = { soft_tissue: false, remote_centre: false, speed_limit: false };
/** Of each tab that drives its name, and of a document how it is called. @type {Record<TrialView["tab"], [string, string]>} */
const TABS = { rehearse: ["Rehearse", "Plan"], drive: ["Drive", "Route"] };
/** @type {Record<LumenTrialView["task"], string>} */
const TASKS = { polyps: "Polyps", labels: "Labels" };

export default class StudyPanel {
  /** @param {{ connection: Connection }} page */
  constructor({ connection }) {
    this.connection = connection;
    this.element = h("div", { id: "study" });
    this.reason = "";
    this.agreed = "";
    /** @type {{ at: string, values: (number | null)[] }} */
    this.rated = { at: "", values: [] };
  }

  /**
   * @template {keyof Commands} K
   * @param {K} type
   * @param {Commands[K]} said
   */
  async ask(type, said) {
    try {
      await this.connection.request(type, said);
      return true;
    } catch (error) {
      note(error instanceof Error ? error.message : String(error), { error: true });
      return false;
    }
  }

  /** @param {ViewModel} state */
  update({ study }) {
    if (!study) return;
    const running = Boolean(study.trial?.running), done = study.subjects.find(({ code }) => code === study.subject);
    const tools = html`${iconTool("undo", "Undo", () => this.ask("study.undo", {}), { operation: "study.undo", off: !study.can_undo })}${
      iconTool("redo", "Redo", () => this.ask("study.redo", {}), { operation: "study.redo", off: !study.can_redo })}${
      iconTool("blocked", "Close study", () => closeStudy(this.connection), { id: "close-study" })}`;
    draw(this.element, html`
      <div class="group">${titled(study.name, tools, html`
        <label class="field"><span>Subject</span><select id="study-subject" data-operation="study.subject" ?disabled=${running} .value=${study.subject} @change=${(/** @type {Event} */ { currentTarget }) => this.choose(/** @type {HTMLSelectElement} */ (currentTarget).value)}>
          ${study.subjects.map(({ code, done: runs, skipped }) => html`<option value=${code} ?selected=${code === study.subject}>${code}: ${runs + skipped} of ${study.total}</option>`)}</select></label>
        <progress class="study-progress" aria-label="Trials done" max=${study.total} value=${(done?.done ?? 0) + (done?.skipped ?? 0)}></progress>`)}</div>
      <div class="group" id="study-next">${this.next(study)}</div>
      ${study.missing.length ? html`<div class="group">${titled("Missing trials", null, html`<ul class="list two-lines plain-rows" id="study-missing">${repeat(study.missing, ({ position }) => position, ({ position, label, reason }) => html`
        <li class="row"><span class="row-main"><span>Trial ${position}: ${label}</span><span class="row-sub">${reason}</span></span>
          <div class="row-tools"><button type="button" data-operation="study.repeat" ?disabled=${running} @click=${() => this.again(study, position)}>Repeat</button></div></li>`)}</ul>`)}</div>` : nothing}
      <div class="group"><div class="buttons">
        ${study.attached.length ? html`<button type="button" data-operation="study.repeat" ?disabled=${running} @click=${() => this.again(study, Math.max(...study.attached))}>Repeat last trial</button>` : nothing}
        ${study.following ? this.saveButton(study, "") : nothing}
        <span data-operation="study.new">${filesButton({ id: "open-study", input: "study-file", words: "Open another", disabled: running, accept: ".toml" }, ([file]) => openStudy(this.connection, file))}</span></div></div>`);
  }

  /** @param {string} subject */
  choose(subject) {
    return this.ask("study.subject", { subject });
  }

  /** @param {LedStudyView} study @param {number} position */
  again({ subject }, position) {
    return this.ask("study.repeat", { subject, position });
  }

  /** The one thing that is next. @param {LedStudyView} study */
  next(study) {
    const { trial } = study;
    if (study.next === "consent") return this.consent(study);
    if (study.next === "done" || !trial) return this.done(study);
    return study.next === "questionnaire" ? this.questionnaire(study, trial) : this.trial(study, trial);
  }

  /** What came of a subject, and who follows; or of all. @param {LedStudyView} study */
  done(study) {
    const { subject, subjects, following } = study;
    const of = following ? subjects.filter(({ code }) => code === subject) : subjects;
    const [runs, skipped] = [of.reduce((sum, one) => sum + one.done, 0), of.reduce((sum, one) => sum + one.skipped, 0)];
    return titled(following ? `${subject} is done` : "All done", null, html`
      <dl class="facts" id="study-done"><dt>Runs</dt><dd>${runs}</dd><dt>Missing</dt><dd>${skipped}</dd></dl>
      ${following ? html`<button type="button" class="primary wide" data-operation="study.subject" @click=${() => this.choose(following)}>Next: ${following}</button>` : this.saveButton(study, "primary wide")}`);
  }

  /** @param {LedStudyView} study @param {string} look */
  saveButton({ id, subjects }, look) {
    return html`<button type="button" id="save-results" class=${look} title="Tables, statistics and report, zipped" ?disabled=${!subjects.some(({ done, skipped }) => done + skipped)}
      @click=${() => download(`/api/v1/studies/${encodeURIComponent(id)}/results`)}>Save results</button>`;
  }

  /** @param {LedStudyView} study */
  consent({ consent, subject }) {
    const agreed = this.agreed === subject;
    return titled("Consent", null, html`
      <p class="study-consent" id="consent-text">${consent}</p>
      <label class="check"><input type="checkbox" id="consent-read" .checked=${agreed} @change=${(/** @type {Event} */ { currentTarget }) => { this.agreed = /** @type {HTMLInputElement} */ (currentTarget).checked ? subject : ""; this.update(this.connection.state); }}> ${subject} agrees</label>
      <button type="button" class="primary wide" data-operation="study.consent" ?disabled=${!agreed} @click=${() => this.ask("study.consent", { subject })}>Confirm consent</button>`);
  }

  /** @param {LedStudyView} study @param {TrialView} trial */
  trial(study, trial) {
    const { subject, total, each } = study;
    return titled(`Trial ${trial.position} of ${total}`, null, html`
      ${study.break_min ? html`<p class="words" id="study-break" role="status">Break first: ${study.break_min} min.</p>` : nothing}
      <dl class="facts" id="study-trial">${facts(trial).map(([term, value]) => html`<dt>${term}</dt><dd>${value}</dd>`)}<dt>In this condition</dt><dd>${trial.number} of ${each}</dd></dl>
      ${hintLine("study-words", trial.running ? `The trial goes on in ${TABS[trial.tab][0]}.` : `${subject} drives next.`, TRIAL_HELP)}
      ${trial.running
        ? html`<div class="buttons even"><button type="button" class="primary" id="back-to-trial" @click=${() => this.set(trial)}>Back to trial</button>
          <button type="button" id="cancel-trial" data-operation="study.repeat" @click=${() => this.again(study, trial.position)}>Cancel trial</button></div>`
        : html`<button type="button" class="primary wide" id="begin-trial" data-operation="study.begin" @click=${() => this.begin(study, trial)}>Begin trial</button>`}
      <details class="study-skip"><summary>Skip trial</summary>
        <label class="field"><span>Why</span><input type="text" id="skip-reason" maxlength="200" .value=${this.reason} @input=${(/** @type {Event} */ { currentTarget }) => { this.reason = /** @type {HTMLInputElement} */ (currentTarget).value; this.update(this.connection.state); }}></label>
        <button type="button" id="skip-trial" data-operation="study.skip" ?disabled=${!this.reason.trim()} @click=${() => this.skip(subject)}>Skip</button></details>`);
  }

  /** @param {string} subject */
  async skip(subject) {
    if (!await this.ask("study.skip", { subject, reason: this.reason.trim() })) return;
    this.reason = "";
    this.update(this.connection.state);
  }

  /** A drive of before ends first: its run is no trial, since it began earlier. @param {LedStudyView} study @param {TrialView} trial */
  async begin({ subject }, trial) {
    if (!await this.open(trial)) return;
    const { rehearsal } = this.connection.state;
    if (rehearsal?.state && rehearsal.state !== "absent" && !await this.ask("rehearsal.end", {})) return;
    if (trial.plan && !await this.ask("rehearsal.options", NO_LIMITS)) return;
    if (await this.ask("study.begin", { subject })) await this.set(trial);
  }

  /** Open the case and the plan or route of a trial. @param {TrialView} trial */
  async open({ case_id: id, document_id: document, plan }) {
    if (this.connection.state.case?.id !== id && !await this.ask("case.open", { case_id: id })) return false;
    if (plan) return this.connection.state.plan?.id === document || this.ask("plan.open", { plan_id: document });
    return this.connection.state.route?.id === document || this.ask("route.open", { route_id: document });
  }

  /** Go to what the trial is driven with; the planner itself sets a drive of a lumen. @param {TrialView} trial */
  async set(trial) {
    if (!await this.open(trial) || (trial.plan && !await this.ask("rehearsal.control", trial.plan))) return;
    await this.ask("step.set", { name: trial.tab });
  }

  /** @param {LedStudyView} study @param {TrialView} trial */
  questionnaire(study, trial) {
    const at = `${study.id}/${study.subject}/${trial.position}`;
    if (this.rated.at !== at) this.rated = { at, values: SCALES.map(() => null) };
    const { values } = this.rated;
    return titled("Questionnaire", null, html`
      ${hintLine("tlx-words", `${study.subject}: how was ${trial.label}?`, TLX_HELP)}
      ${SCALES.map(([name, low, high], index) => html`<label class="study-scale"><span>${name}<output>${values[index] ?? "–"}</output></span>
        <span class="study-ends">${low}<input type="range" min="0" max="100" step="5" aria-label=${name} .value=${String(values[index] ?? MIDDLE)} ?data-unset=${values[index] === null}
          @input=${(/** @type {Event} */ event) => this.rate(index, event)} @click=${(/** @type {Event} */ event) => this.rate(index, event)}>${high}</span></label>`)}
      <button type="button" class="primary wide" data-operation="study.answer" ?disabled=${values.includes(null)} @click=${() => this.ask("study.answer", { subject: study.subject, ratings: /** @type {Commands["study.answer"]["ratings"]} */ (values) })}>Save answers</button>`);
  }

  /** @param {number} index @param {Event} event */
  rate(index, { currentTarget }) {
    this.rated.values[index] = Number(/** @type {HTMLInputElement} */ (currentTarget).value);
    this.update(this.connection.state);
  }
}

/**
 * How a trial is driven, as names and values.
 * @param {TrialView} trial
 * @returns {[string, string | null | undefined][]}
 */
function facts({ tab, document, plan, lumen, view }) {
  /** @type {[string, string | null | undefined][]} */
  const every = [
    ["Mode", plan?.mode], ["Task", lumen && TASKS[lumen.task]], ["Arm", lumen?.arm], [TABS[tab][1], document],
    ["Parameters", (plan ?? lumen)?.preset], ["View", view],
  ];
  return every.filter(([, value]) => value);
}
