// Patient: which head is open, which others there are, and how a new one comes in.
import { h, group, iconButton, whenChanged } from "../dom.js";
import { count, fixed, sentence, when } from "../format.js";
import { FRAME_QUESTION, askChoices, askName, note } from "../dialogs.js";
import { finished, upload } from "../rest.js";

const UNITS = [["mm", "Millimetres"], ["m", "Metres"]];

export class PatientPanel {
  constructor(connection) {
    this.connection = connection;
    this.changedCase = whenChanged();
    this.changedCases = whenChanged();
    this.facts = h("dl", { class: "facts" });
    this.caseWords = h("p", { class: "words" });
    this.uncertainty = h("p", { class: "words", id: "uncertainty" });
    this.list = h("ul", { class: "list" });
    this.showDeleted = h("input", { type: "checkbox", onchange: () => this.update(this.connection.state) });
    this.chooser = h("input", { type: "file", hidden: true, accept: ".nrrd,.nhdr,.nii,.gz,.mha,.mhd,.zip,.dcm,.ply,.stl,.obj", onchange: () => this.chosen() });
    this.importButton = h("button", { type: "button", class: "wide", onclick: () => this.chooser.click() }, "Import a head …");
    this.progressBar = h("div");
    this.progressWords = h("p", { class: "words" });
    this.progress = h("div", { hidden: true }, this.progressWords, h("div", { class: "progress" }, this.progressBar));
    this.element = h("div", {},
      group("This head", null, this.facts, this.caseWords, this.uncertainty),
      group("Heads", null, this.list, h("label", { class: "check" }, this.showDeleted, "Show deleted heads")),
      group("Import", null,
        h("p", { class: "words" }, "A CT volume (NRRD, NIfTI, MHA, a zip of DICOM slices) or a bone surface (PLY, STL, OBJ). It stays on this computer."),
        this.importButton, this.chooser, this.progress));
  }

  update(state) {
    this.changedCase([state.case], () => this.renderCase(state.case));
    this.changedCases([state.cases, this.showDeleted.checked, state.case?.id], () => this.renderCases(state));
  }

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
    this.caseWords.textContent = open.loading ?? (open.frame.assumed ? "The file did not name its frame; LPS in millimetres was assumed. Check left and right." : "");
    this.uncertainty.textContent = open.uncertainty ? `${sentence(open.uncertainty)}; the margin has to cover that.` : "";
    this.uncertainty.hidden = !open.uncertainty;
    this.caseWords.className = open.frame.assumed ? "words caution" : "words";
  }

  renderCases(state) {
    const shown = (state.cases?.items ?? []).filter((item) => this.showDeleted.checked || !item.deleted);
    this.list.replaceChildren(...shown.map((item) => this.row(item, state.case?.id)));
  }

  row(item, openId) {
    const send = (type, fields = {}) => this.connection.send(type, { case_id: item.id, ...fields });
    const tools = item.deleted
      ? [iconButton("restore", "Restore", () => send("case.restore"))]
      : [
        iconButton("pencil", "Rename", async () => {
          const name = await askName("Rename this head", item.name);
          if (name) send("case.rename", { name });
        }),
        iconButton("trash", "Delete", () => this.connection.request("case.delete", { case_id: item.id })
          .then(() => note("The head was deleted.", { action: { label: "Restore", run: () => send("case.restore") } }))
          .catch((error) => note(error.message, { error: true })), { disabled: item.id === openId, title: item.id === openId ? "The open head cannot be deleted" : "Delete" }),
      ];
    const main = h("button", { type: "button", class: "row-main", disabled: item.deleted, onclick: () => send("case.open") },
      item.name, h("span", { class: "row-sub" }, when(item.created)));
    return h("li", { class: item.deleted ? "row deleted" : "row", "aria-current": String(item.id === openId) }, main, h("div", { class: "row-tools" }, tools));
  }

  async chosen() {
    const file = this.chooser.files[0];
    this.chooser.value = "";
    if (file) await this.send(file, {});
  }

  async send(file, answers) {
    const form = new FormData();
    form.append("file", file);
    for (const [key, value] of Object.entries(answers)) form.append(key, value);
    this.importButton.disabled = true;
    this.progress.hidden = false;
    try {
      const job = await finished(await upload("/api/cases", form, (part) => this.uploading(part)), (now) => this.working(now));
      note("The head was imported.");
      this.connection.send("case.open", { case_id: job.result });
    } catch (error) {
      if (error.code === "frame_error" && !answers.frame) await this.askFrame(file, error);
      else note(error.message, { error: true });
    } finally {
      this.importButton.disabled = false;
      this.progress.hidden = true;
    }
  }

  uploading(part) {
    this.progressBar.style.width = `${Math.round(part * 100)}%`;
    this.progressWords.textContent = `Uploading, ${Math.round(part * 100)} %`;
  }

  working(job) {
    this.progressBar.style.width = `${Math.round(job.fraction * 100)}%`;
    this.progressWords.textContent = `${job.stage}, ${Math.round(job.fraction * 100)} %`;
  }

  async askFrame(file, error) {
    const questions = [FRAME_QUESTION, { name: "units", label: "Unit", options: UNITS }];
    const chosen = await askChoices("Which frame and unit?", error.message, questions, "Import");
    if (chosen) await this.send(file, chosen);
  }
}

function surfaceName(name) {
  const words = { bone: "Bone for control", skull: "Skull for display", skin: "Skin for display", display: "Skull for display", skull_half: "Half skull for display" };
  return words[name] ?? name;
}
