"""Tissue in motion: the pathway at a moment, breathing and peristalsis."""

from __future__ import annotations

import numpy as np
import pytest
from lumen_shapes import SHAPES, arc

from vfix_engine.errors import PathwayError
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.pathway.tissue_motion import breathing, peristalsis, together


def test_a_moved_pathway_is_the_pathway_of_the_moved_contours() -> None:
    motion = together(breathing([0, 0.2, 1], falloff_s=90.0), peristalsis(0.3))
    for rest in (SHAPES["interpolated"], SHAPES["cavity"], SHAPES["polar arc"]):
        moved = rest.moved(motion)
        shift, factor = motion(rest.at_s, 1.3)
        tangent = None if rest.tangent is None else moved.contours(1.3).tangent
        rebuilt = Pathway(
            rest.centre + shift, rest.radius * factor[:, None], rest.count, tangent, rest.first, knots=rest.knots
        )
        assert np.abs(moved.packed(1.3).rows - rebuilt.packed().rows).max() < 1e-9
        assert np.abs(moved.packed(1.3).polar - rebuilt.packed().polar).max() < 1e-12


def test_a_shift_of_everything_shifts_the_pathway() -> None:
    rest = SHAPES["cavity"]
    moved = rest.moved(breathing([0, 3, 4], 10.0, 4.0))
    found = moved.contours(2.0)
    assert np.abs(found.centre - rest.contours().centre - [0.0, 6.0, 8.0]).max() < 1e-12
    assert np.abs(found.first - rest.contours().first).max() < 1e-12
    assert np.abs(moved.curve(2.0).position(50.0) - rest.curve().position(50.0) - [0.0, 6.0, 8.0]).max() < 1e-9
    assert moved.packed(0.0) is moved.packed()
    assert np.array_equal(moved.packed(4.0).polar, rest.packed().polar)


def test_given_normals_turn_with_the_tissue() -> None:
    rest = arc()

    def turn(s: np.ndarray, t: float) -> tuple[np.ndarray, np.ndarray]:
        tilted = np.array([[np.cos(t), 0, np.sin(t)], [0, 1, 0], [-np.sin(t), 0, np.cos(t)]])
        return rest.centre @ tilted.T - rest.centre, np.ones(len(s))

    moved = rest.moved(turn).contours(0.4).tangent
    tilted = np.array([[np.cos(0.4), 0, np.sin(0.4)], [0, 1, 0], [-np.sin(0.4), 0, np.cos(0.4)]])
    assert np.abs(moved - rest.tangent @ tilted.T).max() < 1e-9


def test_breathing_leaves_the_entry_and_peristalsis_only_narrows() -> None:
    s = np.linspace(0.0, 500.0, 50)
    shift, factor = breathing([0, 0, 2], 8.0, 4.0, falloff_s=100.0)(s, 2.0)
    assert np.array_equal(shift[0], [0.0, 0.0, 0.0])
    assert shift[-1, 2] == pytest.approx(8.0 * (1.0 - np.exp(-5.0)))
    assert (np.diff(shift[:, 2]) > 0.0).all()
    assert (factor == 1.0).all()
    for t in np.linspace(0.0, 6.0, 13):
        still, narrowed = peristalsis(0.15, 120.0, 20.0)(s, t)
        assert not still.any()
        assert narrowed.max() <= 1.0
        assert narrowed.min() >= 0.85
    later = peristalsis()(s + 20.0 * 1.7, 1.7)[1]  # the wave travels at its speed
    assert np.allclose(later, peristalsis()(s, 0.0)[1], atol=1e-12)


@pytest.mark.parametrize(
    "make",
    [
        lambda: breathing([0, 0, 0]),
        lambda: breathing([0, np.nan, 1]),
        lambda: breathing([0, 0, 1], -1.0),
        lambda: breathing([0, 0, 1], 8.0, 0.0),
        lambda: breathing([0, 0, 1], falloff_s=-3.0),
        lambda: peristalsis(1.0),
        lambda: peristalsis(-0.1),
        lambda: peristalsis(wavelength_mm=0.0),
        lambda: peristalsis(speed_mm_per_s=np.nan),
    ],
)
def test_motions_refuse(make) -> None:
    with pytest.raises(PathwayError, match=r"must|needs"):
        make()


def test_a_motion_that_cannot_be_used_is_refused_when_it_is_asked_for() -> None:
    rest = SHAPES["arc"]
    with pytest.raises(PathwayError, match="shapes"):
        rest.moved(lambda s, t: (np.zeros(3), np.ones(len(s))))
    bad = rest.moved(lambda s, t: (np.zeros((len(s), 3)), np.full(len(s), 1.0 - t)))
    with pytest.raises(PathwayError, match=r"t = 2 s .* contour 1: .* factor -1"):
        bad.packed(2.0)
    wide = rest.moved(lambda s, t: (np.zeros((len(s), 3)), np.full(len(s), 1.0 + t)))
    wide.packed(1.0)
    with pytest.raises(PathwayError, match="cross"):
        wide.packed(9.0)
