"""Robots, tools, zones and fixtures as plain values and arrays, and back; exact to the last bit.

A robot is written joint by joint, so that one from your own URDF is sent like a shipped one; its shapes, which
only a display draws, are omitted. Surfaces of zones become arrays, and their trees are built again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import Field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...geometry.path import SplinePath
from ...geometry.shaft_directions import ShaftDirections
from ...geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from ...proximity.fields.compact_field import stored_values, values_of
from ...proximity.fields.distance_field import DistanceField, FieldGrid
from ...proximity.proximity import Proximity, ProximityTree
from ...robots import RobotModel, Tool
from ...robots.joints import Joint, Mount
from ...robots.tool import Camera, Part
from ...virtual_fixtures import (
    CartesianLimits,
    DeeperPlace,
    Fixture,
    OrientationCone,
    PathTube,
    RemoteCentre,
    SoftRegion,
    SoftZone,
    TipEnvelope,
    Weighted,
    Zone,
)

NamedArrays = dict[str, NDArray[Any]]
SHAPES = {kind.__name__: kind for kind in (Sphere, CapsuleShape, Box, HalfSpace)}
FIXTURES = {kind.__name__: kind for kind in (CartesianLimits, OrientationCone, RemoteCentre)}
_ROUNDING = 1e-9  # largest change of a unit vector when it is normalised again


def robot_parts(robot: RobotModel) -> dict[str, Any]:
    """Plain values of a robot."""
    joints = [_values(joint) for joint in robot.joints]
    mount = {"transform": robot.mount.transform_flange_to_link.tolist(), "hold": robot.mount.hold}
    return {
        "name": robot.name, "title": robot.title, "source": robot.source, "joints": joints, "mount": mount,
        "home": robot.home.tolist(), "stands": robot.upright, "notes": list(robot.notes),
    }  # fmt: skip


def robot_from(values: dict[str, Any]) -> RobotModel:
    """The inverse. Raises RobotError."""
    joints = tuple(
        Joint(**{**one, "axis": tuple(one["axis"]), "placement": np.array(one["placement"])})
        for one in values["joints"]
    )
    mount = Mount(np.array(values["mount"]["transform"]), values["mount"]["hold"])
    return RobotModel(
        values["name"], values["title"], values["source"], joints, (), mount, values["home"], values["stands"],
        tuple(values["notes"]),
    )  # fmt: skip


def tool_parts(tool: Tool) -> dict[str, Any]:
    """Plain values of a tool."""
    camera = None
    if tool.camera is not None:
        transform = tool.camera.transform_camera_to_tip.tolist()
        camera = {"transform_camera_to_tip": transform, "field_of_view": tool.camera.field_of_view}
    parts = [{"name": p.name, "length": p.length, "radius": p.radius, "bend": p.bend} for p in tool.parts]
    return {
        "name": tool.name, "title": tool.title, "source": tool.source, "parts": parts,
        "grip_from_bend": tool.grip_from_bend, "camera": camera,
    }  # fmt: skip


def tool_from(values: dict[str, Any]) -> Tool:
    """The inverse. Raises RobotError."""
    camera = values["camera"]
    if camera is not None:
        camera = Camera(np.array(camera["transform_camera_to_tip"]), camera["field_of_view"])
    parts = tuple(Part(**one) for one in values["parts"])
    return Tool(values["name"], values["title"], parts, values["grip_from_bend"], camera, values["source"])


def zones_parts(zones: tuple[Zone, ...], key: str = "zone") -> tuple[list[dict[str, Any]], NamedArrays]:
    """Plain values of zones; a surface is named by the arrays that hold it."""
    values, arrays = list[dict[str, Any]](), NamedArrays()
    for number, zone in enumerate(zones):
        shape = _shape_parts(zone.solid, f"{key}_{number}", arrays)
        values.append({"name": zone.name, "margin_mm": zone.margin_mm, "shape": shape})
    return values, arrays


def zones_from(values: list[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> tuple[Zone, ...]:
    """The inverse. Raises InputError."""
    return tuple(Zone(one["name"], _shape_from(one["shape"], arrays), one["margin_mm"]) for one in values)


def shaft_parts(shaft: ShaftDirections | None) -> NamedArrays:
    """Arrays of a plan of the shaft; none where there is no plan."""
    if shaft is None:
        return {}
    values = {"stations": shaft.stations, "directions": shaft.directions, "rolls": shaft.rolls}
    return {f"shaft_{name}": np.asarray(value) for name, value in values.items()}


def shaft_from(arrays: Mapping[str, NDArray[Any]]) -> ShaftDirections | None:
    """The inverse. Raises PlanError."""
    if "shaft_stations" not in arrays:
        return None
    return ShaftDirections(arrays["shaft_stations"], arrays["shaft_directions"], arrays["shaft_rolls"])


def fixtures_parts(fixtures: tuple[Fixture, ...]) -> tuple[list[dict[str, Any]], NamedArrays]:
    """Plain values of the library's own standing fixtures.

    Raises:
        InputError: one of another class, whose values are not known.
    """
    values, arrays = list[dict[str, Any]](), NamedArrays()
    for number, one in enumerate(fixtures):
        values.append(_fixture_parts(one, f"fixture_{number}", arrays))
    return values, arrays


def fixtures_from(values: list[dict[str, Any]], arrays: Mapping[str, NDArray[Any]]) -> tuple[Fixture, ...]:
    """The inverse. Raises InputError."""
    return tuple(_fixture_from(one, arrays) for one in values)


def _fixture_parts(one: Fixture, key: str, arrays: NamedArrays) -> dict[str, Any]:
    if isinstance(one, Weighted):
        return {"kind": "Weighted", "weight": one.weight, "fixture": _fixture_parts(one.fixture, key, arrays)}
    if isinstance(one, SoftZone):
        over = None if one.over is None else _shape_parts(one.over, key, arrays)
        values = {"name": one.name, "thickness_mm": one.thickness_mm, "stiffness_n_per_mm": one.stiffness_n_per_mm}
        return {"kind": "SoftZone", **values, "over": over}
    if isinstance(one, SoftRegion):
        return _region_parts(one, key, arrays)
    if isinstance(one, PathTube):
        path = {"points": one.path.points.tolist(), "degree": one.path.degree}
        return {"kind": "PathTube", **path, "radius_mm": one.radius_mm}
    if isinstance(one, TipEnvelope):
        return {"kind": "TipEnvelope", "name": one.name, "shape": _shape_parts(one.shape, key, arrays)}
    kind = type(one).__name__
    if FIXTURES.get(kind) is not type(one):
        raise InputError(f"a standing fixture of the class {kind} cannot be written into a run; keep it with the run")
    return {"kind": kind, "values": _values(one)}


def _fixture_from(values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Fixture:
    kind = values["kind"]
    if kind == "Weighted":
        return Weighted(_fixture_from(values["fixture"], arrays), float(values["weight"]))
    if kind == "SoftZone":
        over = None if values["over"] is None else _shape_from(values["over"], arrays)
        return SoftZone(values["name"], values["thickness_mm"], values["stiffness_n_per_mm"], over)
    if kind == "SoftRegion":
        return _region_from(values, arrays)
    if kind == "PathTube":
        return PathTube(SplinePath(values["points"], values["degree"]), values["radius_mm"])
    if kind == "TipEnvelope":
        solid: Any = _shape_from(values["shape"], arrays)  # which TipEnvelope checks
        return TipEnvelope(values["name"], solid)
    if kind not in FIXTURES:
        raise InputError(f"a run has a standing fixture of the unknown class '{kind!s:.40}'")
    found: Fixture = _exactly(FIXTURES[kind], values["values"])
    return found


def _region_parts(one: SoftRegion, key: str, arrays: NamedArrays) -> dict[str, Any]:
    grids = []
    for number, grid in enumerate(one.field.grids):
        name = f"{key}_grid_{number}"
        arrays[name] = stored_values(grid.values)
        grids.append({"values": name, "origin": grid.origin.tolist(), "step_mm": float(grid.step_mm)})
    return {
        "kind": "SoftRegion", "name": one.name, "grids": grids, "stiffness_n_per_mm": one.stiffness_n_per_mm,
        "max_depth_mm": one.max_depth_mm, "layer_mm": one.layer_mm,
        "deeper": None if one.deeper is None else _values(one.deeper),
    }  # fmt: skip


def _region_from(values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> SoftRegion:
    grids = [
        FieldGrid(values_of(arrays[grid["values"]]), np.array(grid["origin"]), grid["step_mm"])
        for grid in values["grids"]
    ]
    deeper = None if values["deeper"] is None else DeeperPlace(**values["deeper"])
    return SoftRegion(
        values["name"], DistanceField(grids), values["stiffness_n_per_mm"], values["max_depth_mm"], deeper,
        values["layer_mm"],
    )  # fmt: skip


def _shape_parts(solid: Shape | Proximity, key: str, arrays: NamedArrays) -> dict[str, Any]:
    kind = type(solid).__name__
    if kind in SHAPES:
        return {"kind": kind, "values": _values(solid)}
    mesh: TriangleMesh = solid.mesh  # type: ignore[union-attr]
    arrays[f"{key}_vertices"], arrays[f"{key}_faces"] = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    return {"kind": "surface", "arrays": key}


def _shape_from(values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Shape | Proximity:
    kind = values["kind"]
    if kind == "surface":
        key = values["arrays"]
        return ProximityTree(TriangleMesh(arrays[f"{key}_vertices"], arrays[f"{key}_faces"]))
    if kind not in SHAPES:
        raise InputError(f"a zone has a shape of the unknown kind '{kind!s:.40}'")
    found: Shape = _exactly(SHAPES[kind], values["values"])
    return found


def _values(one: Any) -> dict[str, Any]:
    """Numbers and lists of a dataclass's fields, omitting a limit that is infinite by default: JSON has no infinity."""
    values = {field.name: getattr(one, field.name) for field in fields(one) if field.init and not _no_limit(one, field)}
    return {name: value.tolist() if isinstance(value, np.ndarray) else value for name, value in values.items()}


def _no_limit(one: Any, field: Field[Any]) -> bool:
    return field.default == math.inf and getattr(one, field.name) == math.inf


def _exactly(kind: Any, values: dict[str, Any]) -> Any:
    """An object of these values, validated as usual, but a unit vector is not normalised a second time."""
    one = kind(**{name: _tuples(value) for name, value in values.items()})
    for name, value in values.items():
        made = getattr(one, name)
        if isinstance(made, np.ndarray):
            exact = np.array(value, dtype=np.float64)
            if exact.shape != made.shape or not (np.abs(exact - made) <= _ROUNDING * (1.0 + np.abs(exact))).all():
                raise InputError(f"the {name} of a {kind.__name__} is not as it was written")
            exact.setflags(write=False)
            object.__setattr__(one, name, exact)
    return one


def _tuples(value: Any) -> Any:
    """Tuples in place of lists, which a field that is an array takes as well."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value
