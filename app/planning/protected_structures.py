"""A plan's protected structures as zones of the engine: the same for snapping, dry run and drive."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.cases.structures import BONE, encloses
from app.plans.shapes import solids
from app.plans.zones import PlanZone
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, PlanError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.geometry.shape_distance import signed_distance
from vfix_engine.geometry.shape_patch import patch_around
from vfix_engine.geometry.shapes import Shape
from vfix_engine.proximity.fields.distance_field import field_of_surface
from vfix_engine.proximity.proximity import Proximity, ProximityTree
from vfix_engine.virtual_fixtures import SoftRegion, SoftZone, Zone
from vfix_engine.virtual_fixtures.soft_core import hard_core
from vfix_engine.virtual_fixtures.soft_zone import THICKEST_MM
from vfix_engine.virtual_fixtures.zone_file import ZoneSet
from vfix_engine.virtual_fixtures.zones import SHAPES

Surfaces = Callable[[str], TriangleMesh]

_FIELD_STEP_MM = 0.5  # grid step of the distance field of a soft structure
_MOST_POINTS = 12_000_000  # of that grid; for a larger structure the step grows
_LINK = re.compile(r" \(\d+ of \d+\)(?=$|, [^,]+ mm deep$)")
_ADDED = re.compile(r"( \(\d+ of \d+\))?(, [^,]+ mm deep)?")  # to the name of a structure, for its zones
_AROUND_MM = 8.0  # the field reaches this far beyond the layer: the look-ahead distance of the tool


def engine_zones(zones: Sequence[PlanZone], surface: Surfaces, anatomy: str = BONE) -> ZoneSet:
    """Return the engine's zones of a plan's protected structures; a chain of capsules gives one zone per link.

    surface: returns the surface of a structure of the case by its id, and raises InputError if there is none.
    anatomy: id of the structure that the tool is driven in.
    A soft structure with a maximum depth gets a hard core at that depth below the border of its layer; a structure
    whose surface encloses a solid is soft inside as well.
    Raises PlanError, which names the structure.
    """
    hard, soft = list[Zone](), list[SoftZone | SoftRegion]()
    for zone in zones:
        try:
            for name, solid in _named(zone.name, _bodies(zone, surface, anatomy)):
                if zone.kind == "hard":
                    hard.append(_hard(zone, name, solid))
                else:
                    yielding, core = _soft(zone, name, solid)
                    soft.append(yielding)
                    hard.extend(core)
        except InputError as error:
            raise PlanError(f"the protected structure {zone.name!r} cannot be kept: {error}") from error
    return ZoneSet(tuple(hard), tuple(soft))


def check_enforceable(zone: PlanZone, surface: Surfaces, anatomy: str = BONE) -> None:
    """Raise as `engine_zones` for one structure, without the computations that take seconds for a case structure."""
    shape, margin, depth = zone.shape, zone.margin_mm, zone.max_depth_mm
    if shape["kind"] == "structure" and shape["structure"] != anatomy:
        inside = zone.kind == "hard" or depth is None or depth <= margin or encloses(surface(shape["structure"]))
        if inside and (zone.kind == "hard" or 0.0 < margin <= THICKEST_MM):
            return
    engine_zones([zone], surface, anatomy)


def with_surface_errors(zones: Sequence[PlanZone], errors: Mapping[str, float]) -> tuple[PlanZone, ...]:
    """Return the structures with the margin of each hard one increased by the error of its surface.

    errors: surface error in mm by the id of the case structure.
    Raises PlanError for an error that is negative or not finite, which would reduce the margin.
    """
    grown = []
    for zone in zones:
        more = errors.get(zone.shape.get("structure", ""), 0.0) if zone.kind == "hard" else 0.0
        if not 0.0 <= more < math.inf:
            raise PlanError(
                f"the protected structure {zone.name!r} cannot be kept: its surface would be off by {more:g} mm; "
                "import the structure again."
            )
        grown.append(replace(zone, margin_mm=zone.margin_mm + more) if more else zone)
    return tuple(grown)


def within_margin(zones: Sequence[Zone], points: Array, radius_mm: float) -> NDArray[np.bool_]:
    """Return for points (n, 3) whether a ball with that radius is nearer to a zone than the zone's margin."""
    near = np.zeros(len(points), dtype=bool)
    for zone in zones:
        solid = zone.solid
        away = signed_distance(solid, points) if isinstance(solid, SHAPES) else solid.point_distance(points)[0]
        near |= away < radius_mm + zone.margin_mm
    return near


def _bodies(zone: PlanZone, surface: Surfaces, anatomy: str) -> tuple[Shape | Proximity | None, ...]:
    """Return the solids of a structure, or the tree of its surface; None for the anatomy itself."""
    shape = zone.shape
    if shape["kind"] == "patch":
        mesh = surface(shape.get("structure", anatomy))
        return (ProximityTree(patch_around(mesh, shape["centre"], shape["radius"])),)
    if shape["kind"] == "structure":
        return (None,) if shape["structure"] == anatomy else (ProximityTree(surface(shape["structure"])),)
    return solids(shape)


def structure_name(name: str) -> str:
    """Return the name of the structure that a zone belongs to, such as 'optic nerve' for each link of its chain.

    For their hard cores it is 'optic nerve, 1 mm deep'.
    """
    return _LINK.sub("", name)


def structure_of(zone: Zone, structures: Sequence[PlanZone]) -> PlanZone:
    """Return which of a plan's structures a zone of the engine was made of."""
    made_of = (
        one for one in structures if zone.name.startswith(one.name) and _ADDED.fullmatch(zone.name[len(one.name) :])
    )
    return max(made_of, key=lambda one: len(one.name))


def _named(name: str, bodies: Sequence[Shape | Proximity | None]) -> list[tuple[str, Shape | Proximity | None]]:
    """Return the bodies with unique names, such as 'optic nerve (2 of 4)' for a link of a chain."""
    if len(bodies) == 1:
        return [(name, bodies[0])]
    return [(f"{name} ({number} of {len(bodies)})", body) for number, body in enumerate(bodies, 1)]


def _hard(zone: PlanZone, name: str, solid: Shape | Proximity | None) -> Zone:
    if solid is None:
        raise PlanError("all of the bone is protected already; choose a part, as a patch.")
    return Zone(name, solid, zone.margin_mm)


def _soft(zone: PlanZone, name: str, solid: Shape | Proximity | None) -> tuple[SoftZone | SoftRegion, tuple[Zone, ...]]:
    """Return the soft zone of a structure, and its hard core if it has a maximum depth."""
    depth, stiffness = zone.max_depth_mm, zone.stiffness_n_per_mm or 0.0
    layer = SoftZone(name, zone.margin_mm, stiffness, solid)
    surface = None if isinstance(solid, SHAPES) else solid
    if zone.shape["kind"] != "structure" or surface is None or not encloses(surface.mesh):
        core = None if depth is None else hard_core(layer, depth)
        return layer, () if core is None else (core,)
    if depth is not None and depth <= zone.margin_mm:  # exact, from its surface
        core = hard_core(layer, depth)
        return _region(zone, name, surface, None), () if core is None else (core,)
    return _region(zone, name, surface, depth), ()


def _region(zone: PlanZone, name: str, surface: Proximity, depth: float | None) -> SoftRegion:
    """Return the soft region inside a structure's surface and in the layer around it."""
    low, high = surface.mesh.bounds
    around = zone.margin_mm + _AROUND_MM
    box = np.stack([low - around, high + around])
    step = max(_FIELD_STEP_MM, float((np.prod(box[1] - box[0]) / _MOST_POINTS) ** (1.0 / 3.0)))
    field = field_of_surface(surface, box, step)
    return SoftRegion(name, field, zone.stiffness_n_per_mm or 0.0, depth, None, zone.margin_mm)
