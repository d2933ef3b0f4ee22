"""Soft regions in closed loop: δ = f / k, a spring that points out however deep, and a greatest depth that is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, map_coordinates
from skimage.measure import marching_cubes

from tests.engine.scenes import straight_scene, wall
from vfix_engine.anatomy.phantom import load_nose_ct
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.control import Controller, ControlSettings, HandCommand, StepState
from vfix_engine.control.tasks import FollowPath, MoveFreely
from vfix_engine.errors import InputError, StartRefused
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.fields.compact_field import compact_field, stored_values, values_of
from vfix_engine.proximity.fields.distance_field import DistanceField, FieldGrid, field_of_level, field_of_surface
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.virtual_fixtures import DeeperPlace, Fixture, Situation, SoftRegion, weighted
from vfix_engine.virtual_fixtures.soft_region import ERROR_STEPS
from vfix_engine.worlds.rigid.scene import Scene

SLOW = ControlSettings(dt_s=2e-2)
PATH = np.array([[0.0, 0, 0], [0, 10, 0], [0, 30, 0]])
AHEAD = np.array([0.0, 1.0, 0.0])
BOX = np.array([[-25.0, -15.0, -25.0], [25.0, 45.0, 25.0]])


def flesh(depth: float = 6.0) -> DistanceField:
    """All that is beyond the plane y = depth."""
    return field_of_level(lambda places: places[:, 1] - depth, BOX, 0.5)


def ball(radius: float, centre: tuple[float, float, float]) -> DistanceField:
    return field_of_level(lambda places: radius - np.linalg.norm(places - centre, axis=1), BOX, 0.5)


def free_scene() -> Scene:
    return straight_scene(wall(200.0), PATH)


def controller(scene: Scene, *fixtures: Fixture, settings: ControlSettings = SLOW) -> Controller:
    return Controller(scene.placed_robot(), scene.tool, scene.tree, settings, fixtures=fixtures)


def following(scene: Scene) -> FollowPath:
    assert scene.path is not None
    return FollowPath(scene.path)


def situation(control: Controller, state: StepState) -> Situation:
    robot = control.context.robot.robot
    return Situation(state, state.named_pairs(), state.body, robot, control.tool, 1e-3, 0.05, 2e-3, control.tree)


@pytest.mark.parametrize("mode", ["free", "path"])
@pytest.mark.parametrize(("stiffness", "force"), [(0.5, 0.4), (0.5, 1.5), (2.0, 5.0)])
def test_a_steady_hand_stands_where_the_spring_holds_it(mode: str, stiffness: float, force: float) -> None:
    scene = free_scene()
    soft = SoftRegion("flesh", flesh(), stiffness)
    control = controller(scene, soft)
    state, task = control.start(scene.q_start), MoveFreely() if mode == "free" else following(scene)
    for _ in range(700):
        state = control.step(state, task, HandCommand(force * AHEAD)).state
    assert soft.penetration(state) == pytest.approx(force / stiffness, rel=0.05)
    tip = float(state.segments.end[:, 1].max()) if mode == "path" else None
    if tip is not None:
        assert tip + scene.tool.radius[0] - 6.0 == pytest.approx(force / stiffness, rel=0.05)


def test_a_weighted_region_is_as_much_stiffer() -> None:
    scene = free_scene()
    soft = SoftRegion("flesh", flesh(), 0.5)
    control = controller(scene, weighted(soft, 4.0))
    state = control.start(scene.q_start)
    for _ in range(700):
        state = control.step(state, following(scene), HandCommand(1.5 * AHEAD)).state
    assert soft.penetration(state) == pytest.approx(1.5 / (4.0 * 0.5), rel=0.05)


@pytest.mark.parametrize("inside", [0.5, 2.0, 5.0, 9.0, 14.0])
def test_the_spring_points_out_however_deep_the_tool_is(inside: float) -> None:
    """Its row is the growth of the depth in a ball by small motions, from the surface down to near the centre."""
    scene = free_scene()
    control = controller(scene)
    centre, radius = (
        (4.0, 20.0 - inside, 3.0),
        20.0,
    )  # ball whose border is `inside` mm before the tool's tip at the origin
    state = control.measure(scene.q_start)
    soft = SoftRegion("ball", ball(radius, centre), 0.5)
    (constraint,) = soft.rows(situation(control, state)).constraints
    deepest = int(np.argmin(constraint.bound))

    def depth(at: StepState) -> float:
        share = np.linspace(0.0, 1.0, 2000)[:, None]
        axis = [a + share * (b - a) for a, b in zip(at.segments.start, at.segments.end, strict=True)]
        away = [np.linalg.norm(points - centre, axis=1).min() for points in axis]
        return float((radius + np.array(scene.tool.radius) - np.array(away)).max())

    assert soft.penetration(state) == pytest.approx(depth(state), abs=0.3)
    random = np.random.default_rng(3)
    for _ in range(20):
        step = random.normal(size=len(state.q)) * np.where(np.arange(len(state.q)) < 3, 0.2, 2e-3)
        grown = depth(control.measure(state.q + step)) - depth(control.measure(state.q - step))
        told = 2.0 * float(constraint.matrix[deepest, :-1] @ step)
        assert grown == pytest.approx(told, abs=0.15 * abs(grown) + 0.03)
    out = control.step(state, MoveFreely(), HandCommand(np.zeros(3))).state
    assert np.array_equal(out.q, state.q), "without a hand nothing moves"


class EdtJudge:
    """Depth of the tool in a solid by scipy's exact distance transform of a mask of 0.25 mm voxels."""

    STEP = 0.25

    def __init__(self, inside: object) -> None:
        axes = [np.arange(BOX[0, k], BOX[1, k] + 1e-9, self.STEP) for k in range(3)]
        x, y, z = np.meshgrid(*axes, indexing="ij")
        mask = inside(np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(x.shape)  # type: ignore[operator]
        depth, away = distance_transform_edt(mask) - 0.5, distance_transform_edt(~mask) - 0.5
        self._signed = self.STEP * np.where(mask, -depth, away)

    def depths(self, state: StepState, radius: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (n, 3) of the tool's axis, and how deep its surface is there at most."""
        share = np.linspace(0.0, 1.0, 400)[:, None]
        parts = list(zip(state.segments.start, state.segments.end, radius, strict=True))
        places = np.concatenate([a + share * (b - a) for a, b, _ in parts])
        index = ((places - BOX[0]) / self.STEP).T
        found = map_coordinates(self._signed, index, order=1, mode="nearest")
        known = ((places >= BOX[0] + 0.5) & (places <= BOX[1] - 0.5)).all(axis=1)
        depth = np.concatenate([np.full(len(share), r) for _, _, r in parts]) - found
        return places[known], depth[known]


def bore(places: np.ndarray) -> np.ndarray:
    """Flesh beyond y = 4 with a crooked bore of 3 mm in it."""
    across = np.stack([places[:, 0] - 2.0 * np.sin(places[:, 1] / 6.0), places[:, 2]], axis=1)
    inside: np.ndarray = np.minimum(places[:, 1] - 4.0, np.linalg.norm(across, axis=1) - 3.0)
    return inside


@pytest.mark.parametrize(("dt_s", "hold"), [(1e-3, 500), (2e-2, 60)])
def test_an_attacking_hand_never_gets_deeper_than_allowed(dt_s: float, hold: int) -> None:
    """HAZ-01: thousands of random pushes; every pose, and poses between, by a distance transform of scipy's.

    The field is allowed one step of error, which the region keeps in reserve; the judge's voxels are 0.25 mm.
    """
    scene = free_scene()
    radius, bound = np.array(scene.tool.radius), 3.0
    near = DeeperPlace(np.array([0.0, 4.0, 0.0]), 6.0, 4.5)
    soft = SoftRegion("flesh", field_of_level(bore, BOX, 0.5), 0.2, bound, near)
    control = controller(scene, soft, settings=replace(SLOW, dt_s=dt_s))
    judge, random = EdtJudge(lambda places: bore(places) > 0.0), np.random.default_rng(17)
    state, force, deepest, reached = control.start(scene.q_start), np.zeros(3), -np.inf, -np.inf
    for step in range(4000):
        if step % hold == 0:
            force = 5.0 * random.normal(size=3) + (2.0 * AHEAD if step % (4 * hold) else 0.0)
            torque = 300.0 * random.normal(size=3)
        before, state = state, control.step(state, MoveFreely(), HandCommand(force, torque)).state
        reached = max(reached, soft.excess(state))
        if step % 8 == 0:
            for share in (0.5, 1.0):
                pose = state if share == 1.0 else control.measure(before.q + share * (state.q - before.q))
                places, depth = judge.depths(pose, radius)
                beyond = np.maximum(np.linalg.norm(places - near.centre, axis=1) - 6.0, 0.0)
                over = depth - np.maximum(4.5 - 0.5 * beyond, bound)
                deepest = max(deepest, float(over.max(initial=-np.inf)))
    assert deepest <= EdtJudge.STEP, "never deeper, but for the judge's own voxels"
    assert -0.3 < reached < 0.0, "the hand did get to the bound"


def test_a_start_that_is_too_deep_is_refused_and_from_there_it_only_goes_out() -> None:
    """HAZ-04."""
    scene = free_scene()
    soft = SoftRegion("flesh", flesh(-4.0), 0.5, 3.0)
    control = controller(scene, soft)
    with pytest.raises(StartRefused, match=r"the tip would start 5\.\d mm deep in flesh, where 3 mm are allowed"):
        control.start(scene.q_start)
    with pytest.raises(StartRefused):
        controller(scene, weighted(soft, 2.0)).start(scene.q_start)
    state, random = control.measure(scene.q_start), np.random.default_rng(5)
    first = excess = soft.excess(state)
    assert excess > 2.0
    for step in range(400):
        push = random.normal(size=3) - (2.0 * AHEAD if step > 200 else 0.0)
        state = control.step(state, MoveFreely(), HandCommand(4.0 * push)).state
        assert soft.excess(state) <= max(excess, -0.15) + 1e-9
        excess = soft.excess(state)
    assert excess < first - 1.0, "and it did go out"


def test_where_nothing_is_known_nothing_holds() -> None:
    values = np.full((60, 60, 60), np.nan, np.float32)
    scene = free_scene()
    soft = SoftRegion("dark", DistanceField([FieldGrid(values, np.array([-15.0, -15.0, -15.0]), 0.5)]), 0.5, 2.0)
    control = controller(scene, soft)
    state = control.start(scene.q_start)
    for _ in range(50):
        state = control.step(state, MoveFreely(), HandCommand(3.0 * AHEAD)).state
    assert state.tip.position[1] > 2.0
    assert soft.penetration(state) == 0.0


def test_a_closed_surface_is_a_region_as_well() -> None:
    import trimesh

    made = trimesh.creation.icosphere(subdivisions=4, radius=8.0)
    tree = ProximityTree(TriangleMesh(np.add(made.vertices, [0.0, 14.0, 0.0]), np.asarray(made.faces)))
    soft = SoftRegion("gland", field_of_surface(tree, BOX, 0.5), 0.3, 4.0)
    scene = free_scene()
    control = controller(scene, soft)
    state = control.start(scene.q_start)
    for _ in range(400):
        state = control.step(state, following(scene), HandCommand(5.0 * AHEAD)).state
    report = control.step(state, following(scene), HandCommand(5.0 * AHEAD))
    assert any("gland on the tip, at its greatest depth of 4.0 mm" in blocker.text for blocker in report.blockers)
    points = np.concatenate(
        [np.linspace(a, b, 300) for a, b in zip(state.segments.start, state.segments.end, strict=True)]
    )
    radius = np.repeat(np.array(scene.tool.radius), 300)
    inside = 8.0 - np.linalg.norm(points - [0.0, 14.0, 0.0], axis=1)
    assert 2.5 < float((radius + inside).max()) <= 4.0


def test_a_region_says_what_is_wrong_with_it() -> None:
    field = flesh()
    with pytest.raises(InputError, match=r"more than 0\.65 mm"):
        SoftRegion("flesh", field, 0.5, 0.5)
    with pytest.raises(InputError, match="stiffness"):
        SoftRegion("flesh", field, 0.0)
    with pytest.raises(InputError, match="less deep than the rest"):
        SoftRegion("flesh", field, 0.5, 3.0, DeeperPlace(np.zeros(3), 5.0, 2.0))
    with pytest.raises(InputError, match="no greatest depth elsewhere"):
        SoftRegion("flesh", field, 0.5, None, DeeperPlace(np.zeros(3), 5.0, 2.0))
    with pytest.raises(InputError, match="needs a distance field"):
        SoftRegion("flesh", None, 0.5)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="layer"):
        SoftRegion("flesh", field, 0.5, layer_mm=-1.0)


def test_the_field_of_a_head_is_never_off_by_its_stated_error() -> None:
    """Against the exact distance to the border that marching cubes draws through the same grid of the phantom's CT."""
    middle, reach = np.array([7.5, -10.0, 5.0]), np.array([[-16.0], [16.0]])
    ct = load_nose_ct()
    field = field_of_level(lambda places: ct.sample(places, outside=np.nan) - TISSUE_HU, middle + reach, 0.5)
    (grid,) = field.grids
    axes = [grid.origin[k] + 0.5 * np.arange(grid.values.shape[2 - k]) for k in (2, 1, 0)]
    z, y, x = np.meshgrid(*axes, indexing="ij")
    level = ct.sample(np.stack([x, y, z], axis=-1).reshape(-1, 3)).reshape(grid.values.shape) - TISSUE_HU
    vertices, faces, _, _ = marching_cubes(level, 0.0)
    border = ProximityTree(TriangleMesh(grid.origin + 0.5 * vertices[:, ::-1], faces))
    places = np.random.default_rng(0).uniform(middle - 10.0, middle + 10.0, (20_000, 3))
    inside = map_coordinates(level, ((places - grid.origin) / 0.5)[:, ::-1].T, order=1) > 0.0
    exact = np.where(inside, -1.0, 1.0) * border.point_distance(places)[0]
    near = np.abs(exact) < 5.0
    assert near.sum() > 10_000
    assert float((field.at(places) - exact)[near].max()) < 0.5 * ERROR_STEPS


def test_a_compact_field_is_the_field_to_a_hundredth_and_comes_back_exactly() -> None:
    field, box = ball(9.0, (0.0, 12.0, 0.0)), np.array([[-10.0, 0.0, -10.0], [10.0, 20.0, 10.0]])
    compact = compact_field(field, box, 0.0, -25.0, 4.0)
    (grid,) = compact.grids
    assert grid.bounds == pytest.approx(box)
    random = np.random.default_rng(1).uniform(box[0], box[1], (500, 3))
    known = field.at(random)
    near = known < 3.0
    assert np.abs(compact.at(random) - known)[near].max() < 0.006
    stored = stored_values(grid.values)
    assert stored.dtype == np.int16
    assert np.array_equal(values_of(stored), grid.values)
    holes = np.where(np.arange(27).reshape(3, 3, 3) % 5 == 0, np.nan, 0.01).astype(np.float32)
    assert np.array_equal(values_of(stored_values(holes)), holes, equal_nan=True)
    assert stored_values(np.full((2, 2, 2), 0.123456, np.float32)).dtype == np.float32
