"""The Route tab: the open route, its ends by clicks and landmarks, undo, and the pathway that is computed."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from lumen_cases import ENTRY, RADIUS_MM, route_in, tube
from session_doubles import CLIENT, HEAD, Heard, Now, sections_of, send

from app.cases.model import CAVITY_PHANTOM
from app.lumen.marks import MARK_KINDS, MarkKind
from app.scene.dragging import DragEvent
from app.scene.view import ClickRay
from app.services import Services
from app.tabs.route.tab import RouteTab
from app.workspace.workspace import Workspace
from vfix_engine.errors import InputError


class Opened:
    """A client in the Route tab of a tube; work in the background is done at once."""

    def __init__(self, services: Services) -> None:
        self.heard = Heard()
        self.workspace = Workspace(CLIENT, services, Now(), lambda request: request(), self.heard)
        self.tab = RouteTab(self.workspace)
        self.tab.active = True
        self.case = tube(services)
        self.workspace.open_case(self.case.id)

    def do(self, kind: str, **fields: Any) -> dict[str, Any]:
        send(self.tab, kind, **fields)
        return sections_of(self.tab)


@pytest.fixture
def opened(phantom_services: Services) -> Opened:
    return Opened(phantom_services)


def test_a_route_is_made_and_its_ends_are_clicked_on_the_wall(opened: Opened) -> None:
    assert sections_of(opened.tab)["route"] is None
    assert opened.tab.hint() == "Make a route first."
    shown = opened.do("route.new")
    assert (shown["route"]["entry"], shown["route_path"]["state"]) == (None, "none")
    for end, z in (("entry", 20.0), ("end", 140.0)):
        assert opened.do("route.pick", what=end)["route"]["picking"] == end
        opened.tab.clicked(ClickRay(np.array([100.0, 0.0, z]), np.array([-1.0, 0.0, 0.0])))
    shown = sections_of(opened.tab)
    assert shown["route"]["picking"] == ""
    np.testing.assert_allclose(shown["route"]["entry"], [RADIUS_MM, 0.0, 20.0], atol=0.5)
    path = shown["route_path"]
    assert path["state"] == "ready"
    assert path["length_mm"] == pytest.approx(120.0, abs=10.0)
    assert path["limit"] == "end"
    assert [layer.name for layer in opened.tab.layers()] == ["route.ends", "route.path"]


def test_a_click_without_a_wish_turns_the_view_and_changes_nothing(opened: Opened) -> None:
    opened.do("route.new")
    opened.tab.clicked(ClickRay(np.array([100.0, 0.0, 20.0]), np.array([-1.0, 0.0, 0.0])))
    assert sections_of(opened.tab)["route"]["entry"] is None
    assert opened.workspace.camera.section()["pivot"] is not None


def test_a_click_beside_the_wall_is_told_and_the_choice_goes_on(opened: Opened) -> None:
    opened.do("route.new")
    opened.do("route.pick", what="entry")
    opened.tab.clicked(ClickRay(np.array([100.0, 500.0, 20.0]), np.array([-1.0, 0.0, 0.0])))
    assert opened.heard.words[-1] == "No wall there."
    assert sections_of(opened.tab)["route"]["picking"] == "entry"


def test_where_the_tip_stops_is_marked_unless_it_is_the_end(opened: Opened) -> None:
    planned(opened)
    assert "route.stop" not in [layer.name for layer in opened.tab.layers()]
    reach = opened.do("route.robot", links=2, length_mm=20.0, radius_mm=5.0)["route_path"]["reach_mm"]
    (layer,) = [layer for layer in opened.tab.layers() if layer.name == "route.stop"]
    ((stop),) = layer.key
    assert stop.name == f"Tip stops, {reach:.0f} mm"
    np.testing.assert_allclose(stop.position, [0.0, 0.0, ENTRY[2] + reach], atol=8.0)


def test_a_robot_on_a_fixed_base_has_a_reach_and_no_place_where_its_tip_stops(phantom_services: Services) -> None:
    workspace = Workspace(CLIENT, phantom_services, Now(), lambda request: request())
    tab = RouteTab(workspace)
    tab.active = True
    workspace.open_case(CAVITY_PHANTOM)
    path = sections_of(tab)["route_path"]
    assert (path["state"], path["limit"], path["reach_mm"]) == ("ready", "base", 140.0)  # five links of 28 mm
    assert "route.stop" not in [layer.name for layer in tab.layers()]


def test_the_chosen_contour_stays_chosen_until_it_is_gone(opened: Opened) -> None:
    items = planned(opened)["route_contours"]["items"]
    middle = 0.5 * (items[20]["at_mm"] + items[21]["at_mm"])
    shown = opened.do("route.contour.add", at_mm=middle)["route_contours"]
    assert (shown["chosen"], shown["items"][21]["by_hand"]) == (21, True)
    assert opened.do("route.undo")["route_contours"]["chosen"] is None  # it is gone
    assert opened.do("route.redo")["route_contours"]["chosen"] is None
    opened.do("route.contour.choose", at_mm=middle)
    assert opened.do("route.contour.resize", at_mm=middle, radii_mm=[8.0])["route_contours"]["chosen"] == 21
    assert opened.do("route.undo")["route_contours"]["chosen"] == 21
    assert opened.do("route.end", at=(0.0, 0.0, 110.0))["route_contours"]["chosen"] != 21  # another one by then


def test_edits_are_undone_and_redone_and_the_pathway_follows(opened: Opened) -> None:
    opened.do("route.new")
    opened.do("route.entry", at=ENTRY)
    long = opened.do("route.end", at=(0.0, 0.0, 150.0))["route_path"]["length_mm"]
    short = opened.do("route.end", at=(0.0, 0.0, 120.0))["route_path"]["length_mm"]
    assert short == pytest.approx(long - 30.0, abs=5.0)
    assert opened.do("route.undo")["route_path"]["length_mm"] == long
    assert opened.do("route.redo")["route_path"]["length_mm"] == short
    robot = opened.do("route.robot", links=2, length_mm=20.0, radius_mm=5.0)
    assert (robot["route"]["links"], round(robot["route_path"]["reach_mm"])) == (2, 40)
    opened.do("route.redo")
    assert opened.heard.words[-1] == "There is nothing to redo."


def test_an_end_that_lies_in_no_lumen_is_refused_and_a_stored_one_is_told_and_a_better_one_helps(
    opened: Opened, phantom_services: Services
) -> None:
    opened.do("route.new")
    with pytest.raises(InputError, match="outside the lumen"):
        opened.do("route.entry", at=(90.0, 0.0, 20.0))
    case = phantom_services.cases.get(str(opened.workspace.case.case_id))
    stored = route_in(phantom_services, case, entry=(90.0, 0.0, 20.0))  # by a version that took it
    path = opened.do("route.open", route_id=stored.id)["route_path"]
    assert path["state"] == "failed"
    assert "lumen" in path["words"]
    assert opened.do("route.entry", at=ENTRY)["route_path"]["state"] == "ready"


def test_a_route_of_another_case_and_a_deleted_one_are_refused(opened: Opened, phantom_services: Services) -> None:
    own = opened.do("route.new")["route"]["id"]
    other = route_in(phantom_services, tube(phantom_services))
    with pytest.raises(InputError, match="another case"):
        opened.do("route.open", route_id=other.id)
    shown = opened.do("route.delete", route_id=own)
    assert (shown["route"], shown["routes"]["items"]) == (None, [])
    assert opened.do("route.restore", route_id=own)["route"]["id"] == own


def test_a_head_has_no_route_open(opened: Opened) -> None:
    opened.do("route.new")
    opened.workspace.open_case(HEAD)
    assert opened.workspace.opened.id("route") is None
    assert not opened.tab.offered


def wall_at(z: float) -> ClickRay:
    return ClickRay(np.array([100.0, 0.0, z]), np.array([-1.0, 0.0, 0.0]))


def planned(opened: Opened) -> dict[str, Any]:
    opened.do("route.new")
    opened.do("route.entry", at=ENTRY)
    return opened.do("route.end", at=(0.0, 0.0, 150.0))


def test_a_contour_is_chosen_resized_and_dragged_and_the_wall_is_told(opened: Opened) -> None:
    items = planned(opened)["route_contours"]["items"]
    assert len(items) == 50
    opened.tab.clicked(wall_at(40.0))  # nothing is edited: the view turns
    assert sections_of(opened.tab)["route_contours"]["chosen"] is None
    assert opened.do("route.contour.choose", at_mm=items[20]["at_mm"])["route_contours"]["chosen"] == 20
    opened.tab.clicked(wall_at(items[30]["centre"][2]))
    assert sections_of(opened.tab)["route_contours"]["chosen"] == 30
    assert "route.contour" in [layer.name for layer in opened.tab.layers()]
    at_mm = items[30]["at_mm"]
    shown = opened.do("route.contour.resize", at_mm=at_mm, radii_mm=[RADIUS_MM - 2.0])["route_contours"]
    assert (shown["by_hand"], shown["items"][30]["by_hand"], shown["words"]) == (1, True, "")
    x, y, z = shown["items"][30]["centre"]
    for phase in ("start", "update", "end"):
        opened.tab.dragged(DragEvent("contour", phase, (x + 6.0, y, z)))
    shown = sections_of(opened.tab)["route_contours"]
    assert shown["items"][30]["centre"][0] == pytest.approx(x + 6.0, abs=0.01)
    assert shown["chosen"] == 30
    assert "One contour crosses the wall, by up to" in shown["words"]
    assert sections_of(opened.tab)["route_path"]["behind_mm"] > 3.0
    between = 0.5 * (shown["items"][40]["at_mm"] + shown["items"][41]["at_mm"])
    added = opened.do("route.contour.add", at_mm=between)["route_contours"]
    assert (len(added["items"]), added["chosen"]) == (51, 41)
    with pytest.raises(InputError, match="not on the way"):
        opened.do("route.contour.remove", at_mm=900.0)
    assert opened.do("route.contour.clear")["route_contours"]["by_hand"] == 0
    assert opened.do("route.undo")["route_contours"]["by_hand"] == 2


@pytest.mark.parametrize("kind", get_args(MarkKind))
def test_a_mark_of_every_kind_is_clicked_and_shown(opened: Opened, kind: MarkKind) -> None:
    planned(opened)
    shown = opened.do("route.pick", what=kind)["route"]
    many = {one["kind"]: one["many"] for one in shown["mark_kinds"]}[kind]
    assert many in opened.tab.hint()
    opened.tab.clicked(wall_at(40.0))
    (mark,) = sections_of(opened.tab)["route"]["marks"]
    assert (mark["kind"], mark["name"]) == (kind, f"{kind.capitalize()} 1")
    assert "route.marks" in [layer.name for layer in opened.tab.layers()]


def test_kinds_of_marks_are_told_apart() -> None:
    assert set(MARK_KINDS) == set(get_args(MarkKind))
    for styles in zip(*MARK_KINDS.values(), strict=True):
        assert len(set(styles)) == len(MARK_KINDS)  # letters of their ids, words, colours
    assert all(len(style.letter) == 1 for style in MARK_KINDS.values())


def test_polyps_are_clicked_one_after_the_other_and_one_is_moved(opened: Opened) -> None:
    planned(opened)
    opened.do("route.pick", what="polyp")
    for z in (40.0, 60.0):
        opened.tab.clicked(wall_at(z))
    shown = sections_of(opened.tab)["route"]
    assert ([mark["name"] for mark in shown["marks"]], shown["picking"]) == (["Polyp 1", "Polyp 2"], "polyp")
    opened.do("route.pick", what="move", mark_id="p1")
    opened.tab.clicked(wall_at(90.0))
    shown = sections_of(opened.tab)["route"]
    assert (round(shown["marks"][0]["at"][2]), shown["picking"], shown["moving"]) == (90, "", "")
    assert "route.marks" in [layer.name for layer in opened.tab.layers()]
    opened.do("route.lock", route_id=shown["id"], locked=True)
    opened.do("route.pick", what="label")
    with pytest.raises(InputError, match="locked"):
        opened.tab.clicked(wall_at(50.0))
