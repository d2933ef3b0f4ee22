"""The content of a case out of JSON: every type, range and reference is checked, in the store and in an archive alike.

A row of the store may be older than this version, and an archive is untrusted; what is read here can be
listed, shown, driven in and written again.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar, get_args

from app.cases.model import (
    Bounds,
    CaseBead,
    CaseContent,
    CaseFrame,
    CaseLandmark,
    Overlay,
    SurfaceInfo,
    VolumeInfo,
    anatomy_structure,
    extracted_from,
)
from app.cases.structures import ANATOMY, BONE, CaseKind, Provenance, Structure, StructureOrigin, StructureRole
from app.kit.names import COLOUR, check_name, check_stored_label
from app.kit.values import Position, check_id, check_position, number
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.surface import Dropped
from vfix_engine.errors import InputError
from vfix_engine.files.frame_report import FRAMES
from vfix_engine.validate import FARTHEST_MM

MAX_ITEMS = 2000  # surfaces, structures, notes, … of one case
MAX_NOTE = 1 << 16  # [characters]
MAX_COUNT = 2**31 - 1  # triangles of a surface, whose indices are int32; voxels along an axis
MAX_ERROR_MM = 1e4  # by which a surface may be off: longer than any patient
MAX_HU = 1e6  # of a threshold or a window; voxels are int16
_GEOMETRY = re.compile(r"sha256:[0-9a-f]{64}")
_SOURCE = re.compile(r"sha256:[0-9a-f]{64}|asset:\w+/\w+\.ply|phantom:\w+")
_DIGEST = re.compile(r"[0-9a-f]{64}")

_Item = TypeVar("_Item")


def case_content_from_json(data: Any) -> CaseContent:
    """The inverse of `CaseContent.to_json`, checked. Raises InputError that says what is wrong, without its value."""
    given = _fields(data, CaseContent, "a case", also=("volumes", "beads"))
    surfaces = _items(given["surfaces"], "surfaces", _surface)
    volumes = _items(given["volumes"], "volumes", _volume)
    kind: CaseKind = _one_of(given.get("kind", "head"), get_args(CaseKind), "the kind of a case")
    if "structures" in given:
        structures = _items(given["structures"], "structures", _structure)
    else:  # stored before cases had structures
        structures = _former_structures(surfaces, bool(volumes))
    content = CaseContent(
        _frame(given["frame"]),
        surfaces,
        volumes,
        _items(given["beads"], "beads", _bead),
        _notes(given.get("notes", ())),
        kind,
        structures,
        _items(given.get("overlays", ()), "overlays", _overlay),
        _items(given.get("landmarks", ()), "landmarks", _landmark),
    )
    _check_references(content)
    return content


def check_names(content: CaseContent) -> None:
    """Raise InputError for a name that nobody could give here; those of the store may be older than the rule."""
    parts = (content.surfaces, content.volumes, content.beads, content.structures, content.overlays, content.landmarks)
    for name in (item.name for part in parts for item in part):
        check_name(name, "name of a part of the case")


def _check_references(content: CaseContent) -> None:
    surfaces, structures = [one.name for one in content.surfaces], [one.id for one in content.structures]
    volumes = [one.name for one in (*content.volumes, *(overlay.volume for overlay in content.overlays))]
    for names, what in (
        (surfaces, "surfaces"),
        (structures, "structures"),
        (volumes, "volumes"),
        ([one.id for one in content.overlays], "overlays"),
    ):
        if len(set(names)) < len(names):
            raise InputError(f"two {what} of the case are called the same.")
    driven = ANATOMY[content.kind]
    if [one.id for one in content.structures if one.role != "spare"] != [driven]:
        raise InputError(f"a {content.kind} has one structure that it is driven in, its {driven}.")
    if any(one.surface not in surfaces for one in content.structures):
        raise InputError("a structure names a surface that the case does not have.")


def _frame(item: Any) -> CaseFrame:
    given = _fields(item, CaseFrame, "a frame")
    name = _one_of(given["name"], FRAMES, "the frame of a case")
    return CaseFrame(name, _flag(given["assumed"], "whether the frame was assumed"))


def _surface(item: Any) -> SurfaceInfo:
    given = _fields(item, SurfaceInfo, "a surface")
    return SurfaceInfo(
        check_stored_label(given["name"], "name of a surface"),
        _count(given["triangles"], "the triangles of a surface", 1),
        _bounds(given["bounds_lps_mm"], "of a surface"),
        _matching(given["source"], _SOURCE, "the source of a surface"),
        _optional(given.get("report"), _report),
    )


def _report(item: Any) -> SurfaceReport:
    given = _fields(item, SurfaceReport, "the report of a surface")
    dropped = _fields(given["dropped"], Dropped, "what was left out of a surface")
    return SurfaceReport(
        error_mm(given["mean_deviation_mm"], "the mean deviation of a surface"),
        error_mm(given["max_deviation_mm"], "the largest deviation of a surface"),
        Dropped(
            _count(dropped.get("pieces", 0), "the pieces left out of a surface"),
            _count(dropped.get("triangles", 0), "the triangles left out of a surface"),
            _within(dropped.get("extent_mm", 0.0), 0.0, 4.0 * FARTHEST_MM, "the extent of what was left out"),
        ),
        _optional(given.get("certified_mm"), lambda value: error_mm(value, "the certified deviation of a surface")),
        _count(given.get("put_back", 0), "the triangles put back into a surface"),
        error_mm(given.get("smoothed_mm", 0.0), "the smoothing of a surface"),
        error_mm(given.get("resampled_mm", 0.0), "the resampling of a surface"),
    )


def _volume(item: Any) -> VolumeInfo:
    given = _fields(item, VolumeInfo, "a volume")
    i, j, k = (_count(value, "the shape of a volume", 1) for value in _three(given["shape"], "the shape of a volume"))
    x, y, z = (_size_mm(value) for value in _three(given["spacing_mm"], "the spacing of a volume"))
    window = given.get("window")
    if window is not None:
        window = _window(window)
    return VolumeInfo(
        check_stored_label(given["name"], "name of a volume"),
        (x, y, z),
        (i, j, k),
        _bounds(given["bounds_lps_mm"], "of a volume"),
        _matching(given["source"], _SOURCE, "the source of a volume"),
        _optional(given.get("slice_thickness_mm"), _size_mm),
        window,
    )


def _window(value: Any) -> tuple[float, float]:
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError("the window of a volume is a width and a centre.")
    return _width(value[0]), _level(value[1])


def _bead(item: Any) -> CaseBead:
    given = _fields(item, CaseBead, "a bead")
    return CaseBead(
        check_stored_label(given["name"], "name of a bead"), check_position(_three(given["position"], "a bead"))
    )


def _landmark(item: Any) -> CaseLandmark:
    given = _fields(item, CaseLandmark, "a landmark")
    return CaseLandmark(
        check_stored_label(given["name"], "name of a landmark"), check_position(_three(given["position"], "a landmark"))
    )


def _structure(item: Any) -> Structure:
    given = _fields(item, Structure, "a structure")
    role: StructureRole = _one_of(given["role"], get_args(StructureRole), "the role of a structure")
    frame = _one_of(given.get("frame", "LPS"), ("LPS",), "the frame of a structure")
    return Structure(
        check_id(given["id"], "a structure"),
        check_stored_label(given["name"], "name of a structure"),
        role,
        check_stored_label(given["surface"], "surface of a structure"),
        _matching(given["geometry"], _GEOMETRY, "the geometry of a structure"),
        _provenance(given["provenance"]),
        _optional(given["deviation_mm"], lambda value: error_mm(value, "the deviation of a structure")),
        _optional(given["has_inside"], lambda value: _flag(value, "whether a structure has an inside")),
        frame,
        _optional(given.get("colour"), lambda value: _matching(value, re.compile(COLOUR), "the colour of a structure")),
        _notes(given.get("notes", ())),
    )


def _provenance(item: Any) -> Provenance:
    given = _fields(item, Provenance, "the provenance of a structure")
    origin: StructureOrigin = _one_of(given["origin"], get_args(StructureOrigin), "the origin of a structure")
    return Provenance(
        origin,
        _optional(given.get("threshold_hu"), _level),
        _optional(given.get("label"), lambda value: _count(value, "the label of a structure")),
        _optional(given.get("voxel_mm"), _size_mm),
        _optional(given.get("made_of"), lambda value: _matching(value, _DIGEST, "what a structure is made of")),
    )


def _overlay(item: Any) -> Overlay:
    given = _fields(item, Overlay, "a volume laid over a case")
    return Overlay(
        check_id(given["id"], "a volume laid over a case"),
        check_stored_label(given["name"], "name of a volume"),
        _width(given["window"]),
        _level(given["level"]),
        _volume(given["volume"]),
        _notes(given.get("notes", ())),
    )


def _former_structures(surfaces: tuple[SurfaceInfo, ...], has_volume: bool) -> tuple[Structure, ...]:
    bone = next((one for one in surfaces if one.name == BONE), None)
    if bone is None:
        raise InputError("a head has a surface of its bone.")
    return (anatomy_structure("head", bone, bone.source, extracted_from(has_volume), None),)


# -- values


def error_mm(value: Any, what: str) -> float:
    """By how much a surface may be off, in mm: it only ever makes a margin larger. Raises InputError."""
    return _within(value, 0.0, MAX_ERROR_MM, what)


def _within(value: Any, low: float, high: float, what: str) -> float:
    found = number(value, what)
    if not low <= found <= high:
        raise InputError(f"{what} is {found:g}; allowed is {low:g} to {high:g}.")
    return found


def _size_mm(value: Any) -> float:
    what = "the spacing or thickness of a volume"
    found = _within(value, 0.0, FARTHEST_MM, what)
    if found == 0.0:
        raise InputError(f"{what} must be more than 0 mm.")
    return found


def _width(value: Any) -> float:
    found = _within(value, 0.0, MAX_HU, "the window of a volume")
    if found == 0.0:
        raise InputError("the window of a volume must have a width.")
    return found


def _level(value: Any) -> float:
    return _within(value, -MAX_HU, MAX_HU, "a grey value")


def _count(value: Any, what: str, least: int = 0) -> int:
    if type(value) is not int or not least <= value <= MAX_COUNT:
        raise InputError(f"{what} must be a whole number from {least} to {MAX_COUNT:,}.")
    return value


def _flag(value: Any, what: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{what} must be true or false.")
    return value


def _three(value: Any, what: str) -> tuple[Any, Any, Any]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise InputError(f"{what} must be three numbers.")
    return value[0], value[1], value[2]


def _corner(value: Any, what: str) -> Position:
    x, y, z = (_within(one, -4.0 * FARTHEST_MM, 4.0 * FARTHEST_MM, what) for one in _three(value, what))
    return x, y, z


def _bounds(value: Any, whose: str) -> Bounds:
    what = f"the bounds {whose}"
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise InputError(f"{what} must be two corners.")
    low, high = _corner(value[0], what), _corner(value[1], what)
    if any(a > b for a, b in zip(low, high, strict=True)):
        raise InputError(f"{what} are the wrong way round.")
    return low, high


def _matching(value: Any, pattern: re.Pattern[str], what: str) -> str:
    if not isinstance(value, str) or not pattern.fullmatch(value):
        raise InputError(f"{what} is not written as it should be.")
    return value


def _one_of(value: Any, choices: Collection[Any], what: str) -> Any:
    if not isinstance(value, str) or value not in choices:
        raise InputError(f"{what} is not known; it is one of: {', '.join(choices)}.")
    return value


def _optional(value: Any, read: Callable[[Any], _Item]) -> _Item | None:
    return None if value is None else read(value)


def _notes(value: Any) -> tuple[str, ...]:
    notes = _items(value, "notes", lambda note: note)
    if not all(isinstance(note, str) and len(note) <= MAX_NOTE for note in notes):
        raise InputError(f"the notes of a case are texts of up to {MAX_NOTE:,} characters.")
    return notes


def _items(value: Any, what: str, read: Callable[[Any], _Item]) -> tuple[_Item, ...]:
    if not isinstance(value, (list, tuple)) or len(value) > MAX_ITEMS:
        raise InputError(f"the {what} of a case are a list of up to {MAX_ITEMS:,}.")
    return tuple(read(item) for item in value)


def _fields(item: Any, kind: type[Any], what: str, also: Iterable[str] = ()) -> Mapping[str, Any]:
    """The item, where it has the fields of a dataclass: all without a default, and none that it does not know.

    also: fields that have a default and must be there all the same.
    """
    known = {one.name: one.default is MISSING and one.default_factory is MISSING for one in fields(kind)}
    needed = {name for name, must in known.items() if must} | set(also)
    if not isinstance(item, Mapping) or not needed <= set(item) <= set(known):
        raise InputError(f"{what} has {', '.join(known)}; one of them is missing, or another one is there.")
    return item
