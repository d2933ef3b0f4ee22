"""What comes in from outside: numbers that are none, starts that cannot be, solvers that lie or have no answer."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from benchmarks.attack.rigid.bodies import Judges
from tests.engine.scenes import curved_tube, straight_scene, wall
from vfix_engine import Simulation
from vfix_engine.control import Controller, ControlSettings, StepRequest, qp
from vfix_engine.errors import ControlError, InputError, MeshError, PlanError, StartRefused
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Sphere
from vfix_engine.runtime.virtual_coupling import VirtualCoupling
from vfix_engine.virtual_fixtures import Constraint, Objective, Zone
from vfix_engine.worlds.rigid.rehearsal import Command, Rehearsal, RehearsalState
from vfix_engine.worlds.rigid.teleoperation import Master

NOT_FINITE = (np.nan, np.inf, -np.inf)
HUGE = (1e300, -1e300, 1.7e308, -1e18)
NONSENSE = (*NOT_FINITE, *HUGE)
SETTINGS = ControlSettings(dt_s=5e-3)


@pytest.fixture(scope="module")
def rehearsal() -> Rehearsal:
    return Rehearsal(straight_scene(wall(6.0, 30.0), np.array([[0.0, 0, 0], [0, 3, 0], [0, 5, 1]])), SETTINGS)


def spoilt(random: np.random.Generator, size: int = 3) -> np.ndarray:
    """Numbers of which at least one is nonsense."""
    values = np.where(random.random(size) < 0.4, random.choice(NONSENSE, size), 5.0 * random.normal(size=size))
    values[int(random.integers(size))] = random.choice(NONSENSE)
    return values


def sound(state: RehearsalState) -> bool:
    tool = state.tool
    parts = (tool.q, tool.velocity, tool.distance, tool.tip.position, tool.segments.start, tool.segments.end, state.lag)
    return all(np.isfinite(part).all() for part in parts)


def commands(random: np.random.Generator) -> Iterator[Command]:
    while True:
        yield Command(spoilt(random), int(random.integers(-1, 2)), int(random.integers(-1, 2)))
        yield Command(spoilt(random), master=Master(spoilt(random), bool(random.random() < 0.9)))


@pytest.mark.parametrize("where", [1.1e6, 1e31, 1e200, -1e300])
def test_coordinates_beyond_a_kilometre_are_refused_in_words(where: float) -> None:
    """HAZ-05, HAZ-09: squares of them overflow, and then a clearance is none."""
    mesh, points = curved_tube()
    vertices = mesh.vertices.copy()
    vertices[7, 1] = where
    with pytest.raises(MeshError, match=r"vertex number 7 of the surface lies at .* than 1e\+06 mm; check its unit"):
        TriangleMesh(vertices, mesh.faces)
    points = points.copy()
    points[2, 0] = where
    with pytest.raises(PlanError, match="point 3 of the path lies at"):
        SplinePath(points)
    with pytest.raises(InputError, match="target 2 lies at"):
        Simulation(mesh, path=points[:2], targets=[points[0], [0.0, where, 0.0]], base=np.eye(4))


def test_a_clearance_that_is_no_number_starts_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-04, HAZ-05."""
    scene = straight_scene(wall(6.0))
    control = Controller(scene.placed_robot(), scene.tool, scene.tree, ControlSettings())
    honest = control.measure(scene.q_start)
    unknown = replace(honest, distance=np.full_like(honest.distance, np.nan))
    assert np.isnan(unknown.clearance)
    monkeypatch.setattr(control.context, "measure", lambda q: unknown)
    with pytest.raises(StartRefused, match="nan mm from bone"):
        control.start(scene.q_start)


def test_nonsense_from_hand_and_master_never_reaches_the_state(rehearsal: Rehearsal) -> None:
    """HAZ-05: 8,000 spoilt commands in two modes; nothing moves by a force or increment that is no number."""
    random = np.random.default_rng(1)
    stream = commands(random)
    for mode in ("free", "path"):
        state = rehearsal.start(mode)
        for _ in range(4_000):
            command = next(stream)
            after, snapshot = rehearsal.step(state, command)
            assert sound(after)
            assert np.isfinite(snapshot.force).all()
            assert np.linalg.norm(snapshot.force) <= SETTINGS.force_cap_n * (1 + 1e-12)
            assert after.tool.clearance >= SETTINGS.margin_mm
            hand = command.force if command.master is None else command.master.increment
            if not (np.isfinite(hand).all() or command.drive or command.twist or state.tool.velocity.any()):
                lead = command.master is not None and state.lag.any()
                assert lead or np.array_equal(after.tool.q, state.tool.q)
            state = after


@pytest.mark.parametrize("mode", ["path", "inspect", "free"])
def test_keys_beyond_full_force_count_as_full_force(mode: str) -> None:
    """HAZ-05: a drive or twist from -1 to +1; what is not finite counts as none, like a force."""
    scene = straight_scene(wall(6.0, 30.0), np.array([[0.0, 0, 0], [0, 3, 0], [0, 5, 1]]))
    rehearsal = Rehearsal(replace(scene, targets=np.array([[0.0, 20.0, 0.0]]), target_names=("t",)), SETTINGS)
    start, push = rehearsal.start(mode), np.array([0.5, 0.0, 0.0])

    def goes(**keys: float) -> RehearsalState:
        state = start
        for _ in range(3):
            state, snapshot = rehearsal.step(state, Command(push, **keys))
            assert np.isfinite(snapshot.torque).all()
        return state

    for key in ("drive", "twist"):
        for given, taken in [(7.0, 1.0), (-1e300, -1.0), *((value, 0.0) for value in NOT_FINITE), (0.25, 0.25)]:
            assert np.array_equal(goes(**{key: given}).q, goes(**{key: taken}).q), (key, given)


def test_a_step_takes_numbers_only(rehearsal: Rehearsal) -> None:
    """Whatever is given as a force or a key, the error is one of ours, and the state stays."""
    simulation = Simulation(wall(6.0, 30.0), path=np.array([[0.0, 0, 0], [0, 3, 0]]), base=np.eye(4))
    before = simulation.q.copy()
    wrong: list[Any] = ["abc", "1", ["1", "2", "3"], None, [10**400, 0, 0], [-(10**5000), 0, 0], [{}, 0, 0], [1j, 0, 0]]
    for force in wrong:
        with pytest.raises(InputError, match="force"):
            simulation.step(force)
        with pytest.raises(InputError, match="force"):
            rehearsal.step(rehearsal.start(), Command(force))
        with pytest.raises(InputError, match="master"):
            simulation.step(master=force) if force is not None else simulation.step(master=[None] * 3)
    keys: list[Any] = ["abc", 10**5000, None, [1], np.zeros(3)]
    for key in keys:
        with pytest.raises(ControlError, match="drive"):
            simulation.step(drive=key)
        if not isinstance(key, int):
            with pytest.raises(InputError, match="drive"):
                rehearsal.step(rehearsal.start(), Command(np.zeros(3), drive=key))
    assert np.array_equal(simulation.q, before)


def test_nonsense_from_the_page_never_becomes_a_force() -> None:
    """HAZ-05: 55,000 grips."""
    random = np.random.default_rng(2)
    handle, now = VirtualCoupling(), 0.0
    for _ in range(55_000):
        now += 0.01
        grip = spoilt(random) if random.random() < 0.7 else random.normal(size=3)
        handle.move(grip, now, onwards=bool(random.random() < 0.5))
        force = handle.force(np.zeros(3), 0.25, 5.0, now)
        assert np.isfinite(force).all()
        assert force @ force <= 25.0 * (1 + 1e-12)


@pytest.mark.parametrize("name", list(ControlSettings.bounds()))
def test_nonsense_never_becomes_a_setting(name: str) -> None:
    """HAZ-05: 20,000 over all fields; a slider's value is clamped, everything else refused."""
    random = np.random.default_rng(3)
    bound, count = ControlSettings.bounds()[name], 20_000 // len(ControlSettings.bounds()) + 1
    for _ in range(count):
        value: Any = random.choice(NONSENSE)
        with pytest.raises(InputError):
            ControlSettings(**{name: value})
        if np.isfinite(value):
            assert bound.low <= getattr(SETTINGS.clamped(**{name: value}), name) <= bound.high
        else:
            with pytest.raises(InputError):
                SETTINGS.clamped(**{name: value})


def test_nonsense_never_becomes_a_start(rehearsal: Rehearsal) -> None:
    """HAZ-05: 15,000 starts that are no place."""
    random = np.random.default_rng(4)
    for _ in range(15_000):
        with pytest.raises(StartRefused):
            rehearsal.controller.start(spoilt(random, 7))


def shapes(random: np.random.Generator) -> list[Callable[[], object]]:
    bad, good = spoilt(random), random.normal(size=3)
    pose = np.eye(4)
    pose[int(random.integers(4)), int(random.integers(4))] = random.choice(NONSENSE)
    return [
        lambda: Sphere(bad, 1.0),
        lambda: Sphere(good, float(bad[np.argmax(np.abs(np.nan_to_num(bad, nan=1e300)))])),
        lambda: CapsuleShape(bad, good, 1.0),
        lambda: CapsuleShape(good, bad, 1.0),
        lambda: Box(pose, np.ones(3)),
        lambda: Box(np.eye(4), bad),
        lambda: HalfSpace(bad, good),
        lambda: HalfSpace(good, bad),
        lambda: Zone("z", Sphere(good, 1.0), random.choice(NONSENSE)),
    ]


def test_nonsense_never_becomes_a_zone() -> None:
    """HAZ-05: 9,000 spoilt zones of every kind."""
    random = np.random.default_rng(5)
    for _ in range(1_000):
        for make in shapes(random):
            with pytest.raises(InputError):
                make()


def test_starts_are_taken_exactly_where_they_are_safe(rehearsal: Rehearsal) -> None:
    """HAZ-04: 1,500 starts in and out of the ranges and the margin, judged by brute force."""
    random = np.random.default_rng(6)
    robot, judges = rehearsal.scene.robot, Judges(rehearsal.scene, None)
    taken, words = 0, {"outside": 0, "from bone": 0}
    for _ in range(1_500):
        q = np.where(robot.revolute, 0.3, 6.0) * random.normal(size=7)
        q[1] = random.uniform(-2.0, 7.0)
        if random.random() < 0.3:
            q[int(random.integers(7))] = 1.01 * random.choice((-1, 1)) * 121.0
        cap = np.array([SETTINGS.margin_mm + 1.0])
        clear = judges.clearance(judges.screws.places(q), cap).min() >= SETTINGS.margin_mm
        within = bool(((q >= robot.lower) & (q <= robot.upper)).all())
        if clear and within:
            np.testing.assert_array_equal(rehearsal.controller.start(q).q, q)
            taken += 1
            continue
        reason = "from bone" if within else "outside"
        words[reason] += 1
        with pytest.raises(StartRefused, match=reason):
            rehearsal.controller.start(q)
    assert taken > 100
    assert min(words.values()) > 100


def contrary(random: np.random.Generator) -> StepRequest:
    """A task whose first two rows exclude each other and say nothing about progress."""
    scale = 10.0 ** random.uniform(-4, -1)
    rows = random.normal(size=(3, 8))
    rows[0, 7] = 0.0
    rows[1] = -rows[0]
    bound = scale * np.array([-1.0, -random.uniform(0.1, 1.0), random.normal()])
    objective = Objective(random.normal(size=(3, 8)), scale * random.normal(size=3))
    return StepRequest((objective,), (Constraint("target", rows, bound, np.arange(3)),), scale, np.ones(7))


def test_a_program_without_solution_is_a_held_tool_with_a_reason(rehearsal: Rehearsal) -> None:
    """HAZ-03: 10,000 infeasible programs, no exception, no motion that rows forbid, always a reason."""
    random = np.random.default_rng(7)
    controller: Controller = rehearsal.controller
    state = rehearsal.start("free").tool
    outcomes: Counter[str] = Counter()
    blamed = 0
    for _ in range(10_000):
        task = contrary(random)
        report = controller.step(state, task)
        moved = report.state.q - state.q
        # The rows were widened to what holding needs: along them, nothing moves.
        assert np.abs(task.constraints[0].matrix[0, :7] @ moved) <= 1e-9 * task.scale
        assert report.state.clearance >= SETTINGS.margin_mm
        assert not report.held or report.blockers
        outcomes[report.outcome] += 1
        blamed += any(blocker.kind == "target" for blocker in report.blockers)
        state = report.state if report.state.clearance > 1.0 else rehearsal.start("free").tool
    assert outcomes["held"] > 5_000
    assert set(outcomes) <= {"held", "moved", "shrunk"}
    assert blamed > 5_000, "the rows that exclude each other are what most steps are stopped by"


class Liar:
    """daqp's seat, taken by something that calls any finite or infinite nonsense optimal."""

    def __init__(self, random: np.random.Generator):
        self.random, self.asked = random, 0

    def solve(self, hessian: np.ndarray, gradient: np.ndarray, rows: np.ndarray, *_: Any) -> Any:
        self.asked += 1
        size = len(gradient)
        x = 10.0 ** self.random.uniform(-3, 3) * self.random.normal(size=size)
        if self.random.random() < 0.3:
            x[int(self.random.integers(size))] = self.random.choice(NONSENSE)
        return x, 0.0, 1, {"lam": np.zeros(size + len(rows))}


def test_a_solver_that_lies_is_never_believed(rehearsal: Rehearsal, monkeypatch: pytest.MonkeyPatch) -> None:
    """HAZ-03: 10,000 lies, 10,000 times held where it was, with a reason, and no exception."""
    random = np.random.default_rng(8)
    liar = Liar(random)
    monkeypatch.setattr(qp, "daqp", liar)
    rehearsal = copy(rehearsal)
    scene = rehearsal.scene
    rehearsal.controller = Controller(scene.placed_robot(), scene.tool, scene.tree, SETTINGS, solver="daqp")
    state = rehearsal.start("free")
    for _ in range(10_000):
        after, snapshot = rehearsal.step(state, Command(5.0 * random.normal(size=3), twist=1))
        np.testing.assert_array_equal(after.tool.q, state.tool.q)
        assert snapshot.held
        assert snapshot.reason == "no safe step was found"
        state = after
    assert liar.asked >= 10_000
