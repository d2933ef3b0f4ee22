"""Contours fitted to lumens of known shape, and to a made-up and a real colon."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from vfix_engine.anatomy.lumen.centreline import Centreline
from vfix_engine.anatomy.lumen.synthetic import SyntheticCourse
from vfix_engine.errors import PathwayError
from vfix_engine.geometry.curve import Curve
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.transport import transported
from vfix_engine.pathway.fit import containment, fit_pathway
from vfix_engine.pathway.interpolation import Interpolation
from vfix_engine.pathway.uncross import uncrossed

Array = np.ndarray
Width = Callable[[Array, Array], Array]


def tube(curve: Curve, width: Width, beyond: float = 30.0, rays: int = 48) -> TriangleMesh:
    """Open tube of the radius width(s, ψ) about a curve and straight on beyond its ends; normals point out of it."""
    s = np.linspace(-beyond, curve.length + beyond, int(curve.length / 3.0) + 20)
    centre, tangent = curve.position(s), curve.tangent(s)
    first = transported(centre, tangent)
    psi = 2.0 * np.pi * np.arange(rays) / rays
    ray = np.cos(psi)[:, None] * first[:, None] + np.sin(psi)[:, None] * np.cross(tangent, first)[:, None]
    points = centre[:, None] + width(s[:, None], psi[None, :])[..., None] * ray
    here = np.arange((len(s) - 1) * rays).reshape(-1, rays)
    beside = np.roll(here, -1, axis=1)
    one, two = np.stack([here, beside, here + rays], axis=-1), np.stack([beside, beside + rays, here + rays], axis=-1)
    return TriangleMesh(points.reshape(-1, 3), np.concatenate([one, two]).reshape(-1, 3))


def bend(radius: float = 60.0, turn: float = 2.5) -> Curve:
    angle = np.linspace(0.0, turn, 80)
    return Curve.through(radius * np.column_stack([np.sin(angle), 1.0 - np.cos(angle), 0.2 * angle]))


LINE = Curve.through([[5.0, -3.0, 0.0], [5.0, -3.0, 300.0]])
BEND = bend()


def even(s: Array, psi: Array) -> Array:
    return np.full(np.broadcast_shapes(s.shape, psi.shape), 15.0)


def folded(s: Array, psi: Array) -> Array:
    """Folds every 40 mm that narrow the lumen from 18 to 12 mm over 6 mm."""
    return even(s, psi) + 3.0 - 6.0 * np.exp(-(((((s - 150.0 + 20.0) % 40.0) - 20.0) / 3.0) ** 2))


@pytest.mark.parametrize("curve", [LINE, BEND], ids=["straight", "bent"])
@pytest.mark.parametrize("angles", [1, 28])
def test_a_tube_has_its_radius(curve: Curve, angles: int) -> None:
    pathway = fit_pathway(tube(curve, even), curve, angles=angles)
    assert pathway.centre.shape == (50, 3)
    assert pathway.radius.shape == (50, angles)
    found = pathway.contours()
    assert found.radius.shape == (197, angles)
    assert np.abs(found.radius / 15.0 - 1.0).max() < 0.02
    away = [np.linalg.norm(curve.position(curve.closest(point)) - point) for point in found.centre]
    assert max(away) < 0.02
    assert np.array_equal(pathway.centre[[0, -1]], curve.points[[0, -1]])


def test_a_widening_tube_is_followed() -> None:
    pathway = fit_pathway(tube(LINE, lambda s, psi: even(s, psi) * (1.0 + np.clip(s, 0, 300) / 300.0)), LINE)
    found = pathway.contours()
    assert np.abs(found.radius[:, 0] / (15.0 + found.s / 20.0) - 1.0).max() < 0.02


def test_a_lobed_tube_is_followed_in_the_direction_of_its_lobes() -> None:
    mesh = tube(BEND, lambda s, psi: 15.0 * (1.0 + 0.25 * np.cos(2.0 * psi)) + 0.0 * s)
    pathway = fit_pathway(mesh, BEND, angles=36)
    found = pathway.contours()
    frames = transported(BEND.points, BEND.tangents)  # the polar angle 0 of the mesh
    at = np.array([BEND.closest(point) for point in found.centre])
    zero = np.array([frames[round(s / BEND.step_mm)] for s in at])
    second = np.cross(found.tangent, found.first)
    offset = np.arctan2(np.einsum("ij,ij->i", zero, second), np.einsum("ij,ij->i", zero, found.first))
    assert np.ptp(offset) < 1e-3  # both are carried along without a turn
    psi = 2.0 * np.pi * np.arange(36)[None, :] / 36 - offset[:, None]
    assert np.abs(found.radius / (15.0 * (1.0 + 0.25 * np.cos(2.0 * psi))) - 1.0).max() < 0.03


@pytest.mark.parametrize(("contours", "interpolated"), [(2, 2), (3, 9), (12, 45), (80, 80), (50, 120)])
def test_other_numbers_of_contours(contours: int, interpolated: int) -> None:
    pathway = fit_pathway(tube(LINE, even), LINE, contours, interpolated)
    assert len(pathway.centre) == contours
    assert len(pathway.contours().s) == interpolated
    assert np.abs(pathway.radius / 15.0 - 1.0).max() < 0.02


def test_the_inscribed_pathway_stays_inside_the_folds() -> None:
    mesh = tube(BEND, folded)
    inside, over = fit_pathway(mesh, BEND, 6, 21, quantile=0.0), fit_pathway(mesh, BEND, 6, 21)
    assert inside.radius.mean() < over.radius.mean() - 1.5
    assert containment(mesh, inside).behind < 0.01
    told = containment(mesh, over)
    assert 0.1 < told.outside < 0.3
    assert told.behind >= told.outside
    assert 0.0 < told.depth_mm[0] <= told.depth_mm[1] <= told.depth_mm[2] < 6.0


def test_a_margin_is_kept() -> None:
    mesh = tube(LINE, even)
    assert np.allclose(fit_pathway(mesh, LINE).radius - fit_pathway(mesh, LINE, keep_mm=4.0).radius, 4.0)


def test_contours_lie_closer_together_in_a_bend_and_where_the_width_changes() -> None:
    corner = Curve.through(
        np.concatenate([np.linspace([0, 0, 0], [0, 0, 160], 30), np.linspace([20, 0, 180], [180, 0, 180], 30)])
    )
    at = fit_pathway(tube(corner, lambda s, psi: even(s, psi) - 7.0), corner).at_s
    gap, middle = np.diff(at), 0.5 * (at[1:] + at[:-1])
    at_corner = np.abs(middle - 0.5 * corner.length) < 12.0
    assert gap[at_corner].max() < 0.75 * gap[~at_corner].max()
    mesh = tube(LINE, lambda s, psi: even(s, psi) + 5.0 * np.tanh((s - 150.0) / 10.0))
    at = fit_pathway(mesh, LINE).at_s
    gap, middle = np.diff(at), 0.5 * (at[1:] + at[:-1])
    assert gap[np.abs(middle - 150.0) < 10.0].max() < 0.6 * gap.max()


def test_contours_that_would_cross_in_a_tight_bend_are_made_smaller() -> None:
    wide, tight = bend(30.0), bend(12.0)
    mesh = tube(wide, lambda s, psi: even(s, psi) + 12.0)
    # A curve along the inner side of the bend: contours as wide as the lumen would cross behind its centre.
    start = wide.position(wide.closest([0.0, 0.0, 0.0]))
    tight = Curve.through(tight.points + np.array([0.0, 18.0, 0.0]) + start)
    for angles in (1, 28):
        pathway = fit_pathway(mesh, tight, angles=angles)
        assert pathway.radius.min() < 13.0
        # Polar contours give way on the inner side only.
        assert angles == 1 or pathway.radius.max() > 15.0


@pytest.mark.parametrize("angles", [1, 5, 28])
def test_radii_that_cross_are_lowered_no_further_than_they_must_be(angles: int) -> None:
    at = np.linspace(0.0, BEND.length, 20)
    control, radius = BEND.position(at), np.full((20, angles), 90.0)  # the bend's radius is 62.4 mm
    between, first = Interpolation(at, 77), np.array([0.0, 1.0, 0.0])
    pathway = uncrossed(between, control, radius, first, 1.0)
    inner = pathway.radius.min(axis=1)
    assert inner.min() > 40.0
    assert inner.max() < 62.4
    assert pathway.radius.max() == pytest.approx(90.0) or angles == 1
    assert np.array_equal(uncrossed(between, control, 0.5 * radius, first, 1.0).radius, 0.5 * radius)


def test_a_bend_that_no_radius_fits_into_is_refused() -> None:
    corner = np.array([[0, 0, 0], [0, 0, 50], [0, 0.5, 100], [0, 1.0, 50], [0, 1.5, 0]], dtype=float)
    with pytest.raises(PathwayError, match=r"bends so tightly at \d+\.\d mm"):
        uncrossed(Interpolation(np.arange(5.0), 33), corner, np.full((5, 1), 9.0), np.array([1.0, 0.0, 0.0]), 1.0)


def test_the_spline_is_held_off_the_wall() -> None:
    mesh = tube(LINE, even)
    s = np.linspace(0.0, 300.0, 60)
    beside = Curve.through(LINE.position(s) + np.outer(15.2 * np.exp(-(((s - 150.0) / 25.0) ** 2)), [1.0, 0.0, 0.0]))
    pathway = fit_pathway(mesh, beside)
    away = np.linalg.norm(pathway.contours().centre[:, :2] - [5.0, -3.0], axis=1)
    assert 12.0 < away.max() < 14.0
    assert pathway.radius.min() > 1.0


def test_the_winding_of_the_triangles_does_not_matter() -> None:
    mesh = tube(BEND, folded)
    turned = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    assert np.allclose(fit_pathway(mesh, BEND).radius, fit_pathway(turned, BEND).radius, atol=1e-9)
    told, again = (containment(one, fit_pathway(one, BEND)) for one in (mesh, turned))
    assert told.outside == pytest.approx(again.outside)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"contours": 1}, "whole number from 2 to 1,000, not 1"),
        ({"angles": 2}, "at least 3 around its centre; not 2"),
        ({"quantile": 1.5}, "quantile"),
        ({"quantile": float("nan")}, "quantile"),
        ({"keep_mm": -1.0}, "keep_mm"),
        ({"least_mm": 0.0}, "least_mm"),
        ({"interpolated": 1}, "whole number from 2 to 5,000, not 1"),
    ],
)
def test_numbers_that_cannot_be_used_are_refused(given: dict, says: str) -> None:
    with pytest.raises(PathwayError, match=says):
        fit_pathway(tube(LINE, even), LINE, **given)


def test_a_curve_that_leaves_the_lumen_is_refused() -> None:
    mesh = tube(LINE, even)
    with pytest.raises(PathwayError, match=r"leaves the lumen: at \d+ mm, \(.*\) in LPS mm, it is \d+\.\d mm behind"):
        fit_pathway(mesh, Curve.through([[5, -3, 0], [5, -3, 100], [45, -3, 150], [5, -3, 200], [5, -3, 300]]))
    with pytest.raises(PathwayError, match="no wall"):
        fit_pathway(mesh, Curve.through([[900, 0, 0], [900, 0, 900]]))


def test_a_made_up_colon_holds_its_pathway(made_up_colon: TriangleMesh, made_up_course: SyntheticCourse) -> None:
    curve = made_up_course.curve
    inside = fit_pathway(made_up_colon, curve, quantile=0.0)
    assert containment(made_up_colon, inside).outside < 0.005
    told = containment(made_up_colon, fit_pathway(made_up_colon, curve))
    assert told.outside < 0.3
    assert told.depth_mm[2] < 5.0


def test_the_real_colon(colon: TriangleMesh, colon_centreline: Centreline) -> None:
    """Its centreline bends too much for 50 contours to follow it nearer, but none of them leaves the lumen."""
    pathway = fit_pathway(colon, colon_centreline.curve, quantile=0.0)
    found = pathway.contours()
    assert len(found.s) == 197
    told = containment(colon, pathway)
    assert told.outside < 0.01
    assert np.median(found.radius) > 8.0
