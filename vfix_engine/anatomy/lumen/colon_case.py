"""Synthetic colon cases: a whole colon as a closed surface, with landmarks and the two clicks that a drive needs.

A tube of rings about a course from the anus to the caecum (LPS, +x is the patient's left, +z the head):

- three taeniae, bands along which the wall is drawn in; they drift slowly round and end in the rectum;
- semilunar folds between two taeniae each, staggered from sector to sector, with haustra between them;
- three rectal valves, and a slow irregularity everywhere;
- in the hard case tighter flexures, and stretches that have collapsed to a slit.

``synthetic.py`` makes shorter ones of balls, whose walls can fuse. It is not based on measurements of patients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, IntArray
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...geometry.transport import transported
from ...validate import whole
from .synthetic import SyntheticCourse

_RINGS, _SECTORS = 436, 50  # 2 · 436 · 50 = 43,600 triangles, both caps included
_CLICK_MM = 8.0  # from an end of the course to the click there
_LEAST_SHARE = 0.35  # of the mean radius: no fold closes the lumen
_INNER_SHARE = 0.85  # of the bend's radius: on its inner side rings would cross beyond that
_CAECUM_MM = 22.0  # length of the round end
_VALVES_MM = (38.0, 58.0, 78.0)  # rectal valves, from the anus
_VALVE, _VALVE_MM = 0.30, 3.0  # share of the radius, and half the width
_WAVES = ((140.0, 0.030), (61.0, 0.021), (37.0, 0.012))  # of the irregularity: length in mm, share of the radius

# Corners of the course: anus, rectum, sigmoid loop, descending, splenic flexure, transverse, hepatic flexure, caecum.
_COURSE = (
    (0, 55, -20), (0, 66, 18), (4, 62, 52), (-12, 28, 74), (12, -6, 92), (52, -2, 84), (82, 22, 98), (96, 34, 140),
    (98, 38, 190), (100, 40, 238), (94, 30, 284), (66, 4, 306), (26, -22, 286), (-20, -34, 272), (-62, -26, 282),
    (-92, -2, 296), (-106, 22, 268), (-106, 32, 222), (-102, 32, 178), (-98, 28, 138), (-94, 24, 112),
)  # fmt: skip
_TIGHTER = {
    3: (-16, 30, 72), 4: (6, -6, 86), 5: (44, -4, 92), 6: (84, 24, 92), 7: (97, 35, 126), 9: (101, 41, 262),
    10: (96, 32, 284), 11: (76, 12, 288), 15: (-97, 2, 297),
}  # fmt: skip  # corners of the hard case: bends of 16 to 20 mm
_LANDMARKS = {
    "rectosigmoid": 2.5, "descending_sigmoid": 6.5, "splenic_flexure": 10.4, "hepatic_flexure": 15.4,
    "ascending": 17.0,
}  # fmt: skip  # places on the course, in corners
# Corner: mean radius in mm, depth of folds and of taeniae as shares of it, distance of folds in mm.
_BODY = np.array(
    [
        (0, 9, 0, 0, 30), (1, 20, 0, 0, 30), (2, 20, 0.05, 0.02, 30), (3, 16, 0.14, 0.04, 24),
        (6, 16.5, 0.16, 0.05, 24), (8, 18, 0.20, 0.06, 27), (10.4, 20, 0.22, 0.07, 28), (13, 21, 0.26, 0.09, 29),
        (15.4, 23, 0.25, 0.08, 30), (18, 25, 0.22, 0.07, 32), (20, 25, 0.16, 0.06, 32),
    ]
)  # fmt: skip
# Collapsed stretches of the hard case: middle in corners, half length in mm, half height and half width of the slit.
_COLLAPSED = ((6.9, 18.0, 6.6, 13.0), (9.0, 14.0, 5.2, 12.0), (13.3, 16.0, 4.8, 14.0))


@dataclass(frozen=True, eq=False)
class ColonCase:
    """A synthetic colon for a drive.

    mesh: closed, with outward normals, LPS mm. course: what it was made along, with the least radius of each of its
    points; its landmarks are 'anus', 'rectosigmoid', 'descending_sigmoid', 'splenic_flexure', 'hepatic_flexure',
    'ascending' (where the ascending colon begins) and 'caecum', from the anus on. start, end: (3,) clicks in the lumen.
    """

    mesh: TriangleMesh
    course: SyntheticCourse
    start: Array
    end: Array


def colon_case(seed: int = 7, *, hard: bool = False) -> ColonCase:
    """Generate a colon of 43,600 triangles, about 0.9 m long; the same seed gives the same surface.

    Args:
        seed: of folds, taeniae and irregularity; the course is the same for all.
        hard: with tighter flexures, and three stretches collapsed to slits 13, 10 and 10 mm high, through which
            the usual robot of 12 mm does not pass everywhere; one of 14-mm links and 8 mm does.

    Raises:
        InputError: a seed that is not a whole number from 0.
    """
    rng = np.random.default_rng(whole("the seed", seed, 0))
    corners = np.array(_COURSE, dtype=np.float64)
    if hard:
        corners[list(_TIGHTER)] = list(_TIGHTER.values())
    fine = Curve.through(corners)
    s = np.linspace(0.0, fine.length, _RINGS)
    curve = Curve(fine.position(s), float(s[1]))
    corner_s = np.array([curve.closest(corner) for corner in corners])
    radius, theta = _radii(rng, curve, corner_s, s), 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    if hard:
        radius = _collapsed(radius, theta, s, corner_s)
    across = transported(curve.points, curve.tangents)
    out = np.cos(theta)[:, None] * across[:, None] + np.sin(theta)[:, None] * np.cross(curve.tangents, across)[:, None]
    inwards = np.einsum("rk,rsk->rs", np.gradient(curve.tangents, curve.step_mm, axis=0), out)
    radius = np.minimum(radius, _INNER_SHARE / np.maximum(inwards, 1e-6))
    rings = curve.points[:, None] + radius[..., None] * out
    mesh = TriangleMesh(np.concatenate([rings.reshape(-1, 3), curve.points[[0, -1]]]), _faces())
    least = radius.min(axis=1)
    least.setflags(write=False)
    ends = curve.position(_CLICK_MM), curve.position(curve.length - _CLICK_MM)
    places = np.interp(list(_LANDMARKS.values()), np.arange(len(corners)), corner_s)
    between = dict(zip(_LANDMARKS, curve.position(places), strict=True))
    landmarks = {"anus": ends[0], **between, "caecum": ends[1]}
    return ColonCase(mesh, SyntheticCourse(curve, least, landmarks), *ends)


def _radii(rng: np.random.Generator, curve: Curve, corner_s: Array, s: Array) -> Array:
    """(rings, sectors) mm from the course to the wall."""
    from scipy.interpolate import PchipInterpolator  # imported here: slow to load

    corner = np.interp(s, corner_s, np.arange(len(corner_s)))
    mean, fold, band, apart = PchipInterpolator(_BODY[:, 0], _BODY[:, 1:])(corner).T
    into_end = np.maximum((s - s[-1] + _CAECUM_MM) / (_CAECUM_MM + 1.0), 0.0)
    mean = mean * np.sqrt(np.maximum(1.0 - into_end**2, 0.02))
    theta = 2.0 * np.pi * np.arange(_SECTORS) / _SECTORS
    drift = 0.5 * np.sin(2.0 * np.pi * s / 410.0 + rng.uniform(0.0, 2.0 * math.pi)) + 0.3 * np.sin(
        2.0 * np.pi * s / 170.0
    )
    angle = theta - drift[:, None]
    taenia = 0.5 + 0.5 * np.cos(3.0 * angle)
    count = np.concatenate([[0.0], np.cumsum(np.diff(s) * 2.0 / (apart[1:] + apart[:-1]))])  # folds up to a ring
    share = 1.0 - band[:, None] * taenia**2 - fold[:, None] * _folds(rng, s, angle, count)
    haustra = 0.5 - 0.5 * np.cos(2.0 * np.pi * count)
    share += 0.25 * (fold * haustra)[:, None] * (1.0 - taenia)
    for k, place in enumerate(_VALVES_MM):
        side = 0.5 + 0.5 * np.cos(theta - (0.6 + math.pi * k))
        share -= _VALVE * side**2 * np.exp(-(((s - place) / _VALVE_MM) ** 2))[:, None]
    for length, size in _WAVES:
        for m in range(3):
            phase = 2.0 * np.pi * s[:, None] / length + rng.uniform(0.0, 2.0 * math.pi)
            share += size * np.cos(m * theta + phase)
    radius: Array = mean[:, None] * np.maximum(share, _LEAST_SHARE)
    return radius


def _folds(rng: np.random.Generator, s: Array, angle: Array, count: Array) -> Array:
    """(rings, sectors) height of the semilunar folds, about 1 on a ridge: each ends at the taeniae beside it."""
    height = np.zeros_like(angle)
    for sector in range(3):
        off = (angle - (2 * sector + 1) * math.pi / 3.0 + math.pi) % (2.0 * math.pi) - math.pi
        across = np.cos(np.clip(1.125 * off, -0.5 * math.pi, 0.5 * math.pi)) ** 2
        for k in range(int(count[-1]) + 1):
            place = np.interp(k + sector / 3.0 + rng.uniform(-0.12, 0.12), count, s)
            tilt, size, width = rng.uniform(-3.0, 3.0), rng.uniform(0.75, 1.2), rng.uniform(2.2, 3.0)
            near = slice(*np.searchsorted(s, [place - 15.0, place + 15.0]))
            ridge = np.exp(-(((s[near, None] - place - tilt * np.sin(off[near])) / width) ** 2))
            height[near] += size * across[near] * ridge
    return height


def _collapsed(radius: Array, theta: Array, s: Array, corner_s: Array) -> Array:
    """The radii, nowhere larger than those of the slits that stretches of the lumen have collapsed to."""
    for middle, half, height, width in _COLLAPSED:
        place = np.interp(middle, np.arange(len(corner_s)), corner_s)
        slit = 1.0 / np.hypot(np.cos(theta - middle) / width, np.sin(theta - middle) / height)
        open_mm = np.maximum(np.abs(s - place) - half, 0.0)  # beyond its ends the wall rises at 35°
        radius = np.minimum(radius, slit + 0.7 * open_mm[:, None])
    return radius


def _faces() -> IntArray:
    """(F, 3) of the rings' sides and the two caps."""
    ring, sector = (one.ravel() for one in np.meshgrid(np.arange(_RINGS - 1), np.arange(_SECTORS), indexing="ij"))
    a, b = ring * _SECTORS + sector, ring * _SECTORS + (sector + 1) % _SECTORS
    c, d = a + _SECTORS, b + _SECTORS
    k, n = np.arange(_SECTORS), _RINGS * _SECTORS
    after = (k + 1) % _SECTORS
    first = np.column_stack([np.full(_SECTORS, n), after, k])
    last = np.column_stack([np.full(_SECTORS, n + 1), n - _SECTORS + k, n - _SECTORS + after])
    faces: IntArray = np.concatenate([np.column_stack([a, b, c]), np.column_stack([b, d, c]), first, last])
    return faces
