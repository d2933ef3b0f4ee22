"""A tab's desks: which plan may be opened, what a drag leaves behind, whose dry run is shown, what a lost line ends."""

from __future__ import annotations

import re
from collections.abc import Callable
from concurrent.futures import Executor, Future
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.services import Services
from app.services.cases import Case, CaseFrame
from app.session import commands as c
from app.session import hub as hub_module
from app.session.board import Board
from app.session.corridor_desk import Corridor, CorridorDesk
from app.session.head_desk import HeadDesk
from app.session.hub import SessionHub
from app.session.plan_desk import PlanDesk
from app.session.planning_desk import PlanningDesk
from app.session.preparation import plan_key
from app.session.rehearsal_desk import RehearsalDesk
from app.session.rehearsals import RehearsalRooms
from vfix_engine.errors import PlanError
from vfix_engine.geometry.mesh import TriangleMesh

SAMPLE = "head-phantom-sample"
HEAD = "head-phantom"


class _Later(Executor):
    """Keeps the work until it is asked for."""

    def __init__(self) -> None:
        self.work: list[Callable[[], Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.work.append(lambda: fn(*args, **kwargs))
        return Future()


def _planning(services: Services) -> PlanningDesk:
    desk = PlanningDesk(services, Board(), _Later(), lambda request: request())
    desk.open(HEAD, SAMPLE)
    return desk


def _other_head(services: Services) -> Case:
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]])
    mesh = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    return services.cases.create("Other", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": mesh})


def test_the_dry_run_of_an_older_plan_is_not_shown_for_a_newer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """The answer waits in the inbox behind the very edit that makes it old."""
    waiting: list[tuple[int, Corridor]] = []
    executor = _Later()
    desk = CorridorDesk(SimpleNamespace(), executor, lambda *answer: waiting.append(answer))  # type: ignore[arg-type]
    monkeypatch.setattr(desk, "_answer", lambda plan, margin: Corridor("done", plan, completed=True))
    desk.ask("old", 0.3)
    executor.work.pop()()
    desk.ask("new", 0.3)
    desk.accept(*waiting.pop())
    assert desk.current.status == "computing"
    executor.work.pop()()
    desk.accept(*waiting.pop())
    assert desk.current.words == "new"


def test_a_plan_of_another_head_or_a_deleted_one_is_not_opened(phantom_services: Services) -> None:
    services = phantom_services
    other = _other_head(services)
    foreign = services.plans.create(other.id, "Foreign")
    gone = services.plans.create(HEAD, "Gone")
    services.plans.delete(gone.id)
    desk = _planning(services)
    for plan_id, words in ((foreign.id, "another head"), (gone.id, "deleted")):
        for kind in ("plan.open", "plan.duplicate"):
            with pytest.raises(PlanError, match=words):
                desk.do_plan(c.PlanCommand(type=kind, plan_id=plan_id))  # type: ignore[arg-type]
            assert desk.plan_id == SAMPLE
    services.cases.delete(other.id)


def test_the_newest_plan_of_a_head_is_opened(phantom_services: Services) -> None:
    newest = phantom_services.plans.create(HEAD, "Newest")
    desk = _planning(phantom_services)
    desk.open(HEAD, None)
    assert desk.plan_id == newest.id
    phantom_services.plans.delete(newest.id)


@pytest.mark.parametrize("end", ["cancel", "let_go", "undo", "delete", "elsewhere"])
def test_a_drag_that_never_ends_leaves_nothing_behind(phantom_services: Services, end: str) -> None:
    plan = phantom_services.plans.duplicate(SAMPLE)
    desk = PlanDesk(phantom_services, plan.id)
    first, second = plan.points[0].id, plan.points[1].id
    desk.rename(second, "Second")
    desk.drag(first, (1.0, 2.0, 3.0))
    assert desk.dragging
    if end == "delete":
        desk.delete(second)
    elif end == "elsewhere":
        phantom_services.plans.editor(plan.id).delete_point(first)
        desk.refresh()
    else:
        getattr(desk, end)()
    assert not desk.dragging
    assert (1.0, 2.0, 3.0) not in desk.points()
    phantom_services.plans.delete(plan.id)


def test_the_path_is_coloured_with_what_an_export_says(phantom_services: Services) -> None:
    desk = _planning(phantom_services)
    evaluation = phantom_services.planning.evaluate(desk.plan)
    desk._corridor.current = Corridor("done", evaluation=evaluation)
    places, clearance = desk.curve()
    samples, _ = phantom_services.planning.curve(desk.plan)
    assert places is not None
    assert clearance is not None
    assert [tuple(place) for place in places.tolist()] == [sample.position for sample in samples]
    assert clearance.min() == min(sample.clearance_mm for sample in samples if sample.clearance_mm is not None)


def test_the_verdict_names_bone_soft_tissue_and_what_the_margin_leaves_open(phantom_services: Services) -> None:
    desk = _planning(phantom_services)
    ran: list[Corridor] = []
    executor = _Later()
    corridor = CorridorDesk(phantom_services, executor, lambda ticket, answer: ran.append(answer))
    for margin in (0.3, 0.4):
        corridor.ask(desk.plan, margin)
        executor.work.pop()()
    assert re.fullmatch(
        r"Fits: bone clearance 0\.\d\d mm at least\. Passes \d\d mm of soft tissue \(tip at \d+ mm\)\.", ran[0].words
    )
    assert ran[0].view()["soft_tissue"]["complete"] is True
    assert ran[0].warning.endswith("(0.38 mm: surface thinned), more than the margin of 0.30 mm")
    assert ran[1].warning == ""


def test_a_deleted_embedded_head_is_not_opened(phantom_services: Services) -> None:
    services = phantom_services
    services.cases.delete(HEAD)
    try:
        desk = HeadDesk(services, Board(), _Later(), lambda request: None)
        desk.open_first(None)
        assert desk.case_id is None
        other = _other_head(services)
        desk.open_first(HEAD)
        assert desk.case_id == other.id
        services.cases.delete(other.id)
    finally:
        services.cases.restore(HEAD)


@pytest.mark.parametrize("locked", [False, True])
def test_settings_in_force_are_kept_in_the_plan(phantom_services: Services, locked: bool) -> None:
    """The next dry run, the export and the next rehearsal use them; the robot that stands stays where it is."""
    services = phantom_services
    plan = services.plans.duplicate(SAMPLE)
    services.plans.editor(plan.id).set_locked(locked)
    plan = services.plans.get(plan.id)
    desk = RehearsalDesk(services, RehearsalRooms(), _Later(), "tab-one-0")
    desk.enter(plan.id)
    room = desk.room
    assert room is not None
    room.open(plan_key(plan), lambda: None, _Later())  # type: ignore[arg-type,return-value]
    room.lease.take("tab-one-0")
    room._accepted = {"margin_mm": 0.5}
    words = desk.tick()
    after = services.plans.get(plan.id)
    assert room.is_for(plan_key(after))
    if locked:
        assert "this rehearsal only" in words[0]
        assert dict(after.settings) == dict(plan.settings)
    else:
        assert words == []
        assert after.settings["margin_mm"] == 0.5
        assert desk.plan_edited
    services.plans.editor(plan.id).set_locked(False)
    services.plans.delete(plan.id)


class _Tabs:
    def client_for(self, tab: str) -> None:
        return None

    def on_tab_connected(self, callback: Any) -> None:
        pass

    def on_tab_gone(self, callback: Any) -> None:
        pass


def test_a_lost_connection_frees_the_handle_and_keeps_the_rehearsal(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11: after the grace the handle is free; the robot goes home only when nobody has come for long."""
    timers: list[tuple[float, Callable[[], None]]] = []
    monkeypatch.setattr(hub_module, "_later", lambda seconds, action: timers.append((seconds, action)))
    hub = SessionHub(phantom_services, _Tabs(), lambda: "")
    workspace = hub.connect("tab-one-0", {"plan": SAMPLE})

    def settled() -> None:
        done: Future[None] = Future()
        workspace.ask(lambda: done.set_result(None))
        done.result(20)

    try:
        settled()
        room = workspace.rehearsal.room
        assert room is not None
        room.lease.take("tab-one-0")
        hub.disconnect("tab-one-0")
        hub.connect("tab-one-0", {})
        timers.pop()[1]()
        settled()
        assert timers == []
        assert room.lease.held_by("tab-one-0"), "it came back in time"
        hub.disconnect("tab-one-0")
        timers.pop()[1]()
        settled()
        assert room.lease.holder is None
        assert room.watchers == {"tab-one-0"}
        timers.pop()[1]()
        settled()
        assert room.watchers == set()
        hub.connect("tab-one-0", {})
        settled()
        assert workspace.rehearsal.room is room
        assert room.watchers == {"tab-one-0"}
    finally:
        hub.close()
