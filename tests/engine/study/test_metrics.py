"""Each metric of a run is computed a second way: by another formula, another library, or from the drive itself."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.ndimage import label
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tests.engine.scenes import CoalJudge, curved_tube
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.shapes import Sphere
from vfix_engine.robots import Tool
from vfix_engine.runtime.command import Command
from vfix_engine.runtime.operator import Act
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.study.metrics import RunScore, log_dimensionless_jerk, score_run, spectral_arc_length
from vfix_engine.study.metrics.smoothness import dimensionless, filter_samples, moving
from vfix_engine.study.series import series_of
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.rigid.headless import HeadlessRun
from vfix_engine.worlds.rigid.rehearsal import Rehearsal
from vfix_engine.worlds.rigid.requests import ApproachPoint
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot
from vfix_engine.worlds.rigid.spec import RigidSpec, SceneSpec
from vfix_engine.worlds.rigid.system import ON_PATH_MM, RehearsalState, RigidSystem

MESH, POINTS = curved_tube(radius=6.0)
NARROW, _ = curved_tube(radius=4.0)  # in which a pushed tool is held
QUICK = ControlSettings(gain_mm_per_s_per_n=8.0)


@dataclass
class Drive:
    """A recorded drive, and what was seen during it."""

    run: Run
    spec: RigidSpec
    report: dict[str, Any] = field(default_factory=dict)
    held: dict[tuple[str, str, str], int] = field(default_factory=lambda: defaultdict(int))
    target_error: list[float] = field(default_factory=list)

    @cached_property
    def score(self) -> RunScore:
        return score_run(self.run)

    def column(self, *names: str) -> np.ndarray:
        return np.column_stack([self.run.column(name) for name in names])

    @property
    def tip(self) -> np.ndarray:
        return self.column("tip_x", "tip_y", "tip_z")


def drive(folder: Path, job: str, zones: tuple[Zone, ...] = ()) -> Drive:
    base = np.eye(4)
    base[:3, 3] = -Tool.load("bent_30").tip_in_flange  # the tip is before the path: the drive begins with an approach
    mesh = NARROW if job == "push" else MESH
    scene = SceneSpec(
        mesh.vertices, mesh.faces, "steady_hand", "bent_30", base, np.zeros(7), POINTS, POINTS[-1:], ("end",), zones
    )
    spec = RigidSpec(scene, QUICK)
    rehearsal = Rehearsal(scene.build(), QUICK)
    writer = RunWriter(folder / job, spec, rehearsal.system.row_layout)
    held: dict[tuple[str, str, str], int] = defaultdict(int)
    target_error = []

    def keep(snapshot: RigidSnapshot) -> None:
        if snapshot.held:
            one = snapshot.blockers[0]
            held[one.kind, one.structure, one.part] += 1
        if snapshot.phase == "inspect_hold":
            target_error.append(snapshot.target_error_mm)

    headless = HeadlessRun(rehearsal, keep, writer)
    report: dict[str, Any] = {}
    if job == "inspect":
        report = headless.inspect(0, 3000)
    elif job == "back":
        headless.follow(send_back())
    elif job == "push":
        report = headless.push(600, 3, free=True)
    else:
        headless.follow()
    writer.close()
    return Drive(Run.read(folder / job), spec, report | headless.tally.report(), held, target_error)


def send_back() -> Callable[[RigidSystem, RehearsalState], Act]:
    """A hand that is half way when it asks for an approach to a place behind it."""
    sent = False

    def act(system: RigidSystem, state: RehearsalState) -> Act:
        nonlocal sent
        path = system.scene.path
        assert path is not None
        if sent or state.phase != "follow" or state.nearest is None or state.nearest.s < 0.5 * path.length:
            return Act(Command(np.zeros(3), drive=1))
        sent = True
        return Act(Command(np.zeros(3), drive=1), (ApproachPoint(0.3 * path.length),))

    return act


@pytest.fixture(scope="module")
def followed(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    return drive(tmp_path_factory.mktemp("followed"), "follow")


@pytest.fixture(scope="module")
def pushed(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    zone = Zone("nerve", Sphere(POINTS[3] + [3.0, 0.0, 0.0], 1.0), 0.5)
    return drive(tmp_path_factory.mktemp("pushed"), "push", (zone,))


@pytest.fixture(scope="module")
def inspected(tmp_path_factory: pytest.TempPathFactory) -> Drive:
    return drive(tmp_path_factory.mktemp("inspected"), "inspect")


def curve(points: np.ndarray, count: int = 100_001) -> np.ndarray:
    """Points on the path, by scipy's spline alone."""
    chords = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.asarray(make_interp_spline(chords, points, k=5)(np.linspace(0.0, chords[-1], count)))


def test_the_path_error_is_the_distance_to_the_curve_of_another_library(followed: Drive) -> None:
    score, tip = followed.score, followed.tip
    (on_path,) = np.nonzero(followed.run.column("phase") >= 2)
    assert on_path[0] > 10, "the drive begins with an approach"
    away = cKDTree(curve(POINTS)).query(tip[on_path[0] :])[0]
    assert score.path_error_mm is not None
    assert score.path_error_mm.robot_frame.mean == pytest.approx(away.mean(), abs=2e-4)
    assert score.path_error_mm.robot_frame.max == pytest.approx(away.max(), abs=2e-4)
    assert score.path_error_mm.true_frame == score.path_error_mm.robot_frame, "nobody says that they differ"
    assert score.approach.time_s == pytest.approx(on_path[0] * QUICK.dt_s)
    assert score.approach.path_length_mm == pytest.approx(
        sum(map(math.dist, tip[: on_path[0]], tip[1 : on_path[0] + 1]))
    )


def test_an_approach_on_the_way_does_not_count_in_the_path_error(tmp_path: Path) -> None:
    run = drive(tmp_path, "back")
    phase = run.run.column("phase")
    on_path = phase >= 2
    first = int(np.flatnonzero(on_path)[0])
    approach = np.flatnonzero(~on_path)
    between = approach[approach > first]
    assert len(between) > 10, "there is an approach in the middle"
    away = cKDTree(curve(POINTS)).query(run.tip)[0]
    assert away[between].max() > 0.1, "it leaves the path"
    error = run.score.path_error_mm
    assert error is not None
    assert error.robot_frame.max == pytest.approx(away[on_path].max(), abs=2e-4)
    assert error.robot_frame.mean == pytest.approx(away[on_path].mean(), abs=2e-4)
    assert run.report["tip_error_mm"]["max"] == pytest.approx(error.robot_frame.max, abs=ON_PATH_MM)


def test_a_tip_that_was_pushed_off_the_path_counts(followed: Drive) -> None:
    """Its phase is an approach too, but nobody asked for it."""
    ticks = followed.run.ticks.copy()
    names = [name for name, _ in followed.run.manifest["columns"]]
    pushed = slice(len(ticks) // 2, len(ticks) // 2 + 50)
    ticks[pushed, names.index("phase")] = 1.0
    ticks[pushed, names.index("tip_x")] += 1.0
    away = cKDTree(curve(POINTS)).query(ticks[pushed][:, [names.index(f"tip_{axis}") for axis in "xyz"]])[0]
    error = score_run(replace(followed.run, ticks=ticks)).path_error_mm
    assert error is not None
    assert error.robot_frame.max == pytest.approx(away.max(), abs=1e-3)
    assert away.max() > 0.5


def test_the_true_error_of_a_rigid_displacement(followed: Drive) -> None:
    moved = np.eye(4)
    moved[:3, :3] = Rotation.from_euler("xyz", [2.0, -1.0, 3.0], degrees=True).as_matrix()
    moved[:3, 3] = 0.6, -0.3, 0.8
    score = score_run(followed.run, transform_believed_to_true=moved)
    first = int(np.flatnonzero(followed.run.column("phase") >= 2)[0])
    true = Rotation.from_matrix(moved[:3, :3]).apply(followed.tip[first:]) + moved[:3, 3]
    away = cKDTree(curve(POINTS)).query(true)[0]
    assert score.path_error_mm is not None
    assert followed.score.path_error_mm is not None
    assert score.path_error_mm.true_frame.mean == pytest.approx(away.mean(), abs=1e-3)
    assert score.path_error_mm.true_frame.max == pytest.approx(away.max(), abs=1e-3)
    assert score.path_error_mm.robot_frame == followed.score.path_error_mm.robot_frame
    with pytest.raises(InputError, match="transform"):
        score_run(followed.run, transform_believed_to_true=np.diag([2.0, 1.0, 1.0, 1.0]))


def test_time_and_length_from_the_joints_speeds(followed: Drive) -> None:
    """J(q)·q̇·dt of every step, by Pinocchio's Jacobian where the samples have differences of positions."""
    score, run = followed.score, followed.run
    assert score.time_s == pytest.approx(run.column("t")[-1])
    robot = followed.spec.scene.build().placed_robot()
    q, v = (followed.column(*(f"{kind}{i}" for i in range(7))) for kind in "qv")
    first = int(np.flatnonzero(run.column("phase") >= 2)[0])
    speed = [np.linalg.norm(robot.tip(a).jacobian[:3] @ b) for a, b in zip(q, v, strict=True)]
    assert score.path_length_mm == pytest.approx(QUICK.dt_s * sum(speed[first + 1 :]), rel=2e-3)


def test_spectral_arc_length_by_the_sum_of_its_definition(followed: Drive) -> None:
    bell = np.exp(-5.0 * np.arange(-1.0, 1.0, 0.01) ** 2)
    assert spectral_arc_length(bell, 100.0) == pytest.approx(-1.41403, abs=1e-5)  # as published with the definition
    first = int(np.flatnonzero(followed.run.column("phase") >= 2)[0])
    speed = np.linalg.norm(np.diff(followed.tip[first:], axis=0), axis=1) / QUICK.dt_s
    n = 2 ** (math.ceil(math.log2(len(speed))) + 4)
    frequency = np.arange(0.0, 10.0, 1.0 / (n * QUICK.dt_s))
    times = QUICK.dt_s * np.arange(len(speed))
    amplitude = np.array([abs(np.sum(speed * np.exp(-2j * np.pi * f * times))) for f in frequency])
    amplitude /= amplitude.max()
    last = int(np.flatnonzero(amplitude >= 0.05)[-1])
    steps = zip(frequency[: last + 1], amplitude[: last + 1], strict=True)
    points = [(f / frequency[last], a) for f, a in steps]
    length = sum(math.dist(a, b) for a, b in pairwise(points))
    assert followed.score.spectral_arc_length == pytest.approx(-length, rel=1e-9)
    assert math.isnan(spectral_arc_length(np.zeros(50), 100.0))


def test_log_dimensionless_jerk_by_polynomials(followed: Drive) -> None:
    bell = np.exp(-5.0 * np.arange(-1.0, 1.0, 0.01) ** 2)
    raw = dimensionless(bell, np.diff(bell, 2) * 100.0**2, 100.0)
    assert math.exp(-raw) == pytest.approx(335.74684, abs=1e-4)  # as published, without trimming and filter
    # A motion of minimum jerk between the times at which it passes 5 % of its peak speed, integrated in closed form.
    reach = np.polynomial.Polynomial([0.0, 0.0, 30.0, -60.0, 30.0])
    begin, end = sorted(float(t.real) for t in (reach - 0.05 * reach(0.5)).roots() if 0.0 < t.real < 1.0)
    squared = (reach.deriv(2) ** 2).integ()
    exact = -math.log((end - begin) ** 3 / reach(0.5) ** 2 * (squared(end) - squared(begin)))
    assert log_dimensionless_jerk(reach(np.linspace(0.0, 1.0, 2001)), 2000.0) == pytest.approx(exact, abs=0.01)
    first = int(np.flatnonzero(followed.run.column("phase") >= 2)[0])
    speed = np.linalg.norm(np.diff(followed.tip[first:], axis=0), axis=1) / QUICK.dt_s
    speed = speed[moving(speed)]
    half = filter_samples(1.0 / QUICK.dt_s) // 2
    assert 2 * half + 1 == 51
    jerk = []
    for k in range(len(speed)):
        at = min(max(k, half), len(speed) - 1 - half)
        x = QUICK.dt_s * np.arange(-half, half + 1)
        cubic = np.polynomial.Polynomial.fit(x, speed[at - half : at + half + 1], 3).convert()
        jerk.append(cubic.deriv(2)(QUICK.dt_s * (k - at)))
    score = -math.log(len(speed) ** 3 * QUICK.dt_s**4 * float(np.sum(np.square(jerk))) / speed.max() ** 2)
    assert followed.score.log_dimensionless_jerk == pytest.approx(score, abs=1e-6)
    assert followed.score.jerk_filter.endswith("order 3, 51 ms")


def test_rest_before_and_after_moves_neither(followed: Drive) -> None:
    t = np.linspace(0.0, 1.0, 1001)
    reach = 30.0 * (t**2 - 2.0 * t**3 + t**4)
    rested = np.concatenate([np.zeros(3000), reach, np.zeros(2000)])
    assert spectral_arc_length(rested, 1000.0) == pytest.approx(spectral_arc_length(reach, 1000.0), abs=0.02)
    assert log_dimensionless_jerk(rested, 1000.0) == log_dimensionless_jerk(reach, 1000.0)


def test_a_world_that_is_not_known_is_not_certified(pushed: Drive) -> None:
    """HAZ-41."""
    assert pushed.score.certified
    strange = replace(pushed.run, manifest={**pushed.run.manifest, "world": "another"})
    score = score_run(strange, pushed.spec)
    assert (score.world, score.mode, score.certified) == ("another", "hands-on", False)


def test_contacts_by_structure_and_part_as_labelled_by_another_library(pushed: Drive) -> None:
    """The distances of a run are replaced: a certified one has no contact."""
    assert (pushed.score.contacts, pushed.score.max_depth_mm, pushed.score.contacts_by) == (0, 0.0, ())
    random, ticks = np.random.default_rng(7), pushed.run.ticks.copy()
    names = [name for name, _ in pushed.run.manifest["columns"]]
    inside = {}
    for place in ("d0_0", "d0_1", "d1_1"):
        column = np.convolve(random.normal(size=len(ticks)), np.ones(20), "same")
        ticks[:, names.index(place)] = inside[place] = column
    score = score_run(replace(pushed.run, ticks=ticks))
    found = {(one.structure, one.part): one for one in score.contacts_by}
    assert set(found) == {("bone", "tip"), ("bone", "shaft"), ("nerve", "shaft")}
    for place, key in zip(inside, found, strict=True):
        assert found[key].count == label(inside[place] < 0.0)[1] > 5
        assert found[key].max_depth_mm == -inside[place].min()
        assert found[key].time_s == pytest.approx(QUICK.dt_s * np.count_nonzero(inside[place] < 0.0))
    assert score.contacts == sum(one.count for one in found.values())
    assert score.least_clearance_mm["nerve"] == min(inside["d1_1"].min(), pushed.run.column("d1_0").min())


def test_the_least_clearance_is_that_of_coal_and_of_a_ball(pushed: Drive) -> None:
    score, judge, tool = pushed.score, CoalJudge(NARROW), Tool.load("bent_30")
    ends = {end: np.stack([pushed.column(*(f"s{s}_{end}{a}" for a in "xyz")) for s in range(2)], 1) for end in "ab"}
    near = np.flatnonzero(pushed.column("d0_0", "d0_1").min(axis=1) < score.least_clearance_mm["bone"] + 0.01)
    every = [*range(0, len(pushed.run.ticks), 50), *near[::10], pushed.column("d0_0", "d0_1").min(axis=1).argmin()]
    least = min(judge.clearance(Segments(ends["a"][i], ends["b"][i], tool.radius)) for i in every)
    assert score.least_clearance_mm["bone"] == pytest.approx(least, abs=1e-6)
    zone = pushed.spec.scene.zones[0].solid
    assert isinstance(zone, Sphere)
    along = np.linspace(0.0, 1.0, 20_001)[:, None]
    away = []
    for s in range(2):
        i = int(pushed.run.column(f"d1_{s}").argmin())
        points = ends["a"][i, s] + along * (ends["b"][i, s] - ends["a"][i, s])
        away.append(np.linalg.norm(points - zone.centre, axis=1).min() - zone.radius - tool.radius[s])
    assert score.least_clearance_mm["nerve"] == pytest.approx(min(away), abs=1e-4)


def test_time_held_by_what_was_seen_during_the_drive(pushed: Drive) -> None:
    score = pushed.score
    assert score.held_s == pytest.approx(QUICK.dt_s * pushed.report["held_steps"])
    assert score.held_s > 0.0
    assert score.held_by is not None
    found = {(one.kind, one.structure, one.part): round(one.time_s / QUICK.dt_s) for one in score.held_by}
    assert found == pushed.held
    assert score.path_error_mm is not None, "the part before the free pushing follows the path"
    moved = pushed.run.ticks.copy()
    columns = [name for name, _ in pushed.run.manifest["columns"]]
    moved[int(np.flatnonzero(pushed.run.column("outcome") == 3)[0]), columns.index("q0")] += 1e-3
    assert score_run(replace(pushed.run, ticks=moved)).held_by is None, "it is not the step that was recorded"


def test_inspection_as_the_drive_measured_it(inspected: Drive) -> None:
    score, report = inspected.score, inspected.report
    assert report["reached"]
    assert score.target_error_mm is not None
    assert score.angle_deg is not None
    assert score.target_error_mm.robot_frame.mean == pytest.approx(np.mean(inspected.target_error), abs=1e-9)
    assert score.target_error_mm.robot_frame.max == pytest.approx(max(inspected.target_error), abs=1e-9)
    series = series_of(inspected.run)
    np.testing.assert_allclose(series.error[series.phase == 5], inspected.target_error, atol=1e-9)
    rows = inspected.run.column("phase") == 5
    turns = Rotation.from_matrix(inspected.column(*(f"r{i}{j}" for i in range(3) for j in range(3))).reshape(-1, 3, 3))
    held = turns[np.flatnonzero(rows).tolist()]
    assert score.angle_deg == pytest.approx(np.degrees((held[0].inv() * held).magnitude().max()), abs=1e-6)
    assert score.angle_deg == pytest.approx(report["swing_deg"], abs=0.1)
    shift = np.eye(4)
    shift[:3, 3] = 3.0, 4.0, 0.0
    true = score_run(inspected.run, transform_believed_to_true=shift).target_error_mm
    assert true is not None
    assert true.true_frame.mean == pytest.approx(5.0, abs=0.02)
    assert true.robot_frame == score.target_error_mm.robot_frame


def test_what_cannot_be_scored_is_said(followed: Drive) -> None:
    with pytest.raises(InputError, match="no samples"):
        score_run(replace(followed.run, ticks=followed.run.ticks[:0], events=()))
    snake = replace(followed.run, manifest={**followed.run.manifest, "world": "snake"})
    with pytest.raises(InputError):
        score_run(snake)
