"""A person opens the colon that travels with vfix, plans a route, and drives a snake robot in by wheel and drag."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect
from workstation import DRIVEN_S, Rest, Workstation

# The class of the arc that shows the guidance force, '' while there is none.
NOTCH_MM = 5.0
ARC = """() => [...document.querySelectorAll('[data-force=guidance]')].filter(({ style }) => style.display !== "none")
  .map((arc) => arc.getAttribute("class") ?? "").join()"""

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

# How bright the drawn picture of the endoscope is, and how it is turned: its mean, and the pose that it shows.
SHOWN = """() => { const { pose, renderer } = vfix.endoscope; return pose && renderer?.tissue ? pose.shaft : null; }"""

# How red the picture is where nothing is drawn, with the lens behind the wall and before it.
NOTHING = """() => {
  const view = vfix.endoscope, { renderer } = view, { gl, tissue } = renderer;
  const { snake } = view.connection.state, { lens_mm: found } = snake;
  const red = (mm) => {
    snake.lens_mm = mm;
    view.draw();
    const pixel = new Uint8Array(4);
    gl.readPixels(1, 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return pixel[0];
  };
  renderer.tissue = { draw() {} };
  const reds = [red(-1), red(5)];
  snake.lens_mm = found;
  renderer.tissue = tissue;
  return reds;
}"""


def test_a_colon_is_opened_planned_and_driven_by_wheel_and_drag(open_page: Open, rest: Rest) -> None:
    station = open_page(sample=False, viewport={"width": 1280, "height": 720}).ready()
    page = station.page
    page.click("[data-step=patient]")
    page.locator("#cases .row-main", has_text="Colon phantom").click()
    station.wait_for("the colon", lambda: (station.state("case") or {}).get("id") == "colon-phantom")
    expect(page.locator("#steps button:visible")).to_have_text(["Patient", "Route", "Drive", "Review"])
    expect(page.locator("[data-step-name=threshold]")).to_be_hidden()
    station.picture("lumen-patient")

    # a robot whose kernels are compiled meanwhile takes minutes to come
    expect(page.locator("#hint")).not_to_contain_text("Preparing", timeout=1000.0 * DRIVEN_S)

    page.click("[data-step=route]")
    station.wait_for("the pathway", lambda: _path(station, "ready"), DRIVEN_S)
    whole = _length(station)
    page.select_option("#route-end", label="Descending sigmoid")
    station.wait_for("a shorter one", lambda: _path(station, "ready") and _length(station) < whole - 200.0, DRIVEN_S)
    page.keyboard.press("Control+z")
    station.wait_for("the whole colon", lambda: _path(station, "ready") and _length(station) == whole, DRIVEN_S)
    station.picture("lumen-route")

    page.click("[data-step=drive]")
    station.wait_for("the robot", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
    page.click("#start")
    station.wait_for("the drive", lambda: station.rehearsal()["state"] == "running")
    station.wait_for("the picture", lambda: page.evaluate(SHOWN), DRIVEN_S)
    assert abs(_wheeled(station, 8) - 40.0) <= 1.0  # eight notches; both are shown as whole mm
    while not station.state("snake")["can_look"]:  # all links that bend have to be inside
        _wheel(page, 10)
        station.wait_for("rest", lambda: _rests(station))
    ahead = page.evaluate(SHOWN)
    station.picture("lumen-drive")
    _drag(page, 200, 0)
    station.wait_for("another view", lambda: _turned(ahead, page.evaluate(SHOWN)) > 3.0)
    bent = station.state("snake")["bend"]
    _wheeled(station, 1)  # with its bend
    assert not station.state("snake")["straight"]
    assert abs(station.state("snake")["bend"] - bent) < 0.1
    station.wait_for("the arc of the force", lambda: page.evaluate(ARC) or _drag(page, 200, 0))
    station.picture("lumen-turned")
    behind, before = page.evaluate(NOTHING)  # a red-out, and no hole
    assert behind > 100 > 10 > before
    page.click("#straighten")
    station.wait_for("the straight robot", lambda: station.state("snake")["straight"])
    depth = station.state("snake")["depth_mm"]
    page.keyboard.down("s")
    _drag(page, 20, 0)  # stops no key that is held
    station.drive_until("s", "the way back by a key", lambda: station.state("snake")["depth_mm"] < depth - 3.0)
    page.keyboard.up("s")
    _wheeled(station, -4)

    page.uncheck("#outside-view")
    expect(page.locator("#bench")).to_have_attribute("data-layout", "endoscope-alone")
    page.check("#outside-view")
    expect(page.locator("#bench")).to_have_attribute("data-layout", "endoscope")
    page.keyboard.press("Space")
    station.wait_for("the pause", lambda: station.rehearsal()["state"] == "paused")
    expect(page.locator("#certified-words")).to_contain_text("behind wall")
    page.click("[data-arm=guided]")
    expect(page.locator("#uncertified")).to_be_visible()
    station.wait_for("the entry", lambda: station.rehearsal()["state"] == "ready", DRIVEN_S)
    assert (station.state("snake")["depth_mm"], station.state("snake")["certified"]) == (0.0, False)
    page.evaluate("vfix.request('rehearsal.end')")
    (run,) = station.wait_for("the run", lambda: rest.runs("colon-phantom"))
    assert (run["world"], run["origin"], run["plan_id"]) == ("snake", "page", "colon-phantom-sample")
    assert (run["arm"], run["certified"]) == ("certified", True)
    _reviewed(station, page, rest)
    assert station.errors == []


def _reviewed(station: Workstation, page: Page, rest: Rest) -> None:
    """The card at the end of the drive, its replay with robot, endoscope and curves, and the run deleted."""
    card = page.locator("#end-card")
    expect(card).to_contain_text("Run ended", timeout=1000.0 * DRIVEN_S)
    expect(card).to_contain_text("Certified")
    expect(card.locator(".run-result")).to_contain_text("Came ")
    expect(card.locator(".run-facts").first).to_contain_text("Beyond bound0 mm")
    station.picture("lumen-card")
    page.click("#run-replay")
    expect(page.locator(".review-plots .u-over")).to_have_count(5, timeout=1000.0 * DRIVEN_S)
    expect(page.locator("#show-path")).to_have_count(0)
    page.locator("#run-time").press("End")
    expect(page.locator(".timeline-time")).not_to_have_text(re.compile(r"^0\.0 /"))
    page.keyboard.press("e")  # the slider keeps the focus, and the keys that move it alone
    expect(page.locator("#bench")).to_have_attribute("data-layout", "endoscope")
    ahead = station.wait_for("the picture", lambda: page.evaluate(SHOWN), DRIVEN_S)
    expect(page.locator("#scope-source")).to_have_text("Replayed")
    page.locator("#run-time").press("Home")
    station.wait_for("another view", lambda: page.evaluate(SHOWN) != ahead)
    assert page.evaluate(ARC) == ""  # nothing is felt at the start
    (run,) = rest.runs("colon-phantom")
    series = rest.client.get(f"/api/v1/runs/{run['id']}/series").raise_for_status().json()
    _, felt = max((x * x + y * y, t) for t, (x, y) in zip(series["t_s"], series["guidance_xy_n"], strict=True))
    page.locator("#run-time").fill(f"{felt + 0.05:.2f}")
    station.wait_for("the arc of the force, replayed", lambda: page.evaluate(ARC))
    station.picture("lumen-review")
    page.click("#delete-run")
    page.click("#dialog button[value=ok]")
    station.wait_for("no run", lambda: not rest.runs("colon-phantom"))
    expect(page.locator("#runs .row-main")).to_have_count(0)


def _length(station: Workstation) -> float:
    """Of the route's pathway, mm."""
    return float(station.state("route_path")["length_mm"])


def _path(station: Workstation, state: str) -> bool:
    return bool((station.state("route_path") or {}).get("state") == state)


def _centre(page: Page) -> tuple[float, float]:
    box = page.locator(".scope-picture").bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0


def _wheel(page: Page, notches: int) -> None:
    """Turn the wheel in the picture, forwards."""
    page.mouse.move(*_centre(page))
    for _ in range(abs(notches)):
        page.mouse.wheel(0, -100 if notches > 0 else 100)


def _wheeled(station: Workstation, notches: int) -> float:
    """Turn the wheel, once more where the robot was held for so long that the page forgot it; how far it came in mm."""
    for _ in range(5):
        before = station.state("snake")["depth_mm"]
        _wheel(station.page, notches)
        station.page.wait_for_timeout(2000)
        station.wait_for("rest", lambda: _rests(station))
        came = float(station.state("snake")["depth_mm"] - before)
        if came * notches > 0.5 * NOTCH_MM * notches**2:
            return came
    raise AssertionError(f"{notches} notches of the wheel moved nothing: {station.rehearsal()}")


def _drag(page: Page, right: int, down: int) -> None:
    """Drag in the picture in small steps, and hold for a while."""
    x, y = _centre(page)
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(1, 21):
        page.mouse.move(x + right * step / 20, y + down * step / 20)
        page.wait_for_timeout(30)
    page.wait_for_timeout(300)
    page.mouse.up()


def _rests(station: Workstation) -> bool:
    """Whether the depth does not change any more."""
    before = station.state("snake")["depth_mm"]
    station.page.wait_for_timeout(500)
    return bool(abs(station.state("snake")["depth_mm"] - before) < 0.05)


def _turned(one: list[float], other: list[float]) -> float:
    """Degrees between two unit vectors, by their chord."""
    return float(sum((a - b) ** 2 for a, b in zip(one, other, strict=True)) ** 0.5) * 57.3
