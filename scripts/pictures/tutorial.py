"""docs/planning_tutorial.md, step by step on the real page, with the names in that text."""

from __future__ import annotations

import re
from pathlib import Path

from .named_page import NamedPage
from .sample_plan import drive

ENTRY, TARGET = "L 7.5 A 14 I 6", "L 3 P 65 I 3.5"
ORBIT_CORNERS = ("L 20 P 9 S 24", "L 46 P 56 S 50")
ORBIT_AT = "L 33 P 32 S 37"
DOWNLOADS = ("Plan (JSON)", "Slicer markups", "Table (CSV)")
REPORT = "Printable report"
SCANNER = "Scanner"  # followed by its window and level


def import_the_folder(page: NamedPage, folder: Path) -> None:
    page.go_to("Patient")
    page.button("Folder …")  # it opens a dialog of the system, so the files are set directly
    page.page.set_input_files("#folder", folder)
    page.says("Case imported.")
    page.press("Open it")
    page.wait("the new head", lambda: page.station.state("case")["name"].startswith("CT 1, "))
    page.station.ready()
    page.wait("its voxels", lambda: page.page.evaluate("vfix.slices.link.ready"))
    page.says("0.80 × 0.80 × 0.80")
    page.heading("Heads")
    page.press("Oblique")
    page.take("planning_import")


def look_at_slices(page: NamedPage) -> None:
    page.press("Four views")
    page.page.locator(".slice-window").click()
    page.page.get_by_role("menuitemradio", name=re.compile(rf"^{SCANNER} W ")).click()
    go(page, ORBIT_AT)
    page.take("planning_slices")


def mark_the_orbit(page: NamedPage) -> None:
    page.press("3D + slices")
    page.unfold("Threshold")
    page.scroll_to("Threshold")
    page.choose("Tissue", "Soft tissue")
    page.check("Crop to box")
    for label, place in zip(("One corner", "The opposite corner"), ORBIT_CORNERS, strict=True):
        page.fill(label, place)
        page.page.keyboard.press("Tab")
    page.choose("Islands", "Largest only")
    page.fill("Name", "Left orbit")
    page.wait("the islands", lambda: "kept" in page.page.locator("#segment-kept").inner_text())
    page.scroll_to("Threshold")
    page.take("planning_structure")
    page.unfold("Paint")
    page.button("New label …")
    page.press("Make structure")
    page.says("is made. Protect it in Plan.")


def spare_the_orbit(page: NamedPage) -> None:
    page.go_to("Plan")
    page.unfold("Protect")
    choice = page.field("Structure of this head")
    page.wait("the structure", lambda: "Left orbit" in choice.locator("option").all_inner_texts())
    assert "Protect a structure …" in choice.locator("option").all_inner_texts()
    choice.select_option(label="Left orbit")
    page.wait("the region", lambda: page.station.state("regions")["items"])
    page.field("Margin")
    page.field("Firmness")


def suggest_a_path(page: NamedPage) -> None:
    page.page.locator("#panel").evaluate("(panel) => { panel.scrollTop = 0; }")
    page.unfold("Entry")
    page.button("Left nostril")  # its place is near the one that is typed, for the figures of the text
    add(page, ENTRY, "points")
    page.unfold("Targets")
    add(page, TARGET, "targets")
    page.unfold("Path")
    page.press("Suggest a path")
    page.wait("the ways", lambda: page.page.locator("#alternatives .way-picture svg").count())
    page.says("Way 1")
    page.wait("the preview", lambda: page.station.state("shaft")["shown"])
    page.press("Layers")
    page.choose("Cut", "Cut left half")
    page.page.keyboard.press("Escape")
    page.press("Left")
    page.scroll_to("Path")
    page.take("planning_suggest")
    page.press("Use path")
    page.wait("the path", lambda: len(page.station.state("plan")["points"]) > 2)


def read_the_verdict(page: NamedPage) -> None:
    page.judged()
    page.says("Fits")
    page.press("Show me")
    page.wait("the tool", lambda: page.station.state("corridor")["shown_mm"] is not None)
    page.unfold("Check")
    page.scroll_to("Check")
    page.take("planning_verdict")
    page.press("Hide tool")


def drag_a_point(page: NamedPage) -> None:
    station = page.station
    points = station.state("plan")["points"]
    position = points[len(points) // 2]["position"]
    page.press("Left")
    station.settle()
    x, y = station.place(position)
    mouse = page.page.mouse
    mouse.move(x, y)
    page.page.wait_for_timeout(300)
    mouse.down()
    for part in (0.4, 0.7, 1.0):
        mouse.move(x, y - 10 * part)
        page.page.wait_for_timeout(150)
    page.wait("the live verdict", lambda: station.state("corridor")["state"] == "drag")
    page.says("while you drag")
    page.add("planning_drag", page.page.screenshot())
    mouse.up()
    page.judged()
    page.press("Undo (Ctrl+Z)")
    page.judged()


def compare_tools(page: NamedPage) -> None:
    page.unfold("Tool and robot")
    page.press("Which tool?")
    page.wait("the table", lambda: page.page.locator("#tool-table tbody tr").count())
    page.scroll_to("Tool and robot")
    page.page.locator("#which-tool").evaluate(
        "(button) => { const panel = document.getElementById('panel');"
        " panel.scrollTop += button.getBoundingClientRect().top - panel.getBoundingClientRect().top - 12; }"
    )
    page.take("planning_tools")


def name_a_version(page: NamedPage) -> None:
    page.unfold("Versions")
    page.press("Save version")
    dialog = page.page.locator("dialog")
    dialog.get_by_label("Name", exact=True).fill("Before the margin")
    dialog.get_by_role("button", name="Save", exact=True).click()
    page.wait("the version", lambda: page.station.state("versions")["items"])


def rehearse(page: NamedPage) -> None:
    page.go_to("Rehearse")
    page.press("Start")
    page.wait("the robot", lambda: page.station.rehearsal()["state"] == "running")
    page.heading("Hand and margin")
    page.field("Safety margin").fill("0.5")  # a slider
    page.wait("the margin", lambda: abs(page.station.rehearsal()["margin_mm"] - 0.5) < 0.05)
    drive(page, 25.0)
    page.take("planning_rehearse")
    page.press("Pause")


def compare_and_export(page: NamedPage, folder: Path) -> None:
    page.go_to("Plan")
    page.judged()
    page.page.locator("#versions .row-main").first.click()
    page.says("Safety margin")
    page.button("Go back")
    page.scroll_to("Versions")
    page.take("planning_version")
    page.unfold("Export")
    page.scroll_to("Export")
    for name in DOWNLOADS:
        download(page, name, folder)
    page.press(REPORT)
    page.choose("The pictures show", "outlines of bone only")  # without an answer nothing is saved
    download(page, "Save", folder)


def download(page: NamedPage, name: str, folder: Path) -> None:
    with page.page.expect_download() as waiting:
        page.press(name)
    waiting.value.save_as(folder / waiting.value.suggested_filename)


def go(page: NamedPage, place: str) -> None:
    """Move the crosshair to a typed place."""
    page.page.locator("[data-view=axial] .slice-where").click()
    page.fill("Go to a place", place)
    page.page.keyboard.press("Enter")


def add(page: NamedPage, place: str, where: str) -> None:
    """Add a point or target, as the open step says, at a typed place: Enter adds it at the crosshair."""
    station = page.station
    go(page, place)
    page.page.wait_for_timeout(500)
    page.page.locator(".slice-stage[data-axis=axial]").focus()
    page.page.keyboard.press("Enter")
    page.wait("the place", lambda: station.state("plan")[where] or station.state("plan")["ghost"])
    if station.state("plan")["ghost"]:
        page.press("Add here")
        page.wait("the point", lambda: station.state("plan")[where])
