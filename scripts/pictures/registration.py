"""docs/registration_tutorial.md, step by step on the real page, with the names in that text."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

from .named_page import NamedPage

WRONG_BY_MM = 9.0
SLICER = Path(__file__).with_name("slicer_scene.py")


def _registration(page: NamedPage) -> dict[str, Any]:
    return page.station.state("registration") or {}


def _certainty(page: NamedPage) -> str:
    """Return the stated certainty that a point is wrong; '' if no point is named."""
    wrong = _registration(page)["fit"]["wrong"]
    return "" if wrong is None else str(wrong["certainty"])


def find_the_beads(page: NamedPage) -> None:
    page.go_to("Register")
    page.press("Begin registration")
    page.press("Find beads")
    page.wait("five beads", lambda: len(_registration(page).get("beads", ())) == 5)
    page.heading("Beads")
    page.page.locator("#beads").get_by_text("Reject", exact=True).first.wait_for()
    page.page.locator("#beads .row-main").first.click()
    page.press("Oblique")
    page.take("registration_beads")
    page.press("Confirm all")


def touch_them(page: NamedPage) -> None:
    page.press("Simulate all")
    page.wait("the fit", lambda: _registration(page)["fit"]["state"] == "fitted")
    page.unfold("Fit")
    page.says("Fit error (FRE)")
    page.unfold("Error")
    page.scroll_to("Error")
    page.take("registration_fit")


def measure_one_wrongly(page: NamedPage) -> None:
    page.unfold("Points")
    page.page.locator("#pairs .row-main").nth(2).click()
    x = page.field("Measured, x")
    page.wait("its coordinates", x.input_value)
    x.fill(str(float(x.input_value()) + WRONG_BY_MM))
    x.press("Enter")
    page.wait("the wrong one", lambda: _certainty(page) == "outlier")
    page.unfold("Fit")
    page.scroll_to("Fit")
    page.take("registration_wrong")
    page.press("Undo (Ctrl+Z)")
    page.wait("the fit of before", lambda: _certainty(page) != "outlier")


def use_it(page: NamedPage) -> None:
    page.unfold("Use")
    page.press("Use for plan")
    page.wait("the use", lambda: page.station.state("plan_use")["here"])
    page.button("ITK transform (.tfm)")
    page.go_to("Plan")
    page.judged()
    page.unfold("Check")
    page.page.locator("#profile").scroll_into_view_if_needed()
    page.take("registration_band")


def take_it_to_slicer(page: NamedPage, work: Path) -> None:
    """Export the folder by the page's button, and draw it by the libraries of 3D Slicer."""
    page.unfold("Export")
    page.scroll_to("Export")
    with page.page.expect_download(timeout=120_000) as waiting:
        page.press("Slicer folder")
    waiting.value.save_as(work / "slicer.zip")
    with zipfile.ZipFile(work / "slicer.zip") as packed:
        packed.extractall(work / "slicer")
    (scene,) = (work / "slicer").rglob("scene.mrml")
    command = [sys.executable, str(SLICER), str(scene), "--picture", str(work / "slicer.png")]
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    page.add("registration_slicer", (work / "slicer.png").read_bytes())
