"""A tab's desks: which plan may be opened, what a drag leaves behind, whose dry run is shown, what a lost line ends."""

from __future__ import annotations

import re
import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from app.services import Services
from app.services.cases import Case, CaseFrame
from app.services.documents import DocumentKind
from app.services.plans import Plan
from app.session import client_sessions as hub_module
from app.session.client_session import ClientSession
from app.session.client_sessions import ClientSessions, TooManyTabs
from app.session.view_model import ViewModel
from app.steps.plan import commands as c
from app.steps.plan.dry_runs import Corridor, DryRuns
from app.steps.plan.edited_plan import EditedPlan, plan_items
from app.steps.plan.hints import plan_hint
from app.steps.plan.step import PlanStep
from app.steps.rehearse import commands as rc
from app.steps.rehearse.preparation import plan_key
from app.steps.rehearse.shared_drive import Prepared, SharedDrives
from app.steps.rehearse.step import RehearseStep
from app.store.errors import StorageError
from app.store.models import DocumentStateRow
from app.views.case_view import CaseView
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError, PlanError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.imaging.surface_uncertainty import SurfaceUncertainty

SAMPLE = "head-phantom-sample"
HEAD = "head-phantom"


class _Later(Executor):
    """Keeps the work until it is asked for."""

    def __init__(self) -> None:
        self.work: list[Callable[[], Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.work.append(lambda: fn(*args, **kwargs))
        return Future()


def _planning(services: Services) -> PlanStep:
    desk = PlanStep(services, ViewModel(), _Later(), lambda request: request())
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
    desk = DryRuns(SimpleNamespace(), executor, lambda *answer: waiting.append(answer))  # type: ignore[arg-type]
    monkeypatch.setattr(desk, "_answer", lambda plan, margin: Corridor("done", plan.id, completed=True))
    desk.ask(SimpleNamespace(id="old"), 0.3)
    executor.work.pop()()
    desk.ask(SimpleNamespace(id="new"), 0.3)
    desk.accept(*waiting.pop())
    assert desk.current.status == "computing"
    executor.work.pop()()
    desk.accept(*waiting.pop())
    assert desk.current.words == "new"


def test_a_dry_run_whose_case_cannot_be_read_has_failed(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk, executor, ran = _planning(phantom_services), _Later(), list[Corridor]()
    monkeypatch.setattr(phantom_services.cases, "get", lambda case_id: _fail(StorageError("the disk is broken")))
    monkeypatch.setattr(phantom_services.planning, "evaluate", lambda plan: SimpleNamespace())
    DryRuns(phantom_services, executor, lambda ticket, answer: ran.append(answer)).ask(desk.plan, 0.3)
    executor.work.pop()()
    assert [(answer.status, answer.words) for answer in ran] == [("failed", "the disk is broken")]


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
    desk = EditedPlan(phantom_services, plan.id)
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
    corridor = DryRuns(phantom_services, executor, lambda ticket, answer: ran.append(answer))
    for margin in (0.3, 0.4):
        corridor.ask(desk.plan, margin)
        executor.work.pop()()
    assert re.fullmatch(
        r"Fits: bone clearance 0\.\d\d mm at least, when the tip is at \d+ mm\. "
        r"Passes \d\d mm of soft tissue, when the tip is at \d+ mm\.",
        ran[0].words,
    )
    assert ran[0].view()["soft_tissue"]["complete"] is True
    assert ran[0].warning.endswith("(0.38 mm: surface thinned), more than the margin of 0.30 mm")
    assert ran[1].warning == ""
    assert not ran[1].caution


def test_a_clearance_within_what_the_scan_leaves_open_is_no_fit(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """2 mm slices leave a millimetre open: 0.7 mm from the surface may be bone."""
    monkeypatch.setattr(Case, "uncertainty", SurfaceUncertainty(0.0, 2.0))
    desk, executor = _planning(phantom_services), _Later()
    ran: list[Corridor] = []
    DryRuns(phantom_services, executor, lambda ticket, answer: ran.append(answer)).ask(desk.plan, 0.3)
    executor.work.pop()()
    assert re.match(
        r"Fits the surface only: bone clearance 0\.\d\d mm at least, when the tip is at \d+ mm, "
        r"and bone may lie 1\.00 mm off its surface\. ",
        ran[0].words,
    )
    assert ran[0].caution
    assert ran[0].completed
    assert "nearer to bone than the scan can tell" in plan_hint(3, 1, "point", False, False, True, ran[0].caution)


def test_a_deleted_embedded_head_is_not_opened(phantom_services: Services) -> None:
    services = phantom_services
    services.cases.delete(HEAD)
    try:
        desk = CaseView(services, ViewModel(), _Later(), lambda request: None)
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
    desk = RehearseStep(services, SharedDrives(), _Later(), "tab-one-0")
    desk.enter(plan.id)
    room = desk.room
    assert room is not None
    room.open(plan_key(plan), lambda: None, _Later())  # type: ignore[arg-type,return-value]
    room.lease.take("tab-one-0")
    room._talk._accepted = {"margin_mm": 0.5}
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


def test_a_disk_that_refuses_keeps_no_robot_running_and_no_setting_is_forgotten(
    rehearsing: tuple[RehearseStep, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11: the robot pauses and the handle is free first; the plan keeps the setting when the disk lets it."""
    desk, plan = rehearsing
    robot, plans = _in_place(desk, plan), desk._services.plans
    room = desk.room
    assert room is not None
    room.lease.take("tab-one-0")
    room._talk._accepted = {"margin_mm": 0.5}
    with monkeypatch.context() as full:
        full.setattr(plans, "editor", lambda plan_id: _fail(StorageError("the disk is full")))
        words = desk.tick()
        assert [said.endswith("the plan could not keep them: the disk is full") for said in words] == [True]
        assert desk.tick() == [], "it is said once"
        desk.give_up()
    assert robot.told[-2:] == ["pause", "release"]
    assert room.lease.holder is None
    desk.back()
    room.lease.take("tab-one-0")
    assert desk.tick() == []
    assert plans.get(plan.id).settings["margin_mm"] == 0.5


class _Tabs:
    def client_for(self, tab: str) -> None:
        return None

    def on_tab_connected(self, callback: Any) -> None:
        pass

    def on_tab_gone(self, callback: Any) -> None:
        pass


def _settle(workspace: ClientSession) -> None:
    """Wait until everything that was asked of a workspace is done."""
    done: Future[None] = Future()
    workspace.ask(lambda: done.set_result(None))
    done.result(20)


@pytest.fixture
def hub(phantom_services: Services) -> Iterator[ClientSessions]:
    """Its clock stands; a test lets it tick."""
    made = ClientSessions(phantom_services, _Tabs(), lambda: "")
    yield made
    made.close()


def test_a_window_is_refused_where_no_scene_could_be_had(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would wait for its scene for ever; one that closes makes room for it."""
    monkeypatch.setattr(hub_module, "MAX_PAGES", 1)
    hub = ClientSessions(phantom_services, _Tabs(), lambda: "")
    try:
        hub.connect("tab-one-0", {})
        with pytest.raises(TooManyTabs):
            hub.connect("tab-two-0", {})
        hub.disconnect("tab-one-0")
        hub.connect("tab-two-0", {})
        with pytest.raises(TooManyTabs):
            hub.connect("tab-one-0", {})
    finally:
        hub.close()


def test_choosing_the_chosen_point_again_brings_the_slices_back_to_it(phantom_services: Services) -> None:
    desk = _planning(phantom_services)
    point = desk.items()[2]
    for _ in range(2):
        desk.do(c.ItemCommand(type="item.select", item_id=point.id))
        assert desk.take_focus() == point.position


def test_a_lost_connection_frees_the_handle_and_keeps_the_rehearsal(hub: ClientSessions) -> None:
    """HAZ-11: after the grace the handle is free; the robot goes home, and the workspace ends, after longer."""
    workspace = hub.connect("tab-one-0", {"plan": SAMPLE})

    def pass_by(seconds: float) -> None:
        for _ in range(3):
            hub.beat(time.monotonic() + seconds)
        _settle(workspace)

    _settle(workspace)
    room = workspace.rehearsal.room
    assert room is not None
    room.lease.take("tab-one-0")
    hub.disconnect("tab-one-0")
    hub.connect("tab-one-0", {})
    pass_by(hub_module.LEASE_GRACE_S)
    assert room.lease.held_by("tab-one-0"), "it came back in time"
    hub.disconnect("tab-one-0")
    pass_by(0.5 * hub_module.LEASE_GRACE_S)
    assert room.lease.held_by("tab-one-0"), "it may still come back"
    pass_by(hub_module.LEASE_GRACE_S)
    assert room.lease.holder is None
    assert room.watchers == {"tab-one-0"}
    pass_by(hub_module.ABANDONED_S)
    assert room.watchers == set()
    assert hub.connect("tab-one-0", {}) is workspace
    _settle(workspace)
    room = workspace.rehearsal.room
    assert room is not None
    assert room.watchers == {"tab-one-0"}
    hub.disconnect("tab-one-0")
    hub.beat(time.monotonic() + hub_module.ENDED_S)  # the handle first,
    hub.beat(time.monotonic() + hub_module.ENDED_S)  # then the rehearsal,
    hub.beat(time.monotonic() + hub_module.ENDED_S)  # then all of it
    workspace._thread.join(20)
    assert not workspace._thread.is_alive()
    assert room.watchers == set()
    assert hub.connect("tab-one-0", {}) is not workspace


@pytest.mark.parametrize("given_up", range(3))
def test_a_page_that_comes_back_in_the_very_tick_is_waited_for_anew(
    hub: ClientSessions, monkeypatch: pytest.MonkeyPatch, given_up: int
) -> None:
    """HAZ-11, HAZ-12: the clock finds it absent, it connects, and only then something would be given up."""
    workspace, wait_for = hub.connect("tab-one-0", {"plan": SAMPLE}), hub._wait_for
    _settle(workspace)
    hub.disconnect("tab-one-0")
    late = time.monotonic() + hub_module.ENDED_S
    for _ in range(given_up):
        hub.beat(late)
    _settle(workspace)

    def comes_back(*values: Any) -> None:
        assert hub.connect("tab-one-0", {}) is workspace
        wait_for(*values)

    monkeypatch.setattr(hub, "_wait_for", comes_back)
    hub.beat(late)
    monkeypatch.undo()
    _settle(workspace)
    room = workspace.rehearsal.room
    assert room is not None
    assert room.watchers == {"tab-one-0"}
    room.lease.take("tab-one-0")
    hub.disconnect("tab-one-0")
    hub.beat(time.monotonic() + hub_module.LEASE_GRACE_S)
    _settle(workspace)
    assert room.lease.holder is None


def test_a_store_that_cannot_be_asked_is_logged_once_and_asked_again(
    hub: ClientSessions, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    ticks: list[bool] = []
    monkeypatch.setattr(ClientSession, "tick", lambda self, changed: ticks.append(changed))
    _settle(hub.connect("tab-one-0", {"plan": SAMPLE}))
    store, now = hub._services.store, time.monotonic()
    hub.beat(now)
    with monkeypatch.context() as broken:
        connection = SimpleNamespace(execute=lambda statement: _fail(sqlite3.OperationalError("disk I/O error")))
        broken.setattr(store, "_watch", connection)
        with pytest.raises(StorageError):
            store.data_version()
        for n in range(1, 4):
            hub.beat(now + n * hub_module.LOOK_S)
    hub.beat(now + 4 * hub_module.LOOK_S)
    assert ticks == [True, False, False, False, False]
    logged = [record.levelname for record in caplog.records if record.name == hub_module.__name__]
    assert logged == ["WARNING"]


def _fail(error: Exception) -> Any:
    raise error


def test_a_page_that_is_away_costs_nothing(hub: ClientSessions, monkeypatch: pytest.MonkeyPatch) -> None:
    """One clock for all: no tick and no look at the store for a closed tab; it catches up when it is back."""
    ticks: list[str] = []
    tick = ClientSession.tick

    def counted(self: ClientSession, changed: bool) -> None:
        ticks.append(self.tab)
        tick(self, changed)

    monkeypatch.setattr(ClientSession, "tick", counted)
    here, away = (hub.connect(tab, {"plan": SAMPLE}) for tab in ("tab-here-0", "tab-away-0"))
    for _ in range(2):  # what is published follows each request
        _settle(away)
    services = hub._services
    hub.disconnect("tab-away-0")
    now = time.monotonic()
    plan = services.plans.create(HEAD, "Made elsewhere")
    for n in range(100):
        hub.beat(now + 0.05 * n)
    assert set(ticks) == {"tab-here-0"}
    assert len(ticks) < 10, "nothing moves there either: a look now and then is enough"

    def names(workspace: ClientSession) -> set[str]:
        _settle(workspace)
        _settle(workspace)  # what is published follows each request
        section = workspace.board.read("plans")
        return set() if section is None else {item["name"] for item in section["items"]}

    assert "Made elsewhere" in names(here)
    services.plans.rename(plan.id, "Renamed elsewhere")
    services.plans.delete(plan.id)
    assert "Renamed elsewhere" not in names(away)
    hub.connect("tab-away-0", {})
    assert "Renamed elsewhere" in names(away)


def test_slow_heads_keep_no_other_tab_waiting(hub: ClientSessions, monkeypatch: pytest.MonkeyPatch) -> None:
    """Reading a head takes minutes for three tabs; a fourth opens its own meanwhile."""
    cases, done = hub._services.cases, threading.Event()
    slow, read = _other_head(hub._services), cases.display_meshes

    def display_meshes(case_id: str) -> Any:
        if case_id == slow.id:
            done.wait(60)
        return read(case_id)

    monkeypatch.setattr(cases, "display_meshes", display_meshes)
    try:
        for n in range(3):
            hub.connect(f"tab-slow-{n}", {"case": slow.id})
        quick = hub.connect("tab-quick-0", {"case": HEAD})
        deadline = time.monotonic() + 30
        while quick.head.head is None and time.monotonic() < deadline:
            time.sleep(0.02)
        assert quick.head.head is not None
    finally:
        done.set()
        cases.delete(slow.id)


def test_the_list_of_plans_does_not_read_what_they_contain(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    desk = _planning(phantom_services)
    read: list[str] = []
    monkeypatch.setattr(DocumentKind, "content", lambda *_: read.append("content"))
    desk._plans = list(phantom_services.plans.titles(HEAD))
    assert read == []
    assert SAMPLE in [title.id for title in desk._plans]


def test_a_plan_that_cannot_be_read_does_not_keep_its_head_closed(phantom_services: Services) -> None:
    """The newest plan that can be read is opened, and the reason is said; one that goes bad while open is closed."""
    services = phantom_services
    good, bad = services.plans.duplicate(SAMPLE, "Good"), services.plans.duplicate(SAMPLE, "Bad")
    desk = _planning(services)
    desk.do_plan(c.PlanCommand(type="plan.open", plan_id=bad.id))
    with services.store.writing() as session:
        state = session.get(DocumentStateRow, (bad.id, 0))
        assert state is not None
        state.content = {**state.content, "points": "none"}
    with pytest.raises(InputError, match="'Bad' cannot be read"):
        desk.publish(fresh=True)
    desk.publish(fresh=True)
    assert desk.plan_id is None
    assert "'Bad' cannot be read" in desk.open(HEAD, None)
    assert desk.plan_id == good.id
    assert desk.open(HEAD, SAMPLE) == ""
    for plan in (good, bad):
        services.plans.delete(plan.id)


def test_undo_pressed_once_too_often_is_no_error(phantom_services: Services) -> None:
    plan = phantom_services.plans.duplicate(SAMPLE)
    desk = EditedPlan(phantom_services, plan.id)
    assert (desk.undo(), desk.redo()) == ("There is nothing to undo.", "There is nothing to redo.")
    desk.rename(plan.points[0].id, "Entry")
    assert (desk.undo(), desk.redo()) == ("", "")
    phantom_services.plans.delete(plan.id)


class _Robot:
    """Stands for the control process of a room: ready at once, and notes what it is told."""

    silence_s = 0.0

    def __init__(self) -> None:
        self.alive, self.told = True, []  # type: bool, list[str]

    def events(self) -> list[Any]:
        return []

    def snapshot(self) -> None:
        return None

    def close(self) -> None:
        self.alive = False

    def __getattr__(self, name: str) -> Any:
        return lambda *values: self.told.append(name)


@pytest.fixture
def rehearsing(phantom_services: Services) -> Iterator[tuple[RehearseStep, Plan]]:
    """A desk in the room of a copy of the sample; its starts wait to be done."""
    plan = phantom_services.plans.duplicate(SAMPLE)
    desk = RehearseStep(phantom_services, SharedDrives(), _Later(), "tab-one-0")
    desk.enter(plan.id)
    yield desk, plan
    phantom_services.plans.delete(plan.id)


def _in_place(desk: RehearseStep, plan: Plan) -> _Robot:
    """Put a robot in place for a plan."""
    room, robot = desk.room, _Robot()
    assert room is not None
    room._process, room._state, room._plan_key = robot, "ready", plan_key(plan)  # type: ignore[assignment]
    curve = np.array([point.position for point in plan.points])
    spec: Any = SimpleNamespace()
    room._prepared = Prepared(spec, ControlSettings(), tuple(plan_items(plan)), curve)
    return robot


def test_a_rehearsal_goes_on_along_what_it_was_placed_for_and_says_that_the_plan_has_changed(
    phantom_services: Services, rehearsing: tuple[RehearseStep, Plan]
) -> None:
    """Start and Continue drive what is drawn, targets are those of the robot; Reset takes the plan as it is now."""
    desk, plan = rehearsing
    robot, board, editor = _in_place(desk, plan), ViewModel(), phantom_services.plans.editor(plan.id)

    def show() -> tuple[Any, Any]:
        desk.compare(editor.plan)
        desk.publish(board, desk.driven())
        board.commit()
        return board.read("rehearsal"), board.read("driven")

    shown, driven = show()
    assert (shown["plan_changed"], driven) == (False, None)
    editor.rename_point(plan.targets[0].id, "Another name")
    assert show()[1] is None, "a name is not driven"
    first, second = plan.targets[:2]
    editor.delete_target(first.id)
    shown, driven = show()
    assert shown["plan_changed"]
    assert [target["id"] for target in driven["targets"]] == [target.id for target in plan.targets]
    desk.do_plain("rehearsal.start", editor.plan, HEAD)
    assert robot.told == ["run"]
    desk.do(rc.SetMode(type="rehearsal.mode", mode="inspect", target_id=second.id))
    assert desk.room is not None
    assert desk.room.target_id == second.id
    desk.do_plain("rehearsal.reset", editor.plan, HEAD)
    assert not robot.alive
    assert desk.room.is_for(plan_key(editor.plan))


def test_the_scene_shows_what_is_driven_while_it_is_driven(hub: ClientSessions) -> None:
    """In Rehearse the robot's own curve and targets, in Plan the plan's."""
    services = hub._services
    plan = services.plans.duplicate(SAMPLE)
    workspace = hub.connect("tab-one-0", {"case": HEAD, "plan": plan.id})
    _settle(workspace)
    _in_place(workspace.rehearsal, plan)
    services.plans.editor(plan.id).delete_point(plan.points[-1].id)
    workspace.page_back()
    _settle(workspace)
    _settle(workspace)
    picture = workspace._picture()
    assert len(picture.items) == len(plan.points) + len(plan.targets) - 1
    workspace._step = "rehearse"
    picture = workspace._picture()
    assert picture.items == tuple(plan_items(plan))
    places, clearance = picture.curve()
    assert places is not None
    assert clearance is None
    assert np.allclose(places[-1], plan.points[-1].position)
    services.plans.delete(plan.id)


def test_start_while_the_robot_is_being_placed_is_not_forgotten(rehearsing: tuple[RehearseStep, Plan]) -> None:
    desk, plan = rehearsing
    desk.prepare(plan)
    assert desk.state == "starting"
    desk.do_plain("rehearsal.start", plan, HEAD)
    robot = _in_place(desk, plan)
    desk.tick()
    assert robot.told == ["run"]


@pytest.mark.parametrize("name", ["start", "reset", "end"])
def test_a_watcher_is_told_that_it_only_watches(rehearsing: tuple[RehearseStep, Plan], name: str) -> None:
    """HAZ-12: nothing of the holder's robot is moved or ended, and no 'ok' says that it was."""
    desk, plan = rehearsing
    robot = _in_place(desk, plan)
    assert desk.room is not None
    desk.room.lease.take("tab-two-0")
    with pytest.raises(PlanError, match="only the window that holds the handle"):
        desk.do_plain(f"rehearsal.{name}", plan, HEAD)
    for command in (
        rc.SetMode(type="rehearsal.mode", mode="free"),
        rc.SetRehearsalSettings(type="rehearsal.settings", values={"margin_mm": 1.0}),
    ):
        with pytest.raises(PlanError, match="only the window that holds the handle"):
            desk.do(command)
    assert robot.alive
    assert robot.told == []


def test_whoever_watches_may_pause_the_robot(rehearsing: tuple[RehearseStep, Plan]) -> None:
    """HAZ-12: a colleague who sees something may stop it; leaving Rehearse stops nobody else's robot."""
    desk, plan = rehearsing
    robot = _in_place(desk, plan)
    assert desk.room is not None
    desk.room.lease.take("tab-two-0")
    desk.pause()
    assert robot.told == []
    desk.do_plain("rehearsal.pause", plan, HEAD)
    assert robot.told == ["pause"]
    assert desk.room.lease.held_by("tab-two-0")


def test_a_process_that_hangs_is_ended_by_hand(rehearsing: tuple[RehearseStep, Plan]) -> None:
    desk, plan = rehearsing
    robot = _in_place(desk, plan)
    assert desk.room is not None
    desk.room._state = "silent"
    assert "does not answer" in desk.hint(plan)
    desk.do_plain("rehearsal.end", plan, HEAD)
    assert (robot.alive, desk.state) == (False, "absent")
