"""Registration by pairs against scipy, its expected errors against 2,000 trials and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from registration_cases import BEADS, TARGETS, placed, some_pose
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from scipy.stats import chi, chi2

from vfix_engine.errors import InputError
from vfix_engine.registration import expected_fre_mm, fle_from_fre_mm, register_points
from vfix_engine.registration.expected_error import ball_radius

TRIALS = 2000


def trials(beads: np.ndarray, sigma: float, seed: int, weights: np.ndarray | None = None) -> tuple[float, np.ndarray]:
    """rms FRE, and the errors (trial, target, 3) in the fixed frame, of a registration with noisy fixed points."""
    random, pose = np.random.default_rng(seed), some_pose(seed)
    fixed, truth = placed(pose, beads), placed(pose, TARGETS)
    squares, errors = [], []
    for _ in range(TRIALS):
        result = register_points(fixed + random.normal(0.0, sigma, fixed.shape), beads, weights)
        squares.append(result.fre_mm**2)
        errors.append(result.to_fixed(TARGETS) - truth)
    return float(np.sqrt(np.mean(squares))), np.array(errors)


@pytest.mark.parametrize("seed", range(5))
def test_exact_pairs_give_their_transform(seed: int) -> None:
    pose = some_pose(seed)
    for count in (3, 4, 5):
        result = register_points(placed(pose, BEADS[:count]), BEADS[:count])
        assert result.transform == pytest.approx(pose, abs=1e-10)
        assert result.fre_mm < 1e-10
        assert result.to_moving(result.to_fixed(TARGETS)) == pytest.approx(TARGETS, abs=1e-10)


@pytest.mark.parametrize("seed", range(8))
def test_it_is_scipys_fit(seed: int) -> None:
    """align_vectors on points about their weighted centres."""
    random, pose = np.random.default_rng(seed), some_pose(seed)
    moving = random.normal(0.0, 50.0, (6, 3))
    fixed = placed(pose, moving) + random.normal(0.0, 2.0, moving.shape)
    weights = random.uniform(0.1, 3.0, 6)
    result = register_points(fixed, moving, weights)
    a, b = weights @ fixed / weights.sum(), weights @ moving / weights.sum()
    expected = Rotation.align_vectors(fixed - a, moving - b, weights=weights)[0].as_matrix()
    assert result.transform[:3, :3] == pytest.approx(expected, abs=1e-9)
    assert result.transform[:3, 3] == pytest.approx(a - expected @ b, abs=1e-7)
    assert result.residuals_mm == pytest.approx(np.linalg.norm(fixed - placed(result.transform, moving), axis=1))
    assert result.fre_mm == pytest.approx(np.sqrt((result.residuals_mm**2).mean()))
    assert result.mean_residual_mm == pytest.approx(result.residuals_mm.mean())


def test_no_other_transform_fits_better() -> None:
    """A general minimiser of the same sum ends at the same transform."""
    random = np.random.default_rng(3)
    fixed, weights = BEADS + random.normal(0.0, 3.0, BEADS.shape), np.array([1.0, 2.0, 0.5, 1.0, 3.0])

    def cost(motion: np.ndarray) -> float:
        turned = BEADS @ Rotation.from_rotvec(motion[:3]).as_matrix().T + motion[3:] * 100.0
        return float(weights @ ((fixed - turned) ** 2).sum(axis=1))

    best = minimize(cost, np.zeros(6), method="BFGS", options={"gtol": 1e-4})
    result = register_points(fixed, BEADS, weights)
    assert float(weights @ result.residuals_mm**2) <= best.fun + 1e-6
    assert Rotation.from_matrix(result.transform[:3, :3]).as_rotvec() == pytest.approx(best.x[:3], abs=1e-4)


def test_a_plane_and_a_mirror_give_a_rotation() -> None:
    flat = BEADS * [1.0, 1.0, 0.0]
    pose = some_pose(4)
    assert register_points(placed(pose, flat), flat).transform == pytest.approx(pose, abs=1e-9)
    mirrored = register_points(BEADS * [-1.0, 1.0, 1.0], BEADS)
    assert np.linalg.det(mirrored.transform[:3, :3]) == pytest.approx(1.0)
    assert mirrored.fre_mm > 5.0


def test_weight_zero_takes_no_part_and_is_still_measured() -> None:
    fixed = BEADS.copy()
    fixed[4] += [0.0, 9.0, 0.0]
    result = register_points(fixed, BEADS, [1.0, 1.0, 1.0, 1.0, 0.0])
    assert result.transform == pytest.approx(np.eye(4), abs=1e-10)
    assert (result.count, result.fre_mm) == (4, pytest.approx(0.0, abs=1e-10))
    assert result.residuals_mm[4] == pytest.approx(9.0)
    assert result.tre_mm(TARGETS, 1.0) == pytest.approx(register_points(fixed[:4], BEADS[:4]).tre_mm(TARGETS, 1.0))


@pytest.mark.parametrize("count", [3, 4, 5])
def test_fre_and_tre_are_as_predicted(count: int) -> None:
    """rms over 2,000 trials within 3 % of Fitzpatrick 1998; rms values, whose spread is half that of their squares."""
    sigma, beads = 0.3, BEADS[:count]
    fle = np.sqrt(3.0) * sigma
    fre, errors = trials(beads, sigma, seed=count)
    assert fre == pytest.approx(sigma * np.sqrt(3.0 * (1.0 - 2.0 / count)), rel=0.03)
    assert expected_fre_mm(count, fle) == pytest.approx(sigma * np.sqrt(3.0 * (1.0 - 2.0 / count)))
    assert fle_from_fre_mm(count, expected_fre_mm(count, fle)) == pytest.approx(fle)
    predicted = register_points(beads, beads).tre_mm(TARGETS, fle)
    assert np.sqrt((errors**2).sum(axis=2).mean(axis=0)) == pytest.approx(predicted, rel=0.03)
    assert predicted == pytest.approx([fitzpatrick(beads, target, fle) for target in TARGETS])


def fitzpatrick(beads: np.ndarray, target: np.ndarray, fle: float) -> float:
    """The formula as printed, with the distances from the principal axes."""
    q, d = beads - beads.mean(axis=0), target - beads.mean(axis=0)
    axes = np.linalg.svd(q)[2]
    shares = [(d @ d - (d @ e) ** 2) / ((q**2).sum(axis=1) - (q @ e) ** 2).mean() for e in axes]
    return fle * np.sqrt((1.0 + sum(shares) / 3.0) / len(beads))


def test_covariance_and_95_percent_hold_for_weights_and_both_frames() -> None:
    """Covariance within 10 % of its largest entry, and 95 % of 2,000 errors in the ball, within 1.5 %."""
    sigma, weights = 0.3, np.array([1.0, 3.0, 0.5, 1.0, 2.0])
    fre, errors = trials(BEADS, sigma, seed=11, weights=weights)
    known = register_points(placed(some_pose(11), BEADS), BEADS, weights)
    fle = np.sqrt(3.0) * sigma
    turn = known.transform[:3, :3]
    in_fixed = known.tre_covariance(known.to_fixed(TARGETS), fle, frame="fixed")
    assert in_fixed == pytest.approx(turn @ known.tre_covariance(TARGETS, fle) @ turn.T, abs=1e-10)
    radii = known.tre_95_mm(TARGETS, fle)
    for error, covariance, radius in zip(errors.transpose(1, 0, 2), in_fixed, radii, strict=True):
        assert np.cov(error.T) == pytest.approx(covariance, abs=0.1 * covariance.max())
        assert (np.linalg.norm(error, axis=1) <= radius).mean() == pytest.approx(0.95, abs=0.015)
    noisy = register_points(known.fixed + np.random.default_rng(5).normal(0, 1, BEADS.shape), BEADS, weights)
    assert noisy.fle_mm * fre / noisy.fre_mm == pytest.approx(fle, rel=0.03)  # the same share of FLE remains


@pytest.mark.parametrize(
    "eigenvalues", [(4.0, 1.0, 0.25), (1.0, 1.0, 1.0), (9.0, 1e-6, 0.0), (2.0, 2.0, 0.0), (1.0, 0.0, 0.0)]
)
def test_the_radius_of_a_normal_error(eigenvalues: tuple[float, float, float]) -> None:
    """Quantile by a million draws within 0.3 %; exact where one, two or three directions are alike."""
    random = np.random.default_rng(1)
    turn = Rotation.random(rng=random).as_matrix()
    covariance = turn @ np.diag(eigenvalues) @ turn.T
    radius = ball_radius(covariance[None])[0]
    drawn = np.linalg.norm(random.normal(size=(1_000_000, 3)) * np.sqrt(eigenvalues), axis=1)
    assert radius == pytest.approx(np.quantile(drawn, 0.95), rel=3e-3)
    alike = {(1.0, 1.0, 1.0): 3, (2.0, 2.0, 0.0): 2, (1.0, 0.0, 0.0): 1}.get(eigenvalues)
    if alike:
        assert radius == pytest.approx(np.sqrt(eigenvalues[0]) * chi(alike).ppf(0.95), rel=1e-6)


def test_radii_of_many_at_once_and_of_none() -> None:
    known = register_points(BEADS, BEADS)
    many = known.tre_95_mm(np.tile(TARGETS, (500, 1)), 0.5)
    assert many.reshape(500, 3) == pytest.approx(np.tile(known.tre_95_mm(TARGETS, 0.5), (500, 1)), rel=1e-12)
    assert known.tre_95_mm(TARGETS, 0.0) == pytest.approx(0.0)
    assert known.tre_mm(np.zeros((0, 3)), 0.5).shape == known.tre_95_mm(np.zeros((0, 3)), 0.5).shape == (0,)
    assert known.tre_mm(TARGETS[0], 0.5).shape == (1,)


LINE = np.array([(0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (55.0, 0.0, 0.1), (90.0, 0.1, 0.0)])


@pytest.mark.parametrize(
    ("fixed", "moving", "weights", "words"),
    [
        (BEADS[:2], BEADS[:2], None, "too few"),
        (BEADS, BEADS[:4], None, "5 fixed and 4 moving"),
        (LINE, LINE, None, "lie on a line"),
        (BEADS[:4], LINE, None, "the moving points lie on a line"),
        (BEADS[[0, 1, 2, 1]], BEADS[[0, 1, 2, 1]], None, "points 2 and 4 are in the same place"),
        (np.where(BEADS == 8.2, np.nan, BEADS), BEADS, None, "point 1 of the fixed points is not finite"),
        (BEADS, BEADS * 1e9, None, "kilometre"),
        (BEADS[:, :2], BEADS[:, :2], None, r"\(n, 3\)"),
        (BEADS, BEADS, [1, 1, 0, 0, 0], "only 2 pairs"),
        (BEADS, BEADS, [1, 1, 1, 1, -1], "finite numbers from 0 on"),
        (BEADS, BEADS, [1, 1, 1, 1, np.nan], "finite numbers from 0 on"),
        (BEADS, BEADS, [1, 1, 1], "the weights must be 5"),
        (np.vstack([LINE, BEADS[:1]]), np.vstack([LINE, BEADS[:1]]), [1, 1, 1, 1, 0], "lie on a line"),
        ("beads", BEADS, None, "no array of real numbers"),
    ],
)
def test_what_cannot_be_fitted_is_refused(fixed: object, moving: object, weights: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        register_points(fixed, moving, weights)  # type: ignore[arg-type]


def test_wrong_targets_and_errors_are_refused() -> None:
    known = register_points(BEADS, BEADS)
    for points, fle in (([[np.nan, 0, 0]], 0.5), (TARGETS[:, :2], 0.5), (TARGETS, -0.1), (TARGETS, np.inf)):
        for ask in (known.tre_mm, known.tre_covariance, known.tre_95_mm):
            with pytest.raises(InputError):
                ask(points, fle)
    with pytest.raises(InputError, match="frame"):
        known.tre_mm(TARGETS, 0.5, frame="patient")  # type: ignore[arg-type]
    with pytest.raises(InputError):
        known.tre_95_mm(TARGETS, 0.5, share=1.0)
    for wrong in (lambda: expected_fre_mm(2, 0.5), lambda: fle_from_fre_mm(2, 0.5), lambda: expected_fre_mm(5, -1.0)):
        with pytest.raises(InputError):
            wrong()


def test_results_cannot_be_changed() -> None:
    known = register_points(BEADS, BEADS)
    for array in (known.transform, known.fixed, known.moving, known.weights, known.residuals_mm):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize("weights", [None, np.array([1.0, 1.0, 0.2, 3.0, 0.05])])
def test_residuals_are_those_of_the_error_that_was_said(weights: np.ndarray | None) -> None:
    """Of fits with that error one of a hundred leaves more than 99 % do; at twice the error almost all do."""
    random, pose, sigma = np.random.default_rng(11), some_pose(11), 0.5
    fixed, fle = placed(pose, BEADS), 0.5 * np.sqrt(3.0)
    fits = [register_points(fixed + random.normal(0.0, sigma, fixed.shape), BEADS, weights) for _ in range(TRIALS)]
    beyond = np.mean([not one.explained_by(fle, 0.99) for one in fits])
    assert 0.004 < beyond < 0.02
    assert np.mean([one.explained_by(fle / 4.0) for one in fits]) < 0.05


def test_the_limit_of_the_residuals_is_that_of_chi_square() -> None:
    """3n − 6 degrees of freedom and a third of the squared error for each axis."""
    random = np.random.default_rng(12)
    for count in (3, 4, 5):
        result = register_points(BEADS[:count] + random.normal(0.0, 0.5, (count, 3)), BEADS[:count])
        squares = float((result.residuals_mm**2).sum())
        limit = np.sqrt(3.0 * squares / chi2.ppf(0.999, 3 * count - 6))
        assert result.explained_by(1.001 * limit)
        assert not result.explained_by(0.999 * limit)
    with pytest.raises(InputError, match="localisation error"):
        result.explained_by(0.0)
