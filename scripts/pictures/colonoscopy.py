"""docs/colonoscopy_tutorial.md, step by step on the real page, with the names in that text."""

from __future__ import annotations

from .named_page import PATIENCE_S, NamedPage

NOTCHES = 26  # of the wheel; 5 mm each


def open_the_colon(page: NamedPage) -> None:
    page.go_to("Patient")
    page.page.locator("#cases .row-main", has_text="Colon phantom").click()
    page.wait("the colon", lambda: (page.station.state("case") or {}).get("id") == "colon-phantom")


def read_the_route(page: NamedPage) -> None:
    """The pathway of the route that comes along, and how deep the robot comes."""
    page.go_to("Route")
    page.wait("the pathway", lambda: (page.station.state("route_path") or {}).get("state") == "ready")
    page.says("Tip reaches")
    page.says("of pathway behind wall")
    page.take("colonoscopy_route")


def drive(page: NamedPage) -> None:
    """Insert by the wheel, and turn the camera by a drag."""
    page.go_to("Drive")
    page.button("Manual")
    page.button("Guided")
    page.button("Certified")
    page.heading("Task")
    page.button("Polyps")
    page.says("Parameters")
    page.wait("the paper's", lambda: page.page.locator("select", has_text="Kwok 2013").count())
    page.press("Start")
    page.wait("the drive", lambda: page.station.rehearsal()["state"] == "running")
    page.wait("the picture", lambda: page.page.evaluate("Boolean(vfix.endoscope.renderer?.tissue)"))
    _wheel(page, NOTCHES)
    page.wait("the depth", lambda: page.station.state("snake")["depth_mm"] > 4.5 * NOTCHES)
    while not page.station.state("snake")["can_look"]:
        _wheel(page, 4)
        page.page.wait_for_timeout(1500)
    _drag(page, 120, 60)
    page.page.wait_for_timeout(1000)
    page.says("Held by")
    page.press("Pause")  # without a graphics card 3D rests while the robot moves
    page.wait("the pause", lambda: page.station.rehearsal()["state"] == "paused")
    page.take("colonoscopy_drive")
    page.press("Continue")
    page.wait("the drive", lambda: page.station.rehearsal()["state"] == "running")
    page.press("Straighten")
    page.wait("the straight robot", lambda: page.station.state("snake")["straight"])


def end_and_review(page: NamedPage) -> None:
    page.press("Finish run")
    page.button("Replay")
    page.says("Beyond bound")
    page.page.locator("#end-card").evaluate("(card) => card.scrollIntoView({ block: 'start' })")
    page.take("colonoscopy_card")
    page.press("Replay")
    page.wait("the plots", lambda: page.page.locator(".review-plots .u-over").count() == 5)
    if page.page.locator("#bench").get_attribute("data-layout") != "endoscope":
        page.press("Endoscope")
    page.page.locator("#run-time").fill("6")
    page.take("colonoscopy_review")


def _picture(page: NamedPage) -> tuple[float, float]:
    box = page.page.locator(".scope-picture").bounding_box(timeout=1000.0 * PATIENCE_S)
    assert box is not None
    return box["x"] + box["width"] / 2.0, box["y"] + box["height"] / 2.0


def _wheel(page: NamedPage, notches: int) -> None:
    page.page.mouse.move(*_picture(page))
    for _ in range(notches):
        page.page.mouse.wheel(0, -100)
        page.page.wait_for_timeout(60)


def _drag(page: NamedPage, right: int, down: int) -> None:
    x, y = _picture(page)
    mouse = page.page.mouse
    mouse.move(x, y)
    mouse.down()
    for step in range(1, 21):
        mouse.move(x + right * step / 20, y + down * step / 20)
        page.page.wait_for_timeout(40)
    mouse.up()
