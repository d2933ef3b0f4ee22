"""Structures of a case: the parts of its anatomy that plans, zones, blockers and scores refer to, by id."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from vfix_engine.geometry.mesh import TriangleMesh

BONE = "bone"  # id of the structure that the controller keeps away from in a head
LUMEN = "lumen"  # id of the wall that a snake stays within

StructureRole = Literal["bone", "lumen", "spare"]
CaseKind = Literal["head", "lumen"]
StructureOrigin = Literal["ct", "surface", "shipped", "segmentation", "painted"]
# What a case of a kind is driven in: id and role of that structure.
ANATOMY: dict[CaseKind, StructureRole] = {"head": "bone", "lumen": "lumen"}
_NAMES: dict[str, str] = {BONE: "Bone", LUMEN: "Lumen"}


@dataclass(frozen=True)
class Provenance:
    """Where a structure's surface comes from.

    threshold_hu: the value of a CT that it was extracted at. label: its number in a segmentation; voxel_mm: the largest
    spacing of that segmentation's grid, to half of which the surface is known. made_of: of a painted one, the hash of
    the voxels that it was made of.
    """

    origin: StructureOrigin
    threshold_hu: float | None = None
    label: int | None = None
    voxel_mm: float | None = None
    made_of: str | None = None


@dataclass(frozen=True)
class Structure:
    """One structure of a case.

    id: what everything else refers to; unique in the case, and never a name. role: what the controller does with it;
        'spare' does nothing by itself, a plan's zones refer to it.
    surface: which of the case's surfaces it is. geometry: 'sha256:' and the hash of that surface's stored file.
    deviation_mm: the largest measured distance from the surface that it was thinned from; None where not measured. Of
        a label, half of its largest voxel side above 1 mm, by which its surface may be off.
    has_inside: whether its surface is closed, so that a place is inside it or not; None where not examined.
    colour: '#rrggbb' that it is drawn in; None where it has none of its own. notes: what is doubtful about it.
    """

    id: str
    name: str
    role: StructureRole
    surface: str
    geometry: str
    provenance: Provenance
    deviation_mm: float | None
    has_inside: bool | None
    frame: str = "LPS"
    colour: str | None = None
    notes: tuple[str, ...] = ()


def structure_name(structure_id: str) -> str:
    """The name that a structure gets where nobody gives it one."""
    return _NAMES.get(structure_id, structure_id)


def within_a_sentence(name: str) -> str:
    """A name without its first capital, unless it begins with an abbreviation such as 'ICA'."""
    return name if name[1:2].isupper() else name[:1].lower() + name[1:]


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether every edge of a surface is shared by two triangles that run along it in opposite directions."""
    there, back = _edges(mesh)
    return bool(np.array_equal(there, back) and (np.diff(there) > 0).all())


def encloses(mesh: TriangleMesh) -> bool:
    """Whether a surface has no border: each edge is run along as often in one direction as in the other.

    Weaker than `is_closed`: surfaces of labels touch themselves along edges where voxels meet corner to corner.
    """
    there, back = _edges(mesh)
    return np.array_equal(there, back)


def _edges(mesh: TriangleMesh) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Every edge of every triangle as one number, and the same of the edges turned round; both sorted."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]).astype(np.int64)
    count = len(mesh.vertices)
    return np.sort(edges[:, 0] * count + edges[:, 1]), np.sort(edges[:, 1] * count + edges[:, 0])
