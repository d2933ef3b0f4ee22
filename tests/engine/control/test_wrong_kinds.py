"""What a script takes for a state, a task, a fixture or a surface is refused in words, not held or ignored."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import trimesh

from tests.engine.control.test_whole_step import controller_of
from tests.engine.scenes import straight_scene, wall
from vfix_engine import Controller, InputError, ProximityTree, RobotModel, Simulation, Tool, tasks
from vfix_engine.control import HandCommand, StepRequest, build_step
from vfix_engine.errors import RobotError
from vfix_engine.virtual_fixtures import Objective
from vfix_engine.worlds.rigid.scene import Scene

PUSH = HandCommand(np.array([0.0, 1.0, 0.0]))
FREE = tasks.MoveFreely()


class NoRows:
    """A fixture whose author forgot to return."""

    def rows(self, now: Any) -> None:
        """Nothing."""

    def is_admissible(self, before: Any, after: Any) -> bool:
        return True


@pytest.fixture(scope="module")
def scene() -> Scene:
    return straight_scene(wall(90.0))


@pytest.fixture(scope="module")
def control(scene: Scene) -> Controller:
    return controller_of(scene)


def objective(weight: float = 1.0) -> Objective:
    return Objective(np.ones((1, 8)), np.ones(1), weight)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (lambda c, s: c.step(np.zeros(7), FREE, PUSH), "the state is a ndarray; it must be a StepState"),
        (lambda c, s: c.step(s, tasks.MoveFreely, PUSH), r"MoveFreely is a class and no task.*MoveFreely\("),
        (lambda c, s: c.step(s, [FREE, "posture"], PUSH), "a str is no task"),
        (lambda c, s: build_step(s, StepRequest(objective()), (), PUSH), r"a tuple: StepRequest\(\(objective,\)\)"),
        (lambda c, s: build_step(s, FREE, [NoRows()], PUSH), r"rows\(\) of NoRows returns a NoneType"),
        (lambda c, s: objective(-1.0), "an objective's weight is -1.0; it must be a number from 0 on"),
        (lambda c, s: tasks.WeightedTasks([FREE]), r"pairs \(task, weight\), not of a MoveFreely"),
        (
            lambda c, s: c.step(s, [FREE, tasks.PostureTask(np.full(7, np.nan))], PUSH),
            r"the posture is \[nan, .*; it is 7 finite joint values",
        ),
    ],
)
def test_wrong_steps_are_refused(control: Controller, given: Callable[[Any, Any], Any], words: str) -> None:
    state = control.start(np.zeros(7))
    with pytest.raises(InputError, match=words):
        given(control, state)
    assert control.step(state, FREE, PUSH).outcome == "moved"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"robot": RobotModel.load("steady_hand")}, r"the robot is a RobotModel; place it: robot.placed\(base, tool\)"),
        ({"tool": "bent_30"}, r"the tool is a str; it must be a Tool, such as Tool.load"),
        ({"tree": wall(90.0)}, r"the anatomy is a TriangleMesh; index it first: ProximityTree\(mesh\)"),
        ({"fixtures": NoRows()}, r"the fixtures are a list, not a NoRows; a single one is \[it\]"),
    ],
)
def test_a_controller_of_wrong_parts_is_refused(control: Controller, changed: dict[str, Any], words: str) -> None:
    parts = {"robot": control.robot, "tool": control.tool, "tree": control.tree, "settings": control.settings}
    with pytest.raises(InputError, match=words):
        Controller(**(parts | changed))


@pytest.mark.parametrize("mesh", [trimesh.creation.box(), "bone.ply"], ids=["trimesh", "name"])
def test_a_simulation_takes_a_triangle_mesh(mesh: Any) -> None:
    with pytest.raises(InputError, match=r"it must be a TriangleMesh, such as of read_mesh\(file\)"):
        Simulation(mesh, path=[[0, 0, 0], [0, 10, 0]])


def test_a_single_zone_is_no_list() -> None:
    with pytest.raises(InputError, match="the zones are a list, not a object"):
        Simulation(wall(90.0), path=[[0, 0, 0], [0, 10, 0]], zones=object())  # type: ignore[arg-type]


@pytest.mark.parametrize("rotation", [3.0 * np.eye(3), np.diag([1.0, 1.0, -1.0]), np.eye(4)])
def test_a_tool_is_turned_by_rotations_only(rotation: Any) -> None:
    with pytest.raises(InputError, match="the tool's rotation is no rotation"):
        Tool.load("bent_30").segments(rotation, np.zeros(3))


def test_a_query_within_nan_is_refused() -> None:
    """Every comparison with NaN is false, so nothing would seem to be near."""
    tree, segments = ProximityTree(wall(90.0)), Tool.load("bent_30").segments(np.eye(3), np.zeros(3))
    with pytest.raises(InputError, match="the threshold of a query is NaN"):
        tree.pairs_within(segments, np.nan)


@pytest.mark.parametrize("load", [RobotModel.load, Tool.load])
@pytest.mark.parametrize("name", ["mine.json", "folder/mine.urdf"])
def test_a_missing_file_is_called_missing(load: Callable[[str], Any], name: str) -> None:
    with pytest.raises(RobotError, match=f"there is no file '{name}'"):
        load(name)


def test_a_tool_is_no_name_where_a_robot_holds_it() -> None:
    with pytest.raises(RobotError, match="the tip's placement: 'bent_30' is no array of real numbers"):
        RobotModel.load("arm_6").placed(np.eye(4), "bent_30")
