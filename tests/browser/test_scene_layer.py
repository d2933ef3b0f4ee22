"""What the page adds to viser's canvas: one test for each hook, and the page without any of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from workstation import DRIVEN_S, Rest, Workstation

from app.exchange.patient_images import FACE_WARNING

pytestmark = pytest.mark.browser
Open = Callable[..., Workstation]
CAMERA = "(() => { const c = vfix.layer.hooks.camera; return [...c.position.toArray(), ...c.quaternion.toArray()]; })()"
LINES = """() => { const found = []; vfix.layer.hooks.each((o) => { if (o.userData.vfixPass && o.isLineSegments2) {
  found.push({ depthFunc: o.material.depthFunc, parent: o.parent?.isLineSegments2 === true,
    same: o.geometry === o.parent.geometry, opacity: o.material.opacity }); } }); return found; }"""
# How many points and targets are drawn once more where bone hides them.
MARKS = "[...vfix.layer.path.passes.values()].filter((o) => o.isMesh && !o.isLineSegments2 && o.visible).length"
BONE = """() => { const bone = vfix.layer.surfaces.found().bone;
  if (!bone) return {};
  const passes = bone.children.filter((o) => o.userData.vfixPass);
  return { transparent: bone.material.transparent, depthWrite: bone.material.depthWrite, first: passes
    .map((o) => [o.material.colorWrite, o.renderOrder < bone.renderOrder, o.geometry === bone.geometry]) }; }"""

SKIN = """() => { const { skin } = vfix.layer.surfaces.found();
  if (!skin) return {};
  let shown = true;
  for (let o = skin; o; o = o.parent) shown &&= o.visible;
  const passes = skin.children.filter((o) => o.userData.vfixPass);
  return { shown, opacity: skin.material.opacity, depthWrite: skin.material.depthWrite,
    after: skin.renderOrder > 900, first: passes
      .map((o) => [o.material.colorWrite, o.renderOrder < skin.renderOrder, o.geometry === skin.geometry]) }; }"""

# As for a tool that is driven, whose place the page says anew with each state.
OPENED = "(tip) => { const { window } = vfix.layer; window.show(tip); window.show = () => {}; }"
GLIDES = "vfix.layer.hooks.controls.smoothTime > 0"
# How far the camera is, one frame after a turn, from where it was turned to.
TURNED = """async () => { const { hooks } = vfix.layer;
  const { controls } = hooks;
  const drawn = new Promise((go) => { const seen = (camera) => { hooks.watchers.delete(seen); go(camera); };
    hooks.watchers.add(seen); });
  controls.rotate(0.4, 0, true);
  hooks.redraw();
  const camera = await drawn;
  return controls.getPosition(camera.position.clone(), true).distanceTo(camera.position); }"""
# Letters of the scene that lie below the bar of the views, the legend or the scale.
UPON = """() => { const boxes = [...document.querySelectorAll('.views, #legend, #scale-bar')]
    .filter((one) => one.checkVisibility()).map((one) => one.getBoundingClientRect());
  const letters = [...document.querySelectorAll('.scene-label.letter')]
    .filter((one) => one.checkVisibility({ visibilityProperty: true }));
  const meets = (a) => boxes.some((b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom);
  if (!letters.length) return ['no letter'];
  return letters.filter((one) => meets(one.getBoundingClientRect())).map((one) => one.textContent); }"""


def layered(station: Workstation) -> Workstation:
    station.see_scene()
    station.wait_for("the layer", lambda: station.page.evaluate("Boolean(vfix.layer)"))
    station.settle()
    return station


def test_labels_are_text_of_the_page_at_their_places(open_page: Open, rest: Rest) -> None:
    station = layered(open_page())
    station.open_plan(rest.copy_of_sample("Labels"))
    page = station.page
    item = station.state("plan")["points"][3]
    page.evaluate("(item_id) => vfix.request('item.select', { item_id })", item["id"])
    label = page.locator(".scene-label.item")
    expect(label).to_have_text([item["label"]])
    station.settle()
    told = next(label for label in station.state("labels") if label["kind"] == "item")["position"]
    assert told == pytest.approx(item["position"], abs=2.0)
    box = page.locator("#scene").bounding_box()
    assert box is not None
    drawn = "(p) => { const { x, y } = vfix.layer.hooks.project(p); return [x, y]; }"

    def same() -> bool:
        """By the planner's own camera as by the canvas's."""
        x, y = station.place(told)
        return bool(page.evaluate(drawn, told) == pytest.approx([x - box["x"], y - box["y"]], abs=1.0))

    station.wait_for("one camera", same)
    _, y = station.place(told)
    shown = label.evaluate(
        "(label) => new DOMMatrix().translate(...label.style.translate.split(' ').map(parseFloat)).f"
    )
    assert shown == pytest.approx(y - box["y"], abs=1.0)
    seen = "(letter) => getComputedStyle(letter).visibility === 'visible'"
    letters = {
        letter.text_content(): letter.evaluate(seen) for letter in page.locator(".scene-label.letter").element_handles()
    }
    assert letters == {"R": False, "L": True, "A": True, "P": False, "I": True, "S": True}, (
        "what bone hides is not read"
    )
    station.picture("labels")
    station.look_from("anterior")  # the top of the head, with its letter, comes to the bar of the views
    assert page.evaluate(UPON) == []
    page.set_viewport_size({"width": 1000, "height": 560})
    station.settle()
    assert page.evaluate(UPON) == []
    assert station.errors == []


def test_a_path_that_stops_is_marked_there(open_page: Open, rest: Rest) -> None:
    """In the scene and in the slices; the mark leaves with what stopped the tool."""
    station = layered(open_page())
    page = station.page
    plan_id = rest.copy_of_sample("Stops")
    middle = rest.plan(plan_id)["points"][4]["position"]
    ball = {"name": "Ball", "shape": {"kind": "sphere", "centre": middle, "radius": 3.0}}
    rest.client.post(f"/api/v1/plans/{plan_id}/zones", json=ball).raise_for_status()
    station.open_plan(plan_id)

    def verdict(completed: bool) -> Any:
        told = station.state("corridor") or {}
        return told.get("state") == "current" and told["completed"] is completed and told["verdict"]

    station.wait_for("the verdict", lambda: verdict(False), DRIVEN_S)

    def marks() -> Any:
        return [label["position"] for label in station.state("labels") if label["kind"] == "stop"]

    (place,) = station.wait_for("the mark", marks)
    assert 2.5 < np.linalg.norm(np.subtract(place, middle)) < 8.0, "before the ball"
    expect(page.locator(".scene-label.stop")).to_be_visible()
    page.evaluate("(position) => vfix.request('slice.cross', { position })", place)
    at = station.place_in_slice("sagittal", place)
    seen = page.locator("[data-axis=sagittal] .slice-stop")
    expect(seen).to_have_attribute("opacity", "1")
    drawn = seen.evaluate("({ firstChild: { cx, cy } }) => [cx.baseVal.value, cy.baseVal.value]")
    assert drawn == pytest.approx([at["x"], at["y"]], abs=2.0)
    station.picture("stops")
    station.open_plan(rest.copy_of_sample("Goes on"))
    station.wait_for("another verdict", lambda: verdict(True), DRIVEN_S)
    expect(page.locator(".scene-label.stop")).to_have_count(0)
    expect(page.locator(".slice-stop")).to_have_count(0)
    assert station.errors == []


def test_the_path_is_drawn_once_more_where_bone_hides_it(open_page: Open, rest: Rest) -> None:
    station = layered(open_page())
    plan_id = rest.copy_of_sample("Through bone")
    station.open_plan(plan_id)
    drawn = {"depthFunc": 6, "parent": True, "same": True, "opacity": 0.55}
    expected = [drawn]  # the path; a direction of the shaft only at a point that is selected
    station.wait_for("its second pass", lambda: station.page.evaluate(LINES) == expected)
    marks = len(station.state("plan")["points"]) + len(station.state("plan")["targets"])
    assert station.page.evaluate(MARKS) >= marks > 0
    station.picture("through-bone")
    point = station.state("plan")["points"][4]
    x, y, z = point["position"]
    rest.client.patch(f"/api/v1/plans/{plan_id}/points/{point['id']}", json={"position": [x, y, z + 1.0]})
    station.page.evaluate("vfix.layer.hooks.redraw()")
    station.wait_for("it to follow", lambda: station.page.evaluate(LINES) == expected)
    assert station.errors == []


def test_clear_bone_has_its_depth_drawn_first(open_page: Open) -> None:
    """Only what faces the eye is tinted: unsorted triangles would speckle."""
    station = layered(open_page())
    station.wait_for("bone of one pass", lambda: station.page.evaluate(BONE).get("first") == [])
    station.page.evaluate("vfix.request('view.set', { opacity: 0.3 })")
    wanted = {"transparent": True, "depthWrite": True, "first": [[False, True, True]]}
    station.wait_for("clear bone", lambda: station.page.evaluate(BONE) == wanted)
    station.picture("clear-bone")
    station.page.evaluate("vfix.request('view.set', { cut: 'left' })")  # another mesh
    station.wait_for("the cut", lambda: station.page.evaluate(BONE) == wanted)
    station.page.evaluate("vfix.request('view.set', { opacity: 1.0 })")
    station.wait_for("solid bone", lambda: station.page.evaluate(BONE).get("transparent") is False)
    station.wait_for("one pass", lambda: station.page.evaluate(BONE).get("first") == [])
    assert station.errors == []


def test_bone_gives_way_before_the_tip_of_a_tool(open_page: Open) -> None:
    """In a round window, and nowhere else; it closes again."""
    station = layered(open_page())
    station.look_from("anterior")
    behind = [15.0, 60.0, 55.0]  # behind the forehead
    x, y = station.place(behind)

    def seen(right: float) -> bytes:
        return station.page.screenshot(clip={"x": x - 4 + right, "y": y - 4, "width": 8, "height": 8})

    closed, aside = seen(0), seen(120)
    station.page.evaluate(OPENED, behind)
    station.wait_for("the window", lambda: seen(0) != closed)
    assert seen(120) == aside
    station.picture("tool-window")
    station.page.evaluate("() => { delete vfix.layer.window.show; vfix.layer.window.show(null); }")
    station.wait_for("bone", lambda: seen(0) == closed)
    assert station.errors == []


def test_skin_is_made_shown_over_bone_and_hidden(open_page: Open, rest: Rest) -> None:
    """Its depth is drawn before it and after bone; a head that may be a patient's warns of screenshots (HAZ-34)."""
    station = layered(open_page())
    page = station.page
    station.open_look()
    page.click("#skin")
    expect(page.locator("#skin-field .job")).to_be_visible()
    station.wait_for("the skin", lambda: page.evaluate(SKIN).get("shown"))
    expect(page.locator("#skin-field .job")).to_be_hidden()
    expect(page.locator("#skin-words")).to_be_hidden()  # the synthetic head is nobody's face
    wanted = {"shown": True, "opacity": 0.5, "depthWrite": True, "after": True, "first": [[False, True, True]]}
    assert page.evaluate(SKIN) == wanted
    station.picture("skin")
    shines = "vfix.layer.path.passes.size > 0 && [...vfix.layer.path.passes.values()].every((o) => o.visible)"
    assert page.evaluate(shines)
    page.locator("#skin-opacity").fill("100")
    station.wait_for("a path that does not shine through", lambda: not page.evaluate(shines))
    station.picture("skin-opaque")
    page.locator("#skin-opacity").fill("60")
    station.wait_for("its opacity", lambda: page.evaluate(SKIN) == wanted | {"opacity": 0.6})
    page.click("#skin")
    station.wait_for("it hidden", lambda: page.evaluate(SKIN)["shown"] is False)
    expect(page.locator("#skin-opacity")).to_be_hidden()
    page.click("#skin")
    station.wait_for("it shown again", lambda: page.evaluate(SKIN) == wanted | {"opacity": 0.6})
    page.keyboard.press("Escape")

    head = rest.copy_of_head()
    page.evaluate("(id) => vfix.request('case.open', { case_id: id })", head)
    station.wait_for(
        "it", lambda: (station.state("case") or {}).get("id") == head and not station.state("case")["loading"]
    )
    page.evaluate("vfix.request('view.set', { skin: true })")
    station.wait_for("its skin", lambda: station.state("view")["skin"]["shown"])
    expect(page.locator("#skin-words")).to_have_text(FACE_WARNING)
    page.evaluate("vfix.request('view.set', { skin: false })")
    expect(page.locator("#skin-words")).to_be_hidden()
    page.evaluate("vfix.request('case.open', { case_id: 'head-phantom' })")
    station.wait_for("the first head", lambda: station.state("case")["id"] == "head-phantom")
    rest.client.delete(f"/api/v1/cases/{head}").raise_for_status()
    assert station.errors == []


def test_zoom_goes_to_the_pointer(open_page: Open, rest: Rest) -> None:
    station = layered(open_page())
    assert station.page.evaluate(GLIDES), "a view that is turned glides to a halt"
    station.page.emulate_media(reduced_motion="reduce")
    station.wait_for("a view that stands still at once", lambda: not station.page.evaluate(GLIDES))
    far = station.page.evaluate(TURNED)
    assert far == pytest.approx(0.0, abs=1e-3), "the next frame has the view that it was turned to"
    station.look_from("oblique")
    nostril = rest.sample()["points"][1]["position"]
    before = station.place(nostril)
    assert abs(before[0] - 500) + abs(before[1] - 320) > 40, "it must not be in the middle"
    height = station.state("camera")["view_height_mm"]
    station.page.mouse.move(*before)
    for _ in range(4):
        station.page.mouse.wheel(0, -240)
        station.page.wait_for_timeout(200)
    station.wait_for("the zoom", lambda: station.state("camera")["view_height_mm"] < 0.8 * height)
    station.settle()
    assert station.place(nostril) == pytest.approx(before, abs=12)
    assert station.errors == []


def test_a_click_keeps_the_view_and_it_turns_about_the_place(open_page: Open, rest: Rest) -> None:
    station = layered(open_page())
    station.open_plan(rest.empty_plan("Turning"))
    page = station.page
    page.click("[data-kind=none]")
    station.look_from("anterior")
    camera = page.evaluate(CAMERA)
    at = station.place([-30.0, 0.0, 60.0])
    page.mouse.click(*at)
    pivot: Any = station.wait_for("the pivot", lambda: station.state("camera")["pivot"])
    station.settle()
    assert page.evaluate(CAMERA) == pytest.approx(camera, abs=1e-3)
    assert station.place(pivot) == pytest.approx(at, abs=2.0)
    page.mouse.move(*at)
    page.mouse.down()
    for step in range(1, 7):
        page.mouse.move(at[0] + 15 * step, at[1])
        page.wait_for_timeout(80)
    page.mouse.up()
    station.settle()
    assert np.abs(np.subtract(page.evaluate(CAMERA), camera)).max() > 1.0, "the view has turned"
    assert station.place(pivot) == pytest.approx(at, abs=4.0), "about the place that was clicked"
    page.keyboard.press("c")
    station.settle()
    box = page.locator("#scene").bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert station.place(pivot) == pytest.approx(middle, abs=3.0)
    station.look_from("anterior")
    assert page.evaluate(CAMERA) == pytest.approx(camera, abs=1e-2), "a standard view is what it was"
    assert station.errors == []


def test_a_scene_that_nobody_sees_is_not_drawn(open_page: Open) -> None:
    station = layered(open_page())
    page = station.page
    page.evaluate("""() => { window.frames_drawn = 0; vfix.layer.hooks.watchers.add(() => { frames_drawn += 1; }); }""")
    page.keyboard.press("1")
    station.wait_for("the end of it", lambda: page.evaluate("vfix.layer.hooks.paused"))
    page.evaluate("frames_drawn = 0")
    page.evaluate("vfix.request('view.set', { opacity: 0.6 })")
    page.wait_for_timeout(1500)
    assert page.evaluate("frames_drawn") == 0
    page.keyboard.press("1")
    station.wait_for("a frame", lambda: page.evaluate("frames_drawn") > 0)
    assert station.errors == []


def test_without_the_hook_the_page_says_so_and_works(open_page: Open, rest: Rest) -> None:
    """As with another version of viser: its own labels are drawn, everything else goes on."""
    station = open_page(
        script="Object.defineProperty(window, '__THREE_DEVTOOLS__', { get() {}, set() {} });"
    ).see_scene()
    page = station.page
    station.wait_for("words in the console", lambda: any("cannot be reached" in words for words in station.errors))
    assert page.evaluate("vfix.layer") is None
    assert page.locator(".scene-label").count() == 0
    station.open_plan(rest.empty_plan("Without hooks"))
    station.look_from("anterior")
    page.mouse.click(*station.place([-30.0, 0.0, 60.0]))
    station.wait_for("a ghost", lambda: station.state("plan")["ghost"])
