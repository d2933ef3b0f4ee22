"""Review in a real browser: a short rehearsal, its card, its replay beside another run, and the comparison."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from test_accessibility import AXE, check
from workstation import DRIVEN_S, Planner, Rest, Workstation

from app.cases.model import HEAD_PHANTOM
from app.services import build_services
from app.settings import Settings
from tests.engine.study.test_series import ASIDE, CALM, recorded, scene
from vfix_engine.worlds.freehand.spec import FreehandSpec

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

# Whether the replayed tool stands in the scene where the run had it: the tips of all that the page has put there.
REPLAYED = """() => {
  const found = [];
  vfix.layer?.hooks.each((object) => { if (object.userData.vfixReplay) found.push(object.position.toArray()); });
  return found;
}"""
# Whether all of a mark is within its row.
UNCUT = "(mark) => mark.getBoundingClientRect().right <= mark.closest('.row-main').getBoundingClientRect().right"
# Whether a slice shows the tool, in its yellow.
YELLOW = """() => [...document.querySelectorAll('.slice canvas')].some((one) => {
  const data = one.getContext('2d')?.getImageData(0, 0, one.width, one.height).data ?? [];
  const yellow = (at) => data[at] > 230 && data[at + 1] > 190 && data[at + 2] < 140 && data[at + 3] > 200;
  for (let at = 0; at < data.length; at += 4) if (yellow(at)) return true;
  return false;
})"""


# Numbers of vertices of what is replayed and laid into the scene, and of different colours of bone: [made, colours].
LAID = """() => {
  const made = [];
  let colours = [];
  vfix.layer?.hooks.each(({ userData, geometry, material }) => {
    if (!userData.vfixReplay) return;
    made.push(geometry.attributes.position.count);
    if (material.vertexColors) colours = geometry.attributes.color.array;
  });
  const seen = new Set();
  for (let at = 0; at < colours.length; at += 3) seen.add(`${colours[at]} ${colours[at + 1]} ${colours[at + 2]}`);
  return [made, seen.size];
}"""


def freehand_run(planner: Planner, plan_id: str, folder: Path) -> str:
    """Store a drive of a free hand on the plan, outside the certificate."""

    def act(driver: Any, step: Callable[..., None]) -> None:
        step(ASIDE, count=60)
        step(-ASIDE, count=20)

    recorded(folder, FreehandSpec(scene(), CALM), act)
    services = build_services(Settings(home=planner.home, port=0))
    try:
        run = services.runs.keep(folder / "freehand", origin="page", case_id=HEAD_PHANTOM, plan_id=plan_id)
        services.run_scores.of(run.id)
    finally:
        services.close()
    return run.id


def drive(station: Workstation, far: float) -> None:
    """A short rehearsal, finished on the way."""
    station.page.click("[data-step=rehearse]")
    start = station.page.locator("#run-again" if station.page.locator("#run-again").is_visible() else "#start")
    station.wait_for("a robot that can start", start.is_enabled, DRIVEN_S)
    start.click()
    station.wait_for("the robot", lambda: station.state("rehearsal")["state"] == "running", DRIVEN_S)
    station.drive_until("ArrowUp", "a way", lambda: station.rehearsal()["progress_mm"] > far, DRIVEN_S)
    station.page.keyboard.up("ArrowUp")
    station.page.click("#finish-run")
    station.wait_for("the card", lambda: station.page.locator("#run-replay").is_visible(), DRIVEN_S)


def exported(station: Workstation, run: str, rest: Rest) -> None:
    """The menu saves what REST answers; an extra that the planner lacks is told."""
    page = station.page
    page.click("#export-run")
    expect(page.locator("#export-menu [data-format]")).to_have_count(5)
    check(station, "the export of a run")
    with page.expect_download() as started:
        page.click("#export-menu [data-format=csv]")
    assert started.value.suggested_filename == f"{run}.csv"
    expected = rest.client.get(f"/api/v1/runs/{run}/export", params={"format": "csv"}).content
    assert Path(started.value.path()).read_bytes() == expected
    words = "An export to .mcap needs more packages (pip install 'vfix[mcap]')."
    refusal = {"error": {"code": "extra_missing", "message": words, "details": None}}
    page.route("**/export?format=mcap", lambda route: route.fulfill(status=400, json=refusal))
    page.click("#export-menu [data-format=mcap]")
    expect(page.locator("#alerts")).to_contain_text("pip install 'vfix[mcap]'")
    page.click("#alerts button")
    page.keyboard.press("Escape")
    expect(page.locator("#export-menu")).to_be_hidden()


def beside_path(station: Workstation, series: Any) -> None:
    """The plots in the plane of the path and across it; a press goes to the nearest moment."""
    page = station.page
    page.click("#show-path")
    expect(page.locator(".path-plots .u-over")).to_have_count(3)
    expect(page.locator(".path-plots figcaption").first).to_contain_text("path")
    expect(page.locator(".path-plots figcaption").first).to_contain_text("Beside: Hands-on")
    check(station, "a run beside its path")
    station.picture("review-path")
    way = page.locator(".path-plots .u-over").first
    box = way.bounding_box()
    assert box is not None
    way.click(position={"x": 3, "y": box["height"] - 3})  # below the entry, where every drive begins
    station.wait_for("the beginning", lambda: float(page.input_value("#run-time")) < 0.5 * series["t_s"][-1])
    expect(page.locator(".path-plots .plot-dot").first).to_be_visible()


def laid_into_scene(station: Workstation, runs: tuple[str, str], rest: Rest) -> None:
    """The swept volumes of both runs are those of the runs, and go again."""
    page = station.page
    page.check("#show-swept")
    expect(page.locator(".swept-keys .number")).to_have_count(2)
    files = [rest.client.get(f"/api/v1/runs/{run}/swept").content for run in runs]
    counts = [int(np.frombuffer(file[8:12], "<u4")[0]) for file in files]
    station.wait_for("both bodies", lambda: all(page.evaluate(LAID)[0].count(count) >= 2 for count in counts))
    page.check("#show-near")
    expect(page.locator(".near-scale")).to_contain_text("5 mm")
    check(station, "what is laid into the scene")
    station.picture("review-in-scene")
    page.uncheck("#show-near")
    page.uncheck("#show-swept")
    station.wait_for("none of it", lambda: not set(counts) & set(page.evaluate(LAID)[0]))


def near_on_bone(station: Workstation) -> None:
    """Bone has the colours of the open run's near passes, and its own again."""
    page = station.page
    page.check("#show-near")
    expect(page.locator(".near-scale")).to_contain_text("5 mm")
    expect(page.locator(".near-scale")).to_contain_text("tool in bone")
    station.wait_for("colours of bone", lambda: page.evaluate(LAID)[1] > 20)
    page.uncheck("#show-near")
    station.wait_for("bone as before", lambda: not page.evaluate(LAID)[1])


def taught(station: Workstation, run: str, rest: Rest) -> None:
    """The open run becomes the teacher's, and is not any more; REST and the list say so."""
    page = station.page
    pill = page.locator(f"li[data-run={run}] .pill.teacher")
    for on in (True, False, True):
        page.set_checked("#teacher-run", on)
        expect(pill).to_have_count(int(on))
        assert rest.client.get(f"/api/v1/runs/{run}").json()["teacher"] is on


def test_a_rehearsal_ends_with_a_card_and_is_reviewed(
    open_page: Open, rest: Rest, planner: Planner, tmp_path: Path
) -> None:
    station = open_page(script=AXE).ready()
    page, plan = station.page, rest.copy_of_sample("Reviewed")
    station.open_plan(plan)
    hand = freehand_run(planner, plan, tmp_path)
    drive(station, 2.0)
    card = page.locator("#end-card")
    expect(card).to_contain_text("Hands-on")
    expect(card).to_contain_text("Tip error, mean")
    expect(card).not_to_contain_text("without the certificate")
    station.picture("end-card")
    drive(station, 4.0)
    newest, before = (run["id"] for run in rest.runs(HEAD_PHANTOM) if run["plan_id"] == plan and run["id"] != hand)
    check(station, "the card")
    station.picture("end-card-again")

    page.click("#run-compare")
    expect(page.locator(".review-dock")).to_be_visible()
    expect(page.locator("table.compare tbody tr").first).to_contain_text("Time")
    expect(page.locator(f"li[data-run={newest}]")).to_have_attribute("aria-current", "true")
    expect(page.locator(f"li[data-run={before}] .beside")).to_have_attribute("aria-pressed", "true")
    page.click(f"li[data-run={hand}] .beside")
    expect(page.locator("table.compare .pill")).to_have_text("without the certificate")
    expect(page.locator(f"li[data-run={hand}] .pill")).to_have_text("without the certificate")
    assert page.locator(f"li[data-run={hand}] .pill").evaluate(UNCUT), "HAZ-41: it can be read"
    check(station, "a comparison")
    station.picture("review-compare")

    page.click("#show-plots")
    expect(page.locator(".review-plots .u-over")).to_have_count(4)
    station.see_scene()
    series, other = (rest.client.get(f"/api/v1/runs/{run}/series").json() for run in (newest, before))
    end = max(series["t_s"][-1], other["t_s"][-1])
    page.focus("#run-time")
    page.keyboard.press("End")
    expect(page.locator(".timeline-time")).to_contain_text(f"{end:.1f} / {end:.1f}")
    starts = station.wait_for("the tool", lambda: page.evaluate(REPLAYED))
    part = series["segments"][-1][1][:3]
    assert min(np.linalg.norm(np.array(place) - part) for place in starts) < 0.05, "the shaft is where the run ends"
    station.wait_for("the tool in a slice", lambda: page.evaluate(YELLOW))
    check(station, "a replay")
    station.picture("review")
    exported(station, newest, rest)
    beside_path(station, series)
    laid_into_scene(station, (newest, before), rest)
    page.click("#show-plots")
    page.focus("#run-time")
    page.keyboard.press("Home")
    expect(page.locator(".timeline-time")).to_contain_text("0.0 / ")
    page.click("#play-run")
    station.wait_for("the replay", lambda: float(page.input_value("#run-time")) > 0.3)
    page.keyboard.press("Space")
    expect(page.locator("#play-run")).to_have_attribute("aria-label", "Play")
    page.select_option("#filter-mode", "freehand")
    expect(page.locator(f"li[data-run={newest}]")).to_have_count(0)  # other plans of the head may have runs too
    page.click(f"li[data-run={hand}] .row-main")
    expect(page.locator("#run-score")).to_contain_text("without the certificate")
    expect(page.locator("#run-score")).to_contain_text("Contacts")
    near_on_bone(station)
    taught(station, hand, rest)
    page.click("[data-step=plan]")
    station.wait_for("nothing of a replay", lambda: not page.evaluate(REPLAYED))
    assert station.errors == []
