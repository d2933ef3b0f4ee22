"""The Rehearse tab: what is driven, who may drive it, and what the plan keeps of it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plan_editor import PlanEditor
from session_doubles import CLIENT, SAMPLE, Heard, Robot, fail, put_in_place, sections_of, send, workspace_of

from app.cases.model import Case
from app.drives.commands import DeflectRate
from app.drives.drive_record import DriveRecord
from app.drives.shared_drives import SharedDrives
from app.messages.client import Client
from app.messages.fields import ClientMessage
from app.plans.instruments import plan_tool
from app.plans.model import driven_hash
from app.plans.operations.document import LockPlan
from app.plans.operations.points import DeletePoint, RenamePoint
from app.plans.service import Plan
from app.services import Services
from app.store.errors import StorageError
from app.tabs.rehearse import commands as c
from app.tabs.rehearse.drive_session import RehearsalDrive
from app.tabs.rehearse.preparation import plan_key, prepare
from app.tabs.rehearse.tab import RehearseTab
from vfix_engine.errors import ControlError, PlanError, VfixError
from vfix_engine.runtime.requests import SetTask
from vfix_engine.worlds.rigid.requests import ApproachPoint

OTHER = Client("tab-two-0", "holds")


def _tab(services: Services, plan: Plan, heard: Heard | None = None) -> RehearseTab:
    """The active step of a client that has a plan open; the plan is always as the store has it."""
    workspace = workspace_of(services, heard)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active = True
    return tab


def _accepted(drive: RehearsalDrive) -> None:
    """A margin has come into force, which the plan has not kept yet."""
    assert drive._exchange is not None
    drive._exchange._accepted = {"margin_mm": 0.5}


def _act(tab: RehearseTab, name: str) -> None:
    tab.handle(c.DriveCommand(type=f"rehearsal.{name}"))  # type: ignore[arg-type]


@pytest.fixture
def rehearsing(phantom_services: Services) -> Iterator[tuple[RehearseTab, Plan]]:
    """The step with a copy of the sample open; its starts wait to be done."""
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    yield _tab(phantom_services, plan), plan
    phantom_services.plans.documents.delete(plan.id)


def _in_place(tab: RehearseTab, plan: Plan) -> Robot:
    """Put a robot in place for a plan."""
    drive, robot = tab.drive, Robot()
    assert drive is not None
    put_in_place(drive, robot, plan)
    return robot


@pytest.mark.parametrize("steps", [0, 300])
def test_another_plan_ends_a_drive_and_says_so(phantom_services: Services, steps: int) -> None:
    """Not of a robot that has only stood at the entry."""
    plan, heard = phantom_services.plans.get(SAMPLE), Heard()
    tab = _tab(phantom_services, plan, heard)
    robot: Any = _in_place(tab, plan)
    robot.snapshot = lambda: SimpleNamespace(steps=steps, running=True)
    tab.workspace.plan.provide(lambda: None)
    tab.workspace.plan.opened()
    assert not robot.alive
    assert heard.words == (["The drive ended; its run is in Review."] if steps else [])


@pytest.mark.parametrize("locked", [False, True])
def test_settings_in_force_are_kept_in_the_plan(phantom_services: Services, locked: bool) -> None:
    """The next dry run, the export and the next rehearsal use them; the robot that stands stays where it is."""
    services = phantom_services
    plan = services.plans.documents.duplicate(SAMPLE)
    services.plans.do(plan.id, LockPlan(locked=locked))
    plan = services.plans.get(plan.id)
    heard = Heard()
    tab = _tab(services, plan, heard)
    drive = tab.drive
    assert drive is not None
    put_in_place(drive, Robot(), plan)
    drive.lease.take(CLIENT)
    _accepted(drive)
    everything = tab.tick()
    after = services.plans.get(plan.id)
    assert drive.is_for(plan_key(after))
    if locked:
        assert "this rehearsal only" in heard.words[0]
        assert dict(after.content.settings) == dict(plan.content.settings)
    else:
        assert heard.words == []
        assert after.content.settings["margin_mm"] == 0.5
        assert everything
    services.plans.do(plan.id, LockPlan(locked=False))
    services.plans.documents.delete(plan.id)


def test_a_disk_that_refuses_keeps_no_robot_running_and_no_setting_is_forgotten(
    rehearsing: tuple[RehearseTab, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    """HAZ-11: the robot pauses and the handle is free first; the plan keeps the setting when the disk lets it."""
    tab, plan = rehearsing
    robot, plans = _in_place(tab, plan), tab._services.plans
    drive = tab.drive
    assert drive is not None
    drive.lease.take(CLIENT)
    _accepted(drive)
    with monkeypatch.context() as full:
        full.setattr(plans, "do", lambda *_: fail(StorageError("the disk is full")))
        words = tab.hear()
        assert [said.endswith("The plan could not keep them: the disk is full") for said in words] == [True]
        assert tab.hear() == [], "it is said once"
        tab.give_up()
    assert robot.told[-2:] == ["pause", "release"]
    assert drive.lease.holder is None
    tab.come_back()
    drive.lease.take(CLIENT)
    assert tab.hear() == []
    assert plans.get(plan.id).content.settings["margin_mm"] == 0.5


def test_a_rehearsal_goes_on_along_what_it_was_placed_for_and_says_that_the_plan_has_changed(
    phantom_services: Services, rehearsing: tuple[RehearseTab, Plan]
) -> None:
    """Start and Continue drive what is drawn, targets are those of the robot; Reset takes the plan as it is now."""
    tab, plan = rehearsing
    robot, editor = _in_place(tab, plan), PlanEditor(phantom_services.plans, plan.id)

    def show() -> tuple[Any, Any]:
        sections = sections_of(tab)
        return sections["rehearsal"], sections["driven"]

    shown, driven = show()
    assert (shown["plan_changed"], driven) == (False, None)
    editor.do(RenamePoint(point_id=plan.content.targets[0].id, label="Another name"))
    assert show()[1] is None, "a name is not driven"
    first, second = plan.content.targets[:2]
    editor.do(DeletePoint(point_id=first.id))
    shown, driven = show()
    assert shown["plan_changed"]
    assert [target["id"] for target in driven["targets"]] == [target.id for target in plan.content.targets]
    _act(tab, "start")
    assert robot.told == ["run"]
    tab.handle(c.SetMode(type="rehearsal.mode", mode="inspect", target_id=second.id))
    assert tab.drive is not None
    assert tab.read().requested == SetTask("inspect", 1)
    _act(tab, "reset")
    assert not robot.alive
    assert tab.drive.is_for(plan_key(editor.plan))


def test_start_while_the_robot_is_being_placed_is_not_forgotten(rehearsing: tuple[RehearseTab, Plan]) -> None:
    tab, plan = rehearsing
    tab.enter()
    assert tab.read().shown_state == "starting"
    _act(tab, "start")
    robot = _in_place(tab, plan)
    tab.tick()
    assert robot.told == ["run"]


def test_the_tip_goes_to_a_chosen_place_of_the_driven_path(rehearsing: tuple[RehearseTab, Plan]) -> None:
    """Li 2004, V; a path point of what is driven, or a number of mm along it."""
    tab, plan = rehearsing
    _in_place(tab, plan)
    drive = tab.need_drive()
    drive.lease.take(CLIENT)
    offered = sections_of(tab)["approach"]
    second = offered["points"][1]
    assert (second["id"], second["label"], second["at_mm"]) == (plan.content.points[1].id, "2: nostril", 10.7)
    assert (offered["length_mm"], offered["refusal"]) == (90.0, "")
    send(tab, "rehearsal.approach", point=second["id"])
    asked = tab.read().requested
    assert isinstance(asked, ApproachPoint)
    assert asked.at_mm == pytest.approx(10.7, abs=0.05)
    send(tab, "rehearsal.approach", at_mm=90.0)
    assert tab.read().requested == ApproachPoint(90.0)
    for wrong, why in (({"at_mm": 90.6}, "ends at 90.1 mm"), ({"point": "gone"}, "not part of this rehearsal")):
        with pytest.raises(VfixError, match=why):
            send(tab, "rehearsal.approach", **wrong)
    assert tab.read().requested == ApproachPoint(90.0)


def test_what_is_asked_of_a_robot_that_is_not_there_is_refused(rehearsing: tuple[RehearseTab, Plan]) -> None:
    """No 'ok' for a change that is lost."""
    tab, plan = rehearsing
    tab.enter()
    assert tab.read().shown_state == "starting"
    for kind, fields in (
        ("rehearsal.settings", {"values": {"margin_mm": 0.5}}),
        ("rehearsal.mode", {"mode": "free"}),
        ("rehearsal.approach", {"at_mm": 3.0}),
    ):
        with pytest.raises(ControlError, match="Press Start, and wait"):
            send(tab, kind, **fields)
    assert sections_of(tab)["approach"] is None
    _in_place(tab, plan)
    tab.need_drive()._prepared = replace(tab.need_drive()._prepared, items=())  # type: ignore[type-var]
    with pytest.raises(PlanError, match="no target"):
        send(tab, "rehearsal.mode", mode="inspect")


def test_a_hand_without_the_handle_is_told_so_where_it_asks_for_a_reply(rehearsing: tuple[RehearseTab, Plan]) -> None:
    tab, plan = rehearsing
    robot, drive = _in_place(tab, plan), tab.need_drive()
    drive.lease.take(OTHER)
    hand: tuple[ClientMessage, ...] = (
        c.Push(type="drive", direction=1),
        c.HoldCommand(type="heartbeat"),
        c.HoldCommand(type="rehearsal.take"),
        DeflectRate(type="rate", axes=(1, 0, 0, 0, 0, 0)),
    )
    for command in hand:
        with pytest.raises(ControlError, match="only the window that holds the handle"):
            tab.handle_now(command)
    for kind in ("grip.release", "rehearsal.let_go"):
        tab.handle_now(c.HoldCommand(type=kind))  # type: ignore[arg-type]
    assert (robot.told, drive.lease.held_by(OTHER)) == ([], True)


@pytest.mark.parametrize("name", ["start", "reset", "end"])
def test_a_watcher_is_told_that_it_only_watches(rehearsing: tuple[RehearseTab, Plan], name: str) -> None:
    """HAZ-12: nothing of the holder's robot is moved or ended, and no 'ok' says that it was."""
    tab, plan = rehearsing
    robot = _in_place(tab, plan)
    assert tab.drive is not None
    tab.drive.lease.take(OTHER)
    with pytest.raises(ControlError, match="only the window that holds the handle"):
        _act(tab, name)
    for command in (
        c.SetMode(type="rehearsal.mode", mode="free"),
        c.SetDriveSettings(type="rehearsal.settings", values={"margin_mm": 1.0}),
    ):
        with pytest.raises(ControlError, match="only the window that holds the handle"):
            tab.handle(command)
    assert robot.alive
    assert robot.told == []


def test_whoever_watches_may_pause_the_robot(rehearsing: tuple[RehearseTab, Plan]) -> None:
    """HAZ-12: a colleague who sees something may stop it; leaving Rehearse stops nobody else's robot."""
    tab, plan = rehearsing
    robot = _in_place(tab, plan)
    assert tab.drive is not None
    tab.drive.lease.take(OTHER)
    tab.leave()
    assert robot.told == []
    _act(tab, "pause")
    assert robot.told == ["pause"]
    assert tab.drive.lease.held_by(OTHER)


def test_a_process_that_hangs_is_ended_by_hand(rehearsing: tuple[RehearseTab, Plan]) -> None:
    tab, plan = rehearsing
    robot = _in_place(tab, plan)
    assert tab.drive is not None
    tab.drive._state = "silent"
    tab.read()
    assert "does not answer" in tab.hint()
    _act(tab, "end")
    assert (robot.alive, tab.read().shown_state) == (False, "absent")


def test_what_is_driven_has_the_names_of_the_cases_structures(
    phantom_services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Case, "structure_words", lambda case, structure_id: "Skull base")
    prepared = prepare(phantom_services, phantom_services.plans.get(SAMPLE))
    assert prepared.spec.scene.structure_names == {"bone": "skull base"}


def test_a_recording_says_the_plan_that_is_driven(phantom_services: Services) -> None:
    plan = phantom_services.plans.get(SAMPLE)
    recording = prepare(phantom_services, plan).recording
    assert recording is not None
    assert recording.plan_sha256 == driven_hash(plan.content)


def test_those_who_are_connected_hear_where_the_tool_is(rehearsing: tuple[RehearseTab, Plan]) -> None:
    """From the client that drives alone, each snapshot once, and only where somebody listens."""
    tab, plan = rehearsing
    services = tab.workspace.services
    evaluation = services.planning.evaluate(plan)
    robot = services.instruments.robot(plan.content.robot).placed(evaluation.base, plan_tool(plan.content))
    row = len(evaluation.run.q) // 2
    snapshot: Any = SimpleNamespace(q=evaluation.run.q[row], certified=True)
    prepared: Any = SimpleNamespace(robot=robot)
    before = services.live.tool[0]
    tab._tell_tool(DriveRecord(snapshot=snapshot, prepared=prepared, mine=False))
    assert services.live.tool[0] == before
    for _ in range(2):
        tab._tell_tool(DriveRecord(snapshot=snapshot, prepared=prepared, mine=True))
    told, pose, driven = services.live.tool
    assert (told, driven) == (before + 1, "hands-on")
    assert pose is not None
    np.testing.assert_allclose(pose[:3, 3], evaluation.run.tip[row], atol=1e-9)
    np.testing.assert_allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-9)
    shaft = evaluation.run.segments_start[row, -1] - evaluation.run.segments_end[row, -1]
    np.testing.assert_allclose(-pose[:3, 1], shaft / np.linalg.norm(shaft), atol=1e-9)
    calls: list[Any] = []
    tab._tell_tool = calls.append  # type: ignore[method-assign]
    tab.tick()
    services.live.wanted = True
    tab.tick()
    services.live.wanted = False
    assert len(calls) == 1
