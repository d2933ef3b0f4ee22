"""Pathways of known shape for the tests of the lumen."""

from __future__ import annotations

import numpy as np

from vfix_engine.pathway.cavity import body_cavity
from vfix_engine.pathway.pathway import Pathway
from vfix_engine.robots.snake import SnakeModel
from vfix_engine.snake.bending.bending import DIRECTIONS, BendAxis, bend_angles, tip_displacement


def straight(length: float = 300.0, radius: float = 12.0, contours: int = 31, angles: int = 1, **more) -> Pathway:
    """Cylinder along +z from the origin."""
    centre = np.zeros((contours, 3))
    centre[:, 2] = np.linspace(0.0, length, contours)
    tangent = np.tile([0.0, 0.0, 1.0], (contours, 1))
    return _pathway(centre, tangent, radius, angles, more)


def arc(
    bend: float = 80.0, turn: float = np.pi / 2, radius: float = 12.0, contours: int = 31, angles: int = 1, **more
) -> Pathway:
    """Torus piece: from the origin along +z, bending towards +x with the radius ``bend`` in mm by ``turn`` in rad."""
    angle = np.linspace(0.0, turn, contours)
    zero = np.zeros(contours)
    centre = np.column_stack([bend * (1.0 - np.cos(angle)), zero, bend * np.sin(angle)])
    tangent = np.column_stack([np.sin(angle), zero, np.cos(angle)])
    return _pathway(centre, tangent, radius, angles, more)


def helix(
    bend: float = 60.0, rise: float = 40.0, turn: float = np.pi, radius: float = 12.0, contours: int = 41,
    angles: int = 1, **more,
) -> Pathway:  # fmt: skip
    """Round the z axis at the distance ``bend``, rising by ``rise`` mm per radian."""
    angle = np.linspace(0.0, turn, contours)
    centre = np.column_stack([bend * np.cos(angle), bend * np.sin(angle), rise * angle])
    tangent = np.column_stack([-bend * np.sin(angle), bend * np.cos(angle), np.full(contours, rise)])
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return _pathway(centre, tangent, radius, angles, more)


def s_curve(bend: float = 80.0, turn: float = 0.9, radius: float = 12.0, contours: int = 41, **more) -> Pathway:
    """Two arcs in the x-z plane with opposite bends, from the origin along +z."""
    s = np.linspace(0.0, 2.0 * turn * bend, 2001)
    angle = turn - np.abs(s / bend - turn)
    step = s[1] - s[0]
    x = np.concatenate([[0.0], np.cumsum(np.sin(0.5 * (angle[1:] + angle[:-1])) * step)])
    z = np.concatenate([[0.0], np.cumsum(np.cos(0.5 * (angle[1:] + angle[:-1])) * step)])
    at = np.linspace(0.0, s[-1], contours)
    centre = np.column_stack([np.interp(at, s, x), np.zeros(contours), np.interp(at, s, z)])
    turned = np.interp(at, s, angle)
    tangent = np.column_stack([np.sin(turned), np.zeros(contours), np.cos(turned)])
    return _pathway(centre, tangent, radius, 1, more)


def lobed(radius: float, angles: int, contours: int, depth: float = 0.2) -> np.ndarray:
    """Three-lobed radii (contours, angles) that turn a little from contour to contour."""
    psi = 2.0 * np.pi * np.arange(angles) / angles
    return radius * (1.0 + depth * np.cos(3.0 * psi[None, :] + 0.05 * np.arange(contours)[:, None]))


def _pathway(centre: np.ndarray, tangent: np.ndarray, radius: float, angles: int, more: dict) -> Pathway:
    """With the shape's own tangents; as many contours as given, circular or three-lobed."""
    radii = np.full((len(centre), 1), radius) if angles == 1 else lobed(radius, angles, len(centre))
    return Pathway(centre, radii, **({"count": len(centre), "tangent": tangent} | more))


SHAPES = {
    "straight": straight(),
    "arc": arc(),
    "polar arc": arc(angles=28),
    "helix": helix(),
    "s": s_curve(),
    "cavity": body_cavity(),
    "interpolated": helix(contours=50, count=197, tangent=None),
}


def small_bend(direction: BendAxis) -> np.ndarray:
    """d^{e±} or d^{o±} (3,) in mm: of five links bent with m = 0 and ± 5° (13), named after where the tip goes."""
    quarter = DIRECTIONS[direction]
    epsilon = np.radians(5.0) * (1.0 if quarter in (0, 3) else -1.0)
    return tip_displacement(SnakeModel(5), bend_angles(0.0, epsilon, 5, quarter % 2 == 1))
