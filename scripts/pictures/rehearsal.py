"""docs/rehearsal_tutorial.md, step by step on the real page, with the names in that text."""

from __future__ import annotations

from pathlib import Path

from .named_page import PATIENCE_S, NamedPage
from .sample_plan import drive

WITHOUT = "without the certificate"


def begin(page: NamedPage) -> None:
    """See what the endoscope sees, with the robot at the entry."""
    page.go_to("Rehearse")
    start(page, "Start")
    page.press("Endoscope")
    page.wait("the endoscope", lambda: page.page.locator("#endoscope[data-ready=true]").is_visible())
    drive(page, 12.0)
    page.take("rehearsal_endoscope")


def by_a_hand_on_the_robot(page: NamedPage) -> None:
    """Drive on to the end of the path, and end the run; its card."""
    to_the_end(page)
    finish(page)
    page.says("Tip error, mean")
    page.page.locator("#end-card").evaluate("(card) => card.scrollIntoView({ block: 'start' })")
    page.take("rehearsal_card")


def from_a_distance(page: NamedPage) -> None:
    page.press("Teleoperated")
    page.button("Position")
    page.press("Rate")
    page.wait("the device", lambda: page.station.rehearsal()["control"]["device"] == "rate")
    start(page, "Again")
    to_the_end(page)
    finish(page)


def in_a_free_hand(page: NamedPage) -> None:
    """Touch bone, as a hand alone does."""
    page.press("Freehand")
    page.says("Without the certificate: nothing keeps the tool off bone.")
    start(page, "Start")
    page.station.drive_until("ArrowUp", "a contact", lambda: bool(page.station.rehearsal()["contacts"]), PATIENCE_S)
    page.page.locator("#control-modes").evaluate("(modes) => modes.scrollIntoView({ block: 'start' })")
    page.take("rehearsal_freehand")
    page.page.keyboard.up("ArrowUp")
    finish(page)


def compare(page: NamedPage, folder: Path) -> None:
    """The other modes beside the run in Review, and the page to print."""
    modes = page.page.get_by_role("list", name="Other modes")
    page.wait("the other modes", lambda: modes.get_by_role("button").count() == 2)
    modes.get_by_role("button").first.click()
    page.wait("Review", lambda: page.station.state("step")["name"] == "review")
    page.wait("the table", lambda: page.page.locator("table.compare tbody tr").count())
    page.says(WITHOUT)
    page.take("rehearsal_review")
    page.press("Play")
    with page.page.expect_download() as waiting:
        page.press("Report")
    waiting.value.save_as(folder / waiting.value.suggested_filename)


def to_the_end(page: NamedPage) -> None:
    page.station.drive_until("ArrowUp", "the end", lambda: page.station.rehearsal()["path_done"], PATIENCE_S)
    page.page.keyboard.up("ArrowUp")


def start(page: NamedPage, name: str) -> None:
    page.press(name)
    page.wait("the tool at the entry", lambda: page.station.rehearsal()["state"] == "running")


def finish(page: NamedPage) -> None:
    page.press("Finish run")
    page.button("Again")
    page.button("Replay")
