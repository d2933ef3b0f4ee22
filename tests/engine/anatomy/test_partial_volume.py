"""Thin bone between two air spaces is lost to a threshold of bone, and the border of air stands in for it.

The sheets are 0.3 mm thick, as the lamina papyracea and the turbinates are in patients; the phantom's own are 1 mm.
"""

from __future__ import annotations

import numpy as np
import pytest

from head_phantom.generate import generate, generate_fields
from head_phantom.scanned import FINE_MM, scanned
from vfix_engine.anatomy.soft_tissue import TISSUE_HU
from vfix_engine.anatomy.surface import extract_surface
from vfix_engine.files.volume import BONE_HU, Volume
from vfix_engine.proximity.proximity import ProximityTree

TURBINATE = ((-2.0, 26.0, 12.0), (17.0, 40.0, 32.0))  # middle turbinate and septum, and the air on both sides
THINNER_MM = 0.7


@pytest.fixture(scope="module")
def places() -> np.ndarray:
    """Places (n, 3) in the middle of the sheets."""
    distance, origin = generate_fields(FINE_MM, lambda tissues, _: tissues.thin_bone, TURBINATE)
    middle = np.argwhere(distance < -0.4)
    edge = 16  # [voxel] away from the border of the box
    middle = middle[((middle >= edge) & (middle < np.array(distance.shape) - edge)).all(axis=1)]
    return middle[:, ::-1] * FINE_MM + origin


def seen(volume: Volume, places: np.ndarray) -> float:
    """Share of the places that a threshold of bone shows."""
    return float((volume.sample(places) >= BONE_HU).mean())


@pytest.mark.parametrize("slice_mm", [1.0, 2.0])
def test_thin_bone_vanishes_at_usual_slices_and_the_border_of_air_stands_in(
    places: np.ndarray, slice_mm: float
) -> None:
    assert len(places) > 300
    ct = scanned(TURBINATE, (0.5, 0.5, slice_mm), 1.0, THINNER_MM)
    assert seen(ct, places) < 0.05
    assert seen(generate(1.0, TURBINATE), places) > 0.95, "the shipped CT keeps the density of thin sheets"
    border = ProximityTree(extract_surface(ct, TISSUE_HU))
    assert border.point_distance(places)[0].max() < 2.0
    reach = np.arange(0.0, 4.1, 0.25)
    between = np.zeros(len(places), dtype=bool)
    for axis in np.eye(3):
        sides = [
            (np.stack([ct.sample(places + side * step * axis) for step in reach]) <= TISSUE_HU).any(axis=0)
            for side in (-1.0, 1.0)
        ]
        between |= sides[0] & sides[1]
    assert between.mean() > 0.6, "air lies on both sides of most of it; the rest ends in a wall"


def test_partial_volume_takes_density_as_the_sheet_and_the_slice_say(places: np.ndarray) -> None:
    density = [
        float(scanned(TURBINATE, (0.5, 0.5, slice_mm), spread, thinner).sample(places).mean())
        for slice_mm, spread, thinner in ((0.5, 0.7, 0.0), (0.5, 0.7, THINNER_MM), (1.0, 1.0, THINNER_MM))
    ]
    assert density == sorted(density, reverse=True)
    assert density[0] > 600 > BONE_HU > density[2]


def test_a_voxel_size_off_the_fine_grid_is_refused() -> None:
    with pytest.raises(ValueError, match="multiples"):
        scanned(TURBINATE, (0.4, 0.5, 0.5), 1.0)
