"""A tool in a free hand: what bone answers, what is counted, and that its runs repeat to the last bit."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import coal  # noqa: F401  (the judge of ``scenes``)
import numpy as np
import pytest
from scipy.ndimage import label
from scipy.spatial.transform import Rotation

from tests.engine.scenes import CoalJudge, straight_scene, wall
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, InputError, StartRefused
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.robots import Tool
from vfix_engine.runtime import Command, Master, Reset, SetSettings, SetTask, Straighten
from vfix_engine.runtime.driver import Driver
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.metrics import score_run
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.freehand.contact import ContactForces, ContactModel
from vfix_engine.worlds.freehand.motion import MOVE_SHARE
from vfix_engine.worlds.freehand.snapshot import FreehandSnapshot
from vfix_engine.worlds.freehand.spec import FreehandSpec
from vfix_engine.worlds.freehand.state import FreehandState
from vfix_engine.worlds.freehand.system import FreehandSystem
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.spec import SceneSpec

SETTINGS = ControlSettings()
ACROSS = np.array([1.0, 0.0, 0.0])
WALL_MM = 5.0  # in y, before the recorded tool


def turned(mesh: TriangleMesh, rotation: Rotation) -> TriangleMesh:
    return TriangleMesh(rotation.apply(np.array(mesh.vertices)), mesh.faces)


def driven(system: FreehandSystem, state: FreehandState, command: Command, seconds: float) -> FreehandState:
    for _ in range(round(seconds / state.settings.dt_s)):
        state = system.step(state, command)
    return state


@pytest.mark.parametrize("stiffness", [8.0, 10.0, 40.0])
@pytest.mark.parametrize("dt_s", [1e-3, 2e-2])
def test_a_push_of_5_n_into_a_wall_penetrates_force_over_stiffness(stiffness: float, dt_s: float) -> None:
    system = FreehandSystem(straight_scene(wall(4.0)), replace(SETTINGS, dt_s=dt_s), stiffness)
    state = driven(system, system.start(), Command(np.array([0.0, 5.0, 0.0])), 2.0)
    snapshot = system.snapshot(state)
    (contact,) = snapshot.contacts
    assert (contact.structure, contact.part, contact.count) == ("bone", "tip", 1)
    assert contact.depth_mm == pytest.approx(5.0 / stiffness, rel=0.05)
    assert contact.max_depth_mm == pytest.approx(5.0 / stiffness, rel=0.05)
    np.testing.assert_allclose(state.push, [0.0, -5.0, 0.0], atol=0.05)
    assert snapshot.clearance_mm == -contact.depth_mm
    assert snapshot.certified is False
    gone = driven(system, state, Command(np.zeros(3)), 3.0)
    assert system.at_rest(gone, True), "bone pushes the tool out, and then it rests"
    assert not system.at_rest(state, True)


def test_contacts_are_counted_by_structure_and_segment() -> None:
    """The shaft, at z = -7.5, is pushed twice against a wall, and into a structure that does not push back."""
    aside = turned(wall(4.0, 200.0), Rotation.from_euler("z", -90.0, degrees=True))  # its plane is x = 4
    zone = Zone("nerve", Sphere([2.5, -60.0, -7.5], 0.5), 0.3)
    system = FreehandSystem(replace(straight_scene(aside), zones=(zone,)), SETTINGS)
    state = system.start()
    for force in (5.0, -5.0, 5.0, 5.0):
        state = driven(system, state, Command(force * ACROSS), 0.5)
    found = {(one.structure, one.part): one for one in system.snapshot(state).contacts}
    assert found["bone", "shaft"].count == 2
    assert found["bone", "shaft"].max_depth_mm == pytest.approx(0.5, rel=0.05)
    assert ("bone", "tip") not in found or found["bone", "tip"].max_depth_mm < 0.5, "it is thinner than the shaft"
    assert found["nerve", "shaft"].count == 2
    # In the wall the shaft's surface is 0.5 mm beyond x = 4, the ball's centre is at 2.5: as deep as it can be.
    assert found["nerve", "shaft"].max_depth_mm == pytest.approx(2.0, abs=0.05)
    assert state.push[0] == pytest.approx(-5.0, abs=0.05), "one wall is one spring, however many parts touch it"


def test_a_turn_is_resisted_and_never_reversed() -> None:
    aside = turned(wall(4.0, 200.0), Rotation.from_euler("z", -90.0, degrees=True))
    opposite = TriangleMesh(aside.vertices - [8.0, 0.0, 0.0], aside.faces)
    both = TriangleMesh(
        np.concatenate([aside.vertices, opposite.vertices]),
        np.concatenate([aside.faces, opposite.faces + len(aside.vertices)]),
    )
    free, tight = (FreehandSystem(straight_scene(mesh), SETTINGS) for mesh in (wall(500.0), both))
    turn = Command(np.zeros(3), axes=(1.0, 0.0, 0.0))
    angles = {}
    for name, system in (("free", free), ("tight", tight)):
        state, last = system.start(), 0.0
        for _ in range(8):
            state = driven(system, state, turn, 0.1)
            angle = float(Rotation.from_matrix(state.rotation).magnitude())
            assert angle >= last - 1e-12
            last = angle
        angles[name] = last
        np.testing.assert_allclose(state.rotation.T @ state.rotation, np.eye(3), atol=1e-12)
    full = SETTINGS.rotation_gain_rad_per_s_per_nmm * SETTINGS.force_cap_n * Tool.load("bent_30").grip_from_bend
    assert angles["free"] == pytest.approx(0.8 * full, rel=1e-6)
    assert angles["tight"] < 0.5 * angles["free"]
    still = driven(tight, state, Command(np.zeros(3)), 0.2)
    np.testing.assert_array_equal(still.rotation, state.rotation)


def test_bone_never_passes_the_axis_of_the_tool() -> None:
    """Soft contact, the largest force and gain, long steps: the tool is held where its axis would leave the wall."""
    settings = replace(SETTINGS, dt_s=2e-2, force_cap_n=20.0, gain_mm_per_s_per_n=10.0)
    system = FreehandSystem(straight_scene(wall(4.0)), settings, 0.5)
    state = driven(system, system.start(), Command(np.array([0.0, 20.0, 0.0])), 2.0)
    assert state.outcome == "held"
    assert 0.8 < -state.distance[0, 0] <= 0.9
    back = driven(system, state, Command(np.array([0.0, -20.0, 0.0])), 0.2)
    assert back.distance[0].min() > 0.0


def test_no_part_moves_further_within_a_substep_than_a_share_of_the_radius(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hand and contact pull the same way: out of a wall that the tip is deep in."""
    settings = replace(SETTINGS, dt_s=2e-2, force_cap_n=20.0, gain_mm_per_s_per_n=10.0)
    system = FreehandSystem(straight_scene(wall(4.0)), settings, 16.0)
    state = driven(system, system.start(), Command(np.array([0.0, 20.0, 0.0])), 1.0)
    assert -state.distance.min() > 0.8
    push, seen = system.around.push, [state.segments]

    def look(segments: Segments) -> ContactForces:
        seen.append(segments)
        return push(segments)

    monkeypatch.setattr(system.around, "push", look)
    after = system.step(state, Command(np.array([0.0, -20.0, 0.0])))
    assert after.distance.min() > 0.0
    ends = [np.concatenate([one.start, one.end]) for one in seen]
    most = MOVE_SHARE * float(system.scene.tool.radius.min())
    longest = [min(np.linalg.norm(ends[k] - one, axis=1).max() for one in ends[:k]) for k in range(1, len(ends))]
    assert 0.9 * most < max(longest) <= most + 1e-9


def test_opposite_sides_push_apart() -> None:
    mesh = wall(1.0)
    tree = ProximityTree(
        TriangleMesh(np.concatenate([mesh.vertices, mesh.vertices - [0.0, 2.4, 0.0]]),
                     np.concatenate([mesh.faces, mesh.faces + len(mesh.vertices)]))
    )  # fmt: skip
    ball = Segments(np.zeros((1, 3)), np.array([[5.0, 0.0, 0.0]]), np.array([1.5]))
    push = ContactModel(tree, (), 10.0).push(ball)
    assert sorted(push.force[:, 1].round(6).tolist()) == [-5.0, 1.0]
    assert push.deepest == pytest.approx(0.5 / 1.5)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, FreehandSpec]:
    """Everything that a run can hold, at random, before a wall."""
    points = np.array([[0.0, 0.0, 0.0], [0.0, 10.0, 1.0], [0.0, 20.0, 0.0]])
    scene = replace(
        straight_scene(wall(WALL_MM), points), targets=np.array([[0.0, 30.0, 0.0]]), target_names=("there",),
        zones=(Zone("nerve", Sphere([1.5, 3.0, 0.0], 1.0), 0.5),),
    )  # fmt: skip
    spec = FreehandSpec(SceneSpec.of(scene), SETTINGS, 12.0)
    system, random = spec.build(), np.random.default_rng(5)
    writer = RunWriter(tmp_path_factory.mktemp("freehand") / "run", spec, system.row_layout, seed=5)
    driver: Driver[FreehandState] = Driver(system, log=writer)
    for k in range(3000):
        if k % 100 == 0:
            force, axes = random.normal(size=3) * 4.0 + [0.0, 3.0, 0.0], random.uniform(-1.0, 1.0, 3)
        requests = {500: Reset(), 1200: SetTask("inspect"), 1600: SetSettings(replace(SETTINGS, dt_s=2e-3))}
        if k in requests:
            driver.apply(requests[k])
        twist, master = float(np.sin(k / 50.0)), Master(np.ones(3)) if k == 900 else None
        driver.step(Command(force, 0.1, twist, master, (axes[0], axes[1], 0.2 * axes[2])))
    writer.close()
    return Run.read(next(Path(writer._folder.parent).iterdir())), spec


def test_a_run_is_driven_again_with_the_same_hash(recorded: tuple[Run, FreehandSpec]) -> None:
    """HAZ-13 and HAZ-41: in this world too, and the run says which it is."""
    run, spec = recorded
    assert run.manifest["world"] == "freehand"
    again = replay(run, spec_of(run))
    assert again.same
    assert replay(run, spec, keep_states=False).same
    assert again.states[-1].count.sum() > 0
    first = again.states[0]
    assert isinstance(first, FreehandState)


def test_its_score_says_that_nothing_was_certified(recorded: tuple[Run, FreehandSpec]) -> None:
    """Contacts, depth and clearance of the rows against coal and another library's labels."""
    run, _ = recorded
    score = score_run(run)
    assert (score.mode, score.certified) == ("freehand", False)
    assert score.time_s == pytest.approx(1100 * 1e-3 + 1400 * 2e-3)
    tool, rows = Tool.load("bent_30"), slice(500, None)
    inside = {part: run.column(f"d0_{part}")[rows] < 0.0 for part in range(2)}
    by_part = {one.part: one.count for one in score.contacts_by if one.structure == "bone"}
    assert by_part == {name: label(inside[k])[1] for k, name in enumerate(tool.segment_names) if inside[k].any()}
    assert score.contacts == run.column("contacts")[-1] > 1
    judge = CoalJudge(wall(WALL_MM))
    for index in range(500, 3000, 97):
        ends = [np.array([[run.column(f"s{s}_{e}{a}")[index] for a in "xyz"] for s in range(2)]) for e in "ab"]
        least = min(run.column("d0_0")[index], run.column("d0_1")[index])
        if 0.0 < least < SETTINGS.reach_mm:
            assert judge.clearance(Segments(*ends, tool.radius)) == pytest.approx(least, abs=1e-6)
        # The wall is a plane, and the tool comes from below: depth in closed form.
        highest = max((ends[k][s, 1] + tool.radius[s]) for k in range(2) for s in range(2))
        if least < SETTINGS.reach_mm:
            assert least == pytest.approx(WALL_MM - highest, abs=1e-9)


def test_it_is_driven_in_the_control_process_like_the_others(tmp_path: Path) -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 20.0, 0.0]])
    spec = FreehandSpec(SceneSpec.of(straight_scene(wall(5.0), points)), SETTINGS)
    spec.build().prepare()  # what is not compiled yet is compiled here
    process: ControlProcess[FreehandSnapshot] = ControlProcess(spec, real_time=False, record=tmp_path / "run")
    process.start()
    try:
        process.wait_ready()
        first = process.snapshot()
        assert first is not None
        assert first.certified is False
        process.run()
        deadline, snapshot = time.monotonic() + 60.0, first
        while not snapshot.contacts and time.monotonic() < deadline:
            process.set_grip(first.grip + np.array([0.0, 30.0, 0.0]))
            process.axes(0.2, 0.0, 0.0)
            time.sleep(0.02)
            snapshot = process.snapshot() or snapshot
        process.release()
        time.sleep(0.3)
    finally:
        process.close()
    assert snapshot.contacts[0].structure == "bone"
    assert snapshot.blockers[0].kind == "contact"
    assert snapshot.tip[1] > 3.0
    run = Run.read(tmp_path / "run")
    assert replay(run, spec_of(run)).same


def test_what_it_refuses() -> None:
    scene: Scene = straight_scene(wall(4.0))
    system = FreehandSystem(scene, SETTINGS)
    state = system.start()
    for request, error in (
        (Straighten(), ControlError),
        (SetTask("path"), ControlError),
        (SetTask("inspect"), ControlError),
    ):
        with pytest.raises(error):
            system.apply(state, request)
    with pytest.raises(StartRefused, match="inside bone"):
        FreehandSystem(straight_scene(wall(-20.0)), SETTINGS).start()
    with pytest.raises(InputError, match="stiffness"):
        FreehandSpec(SceneSpec.of(scene), SETTINGS, 0.0)
    nothing = system.step(state, Command(np.full(3, np.nan), np.nan, np.nan, None, (np.nan, np.inf, 0.0)))
    np.testing.assert_array_equal(nothing.position, state.position)
    np.testing.assert_array_equal(nothing.rotation, state.rotation)
    with pytest.raises(InputError, match="three numbers"):
        system.step(state, Command(np.zeros(2)))
