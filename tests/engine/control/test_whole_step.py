"""The compiled step against the same step in plain numpy over Pinocchio, coal and qpsolvers, and against itself.

coal's closest points are good to about 1e-7 mm, so that is what the two can agree to.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import coal
import numpy as np
import pytest

from benchmarks.stack import Stack
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepReport, StepRequest, StepState
from vfix_engine.control.tasks import FollowPath, MoveFreely, PathPoint
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures import Constraint, Rows, Situation, Zone
from vfix_engine.worlds.rigid.scene import Scene

SETTINGS = ControlSettings(dt_s=4e-3)
LINE = SplinePath([[0.0, 0, 0], [0, 100, 0]])  # its length alone counts where the nearest point is given
Driven = tuple[StepState, StepRequest, StepReport]


@pytest.fixture(scope="module")
def tube() -> Scene:
    return narrow_tube()


def narrow_tube() -> Scene:
    """A narrow tube around the whole bent tool: dozens of pairs, rows that bind."""
    around, motion_gain = np.linspace(0.0, 2 * np.pi, 40, endpoint=False), np.linspace(-190.0, 40.0, 160)
    angle, y = np.meshgrid(around, motion_gain)
    vertices = np.column_stack([6.5 * np.cos(angle).ravel(), y.ravel(), 6.5 * np.sin(angle).ravel() - 3.75])
    i, j = (index.ravel() for index in np.meshgrid(np.arange(159), np.arange(40), indexing="ij"))
    a, b = i * 40 + j, i * 40 + (j + 1) % 40
    faces = np.concatenate([np.column_stack([a, b, a + 40]), np.column_stack([b, b + 40, a + 40])])
    return straight_scene(TriangleMesh(vertices, faces))


def controller_of(scene: Scene, settings: ControlSettings = SETTINGS, **more: object) -> Controller:
    return Controller(scene.placed_robot(), scene.tool, scene.tree, settings, **more)  # type: ignore[arg-type]


def random_task(state: StepState, random: np.random.Generator) -> StepRequest:
    """What a hand may want: along a path, or freely in all six directions."""
    force = random.normal(size=3) * 4.0
    if random.random() < 0.5:
        tangent = random.normal(size=3)
        tangent /= np.linalg.norm(tangent)
        near = PathPoint(50.0, state.tip.position + random.normal(size=3) * 0.02, tangent)
        return FollowPath(LINE, near).request(state, HandCommand(force))
    return MoveFreely().request(state, HandCommand(force, random.normal(size=3) * 60.0))


def drive(
    controller: Controller, random: np.random.Generator, steps: int
) -> list[tuple[StepState, StepRequest, object]]:
    """A wandering hand that keeps its mind for a tenth of a second."""
    state = controller.start(np.zeros(controller.robot.dof))
    taken = []
    seed = 0
    for index in range(steps):
        if index % 25 == 0:
            seed = int(random.integers(1 << 30))
        task = random_task(state, np.random.default_rng(seed))
        report = controller.step(state, task)
        taken.append((state, task, report))
        state = report.state
    return taken


def test_the_same_step_as_on_the_shelf(tube: Scene) -> None:
    """Hundreds of states, at rest and in motion, in the open and between walls: the same step to a millionth."""
    controller = controller_of(tube)
    stack = Stack(coal, tube.tree.mesh, tube.placed_robot(), tube.tool, SETTINGS)
    compared = bound = 0
    for state, task, report in drive(controller, np.random.default_rng(3), 300):
        if report.outcome != "moved":
            continue
        theirs = stack.step(state, task)
        assert theirs.step is not None
        compared += 1
        bound += len(state.pairs) > 1
        np.testing.assert_allclose(report.state.q - state.q, theirs.step, rtol=0.0, atol=1e-6 * max(task.scale, 1e-3))
        assert report.state.clearance == pytest.approx(min(theirs.clearance, SETTINGS.reach_mm), abs=1e-6)
    assert compared > 200
    assert bound > 50


@pytest.mark.filterwarnings("ignore:The default value of raise_error:PendingDeprecationWarning")
@pytest.mark.parametrize("solver", ["daqp", "osqp"])
def test_part_by_part_with_another_solver_it_is_the_same_step(tube: Scene, solver: str) -> None:
    at_once, by_parts = controller_of(tube), controller_of(tube, solver=solver)
    tolerance, count = (1e-7, 300) if solver == "daqp" else (1e-6, 60)
    steps = drive(at_once, np.random.default_rng(5), count)
    moved = 0
    for state, task, report in steps:
        again = by_parts.step(state, task)
        if report.outcome == again.outcome == "moved":
            moved += 1
            np.testing.assert_allclose(again.state.q, report.state.q, rtol=0.0, atol=tolerance)
    assert moved > 0.7 * len(steps)


def test_what_was_asked_before_changes_nothing(tube: Scene) -> None:
    """Triangles kept near the tool are a cache only: bit for bit the same from a controller that has seen nothing."""
    steps = drive(controller_of(tube), np.random.default_rng(7), 200)
    for state, task, report in steps[::20]:
        fresh = controller_of(tube)
        again = fresh.step(state, task)
        np.testing.assert_array_equal(again.state.q, report.state.q)
        np.testing.assert_array_equal(again.state.distance, report.state.distance)
        np.testing.assert_array_equal(again.state.pairs, report.state.pairs)


def test_leaving_out_what_cannot_bind_changes_nothing(tube: Scene) -> None:
    """The rows of all pairs within the threshold, none left out, hold at every step taken."""
    controller = controller_of(tube)
    keep = SETTINGS.margin_mm + 0.012
    left_out = 0
    for state, task, report in drive(controller, np.random.default_rng(11), 300):
        if report.outcome != "moved" or report.emergency:
            continue
        every = tube.tree.pairs_within(state.segments, SETTINGS.reach_mm)
        left_out += len(every) - len(state.pairs)
        lever = every.on_tool - state.tip.position
        linear = every.normal @ state.tip.jacobian[:3] + np.cross(lever, every.normal) @ state.tip.jacobian[3:]
        nearer = -linear @ (report.state.q - state.q)
        room = np.maximum(every.distance - keep, 0.0)
        # A row that was dropped for a nearer one of nearly its direction may be overdrawn by a share of the step.
        assert (nearer <= room + 0.05 * task.scale).all()
    assert left_out > 10_000


def test_zones_are_bodies_with_margins_of_their_own() -> None:
    """HAZ-01 for a shape and for a patch: full force into each stops at its own margin, and is told by its name."""
    scene = straight_scene(wall(90.0))
    zones = (
        Zone("nerve", Sphere([0.0, 5.0, 0.0], 1.0), 0.8),
        Zone("plate", ProximityTree(wall(6.0, 10.0)), 1.7),
    )
    for zone, margin in ((zones[0], 0.8), (zones[1], 1.7)):
        controller = controller_of(scene, replace(SETTINGS, dt_s=5e-3), zones=(zone,))
        state = controller.start(np.zeros(7))
        for _ in range(200):
            task = MoveFreely().request(state, HandCommand(np.array([0.0, 5.0, 0.0])))
            report = controller.step(state, task)
            state = report.state
            assert state.distance.shape == (2, 2)
            assert state.distance[1].min() >= margin
        assert state.distance[1].min() <= margin + 0.02
        assert report.held
        assert zone.name in report.blockers[0].text


class Ceiling:
    """A fixture that lets nothing rise above a height."""

    def __init__(self, height: float):
        self.height = height

    def rows(self, now: Situation) -> Rows:
        matrix = np.append(now.state.tip.jacobian[2], 0.0)[None, :]
        bound = np.array([self.height - now.state.tip.position[2]])
        return Rows((), (Constraint("ceiling", matrix, bound, np.zeros(1, np.int64), ("the ceiling",)),))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        return bool(after.tip.position[2] <= max(self.height, before.tip.position[2]) + 1e-9)


def test_standing_fixtures_join_the_step_and_its_verdict() -> None:
    scene = straight_scene(wall(90.0))
    controller = controller_of(scene, fixtures=(Ceiling(0.2),))
    state = controller.start(np.zeros(7))
    for _ in range(300):
        report = controller.step(state, MoveFreely(), HandCommand(np.array([0.0, 0.0, 5.0])))
        state = report.state
        assert state.tip.position[2] <= 0.2 + 1e-9
    assert state.tip.position[2] == pytest.approx(0.2, abs=1e-3)
    assert report.blockers[0].text == "the ceiling"


def test_moved_anatomy_is_measured_anew_and_never_deepened() -> None:
    """HAZ-04: the wall comes 0.5 mm nearer than the margin allows; the tool only ever leaves it."""
    scene = straight_scene(wall(1.4))
    controller = controller_of(scene)
    state = controller.start(np.zeros(7))
    moved = controller.with_anatomy(ProximityTree(wall(1.15)))
    clearance = moved.measure(state.q).clearance
    assert clearance < SETTINGS.margin_mm
    for _ in range(50):
        report = moved.step(state, MoveFreely(), HandCommand(np.array([1.0, 5.0, 0.5])))
        assert report.state.clearance >= clearance - 1e-12
        state, clearance = report.state, min(report.state.clearance, SETTINGS.margin_mm)


@pytest.mark.parametrize("robot", ["arm_6", "arm_7", "dvrk_psm", "steady_hand"])
def test_any_robot_is_led_away_from_bone_the_same_way(robot: str) -> None:
    """Deficient and redundant robots: the certificate holds, and the step is the shelf's."""
    model, tool = RobotModel.load(robot), Tool.load("straight_pointer")
    q = model.home
    placed = model.placed(np.eye(4), tool)
    tip = placed.tip(q)
    mesh = wall(0.0)
    ahead = tool.direction(tip.rotation)
    turn = _turning_y_to(ahead)
    walls = TriangleMesh(mesh.vertices @ turn.T + tip.position + 2.6 * ahead, mesh.faces)
    controller = Controller(placed, tool, ProximityTree(walls), SETTINGS)
    stack = Stack(coal, walls, model.placed(np.eye(4), tool), tool, SETTINGS)
    state, same = controller.start(q), 0
    for _ in range(300):
        task = MoveFreely().request(state, HandCommand(5.0 * ahead))
        report = controller.step(state, task)
        assert report.state.clearance >= SETTINGS.margin_mm
        if report.outcome == "moved":
            theirs = stack.step(state, task)
            np.testing.assert_allclose(report.state.q - state.q, theirs.step, rtol=0.0, atol=1e-9)
            same += 1
        state = report.state
    assert same > 30
    assert state.clearance <= SETTINGS.margin_mm + 0.2


def _turning_y_to(direction: np.ndarray) -> np.ndarray:
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    x = np.cross(direction, helper)
    x /= np.linalg.norm(x)
    return np.column_stack([x, direction, np.cross(x, direction)])


def test_an_outside_step_is_a_chain_of_small_ones(tube: Scene) -> None:
    """States follow from each other without a gap, and none of them can be written to."""
    reports: Sequence[Driven] = drive(controller_of(tube), np.random.default_rng(13), 100)
    for (_, _, one), (state, _, _) in pairwise(reports):
        assert state is one.state
    parts = (state.q, state.velocity, state.distance, state.tip.jacobian, state.segments.start, state.pairs)
    for array in parts:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


def kernels() -> dict[str, int]:
    """How many types each compiled function of the engine is compiled or loaded for."""
    found = {}
    for name, module in list(sys.modules.items()):
        if name.startswith("vfix_engine."):
            for kernel in vars(module).values():
                if hasattr(kernel, "overloads") and hasattr(kernel, "py_func"):
                    found[f"{kernel.py_func.__module__}.{kernel.py_func.__name__}"] = len(kernel.overloads)
    return found


def test_after_warming_up_a_drive_compiles_nothing() -> None:
    """Refused, cut, braked and held steps, at once and by parts: a running robot never waits for a compiler.

    In a process of its own, where no other test has loaded anything.
    """
    root = Path(__file__).resolve().parents[3]
    script = "from tests.engine.control.test_whole_step import unusual_drive; unusual_drive()"
    subprocess.run([sys.executable, "-c", script], cwd=root, check=True, timeout=300)


def unusual_drive() -> None:
    """What the test above runs."""
    scene = narrow_tube()
    controller = controller_of(scene)
    state = controller.start(np.zeros(7))
    controller.warm_up(state)
    before, random = kernels(), np.random.default_rng(17)
    for state, _, report in drive(controller, random, 100):
        controller.step(report.state, replace(random_task(state, random), scale=0.0))
        if report.outcome != "idle":
            assert controller.step(state, replace(random_task(state, random), is_admissible=lambda _: False)).held
        matrix = np.append(state.tip.jacobian[0], 0.0)[None, :]
        never = Constraint("never", np.vstack([matrix, -matrix]), np.full(2, -1.0), np.arange(2), ("never",))
        controller.step(state, replace(random_task(state, random), constraints=(never,)))
    after = kernels()
    assert after == before, {name: (before[name], count) for name, count in after.items() if count != before[name]}
