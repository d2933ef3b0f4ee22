"""The walks that docs/architecture.md shows, walked: a click, a drag of the grip, a control step, a snake's tick."""

from __future__ import annotations

import asyncio
import multiprocessing
import re
import time
from collections.abc import Iterator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from session_doubles import HEAD, SAMPLE, Later, Now, put_in_place
from walks import ROOT, Function, functions_passed

from app.plans.service import Plan
from app.services import Services
from app.session.client_session import ClientSession, make_shared
from app.tabs.plan.commands import EditCommand
from app.tabs.plan.tab import PlanTab
from app.tabs.rehearse.drive_nodes import DriveNodes
from app.tabs.rehearse.preparation import prepare
from app.tabs.rehearse.tab import RehearseTab
from vfix_engine.control import HandCommand
from vfix_engine.control.tasks import FollowPath
from vfix_engine.pathway.tissue_motion import breathing
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime.background import InlineWorker
from vfix_engine.runtime.command import no_command
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.loop import ControlLoop
from vfix_engine.runtime.mailbox import Mailbox
from vfix_engine.runtime.outbox import Outbox
from vfix_engine.runtime.priority import RealTimePriority
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.snake import LumenContours, SnakeSystemSpec

TOLERANCE = 0.15  # of the documented numbers


class Browser:
    """Stands for all that viser hands out: any call and attribute, and a camera that looks at a place."""

    def __init__(self) -> None:
        self.camera = SimpleNamespace(
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=(0.0, 0.0, 0.0),
            look_at=(0.0, 0.0, 1.0),
            fov=0.5,
            image_width=800,
            image_height=600,
            _state=SimpleNamespace(update_timestamp=1.0),
            on_update=lambda listener: listener,
        )

    def look_at(self, place: tuple[float, float, float]) -> None:
        """From 300 mm below, along +z: the camera's own axis without a turn."""
        self.camera.look_at, self.camera.position = place, (place[0], place[1], place[2] - 300.0)

    def __getattr__(self, name: str) -> Any:
        return Browser()

    def __call__(self, *values: Any, **options: Any) -> Any:
        return Browser()

    def __len__(self) -> int:
        return 0

    def __bool__(self) -> bool:
        return True

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *error: object) -> None:
        pass


class HeardProcess(ControlProcess[RigidSnapshot]):
    """A control process whose loop this test runs itself."""

    alive = True  # type: ignore[assignment]


def documented(heading: str) -> tuple[list[Function], int, int]:
    """The functions that a walk names, in its order, and its totals of functions and files."""
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    body = re.split(r"^##+ ", text.split(f" {heading}\n", 1)[1], maxsplit=1, flags=re.MULTILINE)[0]
    named: list[Function] = []
    for file, names in re.findall(r"\]\(\.\./((?:app|vfix_engine)/[\w/]+\.py)\) ((?:`[\w.]+`(?:, )?)+)", body):
        named += [(file, name) for name in re.findall(r"`([\w.]+)`", names)]
    total = re.search(r"(\d+) functions in (\d+) files", body)
    assert total is not None, heading
    return named, int(total[1]), int(total[2])


def test_the_way_of_a_hand_in_the_lumen_names_functions_that_exist() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    body = text.split("## How a hand in the lumen reaches a joint\n", 1)[1].split("\n## ", 1)[0]
    named = re.findall(r"\]\(\.\./((?:app|vfix_engine)/[\w/-]+\.(?:py|js))\) ((?:`[\w.]+`(?:, )?)+)", body)
    assert len(named) > 15
    for file, names in named:
        source = (ROOT / file).read_text(encoding="utf-8")
        for part in re.findall(r"\w+", names):  # a class and its method are looked for each by itself
            assert re.search(rf"^ *(?:export )?(?:def |class |function )?{part}\b *[(:]", source, re.M), (file, part)


def check(heading: str, passed: list[Function]) -> None:
    """The documented walk is the one that was walked, and its totals are right."""
    named, functions, files = documented(heading)
    counted = f"{len(passed)} functions in {len({file for file, _ in passed})} files"
    assert [name for name in named if name not in passed] == [], counted
    order = [passed.index(name) for name in named]
    assert order == sorted(order), [named[i] for i in range(1, len(order)) if order[i] < order[i - 1]]
    assert len(passed) == pytest.approx(functions, rel=TOLERANCE), counted
    assert len({file for file, _ in passed}) == pytest.approx(files, rel=TOLERANCE), counted


@pytest.fixture
def plan(phantom_services: Services) -> Iterator[Plan]:
    """A copy of the sample."""
    copy = phantom_services.plans.documents.duplicate(SAMPLE)
    yield copy
    phantom_services.plans.documents.delete(copy.id)


@pytest.fixture
def client(phantom_services: Services, plan: Plan) -> Iterator[tuple[ClientSession, Browser]]:
    """A session whose requests this test answers itself, with the plan open and a scene."""
    shared, browser = make_shared(phantom_services), Browser()
    executor = Now()
    session = ClientSession("tab-one-0", phantom_services, shared, executor, lambda: "")
    session.greet("holds")
    session._open_first({"case": HEAD, "plan": plan.id})
    session._attach(browser)  # type: ignore[arg-type]
    answer(session)
    answer(session)  # what the first dry run has posted
    executor.submit = Later().submit  # type: ignore[method-assign]
    yield session, browser
    for tab in session.tabs.values():
        tab.close()
    for one in shared.values():
        if one is not None:
            one.close()


def answer(session: ClientSession) -> None:
    """What the session's thread does with all that waits: each request, and what is shown of it."""
    while session._inbox._queue.qsize():
        request = session._inbox.get()
        assert request is not None
        assert session._guarded(request)
        session._display.publish()


def test_a_click_goes_from_the_mesh_to_the_store(client: tuple[ClientSession, Browser], plan: Plan) -> None:
    session, browser = client
    tab = session.tabs["plan"]
    assert isinstance(tab, PlanTab)
    assert session._display.scene is not None
    view, centre = session._display.scene.view, SimpleNamespace(screen_pos=(0.5, 0.5))

    def click() -> None:
        asyncio.run(view._clicked(centre))  # type: ignore[arg-type]
        answer(session)

    def look_at(place: tuple[float, float, float]) -> None:
        browser.look_at(place)
        asyncio.run(view._camera_updated(browser.camera))
        answer(session)

    look_at(plan.content.points[2].position)
    click()  # the tree of the surface and the tool are loaded
    session.command(EditCommand(type="ghost.cancel"))
    answer(session)
    first = functions_passed(click)
    ghost = tab._need().ghost
    assert ghost is not None
    look_at(ghost.position)
    second = functions_passed(click)
    check("A click: from the mesh to the store and back to the picture", list(dict.fromkeys([*first, *second])))


def test_a_drag_of_the_grip_goes_to_the_joints_and_back(
    client: tuple[ClientSession, Browser], phantom_services: Services, plan: Plan
) -> None:
    session, _ = client
    tab = session.tabs["rehearse"]
    assert isinstance(tab, RehearseTab)
    drive = tab.drive
    assert drive is not None
    prepared = prepare(phantom_services, plan)
    process = HeardProcess(prepared.spec)
    system = prepared.spec.build()
    system.prepare()
    put_in_place(drive, process, plan, system.controller.robot)
    out, into = Mailbox.attach(process._out.name), Mailbox.attach(process._in.name)
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(theirs)
    loop = ControlLoop(Driver(system), out, into, theirs, outbox, RealTimePriority(False))
    loop._running = True
    try:
        session._set_tab("rehearse")
        assert drive.lease.take(session.workspace.client)
        session._tick()
        assert session._display.scene is not None
        nodes = session._display.scene._drawn["rehearse.drive"][1]
        assert isinstance(nodes, DriveNodes)
        before = tab.now.snapshot
        assert before is not None

        path = system.scene.path
        assert path is not None
        along = path.tangent(0.0)

        def drag(phase: str, place: np.ndarray) -> None:
            event = SimpleNamespace(phase=phase, end_position=place, modifier=None)
            asyncio.run(nodes.hand._dragged(event))  # type: ignore[arg-type]

        def walk() -> None:
            now = time.monotonic()
            drag("update", before.grip + 5.0 * along)
            loop._read_hand(now)
            for i in range(1, 61):  # the hand's force rises within 60 ms
                loop._tick(now + 1e-3 * i, driven=True)
            loop._publish(force=True)
            session._display._drawn_at = 0.0
            session._tick()

        drag("start", before.grip)
        passed = functions_passed(walk)
        assert tab.now.snapshot is not None
        assert not np.allclose(tab.now.snapshot.q, before.q)
        check("A drag: from the grip to a joint and back to the picture", passed)
    finally:
        outbox.end()
        outbox.join()
        out.close()
        into.close()
        ours.close()
        theirs.close()
        process.close()


def test_a_control_step_goes_from_its_task_to_the_verdict(phantom_services: Services, plan: Plan) -> None:
    prepared = prepare(phantom_services, plan)
    system = prepared.spec.build()
    state, path = system.start(), system.scene.path
    assert path is not None
    assert state.nearest is not None
    task, hand = FollowPath(path), HandCommand(2.0 * state.nearest.tangent)
    report = system.controller.step(state.tool, task, hand)  # kernels are loaded, triangles gathered
    passed = functions_passed(lambda: system.controller.step(report.state, task, hand))
    check("A control step: from the task to the verdict", passed)


def test_a_tick_of_the_snake_goes_from_the_axes_to_the_forces() -> None:
    """In moving tissue, by plans that were adopted before."""
    centre = np.column_stack([np.zeros((31, 2)), np.linspace(0.0, 300.0, 31)])
    lumen, breath = LumenContours(centre, np.full((31, 1), 13.0), 61), breathing((0.0, 1.0, 0.0), 6.0, 4.0)
    spec = SnakeSystemSpec(lumen, SnakeModel(6), tissue=breath, tip_s=150.0)
    system, command = spec.build(), replace(no_command(), axes=(0.0, 0.0, 1.0))
    driver = Driver(system, InlineWorker(system.planner, 20))
    for _ in range(150):
        driver.step(command)
    before = driver.state.tip_s
    passed = functions_passed(lambda: driver.step(command))
    assert driver.state.tip_s > before
    check("A tick of the snake: from the axes to the forces", passed)
