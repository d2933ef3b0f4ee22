"""Protected structures, bone to be removed and paths in the Plan tab: drawn by clicks, dragged, changed, undone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from session_doubles import SAMPLE, open_sample, sections_of, send

from app.messages.fields import ClientMessage
from app.planning.shape_meshes import shape_mesh
from app.plans.operations.document import LockPlan
from app.plans.service import Plan
from app.plans.shapes import anchor, moved, resized, size_of
from app.plans.zones import COLOURS
from app.scene.dragging import DragEvent
from app.scene.picking import Hit
from app.scene.view import ClickRay
from app.services import Services
from app.tabs.plan import commands as c
from app.tabs.plan import region_commands as r
from app.tabs.plan.region_sections import RegionsSection
from app.tabs.plan.suggest_commands import AimShaft
from app.tabs.plan.tab import PlanTab
from vfix_engine.errors import InputError, PlanError

PLACE = (9.0, 36.0, 12.0)


@pytest.fixture
def tab(phantom_services: Services) -> Iterator[PlanTab]:
    """The Plan tab over a copy of the sample plan, which is not driven."""
    plan = phantom_services.plans.documents.duplicate(SAMPLE, "Regions")
    opened = open_sample(phantom_services, plan.id)
    yield opened
    phantom_services.plans.do(plan.id, LockPlan(locked=False))
    phantom_services.plans.documents.delete(plan.id)


def plan_of(tab: PlanTab) -> Plan:
    assert tab.plan is not None
    return tab.plan


def regions(tab: PlanTab) -> RegionsSection:
    assert tab._edited is not None
    return tab._edited.regions.section().build()


def click(tab: PlanTab, *places: tuple[float, float, float]) -> None:
    for place in places:
        tab.handle(c.PickOnSlice(type="pick.slice", position=place))


def draw(purpose: str, kind: str, *sizes: float) -> ClientMessage:
    return r.DrawRegion.model_validate({"type": "region.draw", "purpose": purpose, "kind": kind, "sizes_mm": sizes})


def test_a_click_draws_one_region_and_the_next_click_adds_a_point_again(tab: PlanTab) -> None:
    before = plan_of(tab)
    tab.handle(draw("spare", "sphere", 4.0))
    assert "centre" in tab.hint()
    click(tab, PLACE)
    (zone,) = plan_of(tab).content.zones
    assert zone.shape == {"kind": "sphere", "centre": list(PLACE), "radius": 4.0}
    assert (regions(tab)["drawing"], regions(tab)["selected"]) == (None, zone.id)
    assert plan_of(tab).content.points == before.content.points
    click(tab, PLACE)
    assert len(plan_of(tab).content.zones) == 1
    with pytest.raises(InputError, match="something else was edited since"):
        send(tab, "undo", revision=before.revision)
    send(tab, "undo", revision=plan_of(tab).revision)
    assert (regions(tab)["items"], regions(tab)["selected"]) == ([], None)


def test_a_chain_is_drawn_until_it_is_done(tab: PlanTab) -> None:
    tab.handle(draw("spare", "capsules", 1.5))
    with pytest.raises(PlanError, match="at least one place"):
        tab.handle(r.RegionPlain(type="region.done"))
    click(tab, PLACE, (9.0, 42.0, 12.0), (12.0, 46.0, 14.0))
    drawing = regions(tab)["drawing"]
    assert drawing is not None
    assert len(drawing["places"]) == 3
    assert tab._edited is not None
    assert [one.id for one in tab._edited.regions.drawn()] == ["drawing"]
    tab.handle(r.RegionPlain(type="region.done"))
    assert len(plan_of(tab).content.zones[0].shape["points"]) == 3
    tab.handle(draw("spare", "capsules", 1.5))
    click(tab, PLACE)
    tab.handle(c.EditCommand(type="ghost.cancel"))
    assert (regions(tab)["drawing"], len(plan_of(tab).content.zones)) == (None, 1)


def test_beginning_to_draw_takes_a_ghost_and_an_aim_back(tab: PlanTab) -> None:
    assert tab._edited is not None
    tab.handle(c.EditCommand(type="ghost.cancel"))
    click(tab, (0.0, -60.0, 40.0))  # far outside: it is moved, and asked about
    assert tab._edited.ghost is not None
    tab.handle(draw("spare", "capsules", 1.5))
    assert tab._edited.ghost is None
    click(tab, PLACE)
    before = plan_of(tab).content.points
    tab.handle(c.EditCommand(type="ghost.cancel"))
    assert regions(tab)["drawing"] is None
    tab.handle(AimShaft(type="shaft.aim", item_id=before[0].id))
    tab.handle(draw("spare", "sphere", 2.0))
    click(tab, PLACE)
    assert len(plan_of(tab).content.zones) == 1
    assert plan_of(tab).content.points == before


def test_what_is_drawn_tells_where_it_was_clicked(tab: PlanTab) -> None:
    tab.handle(draw("spare", "capsules", 1.5))
    click(tab, PLACE, (9.0, 42.0, 12.0))
    drawing = regions(tab)["drawing"]
    assert drawing is not None
    assert (drawing["radius_mm"], drawing["colour"]) == (1.5, COLOURS[0])
    (layer,) = [layer for layer in tab.layers() if layer.name == "plan.drawing"]
    assert layer.key == (PLACE, (9.0, 42.0, 12.0))
    points = plan_of(tab).content.points
    tab.handle(c.ItemCommand(type="point.insert_after", item_id=points[0].id))
    assert regions(tab)["drawing"] is None  # a point of the path is no place of the chain


def test_a_half_space_tells_its_side_and_is_turned_round(tab: PlanTab) -> None:
    tab.handle(r.DrawRegion(type="region.draw", purpose="spare", kind="half_space", free_side="I"))
    click(tab, PLACE)
    (zone,) = plan_of(tab).content.zones
    assert regions(tab)["items"][0]["sub"].startswith("Half-space: kept free above S 12.0; the tool stays below · hard")
    send(tab, "region.change", region_id=zone.id, turn=True)
    (turned,) = plan_of(tab).content.zones
    assert (turned.shape["point"], turned.shape["normal"]) == (zone.shape["point"], [0.0, 0.0, 1.0])
    assert "the tool stays above" in regions(tab)["items"][0]["sub"]
    tab.handle(draw("spare", "sphere", 2.0))
    click(tab, PLACE)
    ball = plan_of(tab).content.zones[1]
    with pytest.raises(PlanError, match="only a half-space"):
        send(tab, "region.change", region_id=ball.id, turn=True)


def test_bone_to_be_removed_is_a_solid_of_its_own(tab: PlanTab) -> None:
    tab.handle(draw("remove", "capsule", 3.0))
    click(tab, PLACE, (9.0, 42.0, 12.0))
    tab.handle(draw("remove", "box", 2.0, 3.0, 4.0))
    click(tab, PLACE)
    capsule, box = plan_of(tab).content.removed_bone
    assert capsule.shape == {"kind": "capsule", "start": list(PLACE), "end": [9.0, 42.0, 12.0], "radius": 3.0}
    assert (box.shape["half_size"], anchor(box.shape)) == ([2.0, 3.0, 4.0], PLACE)
    assert [item["sub"] for item in regions(tab)["items"]] == ["Capsule, radius 3.0 mm", "Box, 4.0 × 6.0 × 8.0 mm"]
    with pytest.raises(PlanError, match="a sphere, a capsule or a box"):
        tab.handle(draw("remove", "patch", 3.0))
    send(tab, "region.delete", region_id=capsule.id)
    assert plan_of(tab).content.removed_bone == (box,)


def test_a_patch_goes_to_the_bone(tab: PlanTab, phantom_services: Services) -> None:
    tab.handle(draw("spare", "patch", 5.0))
    click(tab, PLACE)
    tree = phantom_services.cases.tree(phantom_services.cases.embedded_case())
    centre = plan_of(tab).content.zones[0].shape["centre"]
    assert tree.point_distance([centre])[0][0] == pytest.approx(0.0, abs=1e-9)
    vertices, faces = shape_mesh(phantom_services.cases, "head-phantom", plan_of(tab).content.zones[0].shape)
    assert len(faces) > 3
    assert np.linalg.norm(vertices - centre, axis=1).min() < 5.0


def test_what_no_drive_could_keep_is_refused_here_too(tab: PlanTab) -> None:
    tab.handle(draw("spare", "patch", 5.0))
    click(tab, PLACE)
    before = plan_of(tab)
    with pytest.raises(PlanError, match="cannot be kept"):
        send(tab, "region.change", region_id=before.content.zones[0].id, soft=True, max_depth_mm=3.0)
    with pytest.raises(PlanError, match="all of the bone"):
        send(tab, "region.structure", structure="bone")
    assert plan_of(tab) == before


def test_a_region_is_dragged_by_its_ball_and_selected_by_a_click_on_it(tab: PlanTab) -> None:
    tab.active = True
    tab.handle(draw("spare", "sphere", 4.0))
    click(tab, PLACE)
    zone = plan_of(tab).content.zones[0]
    item, there = f"region:{zone.id}", (10.0, 30.0, 12.0)
    tab.dragged(DragEvent(item, "start", PLACE))
    tab.dragged(DragEvent(item, "update", there))
    assert regions(tab)["items"][0]["place"] == list(there)
    assert plan_of(tab).content.zones == (zone,)  # nothing is stored while the hand holds it
    tab.release()
    assert regions(tab)["items"][0]["place"] == list(PLACE)
    tab.dragged(DragEvent(item, "end", there))
    assert plan_of(tab).content.zones[0].shape["centre"] == list(there)
    assert tab._edited is not None
    tab._edited.regions.selected = None
    direction = np.array([0.0, 1.0, 0.0])
    tab.clicked(ClickRay(np.array(there) - 0.5 * direction, direction))  # nothing lies between
    assert regions(tab)["selected"] == zone.id
    send(tab, "lock", locked=True)
    tab.dragged(DragEvent(item, "end", PLACE))
    assert plan_of(tab).content.zones[0].shape["centre"] == list(there)
    with pytest.raises(PlanError, match="locked"):
        tab.handle(draw("spare", "sphere", 4.0))
    with pytest.raises(PlanError, match="locked"):
        send(tab, "region.delete", region_id=zone.id)


@pytest.mark.parametrize(
    ("kind", "clicks"), [("sphere", 1), ("box", 1), ("half_space", 1), ("patch", 1), ("capsule", 2)]
)
def test_a_click_on_a_point_a_region_or_a_shaft_belongs_to_what_is_drawn(
    tab: PlanTab, kind: str, clicks: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tab.workspace.case, "hit", lambda ray: Hit("bone", ray.origin + 3.0 * ray.direction, 3.0))
    tab.handle(draw("spare", "sphere", 1.0))
    click(tab, PLACE)
    before, edited = plan_of(tab), tab._edited
    assert edited is not None
    tab.handle(c.ItemCommand(type="item.select", item_id=before.content.points[2].id))  # its shaft has a ball then
    rays = [*(np.array(point.position) for point in before.content.points[:2]), np.array(PLACE)]
    rays += [place for _, place in tab._shafts.balls(edited)]
    assert len(rays) == 4
    for at in rays:
        tab.handle(draw("remove" if kind == "capsule" else "spare", kind))
        edited.selected = edited.regions.selected = None
        layers = {layer.name: layer.key for layer in tab.layers()}
        locked = [layers[name][-1] for name in ("plan.items", "plan.regions", "plan.shaft")]
        assert locked == [True, True, True], "a press on one of them would drag it"
        drawn = len(plan_of(tab).content.zones) + len(plan_of(tab).content.removed_bone)
        for _ in range(clicks):
            direction = np.array([0.0, 1.0, 0.0])
            tab.clicked(ClickRay(at - 0.5 * direction, direction))
        assert len(plan_of(tab).content.zones) + len(plan_of(tab).content.removed_bone) == drawn + 1
        assert edited.selected is None
    assert plan_of(tab).content.points == before.content.points


def test_fields_of_a_region_are_changed_one_edit_at_a_time(tab: PlanTab) -> None:
    tab.handle(draw("spare", "sphere", 4.0))
    click(tab, PLACE)
    zone_id = plan_of(tab).content.zones[0].id

    def change(**fields: object) -> None:
        send(tab, "region.change", region_id=zone_id, **fields)

    change(name="optic nerve", colour="#123456")
    change(soft=True, max_depth_mm=1.5)
    change(sizes_mm=[2.5], place=[1.0, 2.0, 3.0], visible=False)
    zone = plan_of(tab).content.zones[0]
    assert (zone.name, zone.colour, zone.kind, zone.max_depth_mm) == ("optic nerve", "#123456", "soft", 1.5)
    assert zone.shape == {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 2.5}
    assert regions(tab)["items"][0]["sub"] == "Sphere, radius 2.5 mm · soft, 0.5 N/mm, 1.5 mm deep at most"
    assert tab._edited is not None
    assert tab._edited.regions.drawn() == ()
    change(no_depth=True)
    assert plan_of(tab).content.zones[0].max_depth_mm is None
    with pytest.raises(PlanError, match="1 sizes, not 2"):
        change(sizes_mm=[1.0, 2.0])
    for _ in range(5):
        send(tab, "undo")
    assert regions(tab)["items"] == []


def test_every_shape_has_a_mesh_and_is_moved_and_resized(phantom_services: Services) -> None:
    eye = [float(i % 5 == 0) for i in range(16)]
    for shape in (
        {"kind": "sphere", "centre": [1.0, 2.0, 3.0], "radius": 4.0},
        {"kind": "capsule", "start": [0.0, 0.0, 0.0], "end": [2.0, 4.0, 6.0], "radius": 1.5},
        {"kind": "capsules", "points": [[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 5.0, 0.0]], "radius": 1.0},
        {"kind": "box", "transform_box_to_patient": eye, "half_size": [1.0, 2.0, 3.0]},
        {"kind": "half_space", "point": [0.0, 0.0, 40.0], "normal": [0.0, 0.0, -1.0]},
    ):
        at = (7.0, 8.0, 9.0)
        there = moved(shape, at)
        assert anchor(there) == pytest.approx(at)
        first = shape_mesh(phantom_services.cases, "head-phantom", shape)[0]
        second = shape_mesh(phantom_services.cases, "head-phantom", there)[0]
        shift = np.subtract(at, anchor(shape))  # type: ignore[arg-type]
        np.testing.assert_allclose(second - first, np.broadcast_to(shift, first.shape), atol=1e-4)
        if sizes := size_of(shape):
            assert size_of(resized(shape, [2.0 * size for size in sizes])) == [2.0 * size for size in sizes]
    gone = {"kind": "structure", "structure": "gone"}
    assert anchor(gone) is None
    assert len(shape_mesh(phantom_services.cases, "head-phantom", gone)[1]) == 1
    with pytest.raises(PlanError, match="stays where it is"):
        moved(gone, (1.0, 2.0, 3.0))


def test_paths_and_notes_of_the_open_plan(tab: PlanTab) -> None:
    first = plan_of(tab).content.path_id
    count = len(plan_of(tab).content.points)

    def paths() -> list[tuple[str, int]]:
        view = sections_of(tab)["paths"]
        assert view is not None
        return [(item["name"], item["points"]) for item in view["items"]]

    send(tab, "path.new")
    assert plan_of(tab).content.points == ()
    send(tab, "path.choose", path_id=first)
    send(tab, "path.duplicate", path_id=first)
    send(tab, "path.rename", path_id=first, name="Left")
    send(tab, "path.side", path_id=first, side="left")
    assert paths() == [("Left", count), ("Path 2", 0), ("Path 3", count)]
    send(tab, "path.delete", path_id=plan_of(tab).content.path_id)
    assert (plan_of(tab).content.path.name, plan_of(tab).content.paths[0].entry_side) == ("Path 2", "left")
    send(tab, "plan.notes", notes="Septum deviates.")
    view = sections_of(tab)["paths"]
    assert view is not None
    assert view["notes"] == "Septum deviates."
