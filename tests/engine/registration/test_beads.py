"""Beads in synthetic scans: found, centres against the truth, what is refused, and what a scan cannot show."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vfix_engine.anatomy.phantom import load_head_ct, load_landmarks
from vfix_engine.anatomy.synthetic_beads import place_beads, skin_sites
from vfix_engine.errors import ImageError, InputError
from vfix_engine.files.volume import Volume
from vfix_engine.registration import find_beads

RADIUS = 22.0  # mm, of a head that is a ball: skin, and a skull 6 mm below it


def head(spacing: tuple[float, float, float], seed: int, direction: np.ndarray | None = None) -> Volume:
    """A ball of soft tissue in air, with a shell of bone in it."""
    random, side = np.random.default_rng(seed), np.array(spacing)
    axes = np.eye(3) if direction is None else direction
    counts = np.ceil(2.0 * (RADIUS + 8.0) / side).astype(int)
    origin = axes @ (-0.5 * counts * side + random.uniform(0.0, 1.0, 3) * side)
    empty = Volume(np.full(counts[::-1], -1000, dtype=np.int16), origin, side, axes)
    k, j, i = np.indices(empty.hu.shape)
    distance = np.linalg.norm(empty.index_to_lps(np.stack([i, j, k], axis=-1).reshape(-1, 3)), axis=1)
    distance = distance.reshape(empty.hu.shape)
    hu = -1000.0 + 1040.0 * np.clip(0.5 + (RADIUS - distance) / side.max(), 0.0, 1.0)
    hu[(distance < RADIUS - 6.0) & (distance > RADIUS - 10.0)] = 1200.0
    return Volume(np.rint(hu).astype(np.int16), origin, side, axes)


def noisy(volume: Volume, seed: int, sigma_hu: float = 30.0) -> Volume:
    values = volume.hu + np.random.default_rng(seed).normal(0.0, sigma_hu, volume.hu.shape)
    return Volume(np.rint(values).astype(np.int16), volume.origin, volume.spacing, volume.direction)


def on_the_skin(diameter: float, seed: int, count: int = 5) -> np.ndarray:
    """Centres of beads glued on, at least 40 degrees apart."""
    chosen: list[np.ndarray] = []
    for drawn in np.random.default_rng(seed).normal(size=(500, 3)):
        direction = drawn / np.linalg.norm(drawn)
        if all(direction @ other < np.cos(np.radians(40.0)) for other in chosen) and len(chosen) < count:
            chosen.append(direction)
    return np.array(chosen) * (RADIUS + 0.5 * diameter)


def errors(volume: Volume, diameter: float, truth: np.ndarray) -> list[float]:
    found = find_beads(volume, diameter_mm=diameter).positions_mm
    return [float(np.linalg.norm(found - centre, axis=1).min()) for centre in truth if len(found)]


@pytest.mark.parametrize(
    ("spacing", "diameter", "mean", "p95"),
    [  # measured over 50 beads: 0.019 and 0.029, 0.020 and 0.042, 0.029 and 0.047, 0.037 and 0.063, 0.23 and 0.37
        ((0.4, 0.4, 0.6), 3.0, 0.03, 0.045),
        ((0.4, 0.4, 0.6), 2.0, 0.03, 0.06),
        ((0.5, 0.5, 1.0), 3.0, 0.05, 0.07),
        ((0.5, 0.5, 1.0), 2.0, 0.06, 0.11),
        ((1.0, 1.0, 2.0), 3.0, 0.38, 0.73),
    ],
)
def test_centres_are_within_the_measured_error(
    spacing: tuple[float, float, float], diameter: float, mean: float, p95: float
) -> None:
    """Five beads in each of four heads, 30 HU of noise: all found, nothing else, diameter within 5 % (20 % at 2 mm)."""
    off: list[float] = []
    for seed in range(4):
        truth = on_the_skin(diameter, seed)
        volume = noisy(place_beads(head(spacing, seed), truth, diameter), seed)
        search = find_beads(volume)
        assert len(search.beads) == len(truth)
        assert [bead.diameter_mm for bead in search.beads] == pytest.approx(
            [diameter] * 5, rel=0.2 if spacing[2] > 1.0 else 0.05
        )
        assert (np.diff(search.positions_mm[:, 2]) <= 0.0).all()
        off += errors(volume, diameter, truth)
    assert len(off) == 20
    assert np.mean(off) < mean
    assert np.quantile(off, 0.95) < p95


@pytest.mark.parametrize("diameter", [2.0, 3.0, 4.0])
@pytest.mark.parametrize("hu", [2400.0, 2800.0, 3071.0])
def test_bright_beads_are_found_as_dim_ones_are(hu: float, diameter: float) -> None:
    """Metal is clipped at 3,071 HU by most scanners; a third of that is above the threshold, so it has a rim below."""
    truth = on_the_skin(diameter, 3)
    search = find_beads(noisy(place_beads(head((0.5, 0.5, 1.0), 3), truth, diameter, hu), 3))
    assert len(search.beads) == len(truth)
    off = np.linalg.norm(search.positions_mm[:, None] - truth[None], axis=2).min(axis=1)
    assert off.max() < 0.15


def test_a_bead_of_few_voxels_is_doubted() -> None:
    truth = on_the_skin(2.0, 1)
    coarse = find_beads(noisy(place_beads(head((1.0, 1.0, 2.0), 1), truth, 2.0), 1))
    assert any(bead.voxels <= 4 for bead in coarse.beads)
    assert any("may be bits of bone: look at each" in caution for caution in coarse.cautions)


def test_an_oblique_and_a_left_handed_grid_are_placed() -> None:
    axes = Rotation.from_euler("xyz", [20, -35, 50], degrees=True).as_matrix() @ np.diag([1.0, 1.0, -1.0])
    truth = on_the_skin(3.0, 7)
    volume = noisy(place_beads(head((0.5, 0.6, 0.8), 7, axes), truth, 3.0), 7)
    search = find_beads(volume, diameter_mm=3.0)
    assert len(search.beads) == 5
    assert max(errors(volume, 3.0, truth)) < 0.1


def test_slices_that_are_too_coarse_are_said() -> None:
    """Beads of 2 mm between slices of 2 mm: some are lost, and the caution tells the size that is not."""
    lost = 0
    for seed in range(4):
        truth = on_the_skin(2.0, seed)
        volume = noisy(place_beads(head((1.0, 1.0, 2.0), seed), truth, 2.0), seed)
        search = find_beads(volume, diameter_mm=2.0)
        lost += 5 - len(search.beads)
        assert "only those of 3 mm or more can be relied on" in search.cautions[0]
        assert "beads below 3 mm may not be seen" in find_beads(volume).cautions[0]
    assert lost > 0
    assert "off by a fifth of a slice" in find_beads(volume, diameter_mm=3.0).cautions[0]
    fine = place_beads(head((0.5, 0.5, 1.0), 1), on_the_skin(2.0, 1), 2.0)
    assert find_beads(fine, diameter_mm=2.0).cautions == find_beads(fine).cautions == ()


def test_a_bead_of_another_size_a_rod_and_a_bead_on_bone_are_left_out() -> None:
    plain = head((0.5, 0.5, 0.5), 2)
    directions = on_the_skin(0.0, 3) / RADIUS
    volume = place_beads(plain, (directions[:1] * (RADIUS + 1.5)), 3.0)
    volume = place_beads(volume, directions[1:2] * (RADIUS + 3.0), 6.0)  # too big
    across = np.cross(directions[2], [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    rod = directions[2] * (RADIUS + 1.0) + np.arange(-2.0, 2.1, 0.5)[:, None] * across
    volume = place_beads(volume, rod, 1.6)
    volume = place_beads(volume, directions[3:4] * (RADIUS - 5.0), 3.0)  # stands in the skull and out of it
    volume = place_beads(volume, directions[4:5] * (RADIUS + 1.0), 2.0)  # too small
    search = find_beads(noisy(volume, 3), diameter_mm=3.0, threshold_hu=1500.0)
    assert len(search.beads) == 1
    assert {"it is as large as a ball of 5.9 mm", "it is as large as a ball of 2.0 mm"} <= {
        place.reason for place in search.left_out
    }
    assert np.linalg.norm(search.beads[0].position_mm - directions[0] * (RADIUS + 1.5)) < 0.05
    reasons = " ".join(place.reason for place in search.left_out)
    assert "attached" in reasons
    assert "elongated" in reasons
    assert any("needs three" in caution for caution in search.cautions)


def test_a_bead_cut_by_the_border_is_left_out() -> None:
    volume = head((0.5, 0.5, 0.5), 2)
    hu = volume.hu.copy()
    hu[30:36, 30:36, :4] = 2200
    search = find_beads(Volume(hu, volume.origin, volume.spacing, volume.direction))
    assert search.beads == ()
    assert "border" in search.cautions[0]


def test_nothing_dense_is_no_bead() -> None:
    empty = Volume(np.full((9, 9, 9), -1000, dtype=np.int16), np.zeros(3), np.ones(3), np.eye(3))
    assert find_beads(empty).beads == ()
    assert find_beads(empty).positions_mm.shape == (0, 3)


def test_the_shipped_head_has_its_five_beads() -> None:
    """And five more of 3 mm on its skin, at places that lie on skin and away from the others."""
    head_ct, known = load_head_ct(), np.array([bead.centroid for bead in load_landmarks().beads])
    search = find_beads(head_ct)
    assert len(search.beads) == 5
    for centre in known:
        assert np.linalg.norm(search.positions_mm - centre, axis=1).min() < 0.06
    assert [bead.diameter_mm for bead in search.beads] == pytest.approx([4.0] * 5, rel=0.05)
    sites = skin_sites(head_ct)
    assert [site.name for site in sites] == [
        "forehead", "left temple", "right temple", "left cheek bone", "right cheek bone",
    ]  # fmt: skip
    for site in sites:
        inside, outside = (
            head_ct.sample(site.position_mm - np.outer([2.0, 1.5], site.outward)),
            head_ct.sample(site.position_mm + np.outer([1.5, 3.0, 6.0], site.outward)),
        )
        assert (inside > -150.0).all()
        assert (outside < -800.0).all()
        assert np.linalg.norm(known - site.position_mm, axis=1).min() > 10.0
        assert ("left" in site.name) == (site.position_mm[0] > 30.0)
    truth = np.array([site.bead_centre(3.0) for site in sites])
    found = find_beads(place_beads(head_ct, truth, 3.0), diameter_mm=3.0)
    assert max(np.linalg.norm(found.positions_mm - centre, axis=1).min() for centre in truth) < 0.12


def test_placed_beads_have_their_volume() -> None:
    """The mean fill of the voxels is the ball's volume within 1 %, in any grid and off its centres."""
    empty = Volume(np.full((12, 20, 20), 0, dtype=np.int16), np.zeros(3), np.array([0.7, 0.5, 1.3]), np.eye(3))
    for centre in ([5.0, 4.0, 7.0], [5.31, 4.17, 7.52]):
        hu = place_beads(empty, [centre], 3.0, hu=10000.0).hu
        assert hu.sum() / 10000.0 * 0.7 * 0.5 * 1.3 == pytest.approx(np.pi / 6.0 * 27.0, rel=0.01)
        share = hu[hu > 0] / hu.sum()
        at = empty.index_to_lps(np.stack(np.nonzero(hu)[::-1], axis=1))
        assert share @ at == pytest.approx(centre, abs=0.02)  # of voxels filled in part


def test_wrong_numbers_are_refused() -> None:
    volume = head((1.0, 1.0, 1.0), 1)
    for wrong in ({"diameter_mm": 0.0}, {"diameter_mm": 100.0}, {"threshold_hu": 0.0}, {"threshold_hu": np.nan}):
        with pytest.raises(InputError):
            find_beads(volume, **wrong)
    with pytest.raises(ImageError, match="bead 2"):
        place_beads(volume, [[0, 0, 0], [500, 0, 0]], 3.0)
    with pytest.raises(InputError):
        place_beads(volume, [0, 0, 0], 3.0)
    with pytest.raises(InputError):
        place_beads(volume, [[0, 0, 0]], -1.0)
    no_bone = Volume(np.full((9, 9, 9), -1000, dtype=np.int16), np.zeros(3), np.ones(3), np.eye(3))
    with pytest.raises(ImageError, match="no bone"):
        skin_sites(no_bone)
