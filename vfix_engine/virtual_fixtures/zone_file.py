"""Reader of zone files, schema vfix-zones/1, LPS and mm.

    {"schema": "vfix-zones/1", "frame": "LPS", "unit": "mm",
     "zones": [{"name": "optic nerve", "margin_mm": 1.0, "shape": {"kind": "capsule", …}}],
     "soft_zones": [{"name": "mucosa", "thickness_mm": 1.5, "stiffness_n_per_mm": 0.5, "shape": {"kind": "anatomy"}}],
     "envelopes": [{"name": "antrum", "shape": {"kind": "sphere", …}}]}

A soft zone may have a ``max_depth_mm``, the depth beyond which it is hard.

docs/formats.md lists the shapes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import FrameError, InputError
from ..geometry.mesh import TriangleMesh
from ..geometry.shape_patch import patch_around
from ..geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from ..proximity.proximity import Proximity, ProximityTree
from .soft_core import hard_core
from .soft_region import SoftRegion
from .soft_zone import SoftZone
from .tip_envelope import TipEnvelope
from .zones import ANATOMY, Zone, check_number, check_positive, ordered

SCHEMA = "vfix-zones/1"
MOST_ZONES = 64  # of each kind; each costs time in every step
_DEEPEST_MM = 20.0  # largest allowed ``max_depth_mm``


@dataclass(frozen=True, eq=False)
class ZoneSet:
    """The zones of a file or a plan: no-fly zones, including the hard cores of soft ones, soft zones, and envelopes."""

    zones: tuple[Zone, ...] = ()
    soft_zones: tuple[SoftZone | SoftRegion, ...] = ()
    envelopes: tuple[TipEnvelope, ...] = ()


@dataclass(frozen=True, eq=False)
class _Surfaces:
    """Surfaces that shapes refer to: driven_in, the anatomy; by_id, those of the case by the id of their structure."""

    driven_in: TriangleMesh | None
    by_id: Mapping[str, TriangleMesh]

    def of(self, shape: dict[str, Any]) -> TriangleMesh:
        """Return the surface of the structure that a shape names, or the anatomy if it names none."""
        wanted, kind = shape.get("structure", ANATOMY), shape["kind"]
        if not self.by_id:
            article = "an anatomy" if kind == "anatomy" else f"a {kind}"
            raise InputError(f"{article} is a part of the anatomy, which is not given")
        if not isinstance(wanted, str) or wanted not in self.by_id:
            known = ", ".join(self.by_id)
            raise InputError(f"there is no structure {wanted!r:.60}; the structures are {known}")
        return self.by_id[wanted]


def zones_from_dict(
    data: dict[str, Any], anatomy: TriangleMesh | None = None, structures: Mapping[str, TriangleMesh] | None = None
) -> ZoneSet:
    """Create zones from a mapping of the schema vfix-zones/1.

    Args:
        anatomy: surface that the tool is driven in.
        structures: surfaces of the case by the id of their structure, for shapes of the kinds 'patch' and 'anatomy';
            None: only the anatomy, as 'bone'.

    Raises:
        FrameError: the mapping does not state LPS and mm (HAZ-14).
        InputError: the message names the zone and the invalid value.
    """
    if data.get("schema") != SCHEMA:
        raise InputError(f"the schema of the zones is {str(data.get('schema'))!r:.60}; {SCHEMA!r} can be read")
    if data.get("frame") != "LPS" or data.get("unit") != "mm":
        raise FrameError("zones of this schema must name LPS and mm")
    unknown = sorted(set(data) - {"schema", "frame", "unit", "notice", "zones", "soft_zones", "envelopes"})
    if unknown:
        raise InputError(f"a file of zones has no '{unknown[0]:.40}'")
    alone = {} if anatomy is None else {ANATOMY: anatomy}
    surfaces = _Surfaces(anatomy, alone if structures is None else structures)
    hard = tuple(_zone(entry, surfaces) for entry in _entries(data, "zones"))
    entries = _entries(data, "soft_zones")
    soft = tuple(_soft_zone(entry, surfaces) for entry in entries)
    cores = (core for entry, zone in zip(entries, soft, strict=True) for core in _core(entry, zone))
    zones = (*hard, *cores)
    ordered(zones)
    return ZoneSet(zones, soft, tuple(_envelope(entry, surfaces) for entry in _entries(data, "envelopes")))


def _entries(data: dict[str, Any], key: str) -> list[dict[str, Any]]:
    entries = data.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InputError(f"'{key}' must be a list of objects")
    if len(entries) > MOST_ZONES:
        raise InputError(f"there are {len(entries)} entries in '{key}'; {MOST_ZONES} are allowed")
    return entries


def _zone(entry: dict[str, Any], surfaces: _Surfaces) -> Zone:
    named = f"protected structure '{str(entry.get('name'))[:80]}'"
    _only(entry, {"name", "margin_mm", "shape"}, named)
    solid = _with_zone_named(named, lambda: _solid(entry["shape"], surfaces))
    if solid is None:
        raise InputError(f"{named}: the safety margin covers the anatomy already; name a part of it, as a patch")
    return Zone(entry["name"], solid, entry["margin_mm"])


def _envelope(entry: dict[str, Any], surfaces: _Surfaces) -> TipEnvelope:
    named = f"envelope '{str(entry.get('name'))[:80]}'"
    _only(entry, {"name", "shape"}, named)
    kind = entry["shape"].get("kind") if isinstance(entry["shape"], dict) else None
    if kind not in _SOLID:
        raise InputError(f"{named}: the kind of its shape is {str(kind)!r:.40}; the tip stays in a {', '.join(_SOLID)}")
    solid: Any = _with_zone_named(named, lambda: _solid(entry["shape"], surfaces))
    return TipEnvelope(entry["name"], solid)


def _soft_zone(entry: dict[str, Any], surfaces: _Surfaces) -> SoftZone:
    named = f"soft zone '{str(entry.get('name'))[:80]}'"
    fields = {"name", "thickness_mm", "stiffness_n_per_mm", "shape"}
    _only(entry, fields, named, frozenset({"max_depth_mm"}))
    over = _with_zone_named(named, lambda: _solid(entry["shape"], surfaces))
    return SoftZone(entry["name"], entry["thickness_mm"], entry["stiffness_n_per_mm"], over)


def _core(entry: dict[str, Any], soft: SoftZone) -> tuple[Zone, ...]:
    """Hard core of a soft zone that has a greatest depth."""
    depth = entry.get("max_depth_mm")
    if depth is None:
        return ()
    try:
        core = hard_core(soft, check_positive(depth, "the greatest depth in mm", _DEEPEST_MM))
    except InputError as error:
        raise InputError(f"{soft.label}: {error}") from error
    return () if core is None else (core,)


def _only(entry: dict[str, Any], names: set[str], named: str, optional: frozenset[str] = frozenset()) -> None:
    """Refuse missing and unknown fields, so that a misspelt field is not replaced by a default."""
    for missing in sorted(names - set(entry)):
        raise InputError(f"{named} does not say its '{missing}'")
    for unknown in sorted(set(entry) - names - optional):
        raise InputError(f"{named} has no '{unknown[:40]}'")


def _with_zone_named(named: str, make: Callable[[], Shape | Proximity | None]) -> Shape | Proximity | None:
    """Return the result of ``make``; an InputError is raised again with the name of the zone."""
    try:
        return make()
    except InputError as error:
        raise InputError(f"{named}: {error}") from error


def _solid(shape: Any, surfaces: _Surfaces) -> Shape | Proximity | None:
    """Return a shape, the tree of a surface, or None for the anatomy itself."""
    kind = shape.get("kind") if isinstance(shape, dict) else None
    if not isinstance(kind, str) or kind not in _FIELDS:
        raise InputError(f"the kind of its shape is {str(kind)!r:.40}; known are {', '.join(_FIELDS)}")
    _only(shape, {"kind", *_FIELDS[kind]}, f"a {kind}", _OF_A_STRUCTURE.get(kind, frozenset()))
    value = [shape[name] for name in _FIELDS[kind]]
    if kind == "anatomy":
        if "structure" not in shape:
            return None
        whole = surfaces.of(shape)
        driven_in = surfaces.driven_in
        same = driven_in is not None and whole.content_hash == driven_in.content_hash
        return None if same else ProximityTree(whole)
    if kind == "patch":
        return ProximityTree(patch_around(surfaces.of(shape), value[0], check_number(value[1], "a patch's radius")))
    if kind == "surface":
        return ProximityTree(_surface(*value))
    if kind == "box":
        return Box(_rows_of_four(value[0]), value[1])
    return _MAKERS[kind](*value)


_FIELDS: dict[str, tuple[str, ...]] = {
    "sphere": ("centre", "radius"),
    "capsule": ("start", "end", "radius"),
    "box": ("transform_box_to_patient", "half_size"),
    "half_space": ("point", "normal"),
    "patch": ("centre", "radius"),
    "surface": ("vertices", "faces"),
    "anatomy": (),
}
_SOLID = ("sphere", "capsule", "box", "half_space")  # convex, so that the tip can stay in it
_OF_A_STRUCTURE = {kind: frozenset({"structure"}) for kind in ("patch", "anatomy")}
_MAKERS: dict[str, Callable[..., Shape]] = {"sphere": Sphere, "capsule": CapsuleShape, "half_space": HalfSpace}


def _surface(vertices: Any, faces: Any) -> TriangleMesh:
    try:
        return TriangleMesh(vertices, faces)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError("a surface needs vertices [[x, y, z], …] in mm and faces [[a, b, c], …]") from error


def _rows_of_four(values: Any) -> list[Any]:
    """Convert 16 numbers to a transform (4, 4), row by row."""
    if not isinstance(values, list) or len(values) != 16:
        raise InputError("transform_box_to_patient must be 16 numbers, row by row")
    return [values[i : i + 4] for i in range(0, 16, 4)]
