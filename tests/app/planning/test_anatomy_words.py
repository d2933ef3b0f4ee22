"""Descriptions of places, and of a margin smaller than the surface error."""

import pytest

from app.planning.tissue_words import PLACE_WORDS
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty


def test_only_a_place_in_the_airway_needs_no_word() -> None:
    assert PLACE_WORDS["air_inside"] == ""
    assert "soft tissue" in PLACE_WORDS["soft_tissue"]
    assert "Outside the body" in PLACE_WORDS["outside_body"]
    assert "Outside the scan" in PLACE_WORDS["outside_scan"]
    assert "not known" in PLACE_WORDS["not_known"]


@pytest.mark.parametrize(
    ("thinning", "voxel", "margin", "warning"),
    [
        (0.0, 1.0, 0.05, ""),
        (0.25, 0.8, 0.3, ""),
        (
            0.74,
            0.8,
            0.3,
            "",  # what thinning moved is added to the margin
        ),
        (0.0, 2.0, 1.0, ""),
        (
            0.4,
            2.0,
            0.9,
            "bone may lie 1.40 mm off its surface, thin bone further "
            "(1.00 mm: slices 2 mm apart; 0.40 mm: surface thinned or smoothed, added to the margin), "
            "more than the 1.30 mm that are kept",
        ),
    ],
)
def test_a_margin_that_does_not_cover_the_surfaces_error_is_told(
    thinning: float, voxel: float, margin: float, warning: str
) -> None:
    assert SurfaceUncertainty(thinning, voxel).warning(margin) == warning
