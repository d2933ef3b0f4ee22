"""Control modes in Rehearse: changed by one message, at once where the same process has it, and told."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from session_doubles import CLIENT, SAMPLE, Robot, put_in_place, sections_of, workspace_of

from app.drives import drive_process
from app.drives.plan_drive import PlanDrive
from app.drives.prepared_drive import PreparedDrive
from app.drives.shared_drives import SharedDrives
from app.messages.client import Client
from app.plans.operations.points import DeletePoint
from app.plans.service import Plan
from app.services import Services
from app.tabs.rehearse import commands as c
from app.tabs.rehearse import tab as tab_module
from app.tabs.rehearse.drive_nodes import DriveNodes
from app.tabs.rehearse.preparation import PreparedRehearsal, prepare
from app.tabs.rehearse.tab import RehearseTab
from app.tabs.rehearse.view import details_section
from app.workspace.fixed_drive import FixedDrive
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, PlanError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.driver import Driver
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.rigid.presets import PRESETS
from vfix_engine.worlds.rigid.spec import RigidSpec

FREEHAND, TELEOPERATED = Control("freehand"), Control("teleoperated", "rate")
OTHER = Client("tab-two-0", "holds")


class Placed(Robot):
    """A control process that keeps what it is told, and shows a snapshot."""

    def __init__(self, snapshot: Any = None) -> None:
        super().__init__()
        self.controls: list[Control] = []
        self.shown, self.hand_lost = snapshot, False

    def control(self, control: Control) -> None:
        self.controls.append(control)

    def snapshot(self) -> Any:
        return self.shown


@pytest.fixture
def tab(phantom_services: Services) -> Iterator[RehearseTab]:
    """The active step with a copy of the sample open, whose drives are not started but counted."""
    plan = phantom_services.plans.documents.duplicate(SAMPLE)
    workspace = workspace_of(phantom_services)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: phantom_services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active = True
    yield tab
    phantom_services.plans.documents.delete(plan.id)


@pytest.fixture
def opened(tab: RehearseTab, monkeypatch: pytest.MonkeyPatch) -> list[Control]:
    """With which control a drive was opened."""
    found: list[Control] = []
    monkeypatch.setattr(tab, "open", lambda drive, *_: found.append(drive.control))
    return found


def _say(tab: RehearseTab, mode: Any, device: Any = "position", preset: Any = None) -> Any:
    tab.handle(c.ChooseControl(type="rehearsal.control", mode=mode, device=device, preset=preset))
    return sections_of(tab)["rehearsal"]["control"]


def _plan(tab: RehearseTab) -> Plan:
    return tab.need_plan()


def test_a_mode_is_chosen_before_the_drive_and_changed_at_once_in_it(tab: RehearseTab, opened: list[Control]) -> None:
    assert _say(tab, "hands-on") == {"mode": "hands-on", "device": "position", "preset": None, "certified": True}
    robot, drive = Placed(), tab.need_drive()
    put_in_place(drive, robot, _plan(tab))
    drive.lease.take(CLIENT)
    assert _say(tab, "teleoperated", "rate")["device"] == "rate"
    assert (robot.controls, opened) == ([TELEOPERATED], [])
    assert drive.is_for(tab.made_of()), "the robot that stands is the one that is wanted"
    drive.lease.let_go(CLIENT)
    drive.lease.take(OTHER)
    with pytest.raises(ControlError, match="only the window that holds the handle"):
        _say(tab, "hands-on")


def test_to_and_from_freehand_the_drive_ends_and_another_one_stands_at_the_entry(
    tab: RehearseTab, opened: list[Control]
) -> None:
    """HAZ-41: and a preset's robot is another one, too."""
    drive = tab.need_drive()
    assert _say(tab, "freehand")["certified"] is False
    assert opened == [], "nothing stood there"
    put_in_place(drive, Placed(), _plan(tab))
    drive.lease.take(CLIENT)
    _say(tab, "hands-on")
    _say(tab, "hands-on", preset="li2007")
    _say(tab, "freehand", preset="li2007")
    assert [control.mode for control in opened] == ["hands-on", "hands-on", "freehand"]
    assert not drive.is_for(tab.made_of())


def test_a_trial_of_a_study_fixes_mode_parameters_settings_and_limits(tab: RehearseTab, opened: list[Control]) -> None:
    plan = _plan(tab)
    tab.workspace.fixed = FixedDrive(plan.id, PlanDrive(TELEOPERATED, "li2007"))
    assert _say(tab, "teleoperated", "rate", "li2007")["mode"] == "teleoperated", "what is fixed can be chosen"
    put_in_place(tab.need_drive(), Placed(), plan)
    tab.need_drive().lease.take(CLIENT)
    others: list[tuple[str, str, str | None]] = [
        ("hands-on", "position", "li2007"), ("teleoperated", "position", "li2007"), ("teleoperated", "rate", None),
    ]  # fmt: skip
    for other in others:
        with pytest.raises(ControlError, match="a trial of the study fixes"):
            _say(tab, *other)
    assert (tab.need_drive().control, tab.need_drive().preset) == (TELEOPERATED, "li2007")
    with pytest.raises(ControlError, match="a trial of the study fixes"):
        tab.handle(c.SetDriveSettings(type="rehearsal.settings", values={"margin_mm": 2.0}))
    limits = {"soft_tissue": False, "remote_centre": False, "speed_limit": False}
    tab.handle(c.SetOptions(type="rehearsal.options", **limits))
    with pytest.raises(ControlError, match="a trial of the study fixes"):
        tab.handle(c.SetOptions(type="rehearsal.options", **limits | {"speed_limit": True}))
    assert {item["refusal"] for item in sections_of(tab)["options"]["items"]} >= {"The trial fixes it."}
    tab.workspace.fixed = FixedDrive("another plan", PlanDrive(TELEOPERATED, "li2007"))
    assert _say(tab, "hands-on")["mode"] == "hands-on", "other plans are free"


@pytest.mark.parametrize("state", ["ready", "silent"])
def test_a_mode_that_cannot_be_had_is_not_chosen(tab: RehearseTab, free: PreparedRehearsal, state: Any) -> None:
    """HAZ-41: the points of the path were deleted elsewhere; the tool in the free hand goes on, and is told as one."""
    drive, plan = tab.need_drive(), _plan(tab)
    for point in plan.content.points[1:]:
        tab.workspace.services.plans.do(plan.id, DeletePoint(point_id=point.id))
    system = free.spec.build()
    put_in_place(drive, Placed(replace(system.snapshot(system.start()), running=True)), plan)  # type: ignore[arg-type]
    drive._prepared, drive._state = free, state
    drive.choose(FREEHAND, None)
    drive.lease.take(CLIENT)
    with pytest.raises(PlanError, match="two points"):
        _say(tab, "hands-on")
    assert (drive.control, drive.state) == (FREEHAND, state)
    assert sections_of(tab)["rehearsal"]["control"] == {
        "mode": "freehand",
        "device": "position",
        "preset": None,
        "certified": False,
    }


class Later:
    """Does what it was given when the test says so."""

    def __init__(self) -> None:
        self.work: list[Any] = []

    def submit(self, function: Any, *arguments: Any) -> None:
        self.work.append(lambda: function(*arguments))


@pytest.mark.parametrize(
    ("chosen", "told"), [("teleoperated", [TELEOPERATED]), ("hands-on", [Control(device="rate")]), (None, [])]
)
def test_a_mode_chosen_while_the_robot_comes_is_the_one_that_is_driven(
    tab: RehearseTab, monkeypatch: pytest.MonkeyPatch, chosen: Any, told: list[Control]
) -> None:
    robot, later, drive = Placed(), Later(), tab.need_drive()
    monkeypatch.setattr(drive_process, "_process", lambda prepared: robot)
    settings: Any = ControlSettings()
    begun: Any = PreparedDrive(spec=settings, settings=settings, control=drive.control)
    drive.lease.take(CLIENT)
    drive.open(tab.made_of(), lambda tell: begun, later)  # type: ignore[arg-type]
    if chosen:
        assert _say(tab, chosen, "rate")["mode"] == chosen
    (start,) = later.work
    start()
    assert (drive.state, robot.controls) == ("ready", told)


@pytest.fixture(scope="module")
def free(phantom_services: Services) -> PreparedRehearsal:
    return prepare(phantom_services, phantom_services.plans.get(SAMPLE), control=FREEHAND)


def test_a_free_hand_has_no_robot_and_keeps_no_margin(
    tab: RehearseTab, free: PreparedRehearsal, opened: list[Control], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert isinstance(free.spec, FreehandSpec)
    assert (free.robot, free.preset, free.control, free.settings.dt_s) == (None, None, FREEHAND, 0.02)
    system = free.spec.build()
    driver = Driver(system)
    snapshot = replace(system.snapshot(driver.state), running=True)
    drive = tab.need_drive()
    put_in_place(drive, Placed(snapshot), _plan(tab))
    drive._prepared = free
    drive.choose(FREEHAND, None)
    drive.lease.take(CLIENT)
    tab.tick()
    sections = sections_of(tab)
    shown = sections["rehearsal"]
    assert (shown["state"], shown["control"]["certified"], shown["contacts"]) == ("running", False, [])
    assert (shown["margin_mm"], shown["holding"]) == (None, "Nothing touched; nothing holds the tool")
    assert "margin_mm" not in [field["name"] for field in sections["settings"]["fields"]]
    assert details_section(snapshot)["steps"] == 0
    assert sections["nearness"][0]["margin_mm"] == 0.0
    assert "Shift to turn" in tab.hint()
    assert sections["approach"]["refusal"] == "Nothing leads a free hand; choose Hands-on or Teleoperated."
    with pytest.raises(ControlError, match="Nothing leads a free hand"):
        tab.handle(c.SetApproach(type="rehearsal.approach", at_mm=3.0))

    from vfix_engine.runtime import Command

    into = -system.scene.tree.closest(driver.state.segments).normal
    for _ in range(400):
        state = driver.step(Command(into * free.settings.force_cap_n))
    drive._process = Placed(replace(system.snapshot(state), running=True))  # type: ignore[assignment]
    tab.tick()
    shown = sections_of(tab)["rehearsal"]
    (contact, *_) = shown["contacts"]
    assert contact["structure"] == "bone"
    assert contact["depth_mm"] > 0.1
    assert shown["holding"].startswith("Touches: the ")


def test_distances_to_structures_are_measured_in_sight_alone_and_not_of_every_snapshot(
    tab: RehearseTab, free: PreparedRehearsal, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, measured = free.spec.build(), list[float]()
    still: Any = system.snapshot(system.start())  # type: ignore[arg-type]

    def measure(snapshot: Any, *_: object) -> list[Any]:
        measured.extend([] if snapshot is None else [snapshot.t])
        return []

    monkeypatch.setattr(tab_module, "nearness_section", measure)
    robot, drive = Placed(), tab.need_drive()
    put_in_place(drive, robot, _plan(tab))

    def show(*times: float, running: bool = True) -> list[float]:
        measured.clear()
        for t in times:
            robot.shown = replace(still, t=t, running=running)
            tab.tick()
            sections_of(tab)
        return list(dict.fromkeys(measured))

    assert show(*(0.02 * n for n in range(10))) == pytest.approx([0.0, 0.08, 0.16])
    assert show(0.19, running=False) == [0.19], "where it stands is told at once"
    assert show(0.0) == [0.0], "after a reset too"
    tab.active = False
    assert show(1.0, 2.0) == []


def test_the_nodes_of_a_drive_without_a_robot_are_the_tool_and_the_hand(free: PreparedRehearsal) -> None:
    class Node:
        def __getattr__(self, name: str) -> Any:
            return self

        def __call__(self, *_: Any, **__: Any) -> Any:
            return self

        def __enter__(self) -> Any:
            return self

        def __exit__(self, *_: object) -> None:
            pass

    view: Any = Node()
    snapshot: Any = free.spec.build().snapshot(free.spec.build().start())  # type: ignore[arg-type]
    nodes = DriveNodes(view, ())
    nodes.show(
        None, (snapshot.segments_start, snapshot.segments_end, snapshot.radius), snapshot.grip, np.zeros(3), True
    )
    nodes.remove()


def test_a_preset_drives_with_the_papers_program(phantom_services: Services) -> None:
    prepared = prepare(phantom_services, phantom_services.plans.get(SAMPLE), control=TELEOPERATED, preset="li2004")
    assert isinstance(prepared.spec, RigidSpec)
    assert prepared.spec.scene.printed == PRESETS["li2004"].weights
    assert (prepared.settings.dt_s, prepared.preset, prepared.control) == (1.0 / 30.0, "li2004", TELEOPERATED)
    assert prepared.spec.build().start().phase in ("follow", "approach")
