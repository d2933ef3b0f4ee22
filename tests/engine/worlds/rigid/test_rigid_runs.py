"""The rigid tool as a system: its scene crosses whole, its runs repeat to the last bit (HAZ-13)."""

from __future__ import annotations

import json
import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import curved_tube, straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, InputError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shapes import Box, HalfSpace, Sphere
from vfix_engine.json_text import parse_json
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.resources import assets_dir
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.robots.joints import Joint
from vfix_engine.runtime import Command, Master, Reset, SetSettings, SetTask, Straighten
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.virtual_fixtures import (
    CartesianLimits,
    DeeperPlace,
    OrientationCone,
    PathTube,
    RemoteCentre,
    Rows,
    Situation,
    SoftRegion,
    StepState,
    TipEnvelope,
    Zone,
)
from vfix_engine.virtual_fixtures.soft_zone import SoftZone
from vfix_engine.virtual_fixtures.weighted import weighted
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.scene_parts import FIXTURES, fixtures_from, fixtures_parts, robot_from, robot_parts
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

SETTINGS = ControlSettings()


class NeverBack:
    """A fixture of one's own: the tip never goes back along y."""

    def rows(self, now: Situation) -> Rows:
        return Rows((), ())

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        return bool(after.tip.position[1] >= before.tip.position[1] - 1e-9)


@pytest.fixture(scope="module")
def own_scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """A robot from a URDF of one's own, its tip at the origin and its shaft along +y, behind a remote centre."""
    file = tmp_path_factory.mktemp("robot") / "mine.urdf"
    file.write_bytes((assets_dir() / "robots" / "steady_hand.urdf").read_bytes())
    robot, tool = RobotModel.load(file), replace(Tool.load("bent_30"), title="Mine")
    at_origin = robot.placed(np.eye(4), tool).tip(robot.home)
    base = np.eye(4)
    base[:3, :3] = at_origin.rotation.T
    base[:3, 3] = -at_origin.rotation.T @ at_origin.position
    zones = (Zone("nerve", Sphere([0.0, 14.0, 0.0], 4.0), 1.0), Zone("patch", ProximityTree(wall(60.0, 5.0)), 0.5))
    scene = Scene(ProximityTree(wall(90.0)), robot, tool, base, robot.home, zones=zones)
    shaft = scene.placed_robot().tip(robot.home)
    segments = tool.segments(shaft.rotation, shaft.position)
    along = segments.end[-1] - segments.start[-1]
    centre = segments.end[-1] - 60.0 * along / np.linalg.norm(along)
    return replace(scene, fixtures=(RemoteCentre(centre, tolerance_mm=0.5),))


def until(
    process: ControlProcess[RigidSnapshot], wanted: Callable[[RigidSnapshot], bool], sign: Callable[[], None]
) -> RigidSnapshot:
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        sign()
        snapshot = process.snapshot()
        if snapshot is not None and wanted(snapshot):
            return snapshot
        time.sleep(0.02)
    raise AssertionError(f"it did not come to that; the last was {process.snapshot()}")


def test_zone_remote_centre_and_own_robot_hold_in_the_process(own_scene: Scene, tmp_path: Path) -> None:
    (centre,) = own_scene.fixtures
    assert isinstance(centre, RemoteCentre)
    spec = RigidSpec(SceneSpec.of(own_scene), SETTINGS)
    spec.build().prepare()  # what is not compiled yet is compiled here, not while the process is waited for
    process: ControlProcess[RigidSnapshot] = ControlProcess(spec, real_time=False, record=tmp_path / "drive.run")
    process.start()
    try:
        process.wait_ready()
        first = process.snapshot()
        assert first is not None
        process.run()

        def pull() -> None:
            process.set_grip(first.grip + np.array([4.0, 25.0, 0.0]))

        held = until(process, lambda s: any("nerve" in words for words in s.active), pull)
        assert held.tip[1] > 5.0
        for _ in range(20):
            pull()
            time.sleep(0.02)
        process.release()
        time.sleep(0.3)
    finally:
        process.close()
    run = Run.read(tmp_path / "drive.run")
    parts = len(own_scene.tool.radius)
    to_nerve = np.array([run.column(f"d2_{part}") for part in range(parts)])  # surfaces come before shapes
    assert 0.99 <= to_nerve.min() < 1.5, "the margin of 1 mm is kept, and was reached"
    start, end = (np.column_stack([run.column(f"s{parts - 1}_{which}{axis}") for axis in "xyz"]) for which in "ab")
    along = (end - start) / np.linalg.norm(end - start, axis=1)[:, None]
    off = np.linalg.norm(np.cross(centre.point - start, along), axis=1)
    assert off.max() <= 0.5 + 1e-6
    again = replay(run, RigidSpec.from_parts(run.manifest["spec"], run.arrays))
    assert again.same


def _flesh() -> DistanceField:
    """Two grids, one of whole hundredths of a millimetre with a place that is not known."""
    fine = np.arange(27, dtype=np.float32).reshape(3, 3, 3) * np.float32(0.01)
    fine[0, 0, 0] = np.nan
    coarse = np.random.default_rng(1).normal(size=(4, 4, 4)).astype(np.float32)
    return DistanceField([FieldGrid(fine, np.zeros(3), 0.5), FieldGrid(coarse, np.full(3, -1.0), 1.0)])


def test_a_scene_comes_back_from_its_parts_exactly(own_scene: Scene) -> None:
    random = np.random.default_rng(2)
    axis = random.normal(size=3)
    fixtures = (
        *own_scene.fixtures,
        weighted(OrientationCone(axis / np.linalg.norm(axis), 0.5, np.array([0.0, 1.0, 0.0])), 0.25),
        RemoteCentre(random.normal(size=3), 3.0, weight=0.0, into=random.normal(size=3)),
        CartesianLimits(speed_mm_per_s=3.0, point_in_tip=(0.1, 0.2, 0.3)),
        SoftZone("mucosa", 1.5, 0.5, HalfSpace([0.0, 30.0, 0.0], random.normal(size=3))),
        SoftZone("lining", 1.5, 0.5, None),
        PathTube(SplinePath(random.normal(size=(4, 3)), 2), 1.25),
        weighted(TipEnvelope("antrum", Sphere(random.normal(size=3), 4.0)), 0.5),
        TipEnvelope("box", Box(np.eye(4), [1.0, 2.0, 3.0])),
        SoftRegion("flesh", _flesh(), 0.5, 3.0, DeeperPlace(random.normal(size=3), 6.0, 4.0), 0.5),
    )
    zones = (*own_scene.zones, Zone("box", Box(np.eye(4), [1.0, 2.0, 3.0]), 0.1))
    spec = RigidSpec(SceneSpec.of(replace(own_scene, fixtures=fixtures, zones=zones), "daqp"), SETTINGS)
    values, arrays = spec.to_parts()
    again = RigidSpec.from_parts(values, arrays)
    assert again.to_parts()[0] == values
    crossed = parse_json(json.dumps(values))  # as the store reads a manifest: without infinities
    assert RigidSpec.from_parts(crossed, arrays).to_parts()[0] == values
    assert all(np.array_equal(array, again.to_parts()[1][name]) for name, array in arrays.items())
    flesh, same = (one.scene.fixtures[-1].field.grids for one in (spec, again))  # type: ignore[attr-defined]
    for grid, other in zip(flesh, same, strict=True):
        assert np.array_equal(grid.values, other.values, equal_nan=True)
    assert pickle.loads(pickle.dumps(spec)).to_parts()[0] == values
    with pytest.raises(InputError, match="cannot be read"):
        RigidSpec.from_parts({}, arrays)


@dataclass(frozen=True)
class Corners(NeverBack):
    """A fixture with tuples, one without a default and one of tuples."""

    sides: tuple[str, ...]
    corners: tuple[tuple[float, float], ...] = ()


def test_tuples_of_a_fixture_come_back_as_tuples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FIXTURES, "Corners", Corners)
    written = (Corners(("left", "right"), ((0.1, 0.2), (0.3, 1.0 / 3.0))), Corners(()))
    values, arrays = fixtures_parts(written)
    assert fixtures_from(parse_json(json.dumps({"fixtures": values}))["fixtures"], arrays) == written


def test_a_fixture_of_ones_own_crosses_but_is_not_written(own_scene: Scene, tmp_path: Path) -> None:
    spec = RigidSpec(SceneSpec.of(replace(own_scene, fixtures=(NeverBack(),))), SETTINGS)
    (fixture,) = pickle.loads(pickle.dumps(spec)).scene.fixtures
    assert isinstance(fixture, NeverBack)
    with pytest.raises(InputError, match="NeverBack cannot be written"):
        spec.to_parts()
    system = spec.build()
    writer = RunWriter(tmp_path / "own.run", spec, system.row_layout)
    driver = Driver(system, log=writer)
    for _ in range(5):
        driver.step(Command(np.array([0.0, 3.0, 0.0])))
    writer.close()
    run = Run.read(tmp_path / "own.run")
    assert "NeverBack" in run.manifest["spec_not_written"]
    assert replay(run, spec).same


def test_a_scripted_run_repeats_to_the_last_bit(tmp_path: Path) -> None:
    """Modes, targets, settings and a master on the way; states that are gone back to go on the same."""
    mesh, points = curved_tube()
    scene = replace(
        straight_scene(mesh, points), targets=points[-1:] + np.array([0.0, 15.0, 4.0]), target_names=("end",)
    )
    spec = RigidSpec(SceneSpec.of(scene), ControlSettings(dt_s=2e-3))
    system, random = spec.build(), np.random.default_rng(11)
    writer = RunWriter(tmp_path / "one.run", spec, system.row_layout, seed=11)
    driver = Driver(system, log=writer)
    requests = {
        40: SetTask("free"),
        80: SetSettings(ControlSettings(dt_s=5e-3, force_cap_n=3.0)),
        120: SetTask("inspect", 0),
        200: SetTask("path"),
        240: Reset(),
    }
    for step in range(300):
        if step in requests:
            driver.apply(requests[step])
        master = Master(0.05 * random.normal(size=3)) if 160 <= step < 180 else None
        driver.step(Command(4.0 * random.normal(size=3), random.uniform(-1, 1), random.uniform(-1, 1), master))
    writer.close()
    run = Run.read(tmp_path / "one.run")
    again = replay(run, RigidSpec.from_parts(run.manifest["spec"], run.arrays))
    assert again.same
    assert set(run.column("phase")) > {0.0, 2.0}
    # A pure step: from any state with the same command to the same row, settings included.
    fresh, row = spec.build(), np.empty(len(system.row_layout))
    for step in (250, 100, 170, 10):
        if step + 1 not in requests:
            state = again.states[step]
            fresh.row(fresh.step(state, run.command(step)), row)
            assert np.array_equal(row, run.rows[step])


def test_what_cannot_be_done_changes_nothing() -> None:
    system = RigidSpec(SceneSpec.of(straight_scene(*curved_tube(radius=4.0))), SETTINGS).build()
    state = system.start()
    for request, words in (
        (SetTask("dance"), "not one of"),
        (SetTask("inspect", 3), "no target number 4"),
        (SetSettings(ControlSettings(margin_mm=3.0, threshold_mm=5.0)), "less than the margin"),
        (Straighten(), "Straighten"),
    ):
        with pytest.raises((ControlError, InputError), match=words):
            system.apply(state, request)
    before = system.step(state, Command(np.array([0.0, 2.0, 0.0])))
    assert before.settings == SETTINGS
    assert system.controller.settings == SETTINGS


def test_a_snapshot_asked_for_late_is_the_same() -> None:
    """It is made when it is looked at: after later steps it must still tell of its own."""
    rehearsal = Rehearsal(straight_scene(wall(8.0, 30.0)), ControlSettings(dt_s=5e-3))
    state, late, early = rehearsal.start("free"), [], []
    for _ in range(200):
        state, snapshot = rehearsal.step(state, Command(np.array([0.0, 4.0, 0.0])))
        late.append(snapshot)
        early.append(rehearsal.system.snapshot(state))
    assert any(one.held or one.slowed for one in early)
    assert any(one.active for one in early)
    for one, other in zip(early, late, strict=True):
        for field in fields(RigidSnapshot):
            first, second = getattr(one, field.name), getattr(other, field.name)
            if field.name == "blockers":
                first, second = ([(b.kind, b.words) for b in many] for many in (first, second))
            np.testing.assert_array_equal(first, second, err_msg=field.name)


@pytest.mark.parametrize("name", ["steady_hand", "arm_7", "dvrk_psm"])
def test_a_robot_comes_back_with_every_number(name: str) -> None:
    """Ranges, speeds and the joints' weights: whatever is left out would make other steps in the process."""
    robot = RobotModel.load(name)
    again = robot_from(json.loads(json.dumps(robot_parts(robot))))
    for one, other in zip(robot.joints, again.joints, strict=True):
        for field in fields(Joint):
            np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)
    assert np.array_equal(robot.joint_weights, again.joint_weights)
    assert np.array_equal(robot.mount.transform_flange_to_link, again.mount.transform_flange_to_link)


def test_a_row_has_the_room_of_the_tip_in_each_limit(own_scene: Scene) -> None:
    """The columns are named by the layout; a scene without limits has the layout of before."""
    plain = RigidSpec(SceneSpec.of(own_scene), SETTINGS).build()
    tip = own_scene.placed_robot().tip(own_scene.q_start).position
    ball = TipEnvelope("antrum", Sphere(tip + np.array([0.0, 0.0, 1.0]), 4.0))
    limits = (*own_scene.fixtures, ball, weighted(TipEnvelope("floor", HalfSpace(tip + 2.0, np.ones(3))), 0.5))
    system = RigidSpec(SceneSpec.of(replace(own_scene, fixtures=limits)), SETTINGS).build()
    names = [column.name for column in system.row_layout]
    assert [name for name in names if not name.startswith("room")] == [column.name for column in plain.row_layout]
    row, state = np.zeros(len(names)), system.start("free")
    state = system.step(state, Command(np.array([1.0, 0.0, 0.0])))
    system.row(state, row)
    assert row[names.index("room0")] == ball.room(state.tool)
    assert row[names.index("room1")] == pytest.approx(2.0 * np.sqrt(3.0), abs=1e-3)
    assert row[names.index("force_x")] == 1.0
    assert np.array_equal(row[names.index("d0_0") :][: state.tool.distance.size], state.tool.distance.ravel())
