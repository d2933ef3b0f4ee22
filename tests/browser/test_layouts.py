"""Layouts, themes and narrow windows: every control in reach, and nothing of the scene lost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
SIZES = [(1440, 900), (1024, 768), (800, 700), (720, 450), (480, 800), (390, 780)]  # 1440 × 900 at 200 % is 720 × 450
PARTS = ("panel", "scene", "slices")
PLAN_STEPS = ("entry", "targets", "protect", "tool", "check", "export", "bone", "versions", "notes", "path")
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
# Messages of each kind, and the controls and views that one of them lies upon.
SAY = """async () => {
  const { note } = await import('/static/js/dialogs.js');
  note('The file was cut off after 12 of 40 slices; copy it anew, then import it again.', { error: true });
  note('The targets of ‘Other plan’ were added.', { action: { label: 'Undo', run() {} }, stay: true });
}"""
COVERED = """() => {
  const boxes = [...document.querySelectorAll('.toast')].map((toast) => toast.getBoundingClientRect());
  const hit = (a, b) => a.left < b.right - 1 && a.right > b.left + 1 && a.top < b.bottom - 1 && a.bottom > b.top + 1;
  const what = 'button, select, input, summary, tr[tabindex], #hint, #statusbar, #panel, .viewer, .slice';
  const all = [...document.querySelectorAll(what)];
  const seen = all.filter((control) => control.checkVisibility({ visibilityProperty: true }))
    .filter((control) => !control.closest('.toast'));
  const shown = (control) => { // what of it is not scrolled out of sight
    const { left, right, top, bottom } = control.getBoundingClientRect();
    const around = (control.closest('.panel, .slices') ?? document.body).getBoundingClientRect();
    return { left, right, top: Math.max(top, around.top), bottom: Math.min(bottom, around.bottom) };
  };
  const covered = seen.filter((control) => boxes.some((box) => hit(box, shown(control))));
  const fits = (box) => box.left >= 0 && box.top >= 0 && box.right <= innerWidth && box.bottom <= innerHeight;
  const whole = boxes.filter(fits);
  return { said: whole.length, covered: covered.map((control) => control.outerHTML.slice(0, 120)) };
}"""
SCROLLED = "(([box]) => box.scrollHeight - box.clientHeight)(document.querySelectorAll('#slices'))"
# What a person has to scroll: the page, or a part of it. And how many steps are in sight.
SCROLL_BARS = """() => [...document.querySelectorAll('*')]
  .filter((box) => (box === document.scrollingElement ? getComputedStyle(document.body).overflowY !== 'hidden'
    : ['auto', 'scroll'].includes(getComputedStyle(box).overflowY)))
  .filter((box) => box.clientHeight > 0 && box.scrollHeight > box.clientHeight + 1)
  .map((box) => box.id || box.tagName)"""
STEPS_IN_SIGHT = """() => [...document.querySelectorAll('.steps-numbered .step > summary')]
  .filter((line) => line.getBoundingClientRect().bottom <= innerHeight).length"""
ENLARGE = "(name) => window.dispatchEvent(new CustomEvent('vfix:enlarge', { detail: name }))"
WHOLE = "(all) => all.every((words) => words.scrollWidth <= words.clientWidth)"
BESIDE = "document.scrollingElement.scrollWidth - innerWidth"
SHARE = """(selector) => { const box = document.querySelector(selector).getBoundingClientRect();
  return box.width * box.height / (innerWidth * innerHeight); }"""

# Contrast of the borders of controls against what they stand on (WCAG 2.2, 1.4.11).
FAINT_BORDERS = """() => {
  const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
  const light = (colour) => parts(colour).slice(0, 3).map((value) => value / 255)
    .map((value) => (value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4))
    .reduce((sum, value, index) => sum + value * [0.2126, 0.7152, 0.0722][index], 0);
  const ground = (element) => (!element || (parts(getComputedStyle(element).backgroundColor)[3] ?? 1) > 0.9
    ? getComputedStyle(element ?? document.body).backgroundColor : ground(element.parentElement));
  const drawn = (style) => style.borderTopWidth !== '0px' && (parts(style.borderTopColor)[3] ?? 1) > 0;
  const found = [...document.querySelectorAll('button:enabled, select, .segmented')]
    .filter((control) => control.checkVisibility() && drawn(getComputedStyle(control)))
    .map((control) => {
      const [one, other] = [getComputedStyle(control).borderTopColor, ground(control.parentElement)].map(light);
      return [(Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05), control.textContent];
    });
  return { checked: found.length, faint: found.filter(([contrast]) => contrast < 3) };
}"""


@pytest.fixture(scope="module")
def resized(open_shared: Open) -> Workstation:
    """A page whose window gets another size with each test."""
    return open_shared().ready()


def resize(station: Workstation, width: int, height: int) -> None:
    station.page.set_viewport_size({"width": width, "height": height})
    station.wait_for("the size", lambda: station.page.evaluate("[innerWidth, innerHeight]") == [width, height])
    station.drawn()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_no_control_is_cut_off_in_any_step(resized: Workstation, rest: Rest, width: int, height: int) -> None:
    station, page = resized, resized.page
    resize(station, width, height)
    station.open_plan(rest.copy_of_sample("Sizes"))
    held = page.locator("#statusbar .fill:not([hidden]) .reading-value")

    def borders() -> Any:
        return page.evaluate(FAINT_BORDERS)

    for step in ("patient", "plan", "rehearse"):
        page.click(f"[data-step={step}]")
        station.wait_for(step, lambda step=step: station.state("step")["name"] == step)
        station.drawn()
        for part in PARTS if width <= 600 else ("all",):
            if part != "all":
                page.click(f"[data-part-button={part}]")
            for folded in PLAN_STEPS if step == "plan" and part in ("all", "panel") else (None,):
                if folded:
                    station.open_step(folded)
                # what has just come may still find its place
                station.wait_for(f"{step}, {part}, {folded}: every control", lambda: page.evaluate(CUT_OFF) == [])
            station.wait_for("nothing beside the page", lambda: page.evaluate(BESIDE) <= 0)
            page.evaluate("scrollTo(0, 0)")
            station.wait_for(f"{step}, {part}: the notice", lambda: page.evaluate(NOTICE))
        station.wait_for("all words of what holds the tool", lambda: held.evaluate_all(WHOLE))
        # a button that was just pressed or enabled still changes its colours
        station.wait_for("borders", lambda: (now := borders())["checked"] > 0 and now["faint"] == [])
        if height > 560:
            page.evaluate(SAY)
            for layout in ("one-three", "two-by-two", "scene", "axial"):
                page.evaluate(ENLARGE, layout)
                station.drawn()
                assert page.evaluate(COVERED) == {"said": 2, "covered": []}, (step, layout)
            page.click("[data-layout-button=one-three]")
            page.evaluate("document.querySelectorAll('.toast').forEach((toast) => toast.remove())")
    if width <= 600:
        page.click("[data-part-button=scene]")
    station.open_look()
    inside = page.locator("#look").bounding_box()
    assert inside is not None
    assert inside["x"] >= 0
    assert inside["x"] + inside["width"] <= width
    station.picture(f"size-{width}")
    page.keyboard.press("Escape")
    expect(page.locator("#look-toggle")).to_be_focused()
    assert station.errors == []


@pytest.mark.parametrize(("width", "height"), [(720, 450), (1024, 600), (800, 600)])
def test_a_low_window_has_one_scroll_bar_and_the_steps_in_sight(
    resized: Workstation, rest: Rest, width: int, height: int
) -> None:
    """The verdict is folded to one line, its word and worst figure, until somebody asks why."""
    station, page = resized, resized.page
    resize(station, width, height)
    page.click("[data-step=plan]")
    station.open_plan(rest.copy_of_sample("Low window"))
    station.wait_for("the verdict", lambda: (station.state("corridor") or {}).get("state") == "current", DRIVEN_S)
    station.open_step("path")
    page.evaluate("document.getElementById('panel').scrollTo(0, 0)")
    station.slices_stand()
    station.picture(f"low-{width}-{height}")
    assert page.evaluate(SCROLL_BARS) == ["panel"]
    assert page.evaluate(STEPS_IN_SIGHT) >= 4
    card, chips = page.locator("#card"), page.locator("#card .chip")
    assert (card.bounding_box() or {})["height"] <= 40
    figures = station.state("corridor")["verdict"]["figures"]
    assert len(figures) > 1
    expect(page.locator("#card .card-word")).to_be_visible()
    expect(chips.first).to_be_visible()
    expect(chips.first).to_contain_text(figures[0]["name"])
    expect(chips.nth(1)).to_be_hidden()
    page.click("#verdict-why")
    expect(chips.nth(1)).to_be_visible()
    expect(page.locator("#verdict-words")).to_be_visible()
    page.click("#verdict-why")
    expect(chips.nth(1)).to_be_hidden()
    page.locator("[data-step-name=export] > summary").click()
    expect(page.locator("[data-step-name=export] > summary")).to_be_in_viewport()
    assert station.errors == []


def test_layouts_are_chosen_by_button_and_key_and_remembered(open_page: Open) -> None:
    """The scene's frame stays the same document through all of them, here an empty one."""
    station = open_page(viewport={"width": 1440, "height": 900}).ready()
    page, bench = station.page, station.page.locator("#bench")
    page.evaluate("document.getElementById('scene').contentWindow.stillHere = true")

    def has(selector: str, least: float) -> None:
        """A part of the page gets more than this share of it."""
        station.wait_for(f"{least} of the page for {selector}", lambda: page.evaluate(SHARE, selector) > least)

    has(".viewer", 0.3)
    page.click("[data-layout-button=two-by-two]")
    for name in (".viewer", "[data-axis=axial]", "[data-axis=sagittal]"):
        has(name, 0.12)
    for key, layout, seen in (("1", "axial", "[data-axis=axial]"), ("2", "coronal", "[data-axis=coronal]")):
        page.keyboard.press(key)
        expect(bench).to_have_attribute("data-layout", layout)
        has(seen, 0.45)
        expect(page.locator("#scene")).to_be_hidden()
    page.keyboard.press("2")
    expect(bench).to_have_attribute("data-layout", "two-by-two")
    page.keyboard.press("4")
    page.keyboard.press("p")
    has(".viewer", 0.75)
    page.reload()
    station.ready()
    expect(bench).to_have_attribute("data-layout", "scene")
    expect(page.locator("#panel")).to_be_hidden()
    page.evaluate("document.getElementById('scene').contentWindow.stillHere = true")
    page.keyboard.press("p")
    page.click("[data-layout-button=one-three]")
    expect(bench).to_have_attribute("data-layout", "one-three")
    station.slices_stand()
    assert page.evaluate("document.getElementById('scene').contentWindow.stillHere"), "the frame was loaded anew"
    width = "document.getElementById('slices').getBoundingClientRect().width"
    wide = page.evaluate(width)
    page.focus("#splitter")
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    station.wait_for("wider slices", lambda: page.evaluate(width) > wide + 60)
    assert station.errors == []


@pytest.mark.parametrize(("width", "height", "least"), [(1440, 900, 200), (1024, 768, 150), (800, 900, 150)])
def test_the_slices_of_an_empty_plan_are_large_enough_to_click_in(
    resized: Workstation, rest: Rest, width: int, height: int, least: int
) -> None:
    """The first point is clicked before there is a path, and with it a fourth view."""
    station = resized
    resize(station, width, height)
    station.page.click("[data-step=plan]")
    station.open_plan(rest.empty_plan("Before the first point"))
    expect(station.page.locator("#slices")).to_have_attribute("data-panes", "3")
    station.slices_stand()
    stages = station.page.locator(".slice-stage:visible")
    before = [stage.bounding_box() for stage in stages.all()]
    assert len(before) == 3
    assert all(box is not None and box["height"] >= least for box in before), before
    assert station.page.evaluate(SCROLLED) == 0
    station.picture(f"slices-before-path-{width}")
    station.open_plan(rest.copy_of_sample("After it"))
    expect(station.page.locator("#slices")).to_have_attribute("data-panes", "4")
    station.slices_stand()
    station.picture(f"slices-{width}")
    assert [stage.bounding_box() for stage in stages.all()][:3] == before  # none moves under the pointer
    assert station.page.evaluate(SCROLLED) == 0
    if width == 800:
        assert len({box["y"] for box in before if box}) == 1, before  # in one row
        assert (station.page.locator(".viewer").bounding_box() or {})["height"] > 350
    assert station.errors == []


def test_a_view_that_asks_to_be_large_is(open_page: Open) -> None:
    """What a slice sends at a double-click."""
    station = open_page(viewport={"width": 1024, "height": 768}).ready()
    page, bench = station.page, station.page.locator("#bench")
    page.evaluate("dispatchEvent(new CustomEvent('vfix:enlarge', { detail: 'sagittal' }))")
    expect(bench).to_have_attribute("data-layout", "sagittal")
    page.evaluate("dispatchEvent(new CustomEvent('vfix:enlarge', { detail: null }))")
    expect(bench).to_have_attribute("data-layout", "one-three")


def test_the_theme_is_the_system_s_until_somebody_chooses(open_page: Open) -> None:
    station = open_page(viewport={"width": 1024, "height": 700}).see_scene()
    page = station.page
    theme = "document.documentElement.dataset.theme"
    ground = "getComputedStyle(document.getElementById('scene').contentDocument.body).backgroundColor"
    page.emulate_media(color_scheme="dark")
    station.wait_for("the dark theme", lambda: page.evaluate(theme) == "dark")
    sheeted = "document.getElementById('scene').contentDocument.adoptedStyleSheets.length > 0"
    station.wait_for("the scene in the page's colours", lambda: page.evaluate(sheeted))
    dark = page.evaluate(ground)
    page.emulate_media(color_scheme="light")
    station.wait_for("the light theme", lambda: page.evaluate(theme) == "light")
    station.wait_for("the scene's light ground", lambda: page.evaluate(ground) != dark)
    assert page.evaluate("getComputedStyle(document.querySelector('.slice-stage')).backgroundColor") == "rgb(0, 0, 0)"
    page.click("#theme")
    page.reload()
    station.see_scene()
    assert page.evaluate(theme) == "dark"
    station.wait_for("the scene's dark ground", lambda: page.evaluate(ground) == dark)
    assert station.errors == []
