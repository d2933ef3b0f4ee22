"""The certificate of a snake in its pathway: what it takes is judged again, vertex by vertex, and so is the way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lumen_shapes import arc, straight

from vfix_engine.errors import InputError
from vfix_engine.pathway.limits.limits import MOTION_TOLERANCE_MM, Configuration, HardLimits
from vfix_engine.pathway.limits.limits_kernel import _acceleration_bounds, _turn_between, lipschitz_to_depth
from vfix_engine.pathway.limits.limits_vertices import _growth
from vfix_engine.pathway.packed import INSCRIBED_RADIUS, PackedPathway
from vfix_engine.pathway.query.clearance import lipschitz_constant
from vfix_engine.pathway.query.query import Query, deviation_of_points
from vfix_engine.robots.snake import SnakeModel

SNAKE = SnakeModel(5)
BOUND = np.array([6.0, 6.0, 6.0, 6.0, 3.0])
BASE = np.eye(4)


def limits(bound: np.ndarray = BOUND, count: int = 60) -> HardLimits:
    return HardLimits(Query(SNAKE.vertices(count)), SNAKE, bound)


def windows(packed) -> np.ndarray:
    return np.tile(np.array([0, len(packed.rows)], dtype=np.int64), (5, 1))


def judged(packed, pose: Configuration, count: int = 60) -> np.ndarray:
    """Depth (5,) of every link, each vertex against each segment, without the query's blocks."""
    frames, vertices = SNAKE.frames(pose.q, pose.base)[1:], SNAKE.vertices(count)
    depth = np.empty(5)
    for link in range(5):
        own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
        placed = own @ frames[link, :3, :3].T + frames[link, :3, 3]
        depth[link] = deviation_of_points(placed, packed, 0, len(packed.rows))[0].max()
    return depth


def between(one: Configuration, two: Configuration, share: float) -> Configuration:
    """A pose on the way of a motion, by SciPy's rotations."""
    from scipy.spatial.transform import Rotation, Slerp

    base = one.base.copy()
    turns = Slerp([0.0, 1.0], Rotation.from_matrix([one.base[:3, :3], two.base[:3, :3]]))
    base[:3, :3] = turns(share).as_matrix()
    base[:3, 3] = (1.0 - share) * one.base[:3, 3] + share * two.base[:3, 3]
    return Configuration(base, one.q + share * (two.q - one.q))


def wild(rng: np.random.Generator, pose: Configuration) -> Configuration:
    """Somewhere an attacker wants to be: some joints by a little, all by a lot, or the base shifted and turned."""
    size = rng.choice([0.002, 0.03, 0.3])
    q = SNAKE.clamp(pose.q + size * rng.uniform(-1.0, 1.0, 10) * rng.integers(0, 2, 10))
    base = pose.base.copy()
    if rng.uniform() < 0.3:
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle, cross = size * rng.uniform(), np.cross(np.eye(3), axis)
        turn = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
        base[:3, :3] = turn @ base[:3, :3]
        base[:3, 3] += 10.0 * size * rng.normal(size=3)
    return Configuration(base, q)


@pytest.mark.parametrize(
    "shape",
    [
        straight(260.0, contours=14),
        arc(120.0, 1.6, contours=12),
        arc(120.0, 1.6, contours=12, angles=28),  # bounds of more than half the inscribed radius
        arc(120.0, 1.6, 8.0, contours=12, angles=28),  # and of more than nine tenths of it
    ],
)
def test_no_motion_that_is_taken_leaves_the_bounds(shape) -> None:
    """HAZ-01, HAZ-02 for the snake: its poses within b_i, its ways within b_i and the tolerance."""
    packed = shape.packed()
    certificate, window = limits(), windows(packed)
    rng = np.random.default_rng(20261121)
    chords = np.tile([0.0, 2.0 * math.asin(14.0 / 120.0)], 5)  # joint centres on the arc
    chords[1] *= 0.5
    rest = Configuration(BASE, np.zeros(10)) if shape.centre[-1, 0] == 0.0 else Configuration(BASE, chords)
    pose, taken, refused, replayed = rest, 0, 0, 0
    deepest = 0.0
    assert (judged(packed, pose) <= BOUND).all()
    for attempt in range(700):
        if attempt % 60 == 0:
            pose = rest
        wanted = wild(rng, pose)
        verdict = certificate.certify(packed, window, pose, wanted)
        if not verdict.taken:
            refused += 1
            assert verdict.held_by is not None
            assert 0.0 <= verdict.part < 1.0
            continue
        depth = judged(packed, wanted)
        np.testing.assert_allclose(verdict.deviation.depth, depth, rtol=0.0, atol=1e-9)
        assert (depth <= BOUND).all()
        if taken % 10 == 0 or (depth > BOUND - 1.0).any():
            replayed += 1
            for share in np.linspace(0.0, 1.0, 8)[1:-1]:
                on_the_way = judged(packed, between(pose, wanted, share))
                assert (on_the_way <= BOUND + MOTION_TOLERANCE_MM).all()
        deepest = max(deepest, float((depth - BOUND).max()))
        pose, taken = wanted, taken + 1
    assert taken > 60
    assert refused > 150
    assert replayed > 30
    assert deepest > -0.6  # it was pressed against the bound


def test_the_slope_is_that_of_the_depth_that_is_asked_for() -> None:
    """Up to the limit and the tolerance where inscribed radii are large enough, else up to nine tenths of the least."""
    packed = arc(120.0, 1.6, contours=12, angles=28).packed()
    inscribed, tolerance = packed.rows[2:9, INSCRIBED_RADIUS].min(), MOTION_TOLERANCE_MM
    near = (0.5 * inscribed, 0.9 * inscribed - tolerance, 0.9 * inscribed, inscribed, 3.0 * inscribed)
    for limit in (0.0, 1.0, *near, np.inf):
        level, steep = lipschitz_to_depth(packed.rows, 2, 9, limit, tolerance)
        assert level == pytest.approx(min(limit, 0.9 * inscribed - tolerance), abs=1e-12)
        assert steep == pytest.approx(lipschitz_constant(packed, 2, 9, level + tolerance), rel=1e-9)
    assert steep > 2.0 * lipschitz_constant(packed, 2, 9)


def test_a_way_through_the_wall_between_two_good_poses_is_refused() -> None:
    """Both ends are within the bounds, the way between them is not: the base swings round outside the bend."""
    packed = straight(260.0, contours=14).packed()
    window = windows(packed)
    one, two = Configuration(BASE, np.tile([0.0, 0.0], 5)), BASE.copy()
    c, s = math.cos(2.98), math.sin(2.98)  # nearly half a turn about y
    two[:3, :3], two[:3, 3] = [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]], [0.0, 0.0, 200.0]
    back = Configuration(two, np.tile([0.0, 0.03], 5))
    assert (judged(packed, back) <= 20.0).all()
    certificate = limits(np.full(5, 20.0))
    assert certificate.certify(packed, window, one, one).taken
    assert certificate.certify(packed, window, back, back).taken
    verdict = certificate.certify(packed, window, one, back)
    assert not verdict.taken
    assert "bound" in str(verdict.held_by)


def test_where_inscribed_radii_are_small_lemma_7_holds() -> None:
    """HAZ-02 for the snake: how fast a deviation beyond every inscribed radius can grow."""
    packed, rng = arc(120.0, 1.6, 8.0, contours=12, angles=28).packed(), np.random.default_rng(11)
    frame, far, tightest, inscribed = np.eye(4)[:3].copy(), 0, 0.0, packed.rows[:, INSCRIBED_RADIUS].max()
    for _ in range(3000):
        j = int(rng.integers(2, 10))
        x = packed.rows[j, 0:3] + rng.normal(size=3) * 9.0
        way = float(rng.uniform(0.1, 3.0))
        deep, steep = _growth(packed.rows, packed.polar, 1, 12, frame, *x, way, 1.0, 1.5)
        assert deep == pytest.approx(deviation_of_points(x[None], packed, 1, 12)[0][0], abs=1e-12)
        if deep == 0.0 or not math.isfinite(steep):
            continue
        far += deep > inscribed
        ahead = rng.normal(size=(40, 3))
        ahead *= way * rng.uniform(0.3, 1.0, (40, 1)) / np.linalg.norm(ahead, axis=1, keepdims=True)
        grown = deviation_of_points(x + ahead, packed, 1, 12)[0] - deep
        rate = float((grown / np.linalg.norm(ahead, axis=1)).max())
        assert rate <= steep + 1e-9
        tightest = max(tightest, rate / steep)
    assert far > 100
    assert tightest > 0.95


def test_a_way_through_the_end_of_a_window_is_refused() -> None:
    """HAZ-02 for the snake: swung from side to side the tip passes through the last plane, behind which it is deep."""
    packed, base = straight(195.9, 80.0, contours=3, closed_ends=True).packed(), BASE.copy()
    certificate, window, base[2, 3] = limits(np.full(5, 8.0), count=600), windows(packed), 50.0
    aside = [Configuration(base, np.array([0.0, turn, *np.zeros(8)])) for turn in (-0.05, 0.0, 0.05)]
    depth = [judged(packed, pose, 600).max() for pose in aside]
    assert depth[0] == depth[2] == 0.0
    assert depth[1] > 70.0
    assert not certificate.certify(packed, window, aside[0], aside[2]).taken
    longer = straight(225.0, 80.0, contours=3, closed_ends=True).packed()
    assert certificate.certify(longer, window, aside[0], aside[2]).taken


def test_a_link_that_comes_to_count_has_to_be_within_its_bound() -> None:
    """Deeper than was known, by another window: no step ends there; known to be as deep: it may come back."""
    packed = straight(260.0, 9.0, contours=14).packed()
    certificate, window = limits(np.full(5, 1.0)), windows(packed)
    bent, less = (Configuration(BASE, np.tile([0.0, turn], 5)) for turn in (0.05, 0.045))
    depth = judged(packed, bent)
    assert certificate.certify(packed, window, bent, less, known=depth).taken
    verdict = certificate.certify(packed, window, bent, less, known=np.array([*depth[:4], 0.0]))
    assert not verdict.taken
    assert "link 5" in str(verdict.held_by)
    for wrong in (depth[:4], -depth, depth * np.nan, "deep"):
        with pytest.raises(InputError, match="known depths"):
            certificate.certify(packed, window, bent, less, known=wrong)


def test_from_beyond_a_bound_nothing_goes_deeper() -> None:
    """The pathway narrowed: links beyond their bound may only come back."""
    packed = straight(260.0, 9.0, contours=14).packed()
    certificate, window = limits(np.full(5, 1.0)), windows(packed)
    bent = Configuration(BASE, np.tile([0.0, 0.05], 5))
    depth = judged(packed, bent)
    assert (depth[2:] > 1.0).all()
    assert certificate.certify(packed, window, bent, Configuration(BASE, np.tile([0.0, 0.045], 5))).taken
    verdict = certificate.certify(packed, window, bent, Configuration(BASE, np.tile([0.0, 0.051], 5)))
    assert not verdict.taken
    assert "bound" in str(verdict.held_by)
    assert certificate.certify(packed, window, bent, bent).taken


def test_nonsense_is_refused() -> None:
    packed = straight(260.0, contours=14).packed()
    certificate, window = limits(), windows(packed)
    here = Configuration(BASE, np.zeros(10))
    for value in (np.nan, np.inf, -np.inf):
        q = np.zeros(10)
        q[3] = value
        assert not certificate.certify(packed, window, here, Configuration(BASE, q)).taken
        base = BASE.copy()
        base[1, 3] = value
        assert not certificate.certify(packed, window, here, Configuration(base, np.zeros(10))).taken
    beyond = np.zeros(10)
    beyond[4] = math.radians(45.001)
    assert "range" in str(certificate.certify(packed, window, here, Configuration(BASE, beyond)).held_by)
    for bound in ([1.0], [1.0, 1.0, 1.0, 1.0, -0.1], [1.0, 1.0, 1.0, 1.0, np.nan]):
        with pytest.raises(InputError):
            HardLimits(Query(SNAKE.vertices(60)), SNAKE, bound)
    with pytest.raises(InputError):
        HardLimits(Query(SnakeModel(4).vertices(60)), SNAKE, BOUND)


def test_a_pose_has_the_shape_of_one() -> None:
    """HAZ-05 for the snake: what the kernels would read past the end of is refused before."""
    for base in (np.eye(3), np.eye(4)[:3], np.zeros(16), "base", [[1.0, 0.0], [0.0]], np.eye(4) * 1j):
        with pytest.raises(InputError, match="base"):
            Configuration(base, np.zeros(10))
    for q in (np.zeros(9), np.zeros((5, 2)), 0.0, "q", None, [[0.0], [0.0, 1.0]]):
        with pytest.raises(InputError, match=r"joints|the q"):
            Configuration(BASE, q)


@pytest.mark.parametrize("links", [0, 2, 4, 6])
def test_poses_of_another_snake_are_an_error(links) -> None:
    packed = straight(260.0, contours=14).packed()
    here, other = Configuration(BASE, np.zeros(10)), Configuration(BASE, np.zeros(2 * links))
    for pair in ((here, other), (other, here), (other, other)):
        with pytest.raises(InputError, match="give 10, two for each of 5 links"):
            limits().certify(packed, windows(packed), *pair)


@pytest.mark.parametrize(
    "bound",
    [[8.0, 8.0], np.full(4, 8.0), np.full(6, 8.0), np.full((5, 1), 8.0), 8.0, [8.0, 8.0, 8.0, 8.0, np.nan],
     [8.0, 8.0, -1e-9, 8.0, 8.0], [8.0, -np.inf, 8.0, 8.0, 8.0], np.full(5, 8.0 + 0.0j), list("88888")],
)  # fmt: skip
def test_bounds_of_a_motion_are_checked(bound) -> None:
    """HAZ-05 for the snake: two bounds for five links were read past their end."""
    packed, here = straight(260.0, contours=14).packed(), Configuration(BASE, np.zeros(10))
    with pytest.raises(InputError, match=r"bound.*: give"):
        limits().certify(packed, windows(packed), here, here, np.array(bound))


def test_a_link_may_be_unlimited_for_one_motion() -> None:
    packed, here = straight(260.0, contours=14).packed(), Configuration(BASE, np.zeros(10))
    across = Configuration(BASE, np.tile([0.0, 0.3], 5))
    certificate, window = limits(np.full(5, 2.0)), windows(packed)
    assert not certificate.certify(packed, window, here, across).taken
    assert certificate.certify(packed, window, here, across, np.full(5, np.inf)).taken
    assert certificate.certify(packed, window, here, here, [2, 2, 2, 2, 2]).taken
    assert not certificate.bound.flags.writeable


@pytest.mark.parametrize("pair", [(0, 0), (3, 2), (-1, 4), (0, 16), (15, 16), (2**40, 2**41), (-(2**40), 3)])
def test_windows_lie_in_the_pathway(pair) -> None:
    packed, here = straight(260.0, contours=14).packed(), Configuration(BASE, np.zeros(10))
    for link in range(5):
        window = windows(packed)
        window[link] = pair
        with pytest.raises(InputError, match=rf"link {link + 1} has the window.*give 0 ≤ first < last ≤ 15"):
            limits().certify(packed, window, here, here)


def test_windows_are_whole_numbers_for_every_link() -> None:
    packed, here = straight(260.0, contours=14).packed(), Configuration(BASE, np.zeros(10))
    good = windows(packed)
    for wrong in (good[:4], good[0], good[:, :1], good.astype(float), np.vstack([good, good]), None):
        with pytest.raises(InputError, match="windows are whole numbers"):
            limits().certify(packed, wrong, here, here)
    for other in (good.astype(np.int32), np.asfortranarray(good), good.tolist()):
        assert limits().certify(packed, other, here, here).taken


def test_a_pathway_that_was_not_packed_is_an_error() -> None:
    packed, here = straight(260.0, contours=14).packed(), Configuration(BASE, np.zeros(10))
    rows, polar, certificate = packed.rows, packed.polar, limits()
    hole, bad = rows.copy(), polar.copy()
    hole[4, INSCRIBED_RADIUS], bad[3] = np.nan, np.inf
    assert certificate.certify(packed, windows(packed), here, here).taken
    for wrong in (
        (rows[:, :40], polar), (rows[:0], polar[:1]), (rows, polar[:-1]), (rows, polar[:, :0]), (rows, polar[:, 0]),
        (rows, np.repeat(polar, 2, axis=1)), (rows[0], polar), (np.asfortranarray(rows), polar),
        (rows.astype(np.float32), polar), (rows.tolist(), polar), (hole, polar), (rows, bad),
    ):  # fmt: skip
        with pytest.raises(InputError, match=r"pathway|contours"):
            certificate.certify(PackedPathway(*wrong), windows(packed), here, here)


def test_a_broken_certificate_would_be_found_out() -> None:
    """With bounds that are laxer than the judge's the same attack leaves them."""
    packed = straight(260.0, contours=14).packed()
    certificate, window = limits(BOUND + 1.0), windows(packed)
    rng = np.random.default_rng(5)
    pose, found = Configuration(BASE, np.zeros(10)), 0
    for _ in range(300):
        wanted = wild(rng, pose)
        if certificate.certify(packed, window, pose, wanted).taken:
            pose = wanted
            found += bool((judged(packed, pose) > BOUND).any())
    assert found > 3


def test_the_bow_bounds_the_second_derivative() -> None:
    """K of docs/safety.md against differences along random motions; and it is no more than a few times too large."""
    rng = np.random.default_rng(3)
    vertices = SNAKE.vertices(60)
    shape, worst = limits()._shape, 0.0
    for _ in range(60):
        one = Configuration(BASE, rng.uniform(-0.7, 0.7, 10))
        base = BASE.copy()
        angle = rng.uniform(0.0, 0.4)
        base[:3, :3] = [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
        base[:3, 3] = rng.normal(size=3)
        two = Configuration(base, np.clip(one.q + rng.normal(size=10) * 0.2, -0.78, 0.78))
        turn, acceleration_bound = np.empty(3), np.empty(5)
        _turn_between(one.base, two.base, turn)
        np.testing.assert_allclose(turn, [0.0, 0.0, angle], atol=1e-12)
        assert _acceleration_bounds(one.q, two.q, turn, shape, acceleration_bound)
        frames = [SNAKE.frames(*(lambda p: (p.q, p.base))(between(one, two, x)))[1:] for x in (0.49, 0.5, 0.51)]
        for link in range(5):
            own = vertices.points[vertices.start[link] : vertices.start[link + 1]]
            places = [own @ f[link, :3, :3].T + f[link, :3, 3] for f in frames]
            second = np.linalg.norm(places[0] - 2.0 * places[1] + places[2], axis=1).max() / 1e-4
            assert second <= acceleration_bound[link] * 1.001
            worst = max(worst, second / acceleration_bound[link])
    assert worst > 0.2
