"""The controller in closed loop, its clearance judged by coal (HAZ-01, HAZ-02, HAZ-03, HAZ-05)."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.engine.scenes import CoalJudge, curved_tube, head_corridor, head_mesh, placed_scene, straight_scene, wall
from vfix_engine.anatomy.phantom import load_bone_surface, load_landmarks
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, InputError, StartRefused
from vfix_engine.geometry.capsules import Segments
from vfix_engine.worlds.rigid.dry_run import dry_run
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import ON_PATH_MM, Command, Rehearsal
from vfix_engine.worlds.rigid.scene import Scene
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec

SETTINGS = ControlSettings()
FAST = ControlSettings(dt_s=5e-3)  # steps of 0.05 mm: five times fewer, the certificate the same


def segments_of(snapshot: RigidSnapshot) -> Segments:
    return Segments(snapshot.segments_start, snapshot.segments_end, snapshot.radius)


def judged(scene: Scene, snapshots: list[RigidSnapshot], every: int) -> float:
    """Least clearance that coal finds among every n-th snapshot and the ten that we call the tightest."""
    judge = CoalJudge(scene.tree.mesh)
    tightest = sorted(snapshots, key=lambda s: s.clearance_mm)[:10]
    return min(judge.clearance(segments_of(s)) for s in [*snapshots[::every], *tightest])


@pytest.fixture(scope="module")
def real_head(request: pytest.FixtureRequest) -> Scene:
    data: Path = request.getfixturevalue("trial_data")
    return placed_scene(head_mesh(data), head_corridor(data))


@pytest.fixture(scope="module")
def phantom() -> Scene:
    points = [p.position for p in load_landmarks().corridor]
    return placed_scene(load_bone_surface(), np.array(points))


@pytest.fixture(scope="module")
def tube() -> Scene:
    return placed_scene(*curved_tube())


def test_the_real_corridor_is_completed_on_the_path_and_clear_of_bone(real_head: Scene) -> None:
    """Tip error at most 0.01 mm mean and 0.05 mm largest, clearance never below the margin of 0.3 mm."""
    kept: list[RigidSnapshot] = []
    run = HeadlessRun(Rehearsal(real_head, SETTINGS), kept.append)
    last = run.follow()
    report = run.tally.report()
    assert last.phase == "done"
    assert report["tip_error_mm"]["mean"] <= 0.01
    assert report["tip_error_mm"]["max"] <= 0.05
    assert report["min_clearance_mm"] >= SETTINGS.margin_mm
    assert judged(real_head, kept, every=25) >= SETTINGS.margin_mm - 1e-6
    assert real_head.path is not None
    # The error is told honestly: measured again on a dense polyline of the path.
    dense = real_head.path.position(np.linspace(0.0, real_head.path.length, int(real_head.path.length / 0.002) + 2))
    for snapshot in kept[::200]:
        independent = np.linalg.norm(dense - snapshot.tip, axis=1).min()
        assert snapshot.tip_error_mm == pytest.approx(independent, abs=1e-3)


@pytest.mark.parametrize("scene_name", ["real_head", "phantom", "tube"])
@pytest.mark.parametrize("free", [False, True])
def test_full_force_into_bone_stops_at_the_margin(scene_name: str, free: bool, request: pytest.FixtureRequest) -> None:
    """HAZ-01: whatever the hand does, and it comes near enough to mean something."""
    scene: Scene = request.getfixturevalue(scene_name)
    kept: list[RigidSnapshot] = []
    run = HeadlessRun(Rehearsal(scene, replace(FAST, k_tau=float(free))), kept.append)
    pushing = run.push(2000, seed=4, free=free)["pushing"]
    assert pushing["steps"] == 2000
    assert run.tally.least_clearance >= SETTINGS.margin_mm
    assert judged(scene, kept, every=10) >= SETTINGS.margin_mm - 1e-6
    if free or scene_name == "real_head":
        assert pushing["min_clearance_mm"] <= SETTINGS.margin_mm + 0.05


def test_between_the_steps_the_tool_keeps_its_distance_too(real_head: Scene) -> None:
    """HAZ-02: fifty times finer replay where the pushing hand is near bone; our oracle is checked against coal."""
    kept: list[RigidSnapshot] = []
    run = HeadlessRun(Rehearsal(real_head, replace(FAST, k_tau=1.0)), kept.append)
    run.push(1500, seed=9, free=True)
    robot, tool = real_head.placed_robot(), real_head.tool
    judge = CoalJudge(real_head.tree.mesh)
    checked = 0
    for before, after in pairwise(kept):
        if min(before.clearance_mm, after.clearance_mm) > SETTINGS.margin_mm + 0.1 or checked >= 300:
            continue
        checked += 1
        for share in np.linspace(0.0, 1.0, 51)[1:-1]:
            pose = tool.segments(*robot.tip_pose(before.q + share * (after.q - before.q)))
            assert real_head.tree.clearance(pose, 1.0) >= SETTINGS.margin_mm - 1e-3
        if checked % 20 == 0:
            assert judge.clearance(pose) == pytest.approx(real_head.tree.clearance(pose), abs=1e-6)
    assert checked > 100


def test_the_dry_run_takes_the_poses_of_the_rehearsal(real_head: Scene) -> None:
    """Clearance along the path as the plan shows it and as it is driven, both of the same controller."""
    dry = dry_run(real_head, SETTINGS)
    kept: list[RigidSnapshot] = []
    HeadlessRun(Rehearsal(real_head, SETTINGS), kept.append).follow()
    assert dry.completed
    driven = np.interp(dry.s, [s.progress_mm for s in kept], [s.clearance_mm for s in kept])
    assert np.abs(driven - dry.clearance).mean() < 0.1
    assert min(s.clearance_mm for s in kept) == pytest.approx(dry.clearance.min(), abs=0.05)
    tight = dry.clearance < 1.0
    assert tight.any()
    assert np.abs(driven - dry.clearance)[tight].max() < 0.3


def test_the_phantoms_corridor_can_be_driven(phantom: Scene) -> None:
    run = HeadlessRun(Rehearsal(phantom, FAST), lambda snapshot: None)
    assert run.follow().phase == "done"
    assert run.tally.least_clearance >= SETTINGS.margin_mm


def test_inspection_holds_the_view_while_the_tool_swings(real_head: Scene) -> None:
    """Li 2007, eq. 22-25: the virtual point stays within 0.02 mm of the target, all of the tool clear of bone."""
    assert real_head.path is not None
    scene = replace(real_head, targets=real_head.path.points[-1:], target_names=("end",))
    kept: list[RigidSnapshot] = []
    run = HeadlessRun(Rehearsal(scene, FAST), kept.append)
    result = run.inspect(0, 1500)
    assert result["reached"]
    assert result["error_mm"]["max"] <= 0.02
    assert result["swing_deg"] > 5.0
    held = [s for s in kept if s.phase == "inspect_hold"]
    for snapshot in held[::50]:  # told honestly
        away = np.linalg.norm(snapshot.virtual_point - scene.targets[0])
        assert snapshot.target_error_mm == pytest.approx(away, abs=1e-12)
        assert np.linalg.norm(snapshot.virtual_point - snapshot.tip) == pytest.approx(FAST.view_distance_mm)
    assert judged(scene, kept, every=40) >= SETTINGS.margin_mm - 1e-6


def test_a_wall_across_the_path_holds_the_tool_and_is_named() -> None:
    """Progress ends instead of the problem failing, and the page can say why."""
    scene = straight_scene(wall(20.0), np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]]))
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start()
    held: list[RigidSnapshot] = []
    for _ in range(800):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        if snapshot.held:
            held.append(snapshot)
    assert len(held) > 100
    assert held[-1].reason == "bone on the tip, 0.3 mm away"
    assert held[-1].blocking_point is not None
    assert held[-1].blocking_point[1] == pytest.approx(20.0)
    assert snapshot.clearance_mm == pytest.approx(SETTINGS.margin_mm, abs=0.02)
    assert snapshot.tip_error_mm < 0.05


def test_a_structure_is_told_by_the_scenes_name_of_it_and_kept_by_its_id() -> None:
    scene = straight_scene(wall(20.0), np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]]))
    spec = RigidSpec(SceneSpec.of(replace(scene, structure_names={"bone": "skull base"})), FAST)
    spec = RigidSpec.from_parts(*spec.to_parts())
    rehearsal = Rehearsal(spec.scene.build(), FAST)
    state = rehearsal.start()
    for _ in range(500):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    assert snapshot.held
    assert (snapshot.reason, snapshot.active[0]) == ("skull base on the tip, 0.3 mm away",) * 2
    assert (snapshot.blockers[0].kind, snapshot.blockers[0].structure) == ("bone", "bone")
    assert snapshot.blockers[0].words == snapshot.reason
    values, arrays = spec.to_parts()
    del values["structure_names"]  # of a run that was recorded before structures had names in it
    assert RigidSpec.from_parts(values, arrays).scene.structure_names == {}


@pytest.mark.parametrize("margin", [0.1, 1.0, 2.5])
def test_what_holds_the_tool_is_bone_at_the_margin_whatever_the_margin(margin: float) -> None:
    """Every row is a triangle's own: nothing nearer than bone may stop the tool before bone does."""
    scene = straight_scene(wall(20.0), np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]]))
    rehearsal = Rehearsal(scene, replace(FAST, margin_mm=margin))
    state = rehearsal.start()
    for _ in range(800):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    assert snapshot.held
    assert snapshot.reason == f"bone on the tip, {snapshot.clearance_mm:.1f} mm away"
    assert margin <= snapshot.clearance_mm <= margin + 0.02


def test_a_joint_at_its_limit_is_named() -> None:
    scene = straight_scene(wall(500.0), np.array([[0.0, 0, 0], [0, 100, 0], [0, 300, 0]]))
    rehearsal = Rehearsal(scene, ControlSettings(dt_s=2e-2))
    state = rehearsal.start()
    for _ in range(1600):
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
    assert snapshot.held
    assert "at its limit" in snapshot.reason
    assert "joint 2" in " ".join(snapshot.active) or "joint 6" in " ".join(snapshot.active)
    robot = scene.robot
    assert ((snapshot.q >= robot.lower) & (snapshot.q <= robot.upper)).all()


def test_nonsense_forces_move_nothing(tube: Scene) -> None:
    """HAZ-05."""
    rehearsal = Rehearsal(tube, FAST)
    state = rehearsal.start()
    for bad in (np.full(3, np.nan), np.array([np.inf, 0, 0]), np.full(3, -np.inf)):
        after, snapshot = rehearsal.step(state, Command(bad))
        np.testing.assert_array_equal(after.tool.q, state.tool.q)
        assert np.isfinite(snapshot.tip).all()
    _, huge = rehearsal.step(state, Command(np.full(3, 1e300)))
    assert np.linalg.norm(huge.force) <= FAST.force_cap_n + 1e-9


def test_no_hand_no_motion_and_same_inputs_same_recording(tube: Scene) -> None:
    """HAZ-13: 100 of 100; and the robot never pulls by itself."""
    rehearsal = Rehearsal(tube, FAST)
    state = rehearsal.start()
    after, _ = rehearsal.step(state, Command(np.zeros(3)))
    np.testing.assert_array_equal(after.tool.q, state.tool.q)

    hashes = set()
    for _ in range(100):
        random, state, digest = np.random.default_rng(1), rehearsal.start("free"), sha256()
        for _ in range(40):
            state, snapshot = rehearsal.step(state, Command(5.0 * random.normal(size=3)))
            digest.update(snapshot.q.tobytes())
        hashes.add(digest.hexdigest())
    assert len(hashes) == 1
    assert np.abs(snapshot.q - rehearsal.start("free").tool.q).max() > 1e-3


def test_a_tip_off_the_path_is_guided_back_first() -> None:
    """The approach phase: straight to the path at the hand's speed, then following."""
    scene = straight_scene(wall(200.0), np.array([[8.0, 5, 0], [8, 20, 0], [8, 40, 0]]))
    rehearsal = Rehearsal(scene, FAST)
    state = rehearsal.start()
    assert state.phase == "approach"
    phases = []
    for _ in range(400):
        state, snapshot = rehearsal.step(state, Command(np.array([0.0, 5.0, 0.0])))
        phases.append(snapshot.phase)
    assert phases[0] == "approach"
    assert phases[-1] == "follow"
    assert snapshot.tip_error_mm < 0.03


def test_the_error_of_the_tip_counts_from_where_it_first_came_onto_the_path() -> None:
    """Also where it is pushed off later, further than what is called following; the approach before it is counted."""
    run = HeadlessRun(Rehearsal(straight_scene(wall(200.0), np.array([[8.0, 5, 0], [8, 20, 0]])), FAST), lambda s: None)
    assert run.follow().phase == "done"
    report = run.tally.report()
    assert report["approach_steps"] > 100
    assert report["tip_error_mm"]["max"] <= ON_PATH_MM
    assert len(run.tally.errors) + report["approach_steps"] == pytest.approx(report["steps"], abs=1)
    away = replace(run.rehearsal.snapshot(run.rehearsal.start()), tip_error_mm=3.0, phase="approach")
    run.tally.add(away, 0.0)
    assert run.tally.report()["tip_error_mm"]["max"] == 3.0
    for mode, error, counts in (("free", 2.0, 0), ("path", 2.0, 0), ("path", 0.01, 1), ("path", 2.0, 1)):
        before = len(run.tally.errors)
        run.tally.add(replace(away, mode=mode, tip_error_mm=error), 0.0)
        assert len(run.tally.errors) - before == counts, (mode, error)


@pytest.mark.parametrize("mode", ["free", "inspect"])
def test_progress_is_the_nearest_point_of_the_path_wherever_the_tip_has_gone(mode: str) -> None:
    """Off the path nothing binds it to the arc where it last was: 40 mm further it says 40 mm further."""
    scene = straight_scene(wall(200.0), np.array([[0.0, 0, 0], [0, 30, 0], [0, 60, 0]]))
    rehearsal = Rehearsal(replace(scene, targets=np.array([[0.0, 50.0, 9.0]]), target_names=("one",)), FAST)
    state = rehearsal.with_mode(rehearsal.start("path"), mode)
    moved = replace(state, tool=rehearsal.controller.measure(state.q + 40.0 * np.eye(7)[1]))
    snapshot = rehearsal.snapshot(moved)
    assert snapshot.progress_mm == pytest.approx(40.0, abs=1e-6)
    assert snapshot.tip_error_mm == pytest.approx(0.0, abs=1e-6)
    assert rehearsal.step(moved, Command(np.zeros(3)))[1].progress_mm == pytest.approx(40.0, abs=0.5)


@pytest.mark.parametrize("wrong", [np.zeros(2), np.zeros((1, 3)), 5.0])
def test_a_force_of_another_shape_is_an_error(wrong: np.ndarray) -> None:
    rehearsal = Rehearsal(straight_scene(wall(90.0)), FAST)
    with pytest.raises(InputError, match="three numbers in N"):
        rehearsal.step(rehearsal.start("free"), Command(wrong))


def test_starts_that_would_be_unsafe_are_refused_with_the_reason() -> None:
    """HAZ-04."""
    with pytest.raises(StartRefused, match=r"tip would start .* mm from bone"):
        Rehearsal(straight_scene(wall(0.9), np.array([[0.0, 0, 0], [0, 10, 0]])), FAST).start()
    scene = replace(straight_scene(wall(90.0)), q_start=np.array([0, 500.0, 0, 0, 0, 0, 0]))
    with pytest.raises(StartRefused, match=r"joint 2 \(y stage\) would start at 500"):
        Rehearsal(scene, FAST).start("free")


def test_inside_the_margin_only_motions_that_never_deepen_are_taken() -> None:
    """HAZ-04: the anatomy may have moved; every start inside the margin recovers or holds."""
    random = np.random.default_rng(5)
    scene = straight_scene(wall(1.15))  # 0.15 mm in front of the tip: inside the margin
    rehearsal = Rehearsal(scene, FAST)
    controller = rehearsal.controller
    blank = Rehearsal(straight_scene(wall(90.0)), FAST).start("free")
    for _ in range(60):
        q = np.concatenate([random.uniform(-0.1, 0.05, 3), random.uniform(-0.002, 0.002, 4)])
        state = replace(blank, tool=controller.measure(q))
        clearance = state.tool.clearance
        assert clearance < SETTINGS.margin_mm
        for _ in range(12):
            push = random.normal(size=3) * 5
            state, snapshot = rehearsal.step(state, Command(push))
            assert snapshot.clearance_mm >= min(clearance, SETTINGS.margin_mm) - 1e-12
            clearance = snapshot.clearance_mm


def test_modes_that_the_scene_cannot_do_are_refused() -> None:
    rehearsal = Rehearsal(straight_scene(wall(90.0)), FAST)
    with pytest.raises(ControlError, match="path"):
        rehearsal.start("path")
    state = rehearsal.start("free")
    with pytest.raises(ControlError, match="no target number 1"):
        rehearsal.with_mode(state, "inspect")
    with pytest.raises(ControlError, match="teleport"):
        rehearsal.with_mode(state, "teleport")
