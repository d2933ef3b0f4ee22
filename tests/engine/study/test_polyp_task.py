"""Polyps of study I: what counts as viewed, how long, and where they are, against poses made by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.synthetic import synthetic_colon, synthetic_course
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.tissue_motion import breathing, peristalsis
from vfix_engine.study.polyps.aiming import aim_at, may_be_within
from vfix_engine.study.polyps.live import nearest_seen
from vfix_engine.study.polyps.many_steps import after_steps
from vfix_engine.study.polyps.placing import WallPlaces, placed
from vfix_engine.study.polyps.printed import PROUD_MM
from vfix_engine.study.polyps.progress import PolypProgress
from vfix_engine.study.polyps.sight import LumenSight
from vfix_engine.study.polyps.task import Polyp, PolypTask, at_rest
from vfix_engine.study.polyps.world import polyps_in, way_of
from vfix_engine.worlds.snake.viewable import PlannedView, Viewable
from vfix_engine.worlds.snake.viewing import ViewLimits


def looking(eye: tuple[float, float, float], turn_deg: float = 0.0) -> Array:
    """A camera (4, 4) that looks along +z of the patient, turned about its y axis, its y axis down in the picture."""
    turn = math.radians(turn_deg)
    camera = np.eye(4)
    camera[:3, 0] = (math.cos(turn), 0.0, -math.sin(turn))
    camera[:3, 2] = (math.sin(turn), 0.0, math.cos(turn))
    camera[:3, 3] = eye
    return camera


def polyp(s_mm: float, z: float = 0.0) -> Polyp:
    """A polyp whose middle is on the z axis, its wall below."""
    return Polyp(s_mm, (0.0, -PROUD_MM, z), (0.0, 1.0, 0.0), (0.0, 10.0, z))


def task(*polyps: Polyp, end_mm: float = 1000.0) -> PolypTask:
    return PolypTask(polyps or (polyp(100.0),), 0.0, end_mm)


def free(eye: Array, index: int, t: float) -> bool:
    return True


@pytest.mark.parametrize(("distance", "within"), [(7.9, False), (8.1, True), (15.0, True), (21.9, True), (22.1, False)])
def test_a_target_is_within_15_and_7_mm(distance: float, within: bool) -> None:
    aim = aim_at(looking((0.0, 0.0, -distance)), np.zeros(3))
    assert aim.distance_mm == pytest.approx(distance)
    assert aim.angle_deg == pytest.approx(0.0)
    assert aim.within is within


@pytest.mark.parametrize(
    ("turn", "within"), [(19.9, True), (-19.9, True), (20.1, False), (-20.1, False), (90.0, False), (180.0, False)]
)
def test_a_target_is_within_20_degrees_of_the_optical_axis(turn: float, within: bool) -> None:
    aim = aim_at(looking((0.0, 0.0, -15.0), turn), np.zeros(3))
    assert aim.angle_deg == pytest.approx(abs(turn))
    assert aim.within is aim.framed is within  # the frame touches the circle of the angle


def test_a_target_in_the_corner_of_the_frame_is_more_than_20_degrees_off() -> None:
    side = math.tan(math.radians(18.0))
    aim = aim_at(looking((0.0, 0.0, 0.0)), 13.0 * np.array([side, side, 1.0]))
    assert aim.framed
    assert aim.angle_deg == pytest.approx(24.7, abs=0.1)
    assert not aim.within


def test_the_marker_goes_from_blue_to_yellow_gradually() -> None:
    best = aim_at(looking((0.0, 0.0, -15.0)), np.zeros(3))
    half = aim_at(looking((0.0, 0.0, -18.5)), np.zeros(3))
    aside = aim_at(looking((0.0, 0.0, -15.0), 15.0), np.zeros(3))
    assert best.accuracy == pytest.approx(1.0)
    assert half.accuracy == pytest.approx(0.5)
    assert aside.accuracy == pytest.approx(0.25)
    assert aim_at(looking((0.0, 0.0, -22.0001)), np.zeros(3)).accuracy == 0.0
    assert aim_at(looking((0.0, 0.0, -21.9999)), np.zeros(3)).accuracy == pytest.approx(0.0, abs=1e-4)


def held(progress: PolypProgress, given: PolypTask, camera: Array, until: float, dt: float = 0.5) -> PolypProgress:
    targets = given.targets()
    for t in np.arange(progress.t + dt, until + 1e-9, dt):
        progress = progress.step(given, camera, 80.0, float(t), targets, free)
    return progress


def test_a_polyp_is_cleared_by_seven_seconds_in_one_piece() -> None:
    given, there, away = task(), looking((0.0, 0.0, -18.0), 5.0), looking((0.0, 0.0, -30.0))
    progress = held(PolypProgress.at_start(given), given, there, 6.5)
    assert progress.held_s == pytest.approx(6.0)  # from the first step at whose end it was viewed
    assert progress.marker == pytest.approx(1.0 - 3.0 / 7.0)
    progress = held(progress, given, away, 7.0)
    assert (progress.held_s, progress.marker, progress.viewed, progress.viewings[0].lost) == (0.0, 0.0, False, 1)
    progress = held(progress, given, there, 14.0)
    assert progress.cleared == 0  # 6.0 and 6.5 s, but in two pieces
    progress = held(progress, given, there, 14.5)
    viewing = progress.viewings[0]
    assert (progress.cleared, viewing.lost) == (1, 1)
    assert viewing.cleared_t == pytest.approx(14.5)
    assert viewing.viewed_s == pytest.approx(13.0)
    assert viewing.distance_mm_s / viewing.viewed_s == pytest.approx(3.0)
    assert viewing.angle_deg_s / viewing.viewed_s == pytest.approx(5.0)
    after = held(progress, given, away, 20.0)
    assert after.viewings == progress.viewings  # what is cleared is not lost
    assert after.target is None


def test_progress_depends_on_time_and_not_on_the_steps() -> None:
    given, there = task(), looking((0.0, 0.0, -12.0), 8.0)
    started = held(PolypProgress.at_start(given), given, there, 0.5)
    coarse, fine = held(started, given, there, 5.5, 0.5), held(started, given, there, 5.5, 0.001)
    assert coarse.held_s == pytest.approx(fine.held_s) == pytest.approx(5.0)
    assert coarse.viewings[0].distance_mm_s == pytest.approx(fine.viewings[0].distance_mm_s)
    with pytest.raises(InputError, match="begin with PolypProgress"):
        coarse.step(given, there, 80.0, 1.0, given.targets(), free)


@pytest.mark.parametrize("moves", [False, True])
def test_many_steps_at_once_are_those_made_one_by_one(moves: bool) -> None:
    """A camera that wanders past three polyps, of which it clears some; parted at random, as a drive is read."""
    random = np.random.default_rng(2)
    given = replace(task(polyp(20.0), polyp(50.0, 30.0), polyp(80.0, 60.0), end_mm=90.0), hold_s=0.4)
    motion = breathing((0.0, 0.0, 1.0), 2.0) if moves else None
    t = np.cumsum(random.uniform(0.0, 0.02, 9000))
    tip = np.minimum(np.linspace(0.0, 100.0, len(t)) + 3.0 * np.sin(t), 95.0)
    turn = 25.0 * np.sin(1.3 * t)
    cameras = np.stack([looking((0.5, 0.2, s - 25.0), angle) for s, angle in zip(tip, turn, strict=True)])
    sight = lambda eye, index, now: math.sin(3.0 * now + index) > -0.5  # noqa: E731
    one, target, viewed, marker = PolypProgress.at_start(given), [], [], []
    for camera, s, now in zip(cameras, tip.tolist(), t.tolist(), strict=True):
        if one.completed:
            break
        one = one.step(given, camera, s, now, given.targets(motion, now), sight)
        target.append(-1 if one.target is None else one.target)
        viewed.append(one.viewed)
        marker.append(one.marker)
    assert one.cleared >= 1
    assert one.completed
    assert 50 < np.sum(viewed) < len(viewed) / 2
    all_at_once = after_steps(PolypProgress.at_start(given), given, motion, cameras, tip, t, sight)
    assert all_at_once.progress == one
    for made, wanted in zip(all_at_once[:3], (target, viewed, marker), strict=True):
        np.testing.assert_array_equal(made, wanted)
    parted = PolypProgress.at_start(given)
    cuts = np.sort(random.choice(len(target), 300, replace=False))
    for part in np.split(np.arange(len(target)), cuts):
        parted = after_steps(parted, given, motion, cameras[part], tip[part], t[part], sight).progress
    assert parted == one
    with pytest.raises(InputError):
        after_steps(parted, given, motion, cameras[:1], tip[:1], t[:1], sight)


def test_what_may_be_within_is_all_that_is_and_little_else() -> None:
    random = np.random.default_rng(3)
    turns, _ = np.linalg.qr(random.normal(size=(2000, 3, 3)))
    cameras = np.tile(np.eye(4), (2000, 1, 1))
    cameras[:, :3, :3], cameras[:, :3, 3] = turns, random.normal(size=(2000, 3))
    local = random.uniform(-12.0, 12.0, (2000, 5, 3)) + np.array([0.0, 0.0, 12.0])
    targets = np.einsum("nij,npj->npi", turns, local) + cameras[:, None, :3, 3]
    exact = np.array([[aim_at(c, p).within for p in row] for c, row in zip(cameras, targets, strict=True)])
    assert 500 < exact.sum() < 9000
    np.testing.assert_array_equal(may_be_within(cameras, targets), exact)


def test_a_wall_between_camera_and_polyp_hides_it() -> None:
    given, there = task(), looking((0.0, 0.0, -15.0))
    asked: list[int] = []

    def hidden(eye: Array, index: int, t: float) -> bool:
        asked.append(index)
        return False

    start = PolypProgress.at_start(given)
    progress = start.step(given, there, 80.0, 1.0, given.targets(), hidden)
    assert (progress.viewed, progress.marker, asked) == (False, 0.0, [0])
    assert progress.aim is not None
    assert progress.aim.within
    start.step(given, looking((0.0, 0.0, -40.0)), 80.0, 1.0, given.targets(), hidden)
    assert asked == [0]  # nobody asks about what is out of the tolerances


def test_the_nearest_polyp_ahead_is_aimed_at_and_one_that_is_seen_before_it() -> None:
    given = task(polyp(100.0, 0.0), polyp(170.0, 70.0), end_mm=200.0)
    far = looking((0.0, 0.0, -100.0))
    start, targets = PolypProgress.at_start(given), given.targets()
    assert start.step(given, far, 60.0, 0.1, targets, free).target == 0
    assert start.step(given, far, 125.0, 0.1, targets, free).target == 1
    assert start.step(given, looking((0.0, 0.0, -15.0)), 150.0, 0.1, targets, free).target == 0
    missed = start.step(given, far, 197.9, 0.1, targets, free).step(given, far, 198.0, 0.2, targets, free)
    assert (missed.completed, missed.reached_t, missed.cleared) == (True, 0.2, 0)
    assert missed.step(given, far, 10.0, 9.0, targets, free) is missed


def test_what_is_seen_is_the_nearest_polyp_that_is_left_also_where_another_one_is_aimed_at() -> None:
    """The one aimed at, by the tip's place along the lumen, is beside the camera and not in the picture."""
    given = task(polyp(20.0, -5.0), polyp(60.0, 40.0), polyp(80.0, 50.0))
    progress = PolypProgress.at_start(given).step(given, looking((0.0, 0.0, 0.0)), 5.0, 0.1, given.targets(), free)
    assert (progress.target, progress.viewed) == (0, False)
    camera, targets = looking((0.0, 0.0, 0.0)), given.targets()
    seen = nearest_seen(progress, camera, targets, free)
    assert seen is not None
    assert seen.distance_mm == pytest.approx(40.0)
    behind = nearest_seen(progress, camera, targets, lambda eye, index, t: index != 1)
    assert behind is not None
    assert behind.distance_mm == pytest.approx(50.0)
    far = nearest_seen(progress, looking((0.0, 0.0, -105.0)), targets, lambda eye, index, t: index > 0)
    assert far is not None, "a bright ball in a straight part is seen from far"
    assert far.distance_mm == pytest.approx(145.0)
    assert nearest_seen(progress, looking((0.0, 0.0, -161.0)), targets, lambda eye, index, t: index > 0) is None
    assert nearest_seen(progress, looking((0.0, 0.0, 0.0), 60.0), targets, free) is None


@pytest.mark.parametrize(
    ("off_deg", "away_mm", "in_part"), [(37.0, 40.0, True), (41.0, 40.0, False), (52.0, 8.0, True)]
)
def test_a_polyp_whose_middle_is_beside_the_picture_is_seen_as_far_as_its_ball(
    off_deg: float, away_mm: float, in_part: bool
) -> None:
    given = task(polyp(away_mm, away_mm))
    progress = PolypProgress.at_start(given)
    seen = nearest_seen(progress, looking((0.0, 0.0, 0.0), off_deg), given.targets(), free)
    assert (seen is not None) is in_part
    if seen is not None:
        assert seen.angle_deg == pytest.approx(off_deg)


def test_a_task_ends_at_its_landmark_or_2_mm_before_the_depth_that_the_robot_reaches() -> None:
    away, deep = looking((0.0, 0.0, -100.0)), task(end_mm=200.0)
    marked = replace(deep, end_name="ascending")
    for given, tip_mm, completed in ((deep, 198.0, True), (deep, 197.9, False), (marked, 199.9, False)):
        start = PolypProgress.at_start(given)
        assert start.step(given, away, tip_mm, 0.1, given.targets(), free).completed is completed
    assert PolypProgress.at_start(marked).step(marked, away, 200.0, 0.1, marked.targets(), free).completed


def test_polyps_move_with_the_wall() -> None:
    one = Polyp(300.0, (12.0, 0.0, 50.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 50.0))
    given = PolypTask((one,), 0.0, 900.0)
    assert given.targets().tolist() == [[10.0, 0.0, 50.0]]
    assert given.targets(breathing((0.0, 0.0, 1.0), 8.0), 2.0)[0] == pytest.approx([10.0, 0.0, 58.0])
    narrowed = peristalsis(0.2, 100.0, 0.0)  # the wave's crest is where s is a multiple of its length
    assert given.targets(narrowed, 3.0)[0] == pytest.approx([8.0, 0.0, 50.0])
    moved = given.targets(narrowed, 3.0)[0]
    assert at_rest(one, moved, narrowed, 3.0) == pytest.approx(one.target)


def test_a_task_is_written_and_read() -> None:
    given = PolypTask((polyp(100.0), polyp(200.0, 3.0)), 80.0, 700.0, "ascending", 4, 0.75)
    assert PolypTask.from_dict(given.to_dict()) == given
    with pytest.raises(InputError, match="no task of polyps"):
        PolypTask.from_dict({"polyps": [{"s_mm": 1.0}]})


@pytest.mark.parametrize("name", ["from_mm", "end_mm", "hold_s", "s_mm"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0])
def test_a_damaged_task_is_refused(name: str, value: float) -> None:
    values = task().to_dict()
    (values["polyps"][0] if name == "s_mm" else values)[name] = value
    with pytest.raises(InputError, match="no task of polyps"):
        PolypTask.from_dict(values)


@pytest.fixture(scope="module")
def colon() -> TriangleMesh:
    return synthetic_colon()


@pytest.fixture(scope="module")
def places(colon: TriangleMesh) -> WallPlaces:
    return WallPlaces.of(colon, synthetic_course().curve)


def test_a_place_is_a_triangle_with_its_part_of_the_curve(colon: TriangleMesh, places: WallPlaces) -> None:
    one = places.polyp(len(places.s) // 2)
    assert len(places.s) == len(colon.faces)
    assert np.linalg.norm(one.normal) == pytest.approx(1.0)
    assert np.array(one.normal) @ (np.array(one.axis) - one.wall) > 0.0
    assert np.linalg.norm(one.target - one.wall) == pytest.approx(PROUD_MM)
    assert synthetic_course().curve.position(one.s_mm) == pytest.approx(np.array(one.axis))


def test_one_polyp_is_drawn_in_each_part_of_the_way_among_the_viewable_places(places: WallPlaces) -> None:
    viewable = places.wall.centre[:, 1] < places.axis[:, 1]
    given = placed(places, viewable, 100.0, 500.0, seed=3)
    assert [int((one.s_mm - 100.0) // 40.0) for one in given.polyps] == list(range(10))
    assert all(one.wall[1] < one.axis[1] for one in given.polyps)
    assert given.viewable_share == pytest.approx(0.5, abs=0.1)
    assert placed(places, viewable, 100.0, 500.0, seed=3) == given
    assert placed(places, viewable, 100.0, 500.0, seed=4).polyps != given.polyps
    with pytest.raises(InputError, match="between 420 and 460 mm"):
        placed(places, viewable & ((places.s < 420.0) | (places.s >= 460.0)), 100.0, 500.0, seed=3)


def test_a_landmark_far_from_the_way_is_not_on_it() -> None:
    curve = synthetic_course().curve
    marks = {name: curve.position(s) for name, s in (("rectosigmoid", 100.0), ("ascending", 400.0))}
    assert way_of(marks, curve, 500.0, 140.0) == (pytest.approx(100.0), pytest.approx(400.0), "ascending")
    far = {name: place + np.array([0.0, 500.0, 0.0]) for name, place in marks.items()}
    assert way_of(far, curve, 500.0, 140.0) == (140.0, 500.0, None)


def test_polyps_are_drawn_where_their_middles_are_viewed_well(colon: TriangleMesh, places: WallPlaces) -> None:
    """From 10 mm a triangle is viewed well, and not a polyp's middle, which is 2 mm nearer; from 15 mm both are."""
    inner = np.flatnonzero((places.s > 100.0) & (places.s < 500.0))[::97]
    inner = inner[np.argsort(places.s[inner])]
    views = []
    for triangle in inner.tolist():
        camera, ahead = np.eye(4), -places.wall.inward[triangle]
        x = np.cross(ahead, np.eye(3)[np.abs(ahead).argmin()])
        camera[:3, :3] = np.column_stack([x, np.cross(ahead, x), ahead]) / [np.linalg.norm(x), np.linalg.norm(x), 1.0]
        away = 15.0 if triangle in (inner[0], inner[-1]) else 10.0
        camera[:3, 3] = places.wall.centre[triangle] - away * ahead
        views.append(PlannedView(90.0, np.empty((0, 10)), camera))
    view, error = np.full(len(places.s), -1), np.full(len(places.s), np.inf)
    view[inner], error[inner] = np.arange(len(inner)), 5.0 / 7.0
    counted = np.ones(len(view), dtype=bool)
    found = Viewable(tuple(views), view, error, places.s, places.wall.area, 510.0, counted, ViewLimits())
    given = polyps_in(found, colon, synthetic_course().curve, {}, 100.0, count=2)
    assert [polyp.wall for polyp in given.task.polyps] == [
        tuple(places.wall.centre[k].tolist()) for k in inner[[0, -1]]
    ]


def test_a_line_of_sight_ends_at_the_wall_of_the_lumen(colon: TriangleMesh, places: WallPlaces) -> None:
    one = places.polyp(int(np.abs(places.s - 300.0).argmin()))
    given = PolypTask((one,), 0.0, 500.0)
    sight = LumenSight(colon, given)
    middle = np.array(one.axis)
    outside = np.array(one.wall) - 5.0 * np.array(one.normal)
    assert sight(middle, 0, 0.0)
    assert not sight(outside, 0, 0.0)
    motion, away = breathing((0.0, 0.0, 1.0), 20.0), np.array([0.0, 0.0, 20.0])
    moving = LumenSight(colon, given, motion)
    assert moving(middle + away, 0, 2.0)  # the camera moves with the tissue
    assert not moving(outside + away, 0, 2.0)
