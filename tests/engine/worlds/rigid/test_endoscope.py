"""An endoscope inspects along its camera's axis, not along its shaft (Li 2007, eq. 22-25)."""

import numpy as np
import pytest

from tests.engine.scenes import curved_tube
from vfix_engine.control import ControlSettings
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.worlds.rigid.operators import ScriptedOperator
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene

MESH, POINTS = curved_tube(radius=14.0)


@pytest.mark.parametrize(("name", "robot"), [("endoscope_30", "steady_hand"), ("endoscope_70", "dvrk_psm")])
def test_the_camera_is_brought_onto_the_target_and_held_there(name: str, robot: str) -> None:
    """The point that reaches and keeps the target lies ahead along the view; the shaft points elsewhere."""
    model, tool = RobotModel.load(robot), Tool.load(name)
    assert tool.camera is not None
    flange = model.placed(np.eye(4), tool).tip_pose(model.home)
    base = np.eye(4)
    base[:3, :3] = flange[0].T  # the tip frame is the patient's: shaft along +y, view towards +z
    base[:3, 3] = np.array([0.0, 5.0, 0.0]) - base[:3, :3] @ flange[1]
    settings = ControlSettings(view_distance_mm=8.0)
    ahead = np.array([0.0, 5.0, 0.0]) + 8.0 * tool.camera.view
    target = ahead + np.array([0.8, 0.5, -0.3])
    scene = Scene(ProximityTree(MESH), model, tool, base, model.home, SplinePath(POINTS), target[None], ("wall",))
    rehearsal = Rehearsal(scene, settings)
    state, operator = rehearsal.start("inspect"), ScriptedOperator()
    first = rehearsal.snapshot(state)
    np.testing.assert_allclose(first.virtual_point, ahead, atol=1e-6)
    held = 0
    snapshot = first
    for _ in range(3000):
        state, snapshot = rehearsal.step(state, operator(rehearsal.system, state).command)
        if snapshot.phase == "inspect_hold":
            held += 1
            assert snapshot.target_error_mm <= settings.target_tolerance_mm + 1e-9
        if held == 300:
            break
    assert held == 300
    tip = state.tool.tip
    shaft = tip.rotation[:, 1]
    to_target = (target - tip.position) / np.linalg.norm(target - tip.position)
    angle = np.degrees(np.arccos(shaft @ to_target))
    assert angle == pytest.approx(float(name.split("_")[1]), abs=0.2)
    assert snapshot.clearance_mm >= settings.margin_mm
