"""Tabs come with the kind of the open case, and commands of a drive go to the tab that drives."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from session_doubles import HEAD, Now

from app.cases.service import CaseFrame
from app.drives.commands import HoldCommand
from app.services import Services
from app.session.client_session import ClientSession, make_shared
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh

ALL = ["patient", "plan", "register", "rehearse", "review"]


@pytest.fixture
def lumen(phantom_services: Services) -> Iterator[str]:
    """A case in which a snake would be driven."""
    mesh = TriangleMesh(np.eye(3), np.array([[0, 1, 2]]))
    frame = CaseFrame("LPS", assumed=False)
    case = phantom_services.cases.create("Tube", frame=frame, surfaces={"lumen": mesh}, kind="lumen")
    yield case.id
    phantom_services.cases.delete(case.id)


@pytest.fixture
def session(phantom_services: Services) -> Iterator[ClientSession]:
    shared = make_shared(phantom_services)
    made = ClientSession("tab-one-0", phantom_services, shared, Now(), lambda: "")
    made.greet("holds")
    yield made
    for tab in made.tabs.values():
        tab.close()
    for one in shared.values():
        if one is not None:
            one.close()


def test_a_case_offers_the_tabs_of_its_kind(session: ClientSession, lumen: str) -> None:
    """What is a head's is not shown beside a lumen, no plan is made in it, and the client does not stay there."""
    session._open_first({"case": HEAD, "step": "rehearse"})
    assert (session._display.tab_section().get("offered"), session.active.spec.name) == (ALL, "rehearse")
    session.workspace.open_case(lumen)
    section = session._display.tab_section()
    assert (section["name"], section["available"]) == ("patient", ["patient", "route", "drive", "review"])
    assert section["offered"] == section["available"]
    assert session.workspace.plan.current is None
    assert session.workspace.services.plans.titles(lumen) == ()
    with pytest.raises(InputError, match="‘Plan’ is not for this kind of case"):
        session._set_tab("plan")
    session.workspace.open_case(HEAD)
    assert session._display.tab_section().get("offered") == ALL


def test_a_client_that_was_in_a_tab_of_another_kind_begins_elsewhere(session: ClientSession, lumen: str) -> None:
    session._open_first({"case": lumen, "step": "rehearse"})
    assert session.active.spec.name == "patient"


def test_the_active_tab_keeps_what_is_its_while_another_one_ticks(session: ClientSession, lumen: str) -> None:
    """Drive, which ticks, has an endoscope of its own, and none to show while the client is in Review."""
    session._open_first({"case": lumen, "step": "review"})
    display = session._display
    display.publish()
    assert display.model.read("scope")["look"] == "colon"
    display.publish_ticking(session.workspace.services.jobs.going_on())
    assert display.model.read("scope")["look"] == "colon"
    session._set_tab("route")
    display.publish()
    assert display.model.read("scope") is None


def test_a_command_of_several_tabs_is_answered_by_the_active_one(session: ClientSession) -> None:
    heard: list[str] = []
    driving: list[Any] = [session.tabs[name] for name in ("rehearse", "register")]
    session._tabs_of[HoldCommand] = driving
    for tab in driving:
        tab.handle_now = lambda command, tab=tab: heard.append(tab.spec.name)
    for name in ("plan", "register", "rehearse"):
        session.active = session.tabs[name]
        session.command(HoldCommand(type="heartbeat"))
    assert heard == ["rehearse", "register", "rehearse"]
