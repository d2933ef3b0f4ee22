"""The endoscope's picture in a real browser: as the engine's rays say, with the plan where it is; and of a drive."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from workstation import DRIVEN_S, Rest, Workstation

from vfix_engine.anatomy.endoscopy.air_surface import air_surface, box_about
from vfix_engine.anatomy.lumen.wall import Wall
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.arrays import Array
from vfix_engine.geometry.path import SplinePath

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]

ANGLES = (0, 30, 45, 70)  # degrees
STATIONS = 13  # along the path: with the angles 52 poses
FIELD = np.tan(np.radians(35.0))  # half of the picture, at unit depth
SIZE = 160  # px of a picture of depths, and every so many of them are compared
EVERY = 8
CLOSE_MM, SHARE = 0.3, 0.95
OVERLAY = 400  # px of a picture of the plan
HALF_PX, CORNER_PX = 1.25, 0.71  # half of the path's width there, and of a pixel's diagonal

# Depth along the view in 1/512 mm, as two bytes; what is nowhere near a surface keeps the ground's blue.
DEPTHS = """#version 300 es
precision highp float; out vec4 drawn;
void main() {
  float d = floor(512.0 / gl_FragCoord.w);
  drawn = vec4(floor(d / 256.0) / 255.0, mod(d, 256.0) / 255.0, 1.0, 1.0);
}
"""
BLACK = """#version 300 es
precision mediump float; out vec4 drawn; void main() { drawn = vec4(0.0, 0.0, 0.0, 1.0); }
"""
# The pixels of pictures with a shader of the test, from the foot up, and with a plan laid over.
DRAW = """async ([poses, size, fragment, path, targets]) => {
  const { lensOf } = await import("/static/js/endoscope/lens.js");
  const { renderer } = vfix.endoscope;
  renderer.resize(size);
  const told = poses.map(([pose, angle, ...target]) => {
    renderer.overlay.set(path, target.length ? target : targets);
    renderer.draw(lensOf(pose, { angle, turn: 0, level: false }), "lean", fragment);
    const pixels = new Uint8Array(4 * size * size);
    renderer.gl.readPixels(0, 0, size, size, renderer.gl.RGBA, renderer.gl.UNSIGNED_BYTE, pixels);
    let text = "";
    for (let i = 0; i < pixels.length; i += 8192) text += String.fromCharCode(...pixels.subarray(i, i + 8192));
    return btoa(text);
  });
  renderer.overlay.set(vfix.state.curve.points, vfix.state.plan.targets.map((target) => target.position));
  return told;
}"""


class Scope:
    """A pose of a scope, and its picture's axes by arithmetic of the test's own."""

    def __init__(self, tip: Array, shaft: Array, angle: int) -> None:
        shaft = shaft / np.linalg.norm(shaft)
        side = np.array([0.0, 0.0, 1.0]) - shaft[2] * shaft
        side /= np.linalg.norm(side)
        c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
        self.tip, self.ahead, self.above = tip, c * shaft + s * side, c * side - s * shaft
        self.right = np.cross(self.ahead, self.above)
        self.said = [{"tip": tip.tolist(), "shaft": shaft.tolist(), "side": [0.0, 0.0, 1.0]}, angle]

    def rays(self, size: int, every: int) -> tuple[Array, Array]:
        """Pixels (n, 2), column and row from the foot, of the round picture, and unit vectors (n, 3) through them."""
        pixels = np.stack(np.meshgrid(*2 * [np.arange(every // 2, size, every)]), axis=-1).reshape(-1, 2)
        x, y = (FIELD * (2.0 * (pixels + 0.5) / size - 1.0)).T
        within = np.hypot(x, y) < FIELD
        ways = self.ahead + x[within, None] * self.right + y[within, None] * self.above
        return pixels[within], ways / np.linalg.norm(ways, axis=1, keepdims=True)

    def places(self, points: Array, size: int) -> Array:
        """Pixels (n, 2) of points (m, 3) that are in the round picture, ahead of the lens."""
        off = points - self.tip
        depth = off @ self.ahead
        off, depth = off[depth > 0.2], depth[depth > 0.2]
        found = np.stack([off @ self.right, off @ self.above], axis=-1) / depth[:, None] / FIELD
        return (found[np.linalg.norm(found, axis=1) < 0.95] + 1.0) * size / 2.0


@pytest.fixture(scope="module")
def station(open_shared: Open, rest: Rest) -> Workstation:
    """A page that shows the endoscope large, beside a robot at the entry."""
    shown = open_shared(viewport={"width": 1280, "height": 760}).ready()
    shown.open_plan(rest.copy_of_sample("Through the scope"))
    shown.page.click("[data-step=rehearse]")
    shown.wait_for("Rehearse", lambda: shown.state("step")["name"] == "rehearse")
    expect(shown.page.locator("#endoscope-button")).to_be_enabled()  # the key means it from here on
    shown.page.keyboard.press("e")
    expect(shown.page.locator("#bench")).to_have_attribute("data-layout", "endoscope")
    ready = shown.page.locator("#endoscope[data-ready=true]")
    expect(ready).to_be_visible(timeout=1000.0 * DRIVEN_S)
    return shown


@pytest.fixture(scope="module")
def points(station: Workstation) -> Array:
    return np.array([point["position"] for point in station.state("plan")["points"]])


@pytest.fixture(scope="module")
def scopes(points: Array) -> list[Scope]:
    path = SplinePath(points)
    along = np.linspace(0.02, 0.95, STATIONS) * path.length
    tips = np.array([path.position(s) for s in along])
    shafts = np.array([path.position(s + 1.0) - path.position(s - 1.0) for s in along])
    return [Scope(tip, shaft, angle) for tip, shaft in zip(tips, shafts, strict=True) for angle in ANGLES]


def pictures(page: Page, poses: list[Any], size: int, shader: str, path: Any = (), targets: Any = ()) -> Array:
    """Pixels (n, size, size, 4) of the poses, from the foot up."""
    told = page.evaluate(DRAW, [poses, size, shader, list(path), list(targets)])
    return np.array([np.frombuffer(base64.b64decode(one), np.uint8).reshape(size, size, 4) for one in told])


def test_its_depth_is_that_of_the_engines_rays(station: Workstation, points: Array, scopes: list[Scope]) -> None:
    """Against the surface before it is thinned. What differs: rays along a wall, and at edges that hide another."""
    targets = [target["position"] for target in station.state("plan")["targets"]]
    whole = Wall(air_surface(load_nose_ct(), box_about([*points.tolist(), *targets]), triangles=None).mesh)
    drawn = pictures(station.page, [scope.said for scope in scopes], SIZE, DEPTHS)
    off, glancing, edges = [], [], []
    for scope, picture in zip(scopes, drawn.astype(float), strict=True):
        pixels, ways = scope.rays(SIZE, EVERY)
        distance, _ = whole.seen(scope.tip, ways)
        beside = [whole.seen(scope.tip, ways + 0.02 * across)[0] for across in (scope.right, scope.above)]
        column, row = pixels.T
        depth = (
            np.where(picture[row, column, 2] > 128, picture[row, column, 0] * 256.0 + picture[row, column, 1], np.inf)
            / 512.0
        )
        rays = distance * (ways @ scope.ahead)
        seen = np.isfinite(rays) | np.isfinite(depth)
        with np.errstate(invalid="ignore"):
            off.append(np.abs(depth - rays)[seen])
            steps = np.max([np.abs(other - distance) for other in beside], axis=0)[seen]
        glancing.append(steps > 0.5)
        edges.append(steps > 3.0)
    differ = ~(np.concatenate(off) <= CLOSE_MM)
    steep, torn = np.concatenate(glancing), np.concatenate(edges)
    counts = [int((differ & which).sum()) for which in (torn, steep & ~torn, ~steep)]
    named = "{:.2%} of {} differ: {} at edges, {} along a wall, {} others".format(differ.mean(), len(differ), *counts)
    print(named, f"median of the rest {np.median(np.concatenate(off)[~differ]):.3f} mm")
    assert differ.mean() <= 1.0 - SHARE, named
    assert (differ & ~steep).mean() < 0.01, named


def test_path_and_targets_are_where_they_are(station: Workstation, points: Array, scopes: list[Scope]) -> None:
    path = SplinePath(points)
    line = np.array([path.position(s) for s in np.linspace(0.0, path.length, 2000)])
    chosen = [scope for scope in scopes if len(scope.places(line, OVERLAY)) > 20][::3]
    assert len(chosen) >= 8
    drawn = pictures(station.page, [scope.said for scope in chosen], OVERLAY, BLACK, line.tolist())
    for scope, picture in zip(chosen, drawn, strict=True):
        rows, columns = np.nonzero(picture[..., 2] > 40)
        ink = np.stack([columns, rows], axis=-1) + 0.5
        places = scope.places(line, OVERLAY)
        apart = np.linalg.norm(places[:, None] - ink[None], axis=2)
        assert apart.min(axis=1).max() < 1.5, "it has no gaps"
        inner = np.linalg.norm(ink - OVERLAY / 2.0, axis=1) < 0.85 * OVERLAY / 2.0
        assert apart[:, inner].min(axis=0).max() < HALF_PX + CORNER_PX + 1.0, "and its middle is within 1 px"
    ahead = [[*scope.said, (scope.tip + 20.0 * scope.ahead).tolist()] for scope in scopes]
    for scope, picture in zip(scopes, pictures(station.page, ahead, OVERLAY, BLACK), strict=True):
        rows, columns = np.nonzero(picture[..., 0] > 40)
        middle = np.array([columns.mean(), rows.mean()]) + 0.5
        assert np.abs(middle - OVERLAY / 2.0).max() < 2.0, f"the axis of a lens tilted by {scope.said[1]}°"


def test_it_follows_the_drive_and_is_saved(station: Workstation, tmp_path: Path) -> None:
    page = station.page
    station.wait_for("a pose of the robot", lambda: page.evaluate("vfix.endoscope.driven !== null"), DRIVEN_S)
    expect(page.locator("#scope-source")).to_be_empty()
    for angle in ANGLES:
        page.click(f"[data-angle='{angle}']")
        expect(page.locator(f"[data-angle='{angle}']")).to_have_attribute("aria-pressed", "true")
        page.wait_for_timeout(500)
        station.picture(f"endoscope-{angle}")
    page.click("[data-angle='30']")
    with page.expect_download() as saved:
        page.click("#scope-save")
    saved.value.save_as(tmp_path / "scope.png")
    assert saved.value.suggested_filename == "endoscope-30.png"
    assert (tmp_path / "scope.png").read_bytes().startswith(b"\x89PNG")

    page.click("#start")
    station.wait_for("the robot", lambda: station.rehearsal()["state"] == "running", DRIVEN_S)
    expect(page.locator("#scene-rests")).to_be_visible()  # this browser draws in software
    station.drive_until("ArrowUp", "motion", lambda: station.rehearsal()["progress_mm"] > 25.0, DRIVEN_S)
    page.keyboard.up("ArrowUp")
    station.wait_for("no force", lambda: station.rehearsal()["force_n"] == 0)
    tip = station.rehearsal_after(200.0)["tip"]
    station.wait_for("the newest pose", lambda: np.allclose(page.evaluate("vfix.endoscope.pose.tip"), tip, atol=0.02))
    page.click("[data-angle='0']")
    page.wait_for_timeout(1000)
    station.picture("endoscope-driven")
    page.keyboard.press("e")
    expect(page.locator("#bench")).to_have_attribute("data-layout", "endoscope-beside")
    expect(page.locator("#scene-rests")).to_be_hidden()
    station.picture("endoscope-beside")
    page.click("#finish-run")
    page.click("#run-replay")
    expect(page.locator("#scope-source")).to_have_text("Replayed")
    page.focus("#run-time")
    page.keyboard.press("End")
    station.wait_for("its end", lambda: np.allclose(page.evaluate("vfix.endoscope.pose.tip"), tip, atol=0.05))
    expect(page.locator("#endoscope[data-ready=true]")).to_be_visible()
    station.picture("endoscope-review")
    page.evaluate("vfix.endoscope.update({ ...vfix.state, case: { ...vfix.state.case, has_volume: false } })")
    expect(page.locator("#endoscope")).to_contain_text("No CT, so no endoscope")
    page.click("[data-step=plan]")
    expect(page.locator("#bench")).to_have_attribute("data-layout", "one-three")
    expect(page.locator("#endoscope-button")).to_be_disabled()
    assert station.errors == []
