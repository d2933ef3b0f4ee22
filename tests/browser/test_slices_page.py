"""The slices in a real browser: values, hands, keys, measures, the view across the path, one slice large."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

from vfix_engine.anatomy.phantom import load_head_ct, load_nose_ct

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

LARGE = {"width": 1440, "height": 900}
# Mean grey of a canvas that shows a bitmap, drawn onto another one to be read.
GREY = """(axis) => {
  const canvas = document.querySelector(`[data-axis=${axis}] .slice-picture`);
  const copy = new OffscreenCanvas(canvas.width, canvas.height);
  const context = copy.getContext('2d');
  context.drawImage(canvas, 0, 0);
  const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0;
  for (let n = 0; n < data.length; n += 4) sum += data[n];
  return sum / (data.length / 4);
}"""


def opened(open_page: Open, viewport: dict[str, int] | None = None) -> Workstation:
    station = open_page(viewport=viewport or LARGE).ready()
    station.wait_for("the voxels", lambda: station.page.evaluate("vfix.slices.link.ready"))
    station.slices_stand()
    return station


def cross(station: Workstation) -> list[float]:
    place: list[float] = station.page.evaluate("vfix.slices.crosshair.place")
    return place


def middle(station: Workstation, axis: str) -> tuple[float, float]:
    box = station.page.locator(f"[data-axis={axis}]").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


# Notes when the pointer goes down and up, in milliseconds.
PRESSES = """() => {
  window.presses = [];
  const note = () => window.presses.push(performance.now());
  for (const kind of ['pointerup', 'pointerdown']) window.addEventListener(kind, note, { capture: true });
}"""
# What is asked of the slices between the planner's word that there are none and the page's next frame.
NO_SLICES_YET = """() => {
  const { slices } = vfix.state;
  vfix.state.slices = null;
  for (const pane of vfix.slices.panes) { pane.goBy(1); pane.refresh(); pane.mark(); }
  vfix.state.slices = slices;
}"""
PRESETS = ("Bone", "Sinus and air", "Soft tissue")
DOUBLE_MS = 250.0  # two clicks that are further apart are no double click, and each adds


def told(station: Workstation, axis: str) -> Callable[[], str]:
    return lambda: station.page.locator(f"[data-view={axis}] .slice-where").inner_text()


def read(station: Workstation, axis: str) -> list[str]:
    """Place and HU under the pointer."""
    return station.page.locator(f"[data-view={axis}] .slice-reading").all_inner_texts()


def test_the_window_samples_the_ct_as_the_engine_does(open_page: Open) -> None:
    """3,000 places over the whole head: within half a HU, the finer volume where it reaches."""
    station = opened(open_page)
    head, nose = load_head_ct(), load_nose_ct()
    random = np.random.default_rng(3)
    low, high = head.bounds
    places = np.concatenate([random.uniform(low - 5.0, high + 5.0, (2000, 3)), random.uniform(*nose.bounds, (1000, 3))])
    fine, wide = (volume.sample(places, outside=np.nan) for volume in (nose, head))
    wanted = np.where(np.isnan(fine), wide, fine)
    values = station.page.evaluate("(places) => vfix.slices.link.read(places)", places.tolist())
    given = np.array([np.nan if value is None else value for value in values])
    assert np.array_equal(np.isnan(given), np.isnan(wanted))
    known = ~np.isnan(wanted)
    assert known.sum() > 2500
    assert np.isnan(fine).sum() > 1000
    assert np.abs(given[known] - wanted[known]).max() <= 0.5 + 1e-6


def test_scrolling_and_grey_values_need_no_picture_from_the_planner(open_page: Open, rest: Rest) -> None:
    station = opened(open_page)
    station.open_plan(rest.copy_of_sample("Scrolled"))
    page, label = station.page, told(station, "axial")
    start = rest.sample()["points"][0]["position"][2]
    station.wait_for("the slice of the path's first point", lambda: label() == f"I {-start:.1f} mm")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    step = station.state("slices")["planes"]["axial"]["step"]
    page.mouse.move(*middle(station, "axial"))
    page.mouse.wheel(0, 120)
    station.wait_for("the next slice", lambda: cross(station)[2] == pytest.approx(start + step))
    reading = station.wait_for("the reading", lambda: (now := read(station, "axial"))[0].endswith(label()) and now)
    assert reading[0].split()[0] in "LR"
    assert reading[0].split()[2] in "PA"
    assert reading[1].endswith(" HU")
    station.wait_for("the planner's cross", lambda: station.state("slices")["cross"] == pytest.approx(cross(station)))

    station.slices_stand()
    before = page.evaluate(GREY, "axial")
    x, y = middle(station, "axial")
    page.mouse.move(x, y)
    page.mouse.down(button="right")
    page.mouse.move(x, y - 60, steps=4)
    page.mouse.up(button="right")
    station.wait_for("brighter", lambda: page.evaluate(GREY, "axial") > before + 10)
    station.wait_for("the planner's window", lambda: station.state("slices")["window_name"] == "own")
    station.wait_for("the planner's level", lambda: station.state("slices")["level"] < -200)
    greys = page.locator(".slice-window")

    def words() -> str:
        own = station.state("slices")
        return f"W {own['window']:.0f} L −{-own['level']:.0f}"

    station.wait_for("its words", lambda: greys.inner_text() == words())
    page.keyboard.down("Shift")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 50, y, steps=4)
    page.mouse.up()
    page.keyboard.up("Shift")
    station.wait_for("a wider window", lambda: station.state("slices")["window"] > 2000)
    greys.click()
    expect(page.locator("[role=menuitemradio]")).to_contain_text([*PRESETS, "Dragged"])
    expect(page.locator("[data-greys=own]")).to_have_attribute("aria-checked", "true")
    page.click("[data-greys=bone]")
    expect(greys).to_be_focused()
    station.wait_for("the preset", lambda: station.state("slices")["window"] == 2500)
    assert not [url for url in asked if "/slices/" in url or "/volume" in url], asked
    assert len(station.state("plan")["points"]) == len(rest.sample()["points"]), "no drag added a point"
    assert station.errors == []


def test_zoom_keeps_the_place_under_the_pointer_and_pan_moves_the_view(open_page: Open) -> None:
    station = opened(open_page)
    page = station.page
    x, y = (round(value) for value in middle(station, "coronal"))  # as a wheel's event tells it
    at = """([x, y]) => {
      const { stage, port } = vfix.slices.panes[1];
      const box = stage.getBoundingClientRect();
      return port.place(x - box.x, y - box.y);
    }"""
    spot = [x + 50, y - 20]
    before, kept = page.evaluate(at, spot), cross(station)
    wide = page.evaluate("vfix.slices.panes[1].port.perPixel")
    page.mouse.move(*spot)
    page.keyboard.down("Control")
    for _ in range(3):
        page.mouse.wheel(0, -120)
    page.keyboard.up("Control")
    station.wait_for("the zoom", lambda: page.evaluate("vfix.slices.panes[1].port.perPixel") < 0.67 * wide)
    assert page.evaluate(at, spot) == pytest.approx(before, abs=1e-6)
    page.mouse.down(button="middle")
    page.mouse.move(spot[0] - 30, spot[1] + 10, steps=3)
    page.mouse.up(button="middle")
    there = [spot[0] - 30, spot[1] + 10]
    station.wait_for("the pan", lambda: page.evaluate(at, there) == pytest.approx(before, abs=1e-6))
    assert cross(station) == kept, "neither moves the crosshair"
    assert station.errors == []


def test_distance_and_angle_are_measured_and_escape_ends(open_page: Open) -> None:
    station = opened(open_page)
    page = station.page
    page.click("[data-tool=distance]")
    station.slices_stand()
    x, y = middle(station, "axial")
    page.mouse.click(x - 40, y)
    page.mouse.click(x + 40, y)
    words = page.locator("[data-axis=axial] .slice-measure-words")
    expect(words).to_have_count(1)
    per_pixel = page.evaluate("vfix.slices.panes[0].port.perPixel")
    assert float((words.text_content() or "").split()[0]) == pytest.approx(80 * per_pixel, abs=0.06)
    page.click("[data-tool=angle]")
    for dx, dy in ((30, 0), (0, 0), (0, -30)):
        page.mouse.click(x + dx, y + dy)
    station.wait_for("the angle", lambda: "90.0°" in words.all_text_contents())
    page.mouse.click(x + 10, y + 10)
    page.locator("[data-axis=axial]").focus()
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
    expect(page.locator("[data-tool=cross]")).to_have_attribute("aria-pressed", "true")
    expect(words).to_have_count(2)
    page.click("[data-tool=clear]")
    expect(words).to_have_count(0)
    expect(page.locator("[data-tool=clear]")).to_be_hidden()
    page.keyboard.press("ArrowUp")
    expect(page.locator("[data-tool=angle]"), "the strip keeps the focus").to_be_focused()
    page.evaluate(NO_SLICES_YET)  # another head is on its way, and nothing was drawn since
    assert station.state("plan")["ghost"] is None, "measuring adds nothing"
    assert station.errors == []


def test_a_place_is_typed_and_points_are_added_and_moved_by_keys_alone(open_page: Open, rest: Rest) -> None:
    station = opened(open_page)
    page = station.page
    station.open_plan(rest.empty_plan("By keys in slices"))
    station.tab_to("[data-view=axial] .slice-where")
    page.keyboard.press("Enter")
    page.keyboard.type("somewhere")
    page.keyboard.press("Enter")
    expect(page.locator("#slice-place-problem")).to_contain_text("R 24.5 A 10 S 3")
    page.locator("#slice-place").fill("L 4.5 P 17.5 S 3.5")
    page.keyboard.press("Enter")
    station.wait_for("the place", lambda: cross(station) == pytest.approx([4.5, 17.5, 3.5]))
    expect(page.locator("#slice-place")).to_have_count(0)
    expect(page.locator("[data-axis=axial]"), "where Enter adds").to_be_focused()
    for key, place in (
        ("ArrowRight", [5.5, 17.5, 3.5]),
        ("Shift+ArrowLeft", [0.5, 17.5, 3.5]),
        ("Alt+ArrowDown", [0.5, 17.6, 3.5]),
        ("PageUp", [0.5, 17.6, 3.5 + station.state("slices")["planes"]["axial"]["step"]]),
    ):
        page.keyboard.press(key)
        station.wait_for(key, lambda place=place: cross(station) == pytest.approx(place))
    page.keyboard.press("Enter")
    station.wait_for("a ghost", lambda: station.state("plan")["ghost"])
    station.drawn()  # what is not shown yet is not taken
    page.keyboard.press("Enter")
    station.wait_for("the point", lambda: len(station.state("plan")["points"]) == 1)
    point: Any = station.state("plan")["points"][0]
    assert station.state("plan")["selected"] == point["id"]

    def position() -> list[float]:
        place: list[float] = station.state("plan")["points"][0]["position"]
        return place

    station.drawn()
    expect(page.locator("[data-axis=axial]"), "the focus, which the ghost's card had").to_be_focused()
    page.keyboard.press("m")
    page.keyboard.press("Shift+ArrowDown")
    station.wait_for("the carried point", lambda: position()[1] == pytest.approx(point["position"][1] + 5.0, abs=0.01))
    page.keyboard.press("Escape")
    station.wait_for("its return", lambda: position() == pytest.approx(point["position"]))
    page.keyboard.press("m")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    plan_id = station.state("plan")["id"]

    def stored() -> float:
        return float(rest.plan(plan_id)["points"][0]["position"][1])

    station.wait_for("the drop", lambda: stored() > point["position"][1] + 0.5)
    assert station.errors == []


def test_the_view_across_the_path_runs_along_it_with_the_tool_in_it(open_page: Open, rest: Rest) -> None:
    station = opened(open_page)
    page = station.page
    station.open_plan(rest.copy_of_sample("Along"))
    station.wait_for("the dry run", lambda: (station.state("corridor") or {}).get("completed") is True, DRIVEN_S)
    station.wait_for("the tool's poses", lambda: page.evaluate("Boolean(vfix.slices.pose)"))
    length = page.evaluate("vfix.slices.frames.length")
    assert length == pytest.approx(station.state("plan")["length_mm"], abs=0.1)
    page.locator("[data-view=path] input[type=range]").fill("60")
    station.wait_for("the place", lambda: told(station, "path")() == f"60.0 of {length:.1f} mm")
    here = page.evaluate("vfix.slices.frame.place")
    assert cross(station) == pytest.approx(here, abs=1e-3)
    station.wait_for("the 3D view's cross", lambda: station.state("slices")["cross"] == pytest.approx(here, abs=1e-3))
    pose = page.evaluate("vfix.slices.pose")
    tip = np.array(pose["segments"][0][1])
    assert np.linalg.norm(tip - here) < 1.0, "the tip is where the view is"
    drawn = """() => {
      const canvas = document.querySelector('[data-axis=path] .slice-tool-outline');
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      return data.filter((value, index) => index % 4 === 3 && value > 100).length;
    }"""
    station.wait_for("tool and ring", lambda: page.evaluate(drawn) > 10)
    page.locator("[data-axis=path]").focus()
    page.keyboard.press("PageUp")
    station.wait_for("half a millimetre on", lambda: told(station, "path")() == f"60.5 of {length:.1f} mm")
    assert station.errors == []


def test_one_slice_is_large_and_back(open_page: Open, rest: Rest) -> None:
    station = opened(open_page)
    page = station.page
    station.open_plan(rest.copy_of_sample("Large"))
    stage, bench = page.locator("[data-axis=sagittal]"), page.locator(".bench")
    station.slices_stand()
    small = stage.bounding_box()
    page.evaluate(PRESSES)

    def double_clicked() -> bool:
        """A busy machine may press so slowly that it is two clicks: then it is done anew on another copy."""
        page.evaluate("presses.length = 0")
        x, y = middle(station, "sagittal")
        page.mouse.dblclick(x + 30, y - 20)
        _, up, down, _ = page.evaluate("presses")
        if down - up < DOUBLE_MS:
            return True
        page.evaluate("vfix.slices.enlarge(null)")
        station.open_plan(rest.copy_of_sample("Large, once more"))
        station.slices_stand()
        return False

    station.wait_for("a double click", double_clicked)
    expect(bench).to_have_attribute("data-layout", "sagittal")
    station.slices_stand()
    large = stage.bounding_box()
    assert small is not None
    assert large is not None
    assert large["width"] > 3 * small["width"]
    expect(page.locator(".slice-stage:visible")).to_have_count(1)
    station.wait_for("its picture", lambda: page.evaluate("vfix.slices.panes[2].canvas.width") == round(large["width"]))
    page.wait_for_timeout(400)
    page.evaluate("vfix.request('project', { points: [] })")  # answered after whatever was asked for before
    assert station.state("plan")["ghost"] is None, "a double click adds nothing"
    station.picture("slice-large")
    page.keyboard.press("Escape")
    expect(page.locator(".slice-stage:visible")).to_have_count(4)
    page.evaluate("vfix.slices.enlarge('path')")
    expect(bench).to_have_attribute("data-layout", "path")
    expect(page.locator("[data-axis=path]")).to_be_visible()
    page.evaluate("vfix.slices.enlarge(null)")
    expect(bench).to_have_attribute("data-layout", "one-three")
    assert station.errors == []


def test_a_threshold_tints_the_slices_at_once(open_page: Open) -> None:
    station = opened(open_page)
    page = station.page
    green = """() => {
      const canvas = document.querySelector('[data-axis=axial] .slice-picture');
      const copy = new OffscreenCanvas(canvas.width, canvas.height);
      const context = copy.getContext('2d');
      context.drawImage(canvas, 0, 0);
      const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
      let found = 0;
      for (let n = 0; n < data.length; n += 4) if (data[n + 1] > data[n] + 20) found += 1;
      return found / (data.length / 4);
    }"""
    choose = "async (range) => (await import('/static/js/threshold-preview.js')).thresholdPreview.set(range)"
    station.slice_menu()
    page.locator("#slice-outlines").uncheck()
    station.wait_for("a picture", lambda: page.evaluate(GREY, "axial") > 1 and page.evaluate(green) == 0)
    for low, high in ((300, 3000), (-1024, -500)):
        page.evaluate(choose, {"low": low, "high": high})
        station.wait_for("the tint", lambda: 0.02 < page.evaluate(green) < 0.98)
        page.evaluate(choose, None)
        station.wait_for("no tint", lambda: page.evaluate(green) == 0)
    assert station.errors == []


def test_a_second_volume_is_laid_over_by_a_transform(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    """HAZ-38: the finer CT of the phantom as a head of its own is asked about, then laid over the phantom."""
    nose = load_nose_ct()
    image = SimpleITK.GetImageFromArray(nose.hu)
    image.SetOrigin(nose.origin.tolist())
    image.SetSpacing(nose.spacing.tolist())
    image.SetDirection(nose.direction.ravel().tolist())
    SimpleITK.WriteImage(image, str(tmp_path / "nose.nrrd"), True)
    with (tmp_path / "nose.nrrd").open("rb") as file:
        answer = rest.client.post("/api/v1/cases", files={"file": ("nose.nrrd", file)}, data={"name": "Second"})
    job = answer.raise_for_status().json()["id"]
    station = opened(open_page)
    page = station.page

    def imported() -> Any:
        now = rest.client.get(f"/api/v1/jobs/{job}").json()
        assert now["state"] != "failed", now
        return now["state"] == "done"

    station.wait_for("the second head", imported, DRIVEN_S)
    expect(page.locator("#overlay-case option", has_text="Second")).to_have_count(1)
    station.slice_menu()
    page.locator("#slice-outlines").uncheck()
    page.click("#second-volume")
    page.locator("#overlay-placing summary").wait_for(state="hidden")
    grey = lambda: page.evaluate(GREY, "axial")  # noqa: E731
    station.wait_for("a picture", lambda: grey() > 1)
    second = page.locator("optgroup[label='Other heads'] option", has_text="Second · imported").get_attribute("value")
    page.select_option("#overlay-case", second)
    expect(page.locator("#dialog")).to_contain_text("Is this the same patient?")
    page.get_by_role("button", name="Cancel").click()
    expect(page.locator("#overlay-case")).to_have_value("")
    page.select_option("#overlay-case", second)
    page.get_by_role("button", name="Same patient").click()
    page.select_option("#overlay-window", "sinus")
    page.locator("#overlay-opacity").fill("0")
    station.wait_for("the second volume", lambda: page.evaluate("Boolean(vfix.slices.second.look)"))

    def settled() -> bool:
        before = grey()
        page.wait_for_timeout(1000)
        return bool(grey() == before)

    station.slices_stand()
    station.wait_for("its picture stands", settled)
    alone = grey()
    page.locator("#overlay-opacity").fill("100")
    page.wait_for_timeout(500)
    station.slices_stand()
    station.wait_for("the same voxels at the same place", lambda: grey() == pytest.approx(alone, abs=0.5))
    page.select_option("#overlay-window", "soft")
    station.wait_for("another window", lambda: abs(grey() - alone) > 3)
    page.locator("#overlay-opacity").fill("0")
    station.wait_for("the first alone", lambda: grey() == pytest.approx(alone, abs=0.5))
    page.locator("#overlay-opacity").fill("100")
    page.locator("#overlay-placing summary").click()
    page.locator("#overlay-transform").fill("1 2 3")
    page.keyboard.press("Tab")
    expect(page.locator("[role=alert]").last).to_contain_text("16 numbers")
    page.locator("#overlay-transform").fill("1 0 0 0 0 1 0 0 0 0 1 80 0 0 0 1")
    page.keyboard.press("Tab")
    station.wait_for("the moved volume", lambda: grey() == pytest.approx(alone, abs=0.5))
    expect(page.locator("#alerts")).not_to_contain_text("16 numbers")
    expect(page.locator("#overlay-z")).to_have_value("80")
    kept = lambda: (station.state("second_volume") or {}).get("laid") or {}  # noqa: E731
    station.wait_for("what the plan keeps", lambda: kept().get("opacity") == 1 and kept()["transform"][11] == 80)
    page.select_option("#overlay-window", "bone")
    station.wait_for("its grey values", lambda: kept().get("window") == 2500)
    page.reload()
    station.wait_for("the slices again", lambda: page.evaluate("Boolean(window.vfix?.slices.second.look)"))
    look = page.evaluate("vfix.slices.second.look")
    assert (look["opacity"], look["greys"]["window"], look["greys"]["level"]) == (1, 2500, 600)
    expect(page.locator("#overlay-transform")).to_have_value("1 0 0 0 0 1 0 0 0 0 1 80 0 0 0 1")
    station.slice_menu("second-volume")
    page.locator("#overlay-case").select_option(label="None")
    station.wait_for("nothing over it", lambda: station.state("second_volume")["laid"] is None)
    rest.client.delete(f"/api/v1/cases/{rest.client.get(f'/api/v1/jobs/{job}').json()['result']}").raise_for_status()
    assert station.errors == []
