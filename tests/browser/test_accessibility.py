"""axe-core finds no violation in any state of the page, and no text is past its limit of words.

viser's own frame is not ours to mend and is left out.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from page_scripts import LONG_TEXTS
from playwright.sync_api import expect
from workstation import DRIVEN_S, ROOT, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
AXE = (ROOT / "node_modules" / "axe-core" / "axe.min.js").read_text(encoding="utf-8")
# The words of Rehearse are still to be read.
NOT_COUNTED = ("a ghost", "before the start", "running", "the card", "the scene")
RUN = """async () => {
  const found = await axe.run({ exclude: ['#scene'] }, { iframes: false, rules: { 'target-size': { enabled: true } } });
  const told = ({ html, failureSummary }) => [html.slice(0, 160), failureSummary];
  return found.violations.map(({ id, nodes }) => [id, nodes.map(told)]);
}"""
# Words upon a slice whose contrast axe cannot tell, because the picture shines through, or does not like.
UPON_PICTURES = """async () => {
  const upon = { include: [['.slice-head'], ['.slice-controls']] };
  const { violations, incomplete, passes } = await axe.run(upon, { iframes: false, runOnly: ['color-contrast'] });
  const why = ({ html, any }) => `${html.slice(0, 100)}: ${any[0]?.message}`;
  const told = [...violations, ...incomplete].flatMap(({ nodes }) => nodes.map(why));
  return { told, read: passes.flatMap(({ nodes }) => nodes).length };
}"""
# Buttons that show a picture alone, and have no tooltip.
BARE = """() => [...document.querySelectorAll('button, summary')]
  .filter((one) => one.checkVisibility() && !one.title && !one.innerText.trim()).map((one) => one.outerHTML)"""

SIZES = [(1440, 900), (1024, 768), (800, 700), (720, 450), (390, 780)]  # 1440 × 900 at 200 % is 720 × 450
TABS = ("patient", "plan", "register", "rehearse", "review")


def in_theme(station: Workstation, theme: str) -> None:
    station.page.emulate_media(reduced_motion="reduce", color_scheme=theme)  # type: ignore[arg-type]
    station.wait_for(theme, lambda: station.page.evaluate("document.documentElement.dataset.theme") == theme)


def check(station: Workstation, state: str) -> None:
    station.drawn()
    violations: Any = station.page.evaluate(RUN)
    assert violations == [], f"{state}: {violations}"
    assert station.page.evaluate(BARE) == [], state
    if state not in NOT_COUNTED:
        assert station.page.evaluate(LONG_TEXTS) == [], state


def registered(station: Workstation, rest: Rest) -> None:
    """Each step of a registration of four points, and each part below them."""
    page = station.page
    page.click("[data-step=register]")
    station.wait_for("Register", lambda: station.state("step")["name"] == "register")
    check(station, "no registration")
    page.click("#begin-registration")
    station.wait_for("a registration", lambda: station.state("registration"))
    for place in ([8.2, 4.9, 71.8], [51.5, 13.7, 20.6], [-73.5, 73.3, 10.4], [-9.9, -7.6, -63.2]):
        page.evaluate("(p) => vfix.request('pair.add', { in_image: p })", place)
    page.evaluate("vfix.request('pair.touch', { pair_id: null, noise_mm: 0.1 })")
    station.wait_for("the fit", lambda: station.state("registration")["fit"]["state"] == "fitted")
    for step in ("beads", "points", "fit", "error", "use", "refine", "trace", "calibration", "registrations"):
        station.open_step(step)
        check(station, f"registration: {step}")
    rest.client.delete(f"/api/v1/registrations/{station.state('registration')['id']}").raise_for_status()


@pytest.mark.parametrize(("width", "height", "theme"), [(1440, 900, "dark"), (390, 780, "light")])
def test_no_state_of_the_page_has_a_violation(open_page: Open, rest: Rest, width: int, height: int, theme: str) -> None:
    station = open_page(viewport={"width": width, "height": height}, script=AXE)
    page = station.page
    station.ready()
    in_theme(station, theme)

    def show(part: str) -> None:
        if page.locator(f"[data-part-button={part}]").is_visible():
            page.click(f"[data-part-button={part}]")

    show("panel")
    page.keyboard.press("?")
    expect(page.locator("#dialog[open]")).to_be_visible()
    check(station, "the sheet of keys")
    page.keyboard.press("Escape")
    page.click("[data-step=patient]")
    station.wait_for("Patient", lambda: station.state("step")["name"] == "patient")
    check(station, "patient")
    page.click("[data-step=plan]")
    station.open_plan(rest.empty_plan("Nothing yet"))
    check(station, "an empty plan")
    page.click("#plans")
    expect(page.locator("#new-plan")).to_be_visible()
    check(station, "the list of plans")
    page.click("#new-plan")
    expect(page.locator("#dialog[open]")).to_be_visible()
    check(station, "a question")
    page.keyboard.press("Escape")
    plan_id = rest.copy_of_sample("All of it")
    station.open_plan(plan_id)
    station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("state") == "current", DRIVEN_S)
    check(station, "a plan")
    for step in ("entry", "targets", "protect", "tool", "check", "export", "bone", "versions", "notes"):
        station.open_step(step)
        check(station, step)
    show("slices")
    check(station, "slices")
    if page.locator("#scene").is_visible():  # axe cannot tell what lies upon what in a column that scrolls
        upon: Any = page.evaluate(UPON_PICTURES)
        assert upon["told"] == []
        assert upon["read"] > 4
    show("scene")
    check(station, "the scene while it is prepared")
    page.evaluate("vfix.request('add.mode', { kind: 'point' })")  # the step that is open is not about places
    page.evaluate("vfix.request('pick.slice', { position: [60, 40, 40] })")
    station.wait_for("a ghost", lambda: station.state("plan")["ghost"])
    check(station, "a ghost")
    page.evaluate("vfix.request('ghost.cancel')")
    show("panel")
    registered(station, rest)
    page.click("[data-step=rehearse]")
    station.wait_for("Rehearse", lambda: station.state("step")["name"] == "rehearse")
    check(station, "before the start")
    page.click("#start")
    station.wait_for("the robot", lambda: station.state("rehearsal")["state"] == "running")
    check(station, "running")
    page.click("#start")
    station.wait_for("the pause", lambda: station.state("rehearsal")["state"] != "running")
    page.click("[data-step=plan]")
    station.wait_for("Plan", lambda: station.state("step")["name"] == "plan")
    show("scene")
    station.see_scene()
    expect(page.locator(".scene-label").first).to_be_attached()
    check(station, "the scene")
    assert station.errors == []


def test_no_size_of_the_page_has_a_violation(open_page: Open, rest: Rest) -> None:
    station = open_page(script=AXE).ready()
    page = station.page
    station.open_plan(rest.copy_of_sample("All sizes"))
    station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("state") == "current", DRIVEN_S)
    for tab in TABS:
        page.click(f"[data-step={tab}]")
        station.wait_for(tab, lambda tab=tab: station.state("step")["name"] == tab)  # type: ignore[misc]
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            station.wait_for("the size", lambda w=width: page.evaluate("innerWidth") == w)  # type: ignore[misc]
            if page.locator("[data-part-button=panel]").is_visible():
                page.click("[data-part-button=panel]")
            for theme in ("light", "dark"):
                in_theme(station, theme)
                check(station, f"{tab} at {width} px, {theme}")
    assert station.errors == []
