"""Layouts, themes and narrow windows: every control in reach, and nothing of the scene lost."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from workstation import Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
SIZES = [(1440, 900), (1024, 768), (800, 700), (720, 450), (390, 780)]
PARTS = ("panel", "scene", "slices")
# Controls that are cut off, lie under something else or cannot be brought into sight by scrolling.
CUT_OFF = """() => [...document.querySelectorAll('button, select, input, tr[tabindex], .slice-stage, [role=separator]')]
  .filter((control) => control.checkVisibility({ visibilityProperty: true }))
  .filter((control) => {
    control.scrollIntoView({ block: 'center', inline: 'center', behavior: 'instant' });
    const box = control.getBoundingClientRect();
    const inside = box.left >= -0.5 && box.right <= innerWidth + 0.5;
    const found = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
    return !inside || !found || !(control.contains(found) || found.closest('label')?.contains(control));
  })
  .map((control) => control.outerHTML.slice(0, 160))"""
NOTICE = """() => { const box = document.getElementById('notice').getBoundingClientRect();
  return box.width > 60 && box.left >= 0 && box.right <= innerWidth && box.top >= 0 && box.bottom <= innerHeight; }"""
SHARE = """(selector) => { const box = document.querySelector(selector).getBoundingClientRect();
  return box.width * box.height / (innerWidth * innerHeight); }"""


@pytest.fixture(scope="module")
def resized(open_shared: Open) -> Workstation:
    """A page whose window gets another size with each test."""
    return open_shared().ready()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_no_control_is_cut_off_in_any_step(resized: Workstation, rest: Rest, width: int, height: int) -> None:
    station, page = resized, resized.page
    page.set_viewport_size({"width": width, "height": height})
    station.open_plan(rest.copy_of_sample("Sizes"))
    for step in ("patient", "plan", "rehearse"):
        page.click(f"[data-step={step}]")
        station.wait_for(step, lambda step=step: station.state("step")["name"] == step)
        if page.locator("#look-toggle").is_visible():
            page.click("#look-toggle")
        for part in PARTS if width <= 600 else ("all",):
            if part != "all":
                page.click(f"[data-part-button={part}]")
            # what has just come may still find its place
            station.wait_for(f"{step}, {part}: every control", lambda: page.evaluate(CUT_OFF) == [])
            assert page.evaluate("document.scrollingElement.scrollWidth - innerWidth") <= 0
            page.evaluate("scrollTo(0, 0)")
            assert page.evaluate(NOTICE), f"{step}, {part}: the notice"
    station.picture(f"size-{width}")
    assert station.errors == []


def test_layouts_are_chosen_by_button_and_key_and_remembered(open_page: Open) -> None:
    """The scene's frame stays the same document through all of them."""
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    page, bench = station.page, station.page.locator("#bench")
    page.evaluate("document.getElementById('scene').contentWindow.stillHere = true")
    assert page.evaluate(SHARE, ".viewer") > 0.3
    page.click("[data-layout-button=two-by-two]")
    shares = [page.evaluate(SHARE, name) for name in (".viewer", "[data-axis=axial]", "[data-axis=sagittal]")]
    assert min(shares) > 0.12, shares
    for key, layout, seen in (("1", "axial", "[data-axis=axial]"), ("2", "coronal", "[data-axis=coronal]")):
        page.keyboard.press(key)
        assert bench.get_attribute("data-layout") == layout
        assert page.evaluate(SHARE, seen) > 0.45
        assert not page.locator("#scene").is_visible()
    page.keyboard.press("2")
    assert bench.get_attribute("data-layout") == "two-by-two"
    page.keyboard.press("4")
    page.keyboard.press("p")
    assert page.evaluate(SHARE, ".viewer") > 0.75
    page.reload()
    station.ready()
    assert bench.get_attribute("data-layout") == "scene"
    assert not page.locator("#panel").is_visible()
    page.evaluate("document.getElementById('scene').contentWindow.stillHere = true")
    page.keyboard.press("p")
    page.click("[data-layout-button=one-three]")
    assert page.evaluate("document.getElementById('scene').contentWindow.stillHere"), "the frame was loaded anew"
    wide = page.locator("#slices").bounding_box()
    page.focus("#splitter")
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    now = page.locator("#slices").bounding_box()
    assert wide is not None
    assert now is not None
    assert now["width"] > wide["width"] + 60
    assert station.errors == []


@pytest.mark.parametrize(("width", "height", "least"), [(1440, 900, 200), (1024, 768, 150)])
def test_the_slices_of_an_empty_plan_are_large_enough_to_click_in(
    resized: Workstation, rest: Rest, width: int, height: int, least: int
) -> None:
    """The first point is clicked before there is a path, and with it a fourth view."""
    station = resized
    station.page.set_viewport_size({"width": width, "height": height})
    station.page.click("[data-step=plan]")
    station.open_plan(rest.empty_plan("Before the first point"))
    panes = station.page.locator("#slices")
    station.wait_for("three slices", lambda: panes.get_attribute("data-panes") == "3")
    stages = [stage.bounding_box() for stage in station.page.locator(".slice-stage:visible").all()]
    assert len(stages) == 3
    assert all(box is not None and box["height"] >= least for box in stages), stages
    assert station.errors == []


def test_a_view_that_asks_to_be_large_is(open_page: Open) -> None:
    """What a slice sends at a double-click."""
    station = open_page(viewport={"width": 1024, "height": 768}).ready()
    page, bench = station.page, station.page.locator("#bench")
    page.evaluate("dispatchEvent(new CustomEvent('vfix:enlarge', { detail: 'sagittal' }))")
    assert bench.get_attribute("data-layout") == "sagittal"
    page.evaluate("dispatchEvent(new CustomEvent('vfix:enlarge', { detail: null }))")
    assert bench.get_attribute("data-layout") == "one-three"


def test_the_theme_is_the_system_s_until_somebody_chooses(open_page: Open) -> None:
    station = open_page(viewport={"width": 1024, "height": 700}).ready()
    page = station.page
    theme = "document.documentElement.dataset.theme"
    ground = "getComputedStyle(document.getElementById('scene').contentDocument.body).backgroundColor"
    page.emulate_media(color_scheme="dark")
    station.wait_for("the dark theme", lambda: page.evaluate(theme) == "dark")
    dark = page.evaluate(ground)
    page.emulate_media(color_scheme="light")
    station.wait_for("the light theme", lambda: page.evaluate(theme) == "light")
    assert page.evaluate(ground) != dark
    assert page.evaluate("getComputedStyle(document.querySelector('.slice-stage')).backgroundColor") == "rgb(0, 0, 0)"
    page.click("#theme")
    page.reload()
    station.ready()
    assert page.evaluate(theme) == "dark"
    assert page.evaluate(ground) == dark
    assert station.errors == []
