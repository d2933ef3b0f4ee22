"""Files in on the Patient tab: segmentations become structures, one of several series is chosen."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from pydicom.uid import generate_uid
from workstation import Rest, Workstation

from tests.engine.imaging_phantoms import dicom_slices, save_dicom
from tests.engine.label_files import ellipsoid, save_nifti, save_seg_nrrd
from vfix_engine.files.volume import Volume

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
SHAPE = (40, 60, 60)
EYE, NERVE = ellipsoid(SHAPE, (20, 20, 20), (10, 10, 10)), ellipsoid(SHAPE, (40, 30, 20), (5, 20, 5))


def place() -> np.ndarray:
    """A grid within the phantom."""
    transform = np.eye(4)
    transform[:3, 3] = [-30.0, -60.0, -10.0]
    return transform


@pytest.fixture
def station(open_page: Open, rest: Rest) -> Iterator[Workstation]:
    opened = open_page().ready()
    opened.page.click("[data-step=patient]")
    opened.wait_for("Patient", lambda: opened.state("step")["name"] == "patient")
    yield opened
    path = "/api/v1/cases/head-phantom/structures"
    for item in rest.client.get(path).json():
        if item["role"] == "spare":
            rest.client.delete(f"{path}/{item['id']}").raise_for_status()


def names(station: Workstation) -> list[str]:
    return [item["name"] for item in station.state("structures")["items"]]


def test_a_segmentation_becomes_structures(station: Workstation, rest: Rest, tmp_path: Path) -> None:
    """Imported, drawn in the scene, hidden, renamed, recoloured and deleted from the list."""
    segments: list[dict[str, object]] = [
        {"Name": "Left eye", "LabelValue": 1, "Layer": 0, "Color": "0.9 0.2 0.2"},
        {"Name": "<b>Optic</b> nerve", "LabelValue": 2, "Layer": 0, "Color": "0.95 0.9 0.2"},
    ]
    file = save_seg_nrrd(tmp_path / "x.seg.nrrd", [np.where(EYE, 1, np.where(NERVE, 2, 0))], segments, place())
    page = station.page
    page.set_input_files("#segmentation-file", file)
    station.wait_for("the structures", lambda: names(station) == ["Left eye", "<b>Optic</b> nerve"])
    panel = page.locator("#panel")
    expect(panel.locator("[data-structure]")).to_have_count(2)
    expect(panel).to_contain_text("<b>Optic</b> nerve", use_inner_text=True)
    station.look_from("anterior")
    station.picture("structures")
    row = panel.locator("[data-structure]").first
    expect(row.locator("input[type=checkbox]")).to_be_checked()
    row.locator("input[type=checkbox]").click()
    station.wait_for("it hidden", lambda: not station.state("structures")["items"][0]["shown"])
    expect(row.locator("input[type=checkbox]")).not_to_be_checked()
    row.hover()
    row.get_by_role("button", name="Rename").click()
    page.locator("dialog input").fill("Eye, left")
    page.keyboard.press("Enter")
    station.wait_for("its name", lambda: names(station)[0] == "Eye, left")
    row.locator("input[type=color]").fill("#00ff80")
    station.wait_for("its colour", lambda: station.state("structures")["items"][0]["colour"] == "#00ff80")
    page.click("#structures-all")
    station.wait_for("all hidden", lambda: not any(item["shown"] for item in station.state("structures")["items"]))
    row.hover()
    row.get_by_role("button", name="Delete").click()
    expect(page.locator("dialog .words")).to_contain_text("file can be imported again")
    page.locator("dialog button.primary").click()
    station.wait_for("one left", lambda: names(station) == ["<b>Optic</b> nerve"])
    assert station.errors == []


DROP = """([files, selector]) => {
  const transfer = new DataTransfer();
  for (const [name, data] of files) {
    const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    transfer.items.add(new File([bytes], name));
  }
  const target = document.querySelector(selector);
  for (const type of ["dragover", "drop"]) {
    target.dispatchEvent(new DragEvent(type, { bubbles: true, cancelable: true, dataTransfer: transfer }));
  }
}"""


def drop(station: Workstation, *files: Path, onto: str = "#panel .drop") -> None:
    station.page.wait_for_selector("#panel .drop")
    sent = [[file.name, base64.b64encode(file.read_bytes()).decode()] for file in files]
    station.page.evaluate(DROP, [sent, onto])


def test_what_is_dropped_says_what_it_is(station: Workstation, tmp_path: Path) -> None:
    """A label map looks like a CT by its name: the planner finds out, and the file is not sent twice."""
    file = save_nifti(tmp_path / "labels.nii.gz", EYE.astype(int), place())
    table = tmp_path / "names.csv"
    table.write_text("label,name\n1,eye_left\n")
    sent: list[str] = []
    station.page.on("request", lambda request: sent.append(request.url) if request.method == "POST" else None)
    drop(station, file, table)
    dialog = station.page.locator("dialog")
    expect(dialog).to_be_visible()
    expect(dialog).to_contain_text("segmentation")
    dialog.locator("button.primary").click()
    station.wait_for("the structure", lambda: names(station) == ["eye_left"])
    assert sum(url.endswith("/api/v1/cases") for url in sent) == 1
    assert sum(url.endswith("/structures") for url in sent) == 0
    notes = station.page.locator("[data-structure] .structure-notes")
    notes.locator("summary").click()
    expect(notes).to_contain_text("a grid of its own", use_inner_text=True)
    drop(station, tmp_path / "names.csv")
    expect(station.page.locator("#alerts")).to_contain_text("no file in it")
    drop(station, file, onto="#hint")
    station.drawn()
    assert station.errors == []


def head() -> Volume:
    hu = np.full((30, 40, 40), -1000, dtype=np.int16)
    hu[3:27, 4:36, 4:36] = 900
    return Volume(hu, np.zeros(3), np.array([3.0, 3.0, 4.0]), np.eye(3))


def test_one_of_several_series_is_chosen(station: Workstation, rest: Rest, tmp_path: Path) -> None:
    """From a folder: modality, description, slices and spacing are shown; the description is a name if agreed."""
    folder, scout_uid = tmp_path / "disc", generate_uid()
    folder.mkdir()
    fine, scout = dicom_slices(head()), dicom_slices(head())[:3]
    for one in fine:
        one.SeriesDescription = "CanarySinus"
    for one in scout:
        one.SeriesInstanceUID, one.SeriesDescription = scout_uid, "Scout"
    save_dicom(scout, folder / "a")
    save_dicom(fine, folder / "b")  # under the same file names
    (folder / "README.txt").write_text("of the disc")
    before = {case["id"] for case in rest.client.get("/api/v1/cases").json()}
    dialog: Any = station.page.locator("dialog")

    def chosen() -> Any:
        station.page.set_input_files("#folder", folder)
        expect(dialog).to_be_visible()
        options = dialog.locator("option").all_inner_texts()
        assert "CT · CanarySinus · 30 slices · 40 × 40 · 3.00 × 3.00 × 4.00 mm" in options
        dialog.locator("select").select_option(index=next(n for n, text in enumerate(options) if "Canary" in text))
        station.picture("series")
        dialog.locator("button.primary").click()
        station.wait_for("the head", lambda: len(rest.client.get("/api/v1/cases").json()) > len(before))
        (made,) = (case for case in rest.client.get("/api/v1/cases").json() if case["id"] not in before)
        rest.client.delete(f"/api/v1/cases/{made['id']}").raise_for_status()
        return made

    made = chosen()
    assert station.said("1 file of another program was not sent (.txt).")
    assert made["name"].startswith("CT ")
    assert made["volumes"][0]["shape"] == [40, 40, 30]
    assert "Canary" not in station.page.locator("body").inner_text()
    agreed = station.page.locator("[data-step-name=import]").get_by_label("Use series name")
    agreed.check()
    assert chosen()["name"] == "CanarySinus"
    agreed.uncheck()
    assert station.errors == []
