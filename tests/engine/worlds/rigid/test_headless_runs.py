"""A drive without a page leaves a run that is driven again bit by bit, tasks and new starts included."""

from pathlib import Path

import numpy as np

from tests.engine.scenes import curved_tube
from vfix_engine.control import ControlSettings
from vfix_engine.robots import Tool
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec


def test_a_drive_is_recorded_as_it_can_be_driven_again(tmp_path: Path) -> None:
    mesh, points = curved_tube(radius=4.0)
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange
    scene = SceneSpec(
        mesh.vertices, mesh.faces, "steady_hand", "bent_30", base, np.zeros(7), points, points[-1:], ("end",)
    )
    spec = RigidSpec(scene, ControlSettings(gain_mm_per_s_per_n=8.0))  # a quick hand: every tick is driven twice
    rehearsal = Rehearsal(scene.build(), spec.control)
    writer = RunWriter(tmp_path / "run", spec, rehearsal.system.row_layout, seed=3)
    steps = []
    drive = HeadlessRun(rehearsal, lambda snapshot: steps.append(snapshot.q.copy()), writer)
    drive.push(60, 3, free=True)
    drive.inspect(0, 20)
    writer.close()
    run = Run.read(tmp_path / "run")
    assert (len(run.ticks), run.whole, run.lost, run.manifest["seed"]) == (len(steps), True, 0, 3)
    told = [(event.kind, type(event.content).__name__) for event in run.events]
    assert told[:3] == [("request", "SetTask"), ("request", "Reset"), ("request", "SetTask")]
    assert len(told) == 7  # the view comes onto the target in more than one try
    again = replay(run, spec)
    assert again.first_difference is None
    np.testing.assert_array_equal(again.states[-1].q, steps[-1])
