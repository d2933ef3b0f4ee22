"""Tube about the path and envelopes of the tip: their rows, their certificate, what they refuse (HAZ-01, HAZ-04)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from tests.engine.fixture_states import anywhere, situation, state_at
from tests.engine.scenes import straight_scene, wall
from vfix_engine.control import Certified, Controller, ControlSettings, HandCommand, Refused, certify_step
from vfix_engine.control.step import build_step
from vfix_engine.control.tasks import MoveFreely
from vfix_engine.errors import InputError, StartRefused
from vfix_engine.geometry.path import SplinePath
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from vfix_engine.runtime import Command, SetSettings
from vfix_engine.virtual_fixtures import PathTube, StepState, TipEnvelope
from vfix_engine.virtual_fixtures.tip_limit import RESERVE_MM, tip_limits
from vfix_engine.virtual_fixtures.weighted import weighted
from vfix_engine.worlds.rigid.system import RigidSystem

LINE = np.array([[0.0, 0.0, 0.0], [0.0, 8.0, 0.0], [3.0, 14.0, 2.0], [8.0, 16.0, 4.0], [10.0, 22.0, 2.0]])
TUBE = PathTube(SplinePath(LINE), 1.0)
KNOTS = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(LINE, axis=0), axis=1))])
DENSE = cKDTree(make_interp_spline(KNOTS, LINE, k=4)(np.linspace(0.0, KNOTS[-1], 20_000)))
UP = np.array([0.0, 0.0, 3.2])
TURNED = np.eye(4)
TURNED[:3, :3] = Rotation.from_euler("xyz", (0.4, 0.2, -0.3)).as_matrix()
SHAPES: list[Shape] = [
    Sphere((0, 1, 0), 3.0),
    CapsuleShape((0, -3, 1), (0, 6, 0), 2.0),
    Box(TURNED, (3, 4, 2)),
    HalfSpace((0, 3, 1), (1, 2, 3)),
]


def far(points: np.ndarray) -> np.ndarray:
    """Distance of points (n, 3) from the path: scipy's spline, sampled each 0.0015 mm."""
    return np.asarray(DENSE.query(points)[0])


def tip_at(place: np.ndarray, q: np.ndarray | None = None) -> StepState:
    """A state with the tip at a place; the robot's base stands where that needs it."""
    q = np.zeros(7) if q is None else q
    found = state_at(q)
    tip = replace(found.tip, position=np.asarray(place, dtype=float))
    return StepState(found.q, found.velocity, tip, found.segments, found.distance)


def test_the_room_in_the_tube_is_that_of_another_spline() -> None:
    places = np.random.default_rng(1).uniform((-2, -3, -3), (12, 25, 6), (300, 3))
    room = np.array([TUBE.room(tip_at(place)) for place in places])
    np.testing.assert_allclose(TUBE.radius_mm - far(places), room, atol=2e-6)


@pytest.mark.parametrize("limit", [TUBE, *(TipEnvelope("room", shape) for shape in SHAPES)])
def test_a_step_within_the_rows_ends_inside(limit: PathTube | TipEnvelope) -> None:
    """From any place inside, also next to the surface and behind the ends of the path; the rows' error is reserved."""
    random = np.random.default_rng(2)
    tried = near = 0
    while tried < 200:
        state = tip_at(random.uniform((-3, -5, -3), (11, 24, 6)), anywhere(random))
        if not RESERVE_MM < limit.room(state) < 0.6:
            continue
        now = replace(situation(state, dt=5e-3), scale_mm=0.05)
        (rows,) = limit.rows(now).constraints
        for _ in range(10):
            step = np.linalg.lstsq(state.tip.jacobian[:3], 0.05 * unit(random.normal(size=3)), rcond=None)[0]
            if (rows.matrix[:, :-1] @ step <= rows.bound).all():
                tried += 1
                after = state.tip.position + state.tip.jacobian[:3] @ step
                assert limit.room(tip_at(after)) >= RESERVE_MM
                near += limit.room(tip_at(after)) < 0.1
    assert near > 2


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_planes_contain_a_convex_shape(shape: Shape) -> None:
    """From any place inside, however far the other: no plane lies before it by more than what rows are tightened."""
    limit, random = TipEnvelope("room", shape), np.random.default_rng(4)
    places = random.uniform((-6, -8, -6), (11, 24, 8), (6000, 3))
    places = places[signed_distance(shape, places) < 0.0]
    assert len(places) > 60
    now = [replace(situation(tip_at(place), dt=2e-2), scale_mm=1e-3) for place in places[:6]]
    for one in now:
        (rows,) = limit.rows(replace(one, deceleration_mm_per_s2=1e9)).constraints
        for place in places:
            step = np.linalg.lstsq(one.state.tip.jacobian[:3], place - one.state.tip.position, rcond=None)[0]
            assert (rows.matrix[:, :-1] @ step <= rows.bound + 0.02).all()


@pytest.mark.parametrize("limit", [TUBE, *(TipEnvelope("room", shape) for shape in SHAPES)])
def test_no_row_forbids_a_short_step_that_stays_well_inside(limit: PathTube | TipEnvelope) -> None:
    """A step of 0.05 mm between places 0.12 mm inside; of a long one along a curved tube nothing is said."""
    random = np.random.default_rng(3)
    tried = 0
    while tried < 60:
        state = tip_at(random.uniform((-3, -5, -3), (11, 24, 6)))
        aim = state.tip.position + 0.05 * unit(random.normal(size=3))
        if min(limit.room(state), limit.room(tip_at(aim))) < 0.12:
            continue
        tried += 1
        (rows,) = limit.rows(replace(situation(state, dt=2e-2), scale_mm=0.05)).constraints
        step = np.linalg.lstsq(state.tip.jacobian[:3], aim - state.tip.position, rcond=None)[0]
        assert (rows.matrix[:, :-1] @ step <= rows.bound + 1e-9).all()


def controller_with(limit: PathTube | TipEnvelope) -> Controller:
    scene = straight_scene(wall(90.0))
    return Controller(scene.placed_robot(), scene.tool, scene.tree, ControlSettings(), fixtures=(limit,))


@pytest.mark.parametrize("limit", [TUBE, *(TipEnvelope("room", shape) for shape in SHAPES)])
def test_what_the_certificate_accepts_is_inside_all_the_way(limit: PathTube | TipEnvelope) -> None:
    """HAZ-02: joint steps from any source, a hundred poses of each measured by another spline."""
    controller, random = controller_with(limit), np.random.default_rng(5)
    scene = straight_scene(wall(90.0))
    robot, state = scene.placed_robot(), controller.start(np.zeros(7))
    accepted = 0
    for _ in range(120):
        step = random.normal(size=7) * np.where(robot.robot.revolute, 0.02, 2.0) * 10.0 ** random.uniform(-2, 0.3)
        problem = build_step(state, MoveFreely(), controller.fixtures, HandCommand(np.array([1.0, 0.0, 0.0])))
        way = np.array([robot.tip(state.q + share * step).position for share in np.linspace(0, 1, 101)])
        least = TUBE.radius_mm - far(way).max() if limit is TUBE else min(limit.room(tip_at(place)) for place in way)
        verdict = certify_step(problem, step)
        if isinstance(verdict, Certified):
            accepted += 1
            assert least >= -2e-6 if limit is TUBE else least >= 0.0
            state = verdict.next_state
        else:
            state = controller.start(np.zeros(7)) if random.random() < 0.1 else state
    assert accepted > 30


def test_a_start_outside_is_refused_in_words() -> None:
    """HAZ-04."""
    away = PathTube(SplinePath(LINE + UP), 1.0)
    with pytest.raises(StartRefused, match=r"the tip would start 3\.19 mm from the path, outside the tube of 1 mm"):
        controller_with(away).start(np.zeros(7))
    box = TipEnvelope("antrum", Sphere((0, 0, 5), 4.0))
    with pytest.raises(StartRefused, match=r"the tip would start 1\.00 mm outside the envelope 'antrum'; move"):
        controller_with(box).start(np.zeros(7))


@pytest.mark.parametrize("limit", [PathTube(SplinePath(LINE + UP), 1.0), TipEnvelope("antrum", Sphere((0, 0, 5), 4.0))])
def test_a_tip_outside_never_gets_further_out_and_can_come_back(limit: PathTube | TipEnvelope) -> None:
    controller = controller_with(limit)
    state = controller.measure(np.zeros(7))
    room = [limit.room(state)]
    for k in range(900):
        up = np.array([0.5 * np.sin(k / 9), 0.2, 1.0 if k % 300 > 50 else -1.0])
        state = controller.step(state, MoveFreely(), HandCommand(2.0 * up)).state
        room.append(limit.room(state))
    outside = np.array(room) < 0.0
    assert outside[0]
    assert not outside[-1]
    assert (np.diff(np.array(room)[outside]) >= -1e-12).all()


@pytest.mark.parametrize("radius", [0.04, 51.0, np.nan, True, "1"])
def test_a_radius_that_makes_no_tube(radius: object) -> None:
    with pytest.raises(InputError, match="radius"):
        PathTube(SplinePath(LINE), radius)  # type: ignore[arg-type]


def test_what_makes_no_limit() -> None:
    with pytest.raises(InputError, match="about a SplinePath, not a ndarray"):
        PathTube(LINE, 1.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="is a list; it is a sphere"):
        TipEnvelope("room", [1.0])  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"is 0\.04 mm small"):
        TipEnvelope("room", Sphere((0, 0, 0), 0.04))
    with pytest.raises(InputError, match="needs a name"):
        TipEnvelope(" ", Sphere((0, 0, 0), 4.0))


def test_a_way_that_leaves_the_tube_is_refused_although_both_ends_are_inside() -> None:
    """HAZ-02: across, from one leg of a hairpin to the other; and along an arc, out of a ball that has both ends."""
    hairpin = PathTube(SplinePath([(0, 0, 0), (0, 20, 0), (4, 20, 0), (4, 0, 0)], degree=1), 1.0)
    robot = controller_with(hairpin).robot
    across = np.linalg.lstsq(robot.tip(np.zeros(7)).jacobian, np.array([4.0, 0, 0, 0, 0, 0]), rcond=None)[0]
    arc = np.array([0.0, 0, 0, 0, 0.25, 0, 0])
    middle = 0.5 * (robot.tip(np.zeros(7)).position + robot.tip(arc).position)
    half = 0.5 * float(np.linalg.norm(robot.tip(arc).position - robot.tip(np.zeros(7)).position))
    bulge = robot.tip(0.5 * arc).position - middle
    plane = TipEnvelope("flat", HalfSpace(0.1 * bulge, bulge))
    assert half > 0.5
    for limit, step in ((hairpin, across), (plane, arc)):
        controller = controller_with(limit)
        state = controller.start(np.zeros(7))
        problem = build_step(state, MoveFreely(), controller.fixtures, HandCommand(np.array([1.0, 0.0, 0.0])))
        after = controller.certify(state, step)
        assert after is not None
        assert limit.room(after) > RESERVE_MM
        verdict = certify_step(problem, step)
        assert isinstance(verdict, Refused)
        assert verdict.by is limit


def test_states_made_by_hand_are_checked_along_their_chord() -> None:
    """Without a context nothing is known of the joints between: the chord must stay inside as well."""
    hairpin = PathTube(SplinePath([(0, 0, 0), (0, 20, 0), (4, 20, 0), (4, 0, 0)], degree=1), 1.0)
    here, there, beyond = (tip_at(np.array(place)) for place in ([0.0, 5, 0], [4.0, 5, 0], [0.0, 9, 0.5]))
    assert hairpin.room(there) > RESERVE_MM
    assert not hairpin.is_admissible(here, there)
    assert hairpin.is_admissible(here, beyond)


def test_two_legs_of_one_path_lie_in_one_tube() -> None:
    """Where tubes of two branches overlap, the tip crosses from one to the other."""
    legs = SplinePath(np.array([[0.0, 0, 0], [0.0, 20, 0], [0.8, 20.4, 0], [1.6, 20, 0], [1.6, 0, 0]]), degree=1)
    tube = PathTube(legs, 1.0)
    controller = controller_with(tube)
    state = controller.start(np.zeros(7))
    for _ in range(700):
        state = controller.step(state, MoveFreely(), HandCommand(np.array([1.5, 0.6, 0.0]))).state
    assert state.tip.position[0] > 1.9  # beyond the other leg
    assert tube.room(state) > 0.0


@pytest.mark.parametrize("shape", [None, *SHAPES])
def test_a_narrowed_limit_holds_every_deflected_tip(shape: Shape | None) -> None:
    """What is inside it is, moved by as much in any direction, inside the limit itself."""
    by, random = 0.4, np.random.default_rng(7)
    limit = TUBE if shape is None else TipEnvelope("room", shape)
    narrow = limit.narrowed(by)
    places = random.uniform((-4, -4, -4), (12, 24, 6), (3000, 3))
    inside = [place for place in places if narrow.look(place).excess <= 0.0]
    assert len(inside) > 20
    for place in inside:
        away = random.normal(size=3)
        assert limit.look(place + by * away / np.linalg.norm(away)).excess <= 1e-9
        assert limit.room(tip_at(place)) >= by - 1e-9
    assert limit.narrowed(0.0) is limit
    if not isinstance(shape, HalfSpace):
        with pytest.raises(InputError, match="no room for the deflection of 5 mm"):
            limit.narrowed(5.0)


@pytest.mark.parametrize("kind", ["tube", "ball", "box"])
def test_the_tip_that_a_hand_deflects_stays_inside(kind: str) -> None:
    """The deflection C f is known, as every margin of bone knows it: 1 mm under the force cap."""
    scene, settings = straight_scene(wall(200.0), LINE), ControlSettings(compliance_mm_per_n=0.2, threshold_mm=10.0)
    shapes: dict[str, PathTube | TipEnvelope] = {
        "tube": PathTube(SplinePath(LINE), 2.0),
        "ball": TipEnvelope("room", Sphere(LINE[0], 2.0)),
        "box": TipEnvelope("room", Box(np.eye(4), (2.0, 2.0, 2.0))),
    }
    limit = weighted(shapes[kind], 0.5)
    system = RigidSystem(replace(scene, fixtures=(limit,)), settings)
    with_anatomy = system.controller.with_anatomy(scene.tree)
    assert tip_limits(with_anatomy.fixtures)[0].room(system.start("free").tool) == pytest.approx(1.0, abs=1e-6)
    state, row, worst = system.start("free"), np.zeros(len(system.row_layout)), 1e9
    place = [column.name for column in system.row_layout].index("room0")
    for _ in range(900):
        state = system.step(state, Command(np.array([5.0, 0.0, 0.0])))
        assert state.last is not None
        tip = state.tool.tip.position + settings.compliance_mm_per_n * state.last.force
        worst = min(worst, -shapes[kind].look(tip).excess)
        system.row(state, row)
        assert row[place] == shapes[kind].room(state.tool) - settings.deflection_mm
    assert 0.0 <= worst < 0.1, "it is held there"
    stiff = RigidSystem(replace(scene, fixtures=(limit,)), replace(settings, compliance_mm_per_n=0.0))
    soft = SetSettings(replace(settings, compliance_mm_per_n=0.5))
    with pytest.raises(InputError, match="no room for the deflection"):
        stiff.apply(stiff.start("free"), soft)
    assert stiff.step(stiff.start("free"), Command(np.zeros(3))).settings.compliance_mm_per_n == 0.0
