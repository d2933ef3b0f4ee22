"""A person changes a contour of a lumen by hand, in the plot and by number, and puts polyps on its wall."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

from vfix_engine.files.mesh_files import write_ply
from vfix_engine.geometry.mesh import TriangleMesh

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
PLACES = {"entry": [0.0, 0.0, 10.0], "end": [0.0, 0.0, 150.0]}


def test_contours_and_polyps_of_an_imported_lumen(open_page: Open, rest: Rest, tmp_path: Path) -> None:
    solid = trimesh.creation.cylinder(15.0, segment=[[0, 0, 0], [0, 0, 160]], sections=24).subdivide_to_size(12.0)
    open_end = solid.triangles_center[:, 2] < 159.0
    file = tmp_path / "tube.ply"
    write_ply(file, TriangleMesh(np.asarray(solid.vertices), np.asarray(solid.faces)[open_end]))
    station = open_page(sample=False, viewport={"width": 1280, "height": 900}).ready()
    page = station.page
    page.click("[data-step=patient]")
    page.set_input_files("#lumen-file", str(file))
    station.wait_for("the import", lambda: station.said("Case imported."), DRIVEN_S)
    page.get_by_role("button", name="Open it").click()
    station.wait_for("the lumen", lambda: (station.state("case") or {}).get("kind") == "lumen")
    assert "closed by a cap" in " ".join(station.state("case")["notes"])
    page.click("[data-step=route]")
    page.click("#new-route")
    station.wait_for("the route", lambda: station.state("route"))
    for end, at in PLACES.items():
        page.evaluate("([end, at]) => vfix.request(`route.${end}`, { at })", [end, at])
    station.wait_for("the pathway", lambda: station.state("route_path")["state"] == "ready", DRIVEN_S)

    page.locator("[data-step-name=contours] > summary").click()
    box = page.locator(".route-radii .u-over").bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    station.wait_for("a contour", lambda: station.state("route_contours")["chosen"])
    page.fill("#contour-radius", "8")
    page.press("#contour-radius", "Enter")
    station.wait_for("its radius", lambda: station.state("route_contours")["by_hand"] == 1)
    station.wait_for("the pathway", lambda: station.state("route_path")["least_mm"] == 8.0, DRIVEN_S)
    page.locator("[data-step-name=marks] > summary").click()
    page.click("#seed-polyps")
    expect(page.locator("#marks li")).to_have_count(10)
    page.locator("[data-step-name=marks] > summary").click()
    station.see_scene()
    station.drawn()
    station.picture("route-contours")
    page.keyboard.press("Control+z")
    station.wait_for("no polyps", lambda: not station.state("route")["marks"])
    page.keyboard.press("Control+z")
    station.wait_for("the fitted contour", lambda: station.state("route_contours")["by_hand"] == 0)
    page.fill("#contour-radius", "-3")
    page.press("#contour-radius", "Enter")
    expect(page.locator("#contour-radius-problem")).to_contain_text("0.5 to 150 can be used.")
    page.press("#contour-radius", "Escape")
    assert station.errors == []
