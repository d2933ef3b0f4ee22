"""The Rehearse tab never drives by a registration that is not the plan's any more."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest
from edited_registrations import Edited
from registration_contents import content_of
from session_doubles import CLIENT, HEAD, SAMPLE, Heard, Robot, put_in_place, workspace_of

from app.drives.shared_drives import SharedDrives
from app.plans.operations.instruments import UseRegistration
from app.plans.service import Plan
from app.registration.operations import ChangePair
from app.services import Services
from app.tabs.rehearse import commands as c
from app.tabs.rehearse.tab import RehearseTab
from vfix_engine.errors import PlanError


class RobotOnItsWay(Robot):
    """Has made some steps, and runs until it is paused."""

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.now: Any = SimpleNamespace(
            steps=steps, running=False, mode="path", phase="follow", clearance_mm=2.0, threshold_mm=5.0, reason="",
            held=False, force=(0.0, 0.0, 0.0), certified=True,
        )  # fmt: skip

    def snapshot(self) -> Any:
        return self.now

    def run(self) -> None:
        self.told.append("run")
        self.now = SimpleNamespace(**vars(self.now) | {"running": True})

    def pause(self) -> None:
        self.told.append("pause")
        self.now = SimpleNamespace(**vars(self.now) | {"running": False})


@dataclass
class Driven:
    """The step at the drive of a plan, and the registration that the plan goes by."""

    services: Services
    tab: RehearseTab
    plan: Plan
    registration: str
    heard: Heard

    def put(self, steps: int) -> RobotOnItsWay:
        """Put a robot in place by the registration as it is now; it has made so many steps."""
        robot, drive = RobotOnItsWay(steps), self.tab.drive
        assert drive is not None
        put_in_place(drive, robot, self.plan)
        drive._made_of = self.tab._key(self.plan)
        drive.lease.take(CLIENT)
        return robot

    def start(self) -> None:
        self.tab.handle(c.DriveCommand(type="rehearsal.start"))

    def withdraw(self, how: str) -> None:
        """Spoil the registration in a way; the session hears of it as of every change of the store."""
        services, editor = self.services, Edited(self.services, self.registration)
        if how == "deleted":
            services.registrations.delete(self.registration)
        elif how == "misfit":
            pair = editor.document.content.pairs[0]
            assert pair.measured is not None
            x, y, z = pair.measured
            editor.do(ChangePair(pair_id=pair.id, measured=(x + 80.0, y, z)))
        elif how == "changed":
            editor.do(ChangePair(pair_id=editor.document.content.pairs[0].id, enabled=False))
        else:
            services.plans.do(self.plan.id, UseRegistration(registration=None))


@pytest.fixture
def driven(phantom_services: Services) -> Iterator[Driven]:
    services, heard = phantom_services, Heard()
    registration = services.registrations.create(HEAD, "OR", content_of(sigma=0.05)).id
    plan = services.plans.documents.duplicate(SAMPLE)
    plan = services.plans.do(plan.id, UseRegistration(registration=registration))
    workspace = workspace_of(services, heard)
    tab = RehearseTab(workspace, SharedDrives())
    workspace.plan.provide(lambda: services.plans.get(plan.id))
    workspace.plan.opened()
    tab.active = True
    yield Driven(services, tab, plan, registration, heard)
    services.plans.documents.delete(plan.id)


WAYS = {
    "deleted": "was deleted",
    "misfit": "does not fit. Nothing is driven by it",
    "changed": "another registration than the robot was placed by",
    "taken off": "another registration than the robot was placed by",
}


@pytest.mark.parametrize(("how", "words"), WAYS.items())
def test_a_robot_on_its_way_pauses_and_does_not_go_on(driven: Driven, how: str, words: str) -> None:
    robot = driven.put(steps=100)
    driven.start()
    assert driven.tab.tick() is False
    assert (robot.told, driven.heard.words) == (["run"], [])
    driven.withdraw(how)
    driven.tab.tick()
    driven.tab.tick()
    assert robot.told == ["run", "pause"]
    assert [words in said for said in driven.heard.words] == [True], "it is said once"
    with pytest.raises(PlanError, match=words):
        driven.start()
    assert words in driven.tab.hint()
    assert robot.told == ["run", "pause"]


@pytest.mark.parametrize("how", ["deleted", "misfit"])
def test_a_start_at_the_entry_by_a_registration_that_cannot_be_used_is_refused(driven: Driven, how: str) -> None:
    robot = driven.put(steps=0)
    driven.withdraw(how)
    with pytest.raises(PlanError, match=WAYS[how]):
        driven.start()
    assert (robot.told, robot.alive) == ([], True)


@pytest.mark.parametrize("how", ["changed", "taken off"])
def test_a_start_at_the_entry_places_the_robot_by_the_registration_as_it_is_now(driven: Driven, how: str) -> None:
    robot = driven.put(steps=0)
    driven.withdraw(how)
    driven.start()
    assert (robot.told, robot.alive) == ([], False)
    assert driven.tab.read().shown_state == "starting"


def test_a_start_that_waited_for_the_robot_is_not_made_by_a_withdrawn_registration(driven: Driven) -> None:
    driven.tab.enter()
    driven.start()
    robot = driven.put(steps=0)
    driven.withdraw("deleted")
    driven.tab.tick()
    assert robot.told == []
    assert [WAYS["deleted"] in said for said in driven.heard.words] == [True]


def test_a_registration_that_is_back_is_driven_by_again(driven: Driven) -> None:
    robot = driven.put(steps=100)
    driven.withdraw("deleted")
    driven.services.registrations.restore(driven.registration)
    driven.start()
    assert robot.told == ["run"]
