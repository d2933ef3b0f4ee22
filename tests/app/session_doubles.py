"""Stands for what a session and its steps need: executors that wait or do not, and the views of one client."""

from __future__ import annotations

import json
from collections.abc import Callable
from concurrent.futures import Executor, Future
from types import SimpleNamespace
from typing import Any

import numpy as np

from app.cases.service import Case, CaseFrame
from app.drives.settings_exchange import SettingsExchange
from app.messages.client import Client
from app.operations.messages import OperationMessage
from app.plans.service import Plan
from app.services import Services
from app.session.client_session import ClientSession
from app.session.commands import parse_command
from app.tabs.base import Tab
from app.tabs.plan.tab import PlanTab
from app.tabs.rehearse.drive_session import RehearsalDrive
from app.tabs.rehearse.preparation import PreparedRehearsal, plan_key
from app.tabs.rehearse.tab import RehearseTab
from app.workspace.plan_items import plan_items
from app.workspace.workspace import Workspace
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.control import ControlSettings
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh

SAMPLE = "head-phantom-sample"
HEAD = "head-phantom"
CLIENT = Client("tab-one-0", "holds")


def send(tab: Tab, kind: str, **fields: Any) -> Any:
    """A message of a client, which a tab answers."""
    command = parse_command(json.dumps({"type": kind, **fields}))
    return tab.operate(command) if isinstance(command, OperationMessage) else tab.handle(command)


class Later(Executor):
    """Keeps the work until it is asked for."""

    def __init__(self) -> None:
        self.work: list[Callable[[], Any]] = []

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.work.append(lambda: fn(*args, **kwargs))
        return Future()


class Now(Executor):
    """Does the work at once."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        fn(*args, **kwargs)
        return Future()


class Heard:
    """Notes to the user: their words, errors or not."""

    def __init__(self) -> None:
        self.words: list[str] = []

    def __call__(self, words: str, error: bool) -> None:
        self.words.append(words)


def workspace_of(services: Services, heard: Heard | None = None) -> Workspace:
    """What the steps of one client share; requests are answered at once, work in the background waits."""
    return Workspace(CLIENT, services, Later(), lambda request: request(), heard or Heard())


def open_sample(services: Services, plan_id: str = SAMPLE, heard: Heard | None = None) -> PlanTab:
    """The Plan tab with a plan of the embedded head open."""
    workspace = workspace_of(services, heard)
    tab = PlanTab(workspace)
    workspace.open_first(HEAD, plan_id)
    tab.active = True
    return tab


def sections_of(tab: Tab) -> dict[str, Any]:
    """The sections of a tab as they are now."""
    tab.workspace.case.refresh()
    tab.refresh()
    return {name: section.build() for name, section in tab.sections().items()}


def other_case(services: Services) -> Case:
    corners = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0]])
    mesh = TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))
    return services.cases.create("Other", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": mesh})


def fail(error: Exception) -> Any:
    raise error


class Robot:
    """Stands for the control process of a drive: ready at once, and notes what it is told."""

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
        return lambda *values, **named: self.told.append(name)


def put_in_place(drive: RehearsalDrive, robot: Any, plan: Plan, placed: Any = None) -> None:
    """Let a drive believe that this robot stands at the entry of a plan; placed: its model."""
    curve, settings = np.array([point.position for point in plan.content.points]), ControlSettings()
    spec: Any = SimpleNamespace(scene=SimpleNamespace(path_points=curve, fixtures=()))
    drive._prepared = PreparedRehearsal(
        spec=spec, settings=settings, robot=placed, items=tuple(plan_items(plan)), curve=curve
    )
    drive._process, drive._state, drive._made_of = robot, "ready", plan_key(plan)
    drive._exchange = SettingsExchange(settings)


def case_of_ct(services: Services, name: str, volume: Volume) -> Case:
    """A stored case with a CT and the surface of its bone."""
    surfaces = {"bone": extract_surface(volume)}
    return services.cases.create(name, frame=CaseFrame("LPS", False), surfaces=surfaces, volume=volume)


class Tabs:
    """Stands for the scene's server: scenes come and go as a test says."""

    def __init__(self) -> None:
        self.scenes: dict[str, Any] = {}
        self.come: Any = None
        self.gone: Any = None

    def client_for(self, tab: str) -> Any:
        return self.scenes.get(tab)

    def on_tab_connected(self, callback: Any) -> None:
        self.come = callback

    def on_tab_gone(self, callback: Any) -> None:
        self.gone = callback


def settle(session: ClientSession) -> None:
    """Wait until everything that was asked of a session is done."""
    done: Future[None] = Future()
    session.post(lambda: done.set_result(None))
    done.result(60)


def rehearse_tab(session: ClientSession) -> RehearseTab:
    tab = session.tabs["rehearse"]
    assert isinstance(tab, RehearseTab)
    return tab
