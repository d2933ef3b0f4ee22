"""A study of people on the page: one subject in two modes, from the consent to the last questionnaire."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from typing import Any

from playwright.sync_api import expect
from workstation import DRIVEN_S, Workstation

STUDY = """
name = "Two modes"
trials = 1
modes = ["hands-on", "freehand"]
consent = "I take part of my own will, and may stop at any time."
questionnaire = "nasa-tlx"
views = { hands-on = "outside", freehand = "outside" }
[[plans]]
case = "head-phantom"
plan = "head-phantom-sample"
[subjects]
codes = ["P01"]
"""

IN_CAVITY = """
name = "In the cavity"
trials = 1
arms = ["guided"]
[[routes]]
case = "cavity-phantom"
route = "cavity-phantom-sample"
task = "kwok2"
count = 1
[subjects]
codes = ["P01"]
"""


def test_a_whole_study(open_page: Callable[..., Workstation]) -> None:
    station = open_page()
    page = station.page
    page.locator("#steps [data-step=plan]").wait_for()
    expect(page.locator("[data-step=study]")).to_be_hidden()
    page.evaluate("(text) => vfix.request('study.new', { text })", STUDY)
    page.click("[data-step=study]")
    expect(page.locator("#consent-text")).to_have_text("I take part of my own will, and may stop at any time.")
    expect(page.locator("#first-task")).to_be_hidden()
    station.picture("study-consent")
    page.check("#consent-read")
    page.click("[data-operation='study.consent']")
    for number in (1, 2):
        expect(page.locator("#study-next h2")).to_have_text(f"Trial {number} of 2")
        station.picture(f"study-trial-{number}")
        page.click("#begin-trial")
        station.wait_for("Rehearse", lambda: station.state("step")["name"] == "rehearse")
        expect(page.locator("#bench")).to_have_attribute("data-layout", "scene")
        expect(page.locator("[data-control=teleoperated]")).to_be_disabled()
        expect(page.locator("[data-layout-button=two-by-two]")).to_be_disabled()
        expect(page.locator("#trial-head")).to_have_text(f"P01: trial {number} of 2")
        station.wait_for("the tool at the entry", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
        page.click("#start")
        station.wait_for("the robot", lambda: station.state("rehearsal")["state"] == "running", DRIVEN_S)
        station.drive_until("ArrowUp", "motion", lambda: station.rehearsal()["force_n"] > 0.3, DRIVEN_S)
        page.keyboard.up("ArrowUp")
        station.picture(f"study-driven-{number}")
        page.click("#finish-run")
        if number == 1:
            page.reload()  # nothing of the trial is the page's own
        station.wait_for("the run", lambda: _study(station)["next"] == "questionnaire", DRIVEN_S)
        station.wait_for("Study", lambda: station.state("step")["name"] == "study")
        expect(page.locator("#bench")).not_to_have_attribute("data-layout", "scene")
        scales = page.locator(".study-scale input")
        expect(scales).to_have_count(6)
        for scale in scales.all():
            scale.focus()
            page.keyboard.press("ArrowRight")
        station.picture(f"study-tlx-{number}")
        page.click("[data-operation='study.answer']")
    expect(page.locator("#study-next h2")).to_have_text("All done")
    page.reload()
    expect(page.locator("#study-next h2")).to_have_text("All done")
    expect(page.locator("#study-done dd")).to_have_text(["2", "0"])
    station.picture("study-done")
    with page.expect_download() as saved:
        page.click("#save-results")
    with zipfile.ZipFile(saved.value.path()) as files:
        assert {"trials.csv", "answers.csv", "report.html"} <= set(files.namelist())
        trials = files.read("trials.csv").decode().splitlines()[2:]
    assert sorted(line.split(",")[3] for line in trials) == ["freehand", "hands-on"]
    assert station.errors == []


def test_a_trial_in_a_lumen(open_page: Callable[..., Workstation]) -> None:
    """From Study to Drive, which is set and locked, and back with the run."""
    station = open_page(sample=False, viewport={"width": 900, "height": 640}).ready()  # a small picture to draw
    page = station.page
    page.click("[data-step=patient]")
    page.locator("#cases .row-main", has_text="Body cavity").click()
    station.wait_for("the cavity", lambda: (station.state("case") or {}).get("id") == "cavity-phantom")
    page.evaluate("(text) => vfix.request('study.new', { text })", IN_CAVITY)
    page.click("[data-step=study]")
    expect(page.locator("#study-trial")).to_contain_text("Labels")
    station.picture("study-lumen-trial")
    page.click("#begin-trial")
    station.wait_for("Drive", lambda: station.state("step")["name"] == "drive")
    expect(page.locator("#bench")).to_have_attribute("data-layout", "endoscope-alone")
    station.wait_for("the robot", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
    expect(page.locator("#trial-head")).to_have_text("P01: trial 1 of 1")
    expect(page.locator("[data-arm=guided]")).to_have_attribute("aria-pressed", "true")
    for locked in ("[data-arm=manual]", "#drive-preset", "[data-task=none]", "#reset", "#outside-view"):
        expect(page.locator(locked)).to_be_disabled()
    page.click("#start")
    station.wait_for("the drive", lambda: station.rehearsal()["state"] == "running", DRIVEN_S)
    tip = station.rehearsal()["tip"]
    station.drive_until("d", "a turn", lambda: station.rehearsal()["tip"] != tip, DRIVEN_S)
    page.keyboard.up("d")
    station.picture("study-lumen-driven")
    page.click("#finish-run")
    station.wait_for("the run", lambda: _study(station)["next"] == "done", DRIVEN_S)
    station.wait_for("Study", lambda: station.state("step")["name"] == "study")
    expect(page.locator("#study-done dd")).to_have_text(["1", "0"])
    expect(page.locator("#bench")).not_to_have_attribute("data-layout", "endoscope-alone")
    assert station.errors == []


def _study(station: Workstation) -> Any:
    return station.state("study") or {"next": ""}
