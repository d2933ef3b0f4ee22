"""Structures of a case: the parts of its anatomy that plans, zones, blockers and scores refer to, by id."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from vfix_engine.geometry.mesh import TriangleMesh

BONE = "bone"  # id of the structure that the controller keeps away from in a head
LUMEN = "lumen"  # id of the wall that a snake stays within

Role = Literal["bone", "lumen"]
CaseKind = Literal["head", "lumen"]
Origin = Literal["ct", "surface", "shipped"]
# What a case of a kind is driven in: id and role of that structure.
ANATOMY: dict[CaseKind, Role] = {"head": "bone", "lumen": "lumen"}
_NAMES: dict[str, str] = {BONE: "Bone", LUMEN: "Lumen"}


@dataclass(frozen=True)
class Provenance:
    """Where a structure's surface comes from; threshold_hu: the value of a CT that it was extracted at."""

    origin: Origin
    threshold_hu: float | None = None


@dataclass(frozen=True)
class Structure:
    """One structure of a case.

    id: what everything else refers to; unique in the case, and never a name. role: what the controller does with it.
    surface: which of the case's surfaces it is. geometry: 'sha256:' and the hash of that surface's stored file.
    deviation_mm: the largest measured distance from the surface that it was thinned from; None where not measured.
    has_inside: whether its surface is closed, so that a place is inside it or not; None where not examined.
    """

    id: str
    name: str
    role: Role
    surface: str
    geometry: str
    provenance: Provenance
    deviation_mm: float | None
    has_inside: bool | None
    frame: str = "LPS"


def structure_name(structure_id: str) -> str:
    """The name that a structure gets where nobody gives it one."""
    return _NAMES.get(structure_id, structure_id)


def within_a_sentence(name: str) -> str:
    """A name without its first capital, unless it begins with an abbreviation such as 'ICA'."""
    return name if name[1:2].isupper() else name[:1].lower() + name[1:]


def is_closed(mesh: TriangleMesh) -> bool:
    """Whether every edge of a surface is shared by two triangles that run along it in opposite directions."""
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]).astype(np.int64)
    count = len(mesh.vertices)
    there, back = np.sort(edges[:, 0] * count + edges[:, 1]), np.sort(edges[:, 1] * count + edges[:, 0])
    return bool(np.array_equal(there, back) and (np.diff(there) > 0).all())


def structure_from_json(item: Mapping[str, Any]) -> Structure:
    """The inverse of `dataclasses.asdict`. Raises KeyError, TypeError or ValueError."""
    if item["role"] not in get_args(Role):
        raise ValueError(f"the role {item['role']!r:.20} of a structure is not known.")
    return Structure(**{**item, "provenance": Provenance(**item["provenance"])})
