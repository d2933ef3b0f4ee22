"""What of a lumen's wall a snake can view: against known geometry, brute force, independent rays and the real drive."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vfix_engine.arrays import Array, BoolArray, IntArray
from vfix_engine.errors import InputError, PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.tissue_motion import breathing, peristalsis
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.bending.bending_kernel import DistalPathway
from vfix_engine.snake.bending.view_search import ViewGoal, view_path
from vfix_engine.worlds.snake.offline.confirm_views import confirm_views
from vfix_engine.worlds.snake.offline.snake_drive import SnakeDrive
from vfix_engine.worlds.snake.settings import DriveSettings
from vfix_engine.worlds.snake.stepping.motion import TISSUE_RESERVE_MM
from vfix_engine.worlds.snake.viewable import TIMES_S, Viewable, viewable_wall
from vfix_engine.worlds.snake.viewing import ViewLimits, WallSight, moved_wall

LENGTH = 180.0
SETTINGS = DriveSettings(vertices_per_link=30, waypoint_mm=2.0, tissue_s=0.04)
SNAKE = SnakeModel(6)
WIDE = 14.0
FOLD_MM = 110.0  # along the tube; 6 mm high


def tube(radius: float, around: int = 24, along: int = 60, fold: float = 0.0) -> TriangleMesh:
    """An open tube along z from −10 mm, with outward normals, narrowed by a fold."""
    theta = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    z = np.linspace(-10.0, LENGTH + 10.0, along)
    wall = radius - fold * np.exp(-(((z - FOLD_MM) / 3.0) ** 2))
    rings = np.stack([wall[:, None] * np.cos(theta), wall[:, None] * np.sin(theta), np.tile(z, (around, 1)).T], axis=2)
    i, j = (one.ravel() for one in np.meshgrid(np.arange(along - 1), np.arange(around), indexing="ij"))
    a, b = i * around + j, i * around + (j + 1) % around
    faces = np.concatenate([np.column_stack([a, b, a + around]), np.column_stack([b, b + around, a + around])])
    return TriangleMesh(rings.reshape(-1, 3), faces.astype(np.int32))


def pathway(radius: float) -> Pathway:
    line = np.column_stack([np.zeros((20, 2)), np.linspace(0.0, LENGTH, 20)])
    return Pathway(line, np.full(20, radius), 80)


@pytest.fixture(scope="module")
def folded() -> TriangleMesh:
    return tube(WIDE, along=80, fold=6.0)


@pytest.fixture(scope="module")
def still(folded: TriangleMesh) -> Viewable:
    return viewable_wall(folded, pathway(WIDE), SNAKE, SETTINGS)


def viewed_by(mesh: TriangleMesh, camera: Array, triangles: IntArray, limits: ViewLimits) -> BoolArray:
    """By the paper's words and every triangle of the mesh (Möller & Trumbore 1997), without Embree."""
    corner, one, two = mesh.triangles[:, 0], *np.moveaxis(mesh.triangles[:, 1:] - mesh.triangles[:, :1], 1, 0)
    found = np.zeros(len(triangles), dtype=bool)
    for row, triangle in enumerate(triangles.tolist()):
        ahead = mesh.triangles[triangle].mean(axis=0) - camera[:3, 3]
        away = float(np.linalg.norm(ahead))
        angle = math.degrees(math.acos(min(float(ahead @ camera[:3, 2]) / away, 1.0)))
        if abs(away - limits.distance_mm) > limits.distance_tolerance_mm or angle > limits.angle_deg:
            continue
        across, start = np.cross(ahead, two), camera[:3, 3] - corner
        size = np.einsum("ij,ij->i", one, across)
        turned = np.cross(start, one)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", start, across) / size
            v = turned @ ahead / size
            at = np.einsum("ij,ij->i", two, turned) / size
        met = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (at > 0.0) & (at < 1.0 - 1e-6)
        met[triangle] = False
        found[row] = not met.any() and float(mesh.face_normals[triangle] @ ahead) > 0.0  # outward normals: from inside
    return found


def bent(found: Viewable, number: int, given: DriveSettings = SETTINGS) -> tuple[SnakeDrive, Array]:
    """A drive at the depth of a view, and the joints (2L,) of that view."""
    view = found.views[number]
    settings = replace(given, speed_max=20.0, insertion_step_mm=given.waypoint_mm)
    drive = SnakeDrive(SNAKE, pathway(WIDE), settings, tip_s=view.tip_s)
    q = drive.q.copy()
    if len(view.bends):
        q[2 * drive.constants.first :] += view.bends[-1]
    return drive, drive.snake.clamp(q)


def test_a_robot_that_cannot_bend_views_a_ring_ahead_of_each_depth() -> None:
    """Of a tube of 7 mm radius it is 19.2 to 20.9 mm ahead of the camera: R / tan 20° and √(22² − R²)."""
    mesh, stiff = tube(7.0, along=401), SnakeModel(3, q_max=1e-9, radius_mm=5.0)
    found = viewable_wall(mesh, pathway(7.0), stiff, SETTINGS, every_mm=7.0)
    depths = np.array([*np.arange(7.0, 84.0, 7.0), 84.0])
    x, y, z = mesh.triangles.mean(axis=1).T
    ahead = z[:, None] - (depths + stiff.camera_offset_mm)
    away, across = np.hypot(np.hypot(x, y)[:, None], ahead), np.hypot(x, y)[:, None]
    expected = (ahead > 0.0) & (np.abs(away - 15.0) <= 7.0) & (across <= ahead * math.tan(math.radians(20.0)))
    assert expected.any(axis=1).sum() > 500
    np.testing.assert_array_equal(found.mask, expected.any(axis=1))
    assert found.depth_mm == pytest.approx(84.0)
    ring = found.mask & found.counted
    whole = found.area_mm2[(found.s_mm <= 84.0)].sum()
    assert found.share == pytest.approx(found.area_mm2[ring].sum() / whole)
    # Its measure in a smooth tube: every depth but the last ones adds a ring of 1.6 mm to 84 mm and what is outside.
    assert 0.05 < found.share < 0.30


def test_every_view_is_one_by_other_rays_and_within_bounds_and_range(folded: TriangleMesh, still: Viewable) -> None:
    assert still.share > 0.5
    numbers = np.random.default_rng(1).choice(len(still.views), 12, replace=False)
    for number in numbers.tolist():
        drive, q = bent(still, number)
        frames = drive.snake.frames(q, drive.state.base)
        depth = drive.query.deviations(drive.state.packed, frames, drive.state.windows).depth
        assert (depth[drive.state.measured] <= drive.state.bound[drive.state.measured] + 1e-6).all()
        assert np.abs(q).max() <= SNAKE.q_max
        camera = drive.snake.camera(q, drive.state.base)
        np.testing.assert_allclose(camera, still.views[number].camera, atol=0.3)
        triangles = np.flatnonzero(still.view == number)
        assert viewed_by(folded, still.views[number].camera, triangles, still.limits).all()


def test_a_fold_hides_what_is_behind_it_from_before(folded: TriangleMesh) -> None:
    sight = WallSight(folded, pathway(WIDE).curve())
    camera = np.eye(4)
    camera[:3, 3] = 0.0, 4.0, FOLD_MM - 14.0
    z = sight.centre[:, 2]
    near, _ = sight.viewed(camera, ViewLimits(angle_deg=35.0, frame_deg=35.0))
    assert ((z[near] > FOLD_MM - 5.0) & (z[near] < FOLD_MM)).any()
    assert not ((z[near] > FOLD_MM + 1.0) & (z[near] < FOLD_MM + 6.0)).any()
    turned = camera.copy()
    turned[:3, 3] = 0.0, 4.0, FOLD_MM + 14.0
    turned[:3, :3] = np.diag([1.0, -1.0, -1.0])
    back, _ = sight.viewed(turned, ViewLimits(angle_deg=35.0, frame_deg=35.0))
    assert ((z[back] > FOLD_MM + 1.0) & (z[back] < FOLD_MM + 6.0)).any()


def test_a_camera_behind_the_wall_views_nothing_and_a_turned_surface_is_the_same(folded: TriangleMesh) -> None:
    line, camera = pathway(WIDE).curve(), np.eye(4)
    camera[:3, :3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]  # along x
    camera[:3, 3] = 0.0, 0.0, 60.0
    limits, sight = ViewLimits(), WallSight(folded, line)
    inside, error = sight.viewed(camera, limits)
    assert len(inside) > 10
    np.testing.assert_array_equal(
        inside, np.flatnonzero(viewed_by(folded, camera, np.arange(len(folded.faces)), limits))
    )
    turned = WallSight(TriangleMesh(folded.vertices, folded.faces[:, ::-1]), line)
    np.testing.assert_array_equal(turned.viewed(camera, limits)[0], inside)
    np.testing.assert_allclose(turned.viewed(camera, limits)[1], error)
    camera[0, 3] = -WIDE - 8.0
    assert len(sight.viewed(camera, limits)[0]) == 0


def test_brute_force_views_hardly_anything_else(folded: TriangleMesh, still: Viewable) -> None:
    """Random joints at one depth, all that are within the bounds: what they view is viewable from some depth."""
    drive = SnakeDrive(SNAKE, pathway(WIDE), SETTINGS, tip_s=150.0)
    sight, random = WallSight(folded, pathway(WIDE).curve()), np.random.default_rng(0)
    distal, seen = 2 * drive.constants.first, np.zeros(len(folded.faces), dtype=bool)
    for _ in range(4000):
        q = drive.q.copy()
        q[distal:] += random.normal(0.0, random.uniform(0.0, 0.5), len(q) - distal)
        q = drive.snake.clamp(q)
        frames = drive.snake.frames(q, drive.state.base)
        depth = drive.query.deviations(drive.state.packed, frames, drive.state.windows).depth
        if (depth <= drive.state.bound)[drive.state.measured].all():
            seen[sight.viewed(drive.snake.camera(q, drive.state.base), still.limits)[0]] = True
    area = still.area_mm2
    assert area[seen].sum() > 500.0
    assert area[seen & still.mask].sum() >= 0.95 * area[seen].sum()


def test_a_way_keeps_the_bounds_in_small_steps_and_tells_its_error() -> None:
    drive = SnakeDrive(SNAKE, pathway(WIDE), replace(SETTINGS, speed_max=20.0), tip_s=150.0)
    context = drive.distal_context()
    lumen = DistalPathway(
        context.packed, context.query.blocks, context.window, context.base, context.rest.copy(), context.bound.copy(),
        SNAKE.q_max, SNAKE.length_mm,
    )  # fmt: skip
    point, way = np.array([WIDE, 0.0, 165.0]), np.empty((80, context.snake.dof))
    goal = ViewGoal(point, 15.0, 7.0, math.radians(20.0), SNAKE.camera_offset_mm)
    count, error = view_path(lumen, context.query.vertices.points.copy(), goal, np.ones(10), context.rest.copy(), way)
    assert 0 < count <= len(way)
    assert error < 1.0
    camera = context.snake.camera(way[count - 1], context.base)
    assert ViewLimits().error(camera, point[None])[0] == pytest.approx(error)
    before = context.rest
    for q in way[:count]:
        depth = context.query.deviations(context.packed, context.snake.frames(q, context.base), context.window).depth
        assert (depth <= context.bound).all()
        assert np.abs(q - before).max() < math.radians(10.0)
        before = q
    held = np.zeros(10)
    assert view_path(lumen, context.query.vertices.points.copy(), goal, held, context.rest.copy(), way)[0] == 0


def test_the_real_drive_views_the_places(folded: TriangleMesh, still: Viewable) -> None:
    told = confirm_views(folded, pathway(WIDE), SNAKE, SETTINGS, None, None, still, count=8, seed=3)
    assert (told.of, told.viewed, told.beyond_bound, told.missed) == (8, 8, 0, ())


def test_in_a_breathing_tube_the_same_bend_views_a_place_all_the_time(folded: TriangleMesh, still: Viewable) -> None:
    moving = pathway(WIDE).moved(breathing((1, 0, 0), 8.0, 4.0))
    found = viewable_wall(folded, moving, SNAKE, SETTINGS)
    assert 0.8 * still.share < found.share <= still.share + 0.05
    told = confirm_views(folded, moving, SNAKE, SETTINGS, None, None, found, count=3)
    assert told.beyond_bound == 0
    assert told.viewed == told.of == 3


def test_a_wave_takes_its_time_into_account(folded: TriangleMesh) -> None:
    """All the tube is so narrow at one of the times that no view is left."""
    narrow = pathway(WIDE).moved(peristalsis(0.9, 1e9, 0.25e9))
    assert viewable_wall(folded, narrow, SNAKE, SETTINGS, every_mm=60.0).share == 0.0
    assert viewable_wall(folded, narrow, SNAKE, SETTINGS, every_mm=60.0, times_s=(2.0,)).share > 0.0


def test_views_of_moving_tissue_keep_what_the_drive_keeps_at_every_moment() -> None:
    """0.5 mm of the bound, or what the conforming shape uses of it. Waves narrow the tube elsewhere at each moment."""
    moving = pathway(WIDE).moved(peristalsis(0.25, 60.0, 15.0))
    settings = replace(SETTINGS, bound_mm=4.0)
    found, over = viewable_wall(tube(WIDE, along=80), moving, SNAKE, settings, every_mm=30.0), list[float]()
    for number in range(len(found.views)):
        drive, q = bent(found, number, settings)
        state, snake = drive.state, drive.snake
        bent_links, rest = snake.frames(q, state.base), snake.frames(drive.q, state.base)
        for t in TIMES_S:
            depth = drive.query.deviations(moving.packed(t), bent_links, state.windows).depth
            least = drive.query.deviations(moving.packed(t), rest, state.windows).depth
            kept = np.maximum(state.bound - TISSUE_RESERVE_MM, least)
            over.append(float((depth - kept)[state.measured].max(initial=-np.inf)))
    assert len(found.views) > 20
    assert -0.2 < max(over) <= 0.0  # some views would use the reserve up


def test_a_wall_moves_as_its_pathway_does(folded: TriangleMesh) -> None:
    shift = breathing((0, 3, 0), 8.0, 4.0)
    moved = moved_wall(folded, pathway(WIDE).moved(shift), 2.0)
    np.testing.assert_allclose(moved.vertices, folded.vertices + np.array([0.0, 8.0, 0.0]), atol=1e-9)
    narrowed = moved_wall(folded, pathway(WIDE).moved(peristalsis(0.2, 1e9, 0.0)), 0.0)
    np.testing.assert_allclose(narrowed.vertices[:, :2], 0.8 * folded.vertices[:, :2], atol=1e-9)
    assert moved_wall(folded, pathway(WIDE), 1.0) is folded


def test_arc_lengths_are_of_the_near_part_of_a_curve_that_comes_back() -> None:
    """A second tube beside the first one is nearer to some of its triangles, and behind their wall."""
    mesh = tube(WIDE)
    turn = np.linspace(0.0, np.pi, 40)[1:-1]
    up = np.column_stack([np.zeros((60, 2)), np.linspace(0.0, LENGTH, 60)])
    over = np.column_stack([9.0 - 9.0 * np.cos(turn), np.zeros(38), LENGTH + 9.0 * np.sin(turn)])
    down = up[::-1] + np.array([18.0, 0.0, 0.0])
    line = Curve.through(np.concatenate([up, over, down]))
    sight = WallSight(mesh, Curve.through(up))
    s = sight.arc_lengths(line)
    inside = (sight.centre[:, 2] > 5.0) & (sight.centre[:, 2] < LENGTH - 5.0)
    np.testing.assert_allclose(s[inside], sight.centre[inside, 2], atol=2.1)


def test_where_the_lumen_goes_on_its_wall_is_not_at_the_end_of_the_way() -> None:
    mesh = tube(WIDE)
    sight = WallSight(mesh, pathway(WIDE).curve())
    z = sight.centre[:, 2]
    whole = sight.arc_lengths(pathway(WIDE).curve())
    assert (whole.min(), whole.max()) == (0.0, pytest.approx(LENGTH, abs=2.0))  # 10 mm more than the way are its ends
    part = sight.arc_lengths(Curve.through(np.column_stack([np.zeros((9, 2)), np.linspace(60.0, 120.0, 9)])))
    np.testing.assert_allclose(part, z - 60.0, atol=1.1)


def test_the_share_of_a_way_that_ends_within_a_lumen_is_of_the_wall_along_it() -> None:
    mesh, stiff = tube(7.0, along=401), SnakeModel(3, q_max=1e-9, radius_mm=5.0)
    way = Pathway(np.column_stack([np.zeros((20, 2)), np.linspace(50.0, 120.0, 20)]), np.full(20, 7.0), 80)
    found = viewable_wall(mesh, way, stiff, SETTINGS, every_mm=7.0)
    assert found.depth_mm == pytest.approx(70.0)
    z = mesh.triangles.mean(axis=1)[:, 2]
    along = (z > 50.0) & (z < 120.0)
    area = found.area_mm2
    assert area[found.counted].sum() == pytest.approx(area[along].sum(), rel=0.03)
    assert found.share == pytest.approx(area[found.mask & along].sum() / area[along].sum(), abs=0.02)
    assert (found.mask & (z > 120.0)).any()  # viewed from the end of the way, and not of it


def test_errors_of_views_are_shares_of_their_tolerances() -> None:
    limits, far = ViewLimits(), math.sin(math.radians(10.0)) * 15.0
    points = np.array([(0, 0, 15), (0, 0, 22), (0, 0, 22.1), (far, 0, 15 * math.cos(math.radians(10.0))), (0, 0, -15)])
    np.testing.assert_allclose(limits.error(np.eye(4), points), [0.0, 1.0, 7.1 / 7.0, 0.5, np.inf], atol=1e-9)
    corner = 15.0 * np.array([[0.2, 0.2, math.sqrt(1.0 - 0.08)]])
    assert ViewLimits(frame_deg=10.0).error(np.eye(4), corner)[0] == np.inf
    assert np.isfinite(ViewLimits(frame_deg=13.0).error(np.eye(4), corner)[0])
    for wrong in ({"angle_deg": 0.0}, {"frame_deg": 60.0}, {"distance_mm": 5.0}, {"distance_tolerance_mm": -1.0}):
        with pytest.raises(InputError):
            ViewLimits(**wrong)


def test_what_cannot_be_is_refused(folded: TriangleMesh) -> None:
    with pytest.raises(InputError, match="between two depths"):
        viewable_wall(folded, pathway(WIDE), SNAKE, SETTINGS, every_mm=0.0)
    with pytest.raises(InputError, match="between two depths"):
        viewable_wall(folded, pathway(WIDE), SNAKE, SETTINGS, every_mm=1e-9)
    with pytest.raises(InputError, match="one time"):
        viewable_wall(folded, pathway(WIDE), SNAKE, SETTINGS, times_s=())
    away = TriangleMesh(folded.vertices + np.array([500.0, 0.0, 0.0]), folded.faces)
    with pytest.raises(PathwayError, match="no wall"):
        viewable_wall(away, pathway(WIDE), SNAKE, SETTINGS)
