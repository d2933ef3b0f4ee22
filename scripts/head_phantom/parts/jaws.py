"""Alveolar arch, mandible and teeth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from head_phantom.blending import Field, intersection, union
from head_phantom.shapes import Box, Ellipsoid, Halfspaces, Part, Plate, Points, Shared, Tube

UPPER_JAW = (
    Part(
        "alveolar process",
        Tube(
            [(0, -1, -9), (11, 1, -9), (20, 10, -9), (25, 24, -9), (26.5, 42, -9), (24, 50, -7)],
            [4.2, 4.3, 4.6, 5, 5.3, 4.5],
            (1, 1, 1.6),
        ),
        6,
        paired=True,
    ),
)
ANTERIOR_NASAL_SPINE = (
    Part("anterior nasal spine", Tube([(0, 7, -3), (0, 1, -1), (0, -5.5, 1.2)], [3.2, 2.2, 0.7]), 3),
)
PALATE_VAULT = (
    Part(
        "vault of the palate",
        Shared(
            [
                Ellipsoid((0, 30, -17.5), (20, 30, 10.5)),
                Halfspaces([((0, 0, 1), -6.0)], ((-20, 0, -29), (20, 60, -4)), 0),
            ],
            3,
        ),
        3,
        taken=True,
    ),
)

RAMUS = (
    (52, -38), (62, -44.5), (70, -44.5), (75, -41), (78, -34), (81.5, -10), (84, 1), (81, 2),
    (76, -5), (71, -9), (66, -7), (61, 3), (58, 4), (56, -8), (53, -22), (49, -30),
)  # fmt: skip

MANDIBLE = (
    Part(
        "body",
        Tube(
            [(0, 8.5, -53), (11, 12, -53), (24, 28, -50.5), (35, 46, -45), (43, 62, -37), (46, 72, -28)],
            [5.2, 5.2, 5.4, 5.2, 4.2, 3],
            (1, 1, 2.2),
        ),
        2,
        True,
    ),
    Part("mental protuberance", Ellipsoid((0, 6.8, -57.5), (12.5, 5.2, 6.8)), 10),
    Part("mental tubercle", Ellipsoid((10, 8, -61.5), (7, 5.5, 4)), 9, True),
    Part(
        "alveolar part",
        Tube(
            [(0, 2.5, -38.4), (10, 5, -38.4), (18.5, 14.5, -38.4), (23.5, 28, -38.4), (28, 42, -37.6), (36, 52, -34)],
            [3.6, 3.6, 3.9, 4.3, 4.2, 2.5],
            (1, 1, 1.6),
        ),
        7,
        True,
    ),
    Part("ramus", Plate(RAMUS, 47.5, 3.2, ((0.08, 68), (0.09, -20)), 5, edge=2.6), 11, True),
    Part("oblique line", Tube([(50, 56, -18), (45, 52, -30), (36, 42, -40)], [2.2, 2.4, 1.4]), 5, True),
    Part("angle", Tube([(47.5, 74, -40), (48.5, 78, -30)], [2.6, 2.2]), 5, True),
    Part("neck of the condyle", Tube([(50, 81, -8), (51, 84, 3)], [3.4, 3.6], (1.2, 1, 1)), 4, True),
    Part("condyle", Ellipsoid((51, 84, 4.5), (8.8, 4.4, 4.4)), 3, True),
    Part("sublingual fossa", Ellipsoid((12, 25, -44), (9, 9, 6)), 5, True, taken=True),
    Part("mental foramen", Tube([(30, 18, -46), (22, 26, -47)], [1.6, 1.3]), 1, True, taken=True),
)


@dataclass(frozen=True)
class Tooth:
    """Crown and root of one tooth, upright in the dental arch.

    centre: (x, y) in the arch; tangent: unit direction along the arch; up: +1 for the upper jaw, -1 for the lower.
    width along the arch, depth across it, crown_height [mm]; edge: depth of the biting edge as a fraction of depth;
    point: how much narrower the biting edge is; lean: how far the root leans inwards [mm]; cusps: 0 for front teeth.
    """

    centre: tuple[float, float]
    tangent: tuple[float, float]
    up: int
    width: float
    depth: float
    crown_height: float
    neck_z: float
    root_z: float
    edge: float
    point: float
    lean: float
    cusps: int

    @property
    def box(self) -> Box:
        """See Shape."""
        tip = self.neck_z - self.up * self.crown_height
        low, high = min(tip, self.root_z) - 1, max(tip, self.root_z) + 1
        (x, y), reach = self.centre, self.width / 2 + self.depth / 2 + 1.5
        return (x - reach, y - reach, low), (x + reach, y + reach, high)

    def distance(self, at: Points) -> Field:
        """See Shape."""
        (cx, cy), (tx, ty) = self.centre, self.tangent
        along = (at.x - np.float32(cx)) * np.float32(tx) + (at.y - np.float32(cy)) * np.float32(ty)
        across = (at.y - np.float32(cy)) * np.float32(tx) - (at.x - np.float32(cx)) * np.float32(ty)
        above = (at.z - np.float32(self.neck_z)) * np.float32(self.up)  # > 0 in the root, < 0 in the crown
        across = across - np.float32(self.lean) * np.clip(above / 12, -0.7, 1.2)
        return union(self._crown(along, across, above), self._root(along, across, above), 1.5)

    def _crown(self, along: Field, across: Field, above: Field) -> Field:
        t = np.clip(-above / np.float32(self.crown_height), 0, 1)  # 0 at the neck, 1 at the biting edge
        bulge = np.float32(0.84) + np.float32(0.16) * np.sin(np.clip(t * 1.6, 0, 1) * np.float32(np.pi / 2))
        half_width = np.float32(self.width * 0.5) * bulge * (1 - np.float32(self.point) * t**3)
        half_depth = np.float32(self.depth / 2) * (bulge + (np.float32(self.edge) - bulge) * t**2)
        m = np.float32(3.0)
        section = ((np.abs(along) / half_width) ** m + (np.abs(across) / half_depth) ** m) ** (1 / m)
        side = (section - 1) * np.minimum(half_width, half_depth)
        height: Field = np.full(1, self.crown_height, dtype=np.float32)
        if self.cusps:
            u, v = along / np.float32(self.width / 2), across / np.float32(self.depth / 2)
            fissures = np.cos(v * np.float32(np.pi)) + (np.cos(u * np.float32(np.pi)) if self.cusps == 4 else 0)
            height = height - np.float32(0.45) * (1 + fissures)
        else:
            height = height - np.float32(self.point * 6) * (along / np.float32(self.width / 2)) ** 2
        ends = np.maximum(-above - height, above - 2)
        return intersection(side, ends.astype(np.float32), 1.6)

    def _root(self, along: Field, across: Field, above: Field) -> Field:
        length = np.float32(abs(self.root_z - self.neck_z))
        t = np.clip(above / length, 0, 1)
        taper = 1 - np.float32(0.72) * t
        section = np.sqrt((along / np.float32(self.width * 0.36)) ** 2 + (across / np.float32(self.depth * 0.42)) ** 2)
        side = (section - taper) * np.float32(min(self.width * 0.36, self.depth * 0.42))
        return intersection(side, np.maximum(above - length, -above).astype(np.float32), 1.5)


@dataclass(frozen=True)
class ToothKind:
    """Sizes [mm] of one kind of tooth, equal in both jaws except for the width."""

    name: str
    width_upper: float
    width_lower: float
    depth: float
    crown_height: float
    root: float
    edge: float
    point: float
    lean: float
    cusps: int


KINDS = (
    ToothKind("central incisor", 8.5, 5.5, 6.6, 9.6, 13, 0.36, 0.03, 3.2, 0),
    ToothKind("lateral incisor", 6.8, 6.0, 6.2, 9.0, 13, 0.36, 0.06, 3.0, 0),
    ToothKind("canine", 7.6, 6.9, 7.6, 10.0, 17, 0.46, 0.22, 2.4, 0),
    ToothKind("first premolar", 7.0, 7.2, 8.2, 8.3, 14, 0.80, 0.08, 0.8, 2),
    ToothKind("second premolar", 7.0, 7.3, 8.4, 8.1, 14, 0.82, 0.08, 0.5, 2),
    ToothKind("first molar", 10.2, 11.0, 10.0, 7.9, 12, 0.88, 0.04, 0.0, 4),
    ToothKind("second molar", 9.8, 10.5, 9.8, 7.8, 11, 0.88, 0.04, 0.0, 4),
)


@dataclass(frozen=True)
class DentalArch:
    """Half an ellipse in the horizontal plane, open to the back; the necks of its teeth are at neck_z."""

    half_width: float
    centre_y: float
    length: float
    neck_z: float
    up: int

    def teeth(self) -> list[Part]:
        """Return the teeth side by side from the midline backwards."""
        angle = np.linspace(0, 0.55 * np.pi, 500)
        x, y = self.half_width * np.sin(angle), self.centre_y - self.length * np.cos(angle)
        along = np.r_[0, np.cumsum(np.hypot(np.diff(x), np.diff(y)))]
        parts, start = [], -0.2
        for kind in KINDS:
            width = kind.width_upper if self.up > 0 else kind.width_lower
            at = np.interp(start + width / 2, along, angle)
            start += width
            tangent = np.array([self.half_width * np.cos(at), self.length * np.sin(at)])
            tangent /= np.hypot(*tangent)
            centre = (float(self.half_width * np.sin(at)), float(self.centre_y - self.length * np.cos(at)))
            tooth = Tooth(
                centre, (float(tangent[0]), float(tangent[1])), self.up, width, kind.depth,
                kind.crown_height, self.neck_z, self.neck_z + self.up * kind.root,
                kind.edge, kind.point, kind.lean, kind.cusps,
            )  # fmt: skip
            parts.append(Part(kind.name, tooth, paired=True))
        return parts


UPPER_ARCH = DentalArch(27.5, 42.0, 47.0, -16.3, 1)
LOWER_ARCH = DentalArch(25.5, 43.0, 44.0, -32.4, -1)
TEETH = (*UPPER_ARCH.teeth(), *LOWER_ARCH.teeth())
