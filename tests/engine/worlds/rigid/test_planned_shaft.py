"""The tool keeps the orientation of its shaft that was planned, as far as bone lets it, and never sticks for it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.engine.scenes import curved_tube, wall
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shaft_directions import ShaftDirections, roll_of
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.runtime.command import Command
from vfix_engine.worlds.rigid.dry_run import dry_run
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.placing import place_robot, placed_along
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

ROBOT = RobotModel.load("steady_hand")
POINTS = np.column_stack([np.zeros(5), np.linspace(0.0, 60.0, 5), np.zeros(5)])
BACK = np.array([0.0, -1.0, 0.0])


def tilted(degrees: float, towards: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    angle = np.radians(degrees)
    return np.cos(angle) * BACK + np.sin(angle) * np.array(towards)


def scene_with(
    shaft: ShaftDirections,
    tool: str = "straight_pointer",
    mesh: TriangleMesh | None = None,
    points: np.ndarray = POINTS,
) -> Scene:
    path, instrument = SplinePath(points), Tool.load(tool)
    base, q_start = placed_along(ROBOT, instrument, path, shaft)
    tree = ProximityTree(wall(200.0) if mesh is None else mesh)
    return Scene(tree, ROBOT, instrument, base, q_start, path, shaft=shaft)


def errors_deg(scene: Scene, shots: list[RigidSnapshot]) -> np.ndarray:
    """Angles between the shaft and its plan."""
    assert scene.shaft is not None
    found = []
    for shot in shots:
        axis = shot.segments_start[-1] - shot.segments_end[-1]
        axis /= np.linalg.norm(axis)
        found.append(np.degrees(np.arccos(min(1.0, float(axis @ scene.shaft.direction(shot.progress_mm))))))
    return np.array(found)


def followed(scene: Scene) -> tuple[RigidSnapshot, list[RigidSnapshot]]:
    shots = list[RigidSnapshot]()
    last = HeadlessRun(Rehearsal(scene, ControlSettings()), shots.append).follow()
    return last, shots


def test_a_straight_shaft_follows_its_plan() -> None:
    shaft = ShaftDirections([0.0, 20.0, 45.0], [BACK, tilted(15.0), tilted(-5.0, (1.0, 0.0, 0.0))])
    scene = scene_with(shaft)
    last, shots = followed(scene)
    assert last.phase == "done"
    assert errors_deg(scene, shots).max() < 1.0
    _, free = followed(replace(scene, shaft=None))
    assert errors_deg(scene, free).max() > 10.0  # without the plan it keeps the direction that it came with


def test_a_bent_tool_follows_its_roll() -> None:
    shaft = ShaftDirections([0.0, 50.0], [BACK, tilted(10.0)], np.radians([0.0, 60.0]))
    scene = scene_with(shaft, "bent_30")
    run = dry_run(scene, ControlSettings())
    assert run.completed
    end = scene.placed_robot().tip(run.q[-1]).rotation
    assert np.degrees(roll_of(end)) == pytest.approx(60.0, abs=1.0)


def test_a_side_pull_does_not_change_the_direction() -> None:
    shaft = ShaftDirections([0.0, 40.0], [BACK, tilted(12.0)])
    scene = scene_with(shaft)
    rehearsal, shots = Rehearsal(scene, ControlSettings()), list[RigidSnapshot]()
    state = rehearsal.start("path")
    for _ in range(4000):
        state, shot = rehearsal.step(state, Command(np.array([2.0, 0.0, 0.0]), drive=1))
        shots.append(shot)
    assert shots[-1].progress_mm > 30.0
    assert errors_deg(scene, shots).max() < 1.0


def test_without_a_hand_nothing_turns() -> None:
    scene = scene_with(ShaftDirections([0.0], [tilted(20.0)]))
    scene = replace(scene, shaft=ShaftDirections([0.0], [BACK]))  # 20° from where the tool is
    rehearsal = Rehearsal(scene, ControlSettings())
    state = rehearsal.start("path")
    for _ in range(50):
        after, _ = rehearsal.step(state, Command(np.zeros(3)))
        assert np.array_equal(after.q, state.q)
        state = after


@pytest.mark.parametrize("tool", ["straight_pointer", "bent_30"])
def test_a_plan_that_bone_does_not_allow_slows_the_tool_but_does_not_halt_it(tool: str) -> None:
    """In a tube the shaft cannot lean as it is told to; the tip arrives all the same, and keeps the margin (HAZ-01)."""
    mesh, points = curved_tube()
    path, tree, settings = SplinePath(points), ProximityTree(mesh), ControlSettings()
    placing = place_robot(tree, ROBOT, Tool.load(tool), path, settings)
    assert placing.run.completed
    scene = Scene(tree, ROBOT, Tool.load(tool), placing.base, placing.q_start, path)
    first = scene.placed_robot().tip(placing.q_start).rotation
    away = -first[:, 1] + 0.6 * first[:, 0]
    plan = ShaftDirections([0.0, 10.0], [-first[:, 1], away], [roll_of(first)] * 2)
    run = dry_run(replace(scene, shaft=plan), settings)
    assert run.completed
    assert run.clearance.min() >= settings.margin_mm - 1e-3


def test_the_placing_takes_the_planned_direction_and_finds_the_roll_that_is_left_open() -> None:
    mesh, points = curved_tube()
    path, tool = SplinePath(points), Tool.load("bent_30")
    shaft = ShaftDirections([0.0], [-path.tangent(0.5 * path.length)])
    placing = place_robot(ProximityTree(mesh), ROBOT, tool, path, ControlSettings(), shaft=shaft)
    tip = ROBOT.placed(placing.base, tool).tip(placing.q_start)
    assert tip.rotation[:, 1] == pytest.approx(-shaft.direction(0.0), abs=1e-9)
    assert placing.run.completed


def test_the_plan_crosses_to_another_process_and_into_a_run_bit_by_bit() -> None:
    shaft = ShaftDirections([0.0, 20.0], [BACK, 3.0 * tilted(15.0)], [0.1, np.nan])
    spec = RigidSpec(SceneSpec.of(scene_with(shaft, "bent_30")), ControlSettings())
    back = RigidSpec.from_parts(*spec.to_parts()).scene.shaft
    assert back is not None
    assert all(np.array_equal(a, b) for a, b in zip(back.table, shaft.table, strict=True))
    assert np.array_equal(np.asarray(back.rolls), np.asarray(shaft.rolls), equal_nan=True)
    assert RigidSpec(SceneSpec.of(replace(spec.scene.build(), shaft=None)), ControlSettings()).scene.shaft is None
