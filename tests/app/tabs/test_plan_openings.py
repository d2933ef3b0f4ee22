"""An empty plan begins at an opening of the head: found in the background, marked, and one edit with its side."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from session_doubles import HEAD, Heard, Later, open_sample, sections_of, send

from app.imaging.openings import Opening, OpeningsOfHead
from app.scene.view import ClickRay
from app.services import Services
from app.tabs.plan import commands as c
from app.tabs.plan.openings import BEHIND_MM, CANCELLED, FAILED, NONE_FOUND
from app.tabs.plan.tab import PlanTab
from vfix_engine.errors import ImageError, PlanError

RIGHT = Opening("nostril-right", "right", (-7.0, -10.0, 1.0), (0.0, 0.6, 0.8), 4.0)
LEFT = Opening("nostril-left", "left", (7.0, -10.0, 1.0), (0.0, 0.6, 0.8), 4.0)
FROM_FRONT = np.array([0.0, 1.0, 0.0])


@pytest.fixture
def found(phantom_services: Services, monkeypatch: pytest.MonkeyPatch) -> list[Opening]:
    """What the head's CT shows, which a test may change."""
    items = [RIGHT, LEFT]
    monkeypatch.setattr(phantom_services.openings, "find", lambda volume, progress: OpeningsOfHead(tuple(items)))
    monkeypatch.setattr(phantom_services.openings, "_stored", lambda key: None)
    monkeypatch.setattr(phantom_services.openings._store.derived, "put", lambda *rest: None)
    phantom_services.openings._known._entries.clear()
    return items


def empty_plan(services: Services, heard: Heard | None = None) -> PlanTab:
    return open_sample(services, services.plans.create(HEAD, "Empty").id, heard)


def shown(tab: PlanTab) -> Any:
    return sections_of(tab)["openings"]


def do_work(tab: PlanTab) -> None:
    """What waits in the background."""
    work = cast(Later, tab.workspace.executor).work
    while work:
        work.pop(0)()


def click(tab: PlanTab, x: float, before: float) -> None:
    """A click from the front; before: how far in front of an opening something else is met."""
    tab.workspace.case.hit = lambda ray: None  # type: ignore[method-assign]
    if before:
        hit = type("Met", (), {"distance_mm": 200.0 - before, "position": np.array([x, -10.0 - before, 1.0])})
        hit.item_id = None  # type: ignore[attr-defined]
        tab.workspace.case.hit = lambda ray: hit  # type: ignore[method-assign,assignment,return-value]
    tab.clicked(ClickRay(np.array([x, -210.0, 1.0]), FROM_FRONT))


@pytest.mark.parametrize(("beside_mm", "side"), [(5.0, "left"), (7.0, "")])
def test_an_entry_clicked_near_one_is_where_it_was_clicked_with_the_side_as_one_edit(
    phantom_services: Services, found: list[Opening], beside_mm: float, side: str
) -> None:
    place = (7.5, -14.0, -6.0)
    found[:] = [RIGHT, replace(LEFT, position=(place[0], place[1] - beside_mm, place[2]))]
    tab = empty_plan(phantom_services)
    do_work(tab)
    shown(tab)
    do_work(tab)
    send(tab, "pick.slice", position=list(place))
    send(tab, "ghost.confirm")  # the place lies in the room's air
    assert tab.plan is not None
    (point,) = tab.plan.content.points
    assert (point.position, tab.plan.content.path.entry_side) == (pytest.approx(place, abs=0.1), side)
    send(tab, "undo")
    assert (tab.plan.content.points, tab.plan.content.path.entry_side) == ((), "")


def marked(tab: PlanTab) -> list[str]:
    (layer,) = (layer for layer in tab.layers() if layer.name == "plan.openings")
    return [mark.name for mark in cast(Any, layer.key)]


def test_they_are_shown_once_found_and_the_slices_go_there_once(
    phantom_services: Services, found: list[Opening]
) -> None:
    tab = empty_plan(phantom_services)
    assert shown(tab) == {"state": "waiting", "items": [], "marked": False, "words": ""}
    assert marked(tab) == []
    do_work(tab)
    section = shown(tab)
    assert (section["state"], section["marked"], section["words"]) == ("current", True, "")
    assert [(one["id"], one["name"], one["position"]) for one in section["items"]] == [
        ("nostril-right", "Right nostril", [-7.0, -10.0, 1.0]),
        ("nostril-left", "Left nostril", [7.0, -10.0, 1.0]),
    ]
    assert marked(tab) == ["Right nostril", "Left nostril"]
    assert tab.workspace.case.cross == (0.0, -10.0, 1.0)
    tab.workspace.case.go_to((1.0, 2.0, 3.0))
    shown(tab)
    assert tab.workspace.case.cross == (1.0, 2.0, 3.0)
    other = empty_plan(phantom_services)
    do_work(other)  # the head is read
    shown(other)
    other.workspace.case.go_to((1.0, 2.0, 3.0))
    do_work(other)
    assert shown(other)["state"] == "current"
    assert other.workspace.case.cross == (1.0, 2.0, 3.0), "somebody looks at something else"


def test_the_slices_of_a_head_that_is_opened_in_another_tab_go_there_too(
    phantom_services: Services, found: list[Opening]
) -> None:
    tab = empty_plan(phantom_services)
    tab.active = False
    do_work(tab)
    shown(tab)
    do_work(tab)
    shown(tab)
    assert tab.workspace.case.cross == (0.0, -10.0, 1.0)


def test_the_slices_of_a_plan_begin_at_its_first_point(phantom_services: Services) -> None:
    tab = open_sample(phantom_services)
    do_work(tab)
    assert tab.plan is not None
    assert tab.workspace.case.cross == tab.plan.content.points[0].position


@pytest.mark.parametrize("how", ["button", "scene"])
def test_choosing_one_is_a_single_edit_with_its_side(
    phantom_services: Services, found: list[Opening], how: str
) -> None:
    tab = empty_plan(phantom_services)
    do_work(tab)
    shown(tab)
    do_work(tab)
    before = shown(tab)
    if how == "button":
        send(tab, "opening.use", opening_id="nostril-left")
    else:
        click(tab, 9.0, 0.0)
    assert tab.plan is not None
    (point,) = tab.plan.content.points
    assert point.position == pytest.approx(LEFT.position, abs=0.1)
    assert tab.plan.content.path.entry_side == "left"
    assert tab._need().selected == point.id
    assert shown(tab)["state"] == "none"
    assert marked(tab) == []
    with pytest.raises(PlanError, match="not shown any more"):
        send(tab, "opening.use", opening_id="nostril-right")
    send(tab, "undo")
    assert (tab.plan.content.points, tab.plan.content.path.entry_side) == ((), "")
    assert shown(tab) == before
    send(tab, "redo")
    assert tab.plan.content.path.entry_side == "left"


def test_a_click_means_an_opening_where_its_mark_is_seen_and_not_otherwise(
    phantom_services: Services, found: list[Opening]
) -> None:
    tab = empty_plan(phantom_services)
    shown(tab)
    do_work(tab)
    shown(tab)
    click(tab, -7.0, BEHIND_MM + 5.0)  # such as from behind
    assert tab.plan is not None
    assert not tab.plan.content.points
    click(tab, -14.0, 0.0)  # beside it
    assert not tab.plan.content.points
    tab.handle(c.AddMode(type="add.mode", kind="target"))
    assert (shown(tab)["marked"], marked(tab)) == (False, [])
    tab.handle(c.AddMode(type="add.mode", kind="point"))
    click(tab, -7.0, BEHIND_MM - 5.0)  # skin or a nasal bone is before it
    assert tab.plan.content.path.entry_side == "right"


def test_one_whose_side_is_not_known_leaves_the_side(phantom_services: Services, found: list[Opening]) -> None:
    found[:] = [Opening("nostril", "", (0.0, -10.0, 1.0), (0.0, 0.6, 0.8), 4.0)]
    tab = empty_plan(phantom_services)
    assert tab.plan is not None
    send(tab, "path.side", path_id=tab.plan.content.path_id, side="midline")
    shown(tab)
    do_work(tab)
    send(tab, "opening.use", opening_id="nostril")
    assert tab.plan.content.path.entry_side == "midline"


def test_where_none_is_found_it_says_what_to_do(
    phantom_services: Services, found: list[Opening], monkeypatch: pytest.MonkeyPatch
) -> None:
    found.clear()
    tab = empty_plan(phantom_services)
    shown(tab)
    do_work(tab)
    assert shown(tab) == {"state": "current", "items": [], "marked": False, "words": NONE_FOUND}

    def fails(volume: Any, progress: Any) -> Any:
        raise ImageError("damaged")

    phantom_services.openings._known._entries.clear()
    monkeypatch.setattr(phantom_services.openings, "find", fails)
    other = empty_plan(phantom_services)
    shown(other)
    do_work(other)
    assert shown(other)["words"] == FAILED
    monkeypatch.setattr(phantom_services.openings, "find", lambda volume, progress: OpeningsOfHead((LEFT,)))
    assert shown(other)["words"] == FAILED, "it is not looked for again and again"
    send(other, "plan.open", plan_id=phantom_services.plans.create(HEAD, "Another").id)
    shown(other)
    do_work(other)
    assert [one["name"] for one in shown(other)["items"]] == ["Left nostril"]
    assert max(len(words.split()) for words in (NONE_FOUND, FAILED, CANCELLED)) <= 12


def test_a_search_that_is_cancelled_says_so_and_another_plan_asks_again(
    phantom_services: Services, found: list[Opening], monkeypatch: pytest.MonkeyPatch
) -> None:
    jobs = phantom_services.jobs

    def cancelled(volume: Any, progress: Any) -> Any:
        [job] = [one for one in jobs.list() if one.kind == "openings" and one.state == "running"]
        jobs.cancel(job.id)
        progress("Finding the nostrils", 0.5)
        raise AssertionError("it goes on")

    monkeypatch.setattr(phantom_services.openings, "find", cancelled)
    tab = empty_plan(phantom_services)
    assert shown(tab)["state"] == "waiting"
    do_work(tab)
    assert shown(tab) == {"state": "current", "items": [], "marked": False, "words": CANCELLED}
    monkeypatch.setattr(phantom_services.openings, "find", lambda volume, progress: OpeningsOfHead((LEFT,)))
    send(tab, "plan.open", plan_id=phantom_services.plans.create(HEAD, "Asked again").id)
    shown(tab)
    do_work(tab)
    assert [one["name"] for one in shown(tab)["items"]] == ["Left nostril"]


def test_nothing_is_looked_for_where_no_entry_is_missing(phantom_services: Services) -> None:
    tab = open_sample(phantom_services)
    assert shown(tab)["state"] == "none"
    locked = empty_plan(phantom_services)
    send(locked, "lock", locked=True)
    assert shown(locked)["state"] == "none"
    assert (tab._openings._asked, locked._openings._asked) == (None, None)
