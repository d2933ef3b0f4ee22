"""What is said of soft tissue, of places, and of a margin that does not cover what the surface may be off."""

import pytest

from app.services.tissue_words import place_words, tissue_words
from vfix_engine.imaging.soft_tissue import TissuePassed
from vfix_engine.imaging.surface_uncertainty import SurfaceUncertainty


@pytest.mark.parametrize(
    ("passed", "words"),
    [
        (TissuePassed(6.95, 7.3, complete=True), "Passes 7 mm of soft tissue, when the tip is at 7 mm."),
        (TissuePassed(0.3, 41.0, complete=True), "Passes less than 1 mm of soft tissue, when the tip is at 41 mm."),
        (TissuePassed(0.0, 0.0, complete=True), "Passes no soft tissue."),
        (
            TissuePassed(6.95, 7.3, complete=False),
            "Passes 7 mm of soft tissue at least; the scan ends in tissue there, when the tip is at 7 mm.",
        ),
        (TissuePassed(0.0, 0.0, complete=False), "Soft tissue is not known: the scan ends in tissue beside the tool."),
        (TissuePassed(), "Soft tissue is not known: no CT shows the tool's way."),
    ],
)
def test_soft_tissue_is_told_calmly_and_what_is_not_known_too(passed: TissuePassed, words: str) -> None:
    assert tissue_words(passed) == words


def test_only_a_place_in_the_airway_needs_no_word() -> None:
    assert place_words("air_inside") == ""
    assert "soft tissue" in place_words("soft_tissue")
    assert "outside the body" in place_words("outside_body")
    assert "not known" in place_words("outside_scan")
    assert "not known" in place_words("not_known")


@pytest.mark.parametrize(
    ("thinning", "voxel", "margin", "warning"),
    [
        (0.0, 1.0, 0.05, ""),
        (0.25, 0.8, 0.3, ""),
        (
            0.74,
            0.8,
            0.3,
            "bone may lie 0.74 mm off its surface (0.74 mm: surface thinned), more than the margin of 0.30 mm",
        ),
        (0.0, 2.0, 1.0, ""),
        (
            0.4,
            2.0,
            1.0,
            "bone may lie 1.40 mm off its surface, thin bone further "
            "(1.00 mm: slices 2 mm apart; 0.40 mm: surface thinned), more than the margin of 1.00 mm",
        ),
    ],
)
def test_a_margin_that_does_not_cover_the_surfaces_error_is_told(
    thinning: float, voxel: float, margin: float, warning: str
) -> None:
    assert SurfaceUncertainty(thinning, voxel).warning(margin) == warning
