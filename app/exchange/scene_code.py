"""A scene as Python: the lines that set up the same head, robot, tool, path and protected structures in the library."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from app.plans.model import NOTICE
from vfix_engine.control import ControlSettings
from vfix_engine.errors import InputError
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Sphere
from vfix_engine.robots import RobotModel, Tool
from vfix_engine.virtual_fixtures import Zone
from vfix_engine.worlds.rigid.scene_parts import robot_parts, tool_parts
from vfix_engine.worlds.rigid.spec import SceneSpec

_SHAPES = (Box, CapsuleShape, HalfSpace, Sphere)
_IMPORTS = (
    "import numpy as np",
    "from vfix_engine.control import ControlSettings",
    "from vfix_engine.geometry.path import SplinePath",
    "from vfix_engine.geometry.shaft_directions import ShaftDirections",
    "from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Sphere",
    "from vfix_engine.robots import RobotModel, Tool",
    "from vfix_engine.virtual_fixtures import Zone",
    "from vfix_engine.worlds.rigid.scene import Scene",
)


@dataclass(frozen=True)
class SceneUse:
    """What stands about the lines of a scene.

    title: what the script sets up, of any characters. imports: of the lines below. head: lines that define `tree`, the
    proximity tree of the head. drive: lines that use `scene` and `settings`. known: expression for the same scene in
    the script, from which what has no line of its own is taken, such as a tool from a file; None: there is none.
    """

    title: str
    imports: tuple[str, ...]
    head: tuple[str, ...]
    drive: tuple[str, ...]
    known: str | None = None


def scene_code(use: SceneUse, scene: SceneSpec, settings: ControlSettings) -> str:
    """A script for the library. Raises InputError for a part without a line of its own where no scene is known."""
    code = "\n".join([*use.head, *_assignments(scene, settings, use.known), *use.drive])
    names = dict[str, list[str]]()
    for line in (*_IMPORTS, *use.imports):
        before, _, after = line.rpartition("import ")
        names.setdefault(before, []).extend(after.split(", "))
    lines = (f"{before}import {', '.join(sorted(set(after)))}" for before, after in names.items())
    wanted = {text for line in lines if (text := _used(line, code))}
    plain = sorted(line for line in wanted if line.startswith("import "))
    app, engine = (
        sorted(line for line in wanted if line.startswith(f"from {room}")) for room in ("app", "vfix_engine")
    )
    other = sorted(wanted - {*plain, *app, *engine})
    imports = "\n\n".join("\n".join(group) for group in ([*other], plain, [*app, *engine]) if group)
    return f"{_docstring(f'{use.title}. {NOTICE}.')}\n\n{imports}\n\n{code}\n"


def _docstring(text: str) -> str:
    """A literal of a text in three double quotes. Names come with files of others, and none may end the literal."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"""{"".join(one if one.isprintable() else ascii(one)[1:-1] for one in escaped)}"""'


def _used(line: str, code: str) -> str:
    """The import of the names that the code uses; '' if it uses none."""
    before, _, names = line.rpartition("import ")
    if not before:
        return line if "np." in code else ""
    used = [name for name in names.split(", ") if re.search(rf"\b{name}\b", code)]
    return f"{before}import {', '.join(used)}" if used else ""


def _assignments(scene: SceneSpec, settings: ControlSettings, known: str | None) -> list[str]:
    robot, tool, path = scene.robot_model(), scene.tool_itself(), scene.path_points
    lines = [
        f"robot = {_loaded(robot, robot_parts, known, 'robot_model()')}",
        f"tool = {_loaded(tool, tool_parts, known, 'tool_itself()')}",
        f"path = {'None' if path is None else f'SplinePath({_numbers(path)})'}",
        f"base = np.array({_numbers(scene.base)})",
        f"q_start = np.array({_numbers(scene.q_start)})",
        f"settings = ControlSettings({_changed(settings)})",
    ]
    named = {}
    if scene.zones:
        zones = [_zone(zone, place, known) for place, zone in enumerate(scene.zones)]
        lines.append(f"zones = {_block('(', zones, ')')}")
        named["zones"] = "zones"
    if len(scene.targets):
        lines.append(f"targets = np.array({_numbers(scene.targets)})")
        named |= {"targets": "targets", "target_names": f"tuple({_text(list(scene.target_names))})"}
    if scene.structure_names:
        named["structure_names"] = _text(dict(scene.structure_names))
    if scene.shaft is not None:
        stations, directions, rolls = (
            np.asarray(getattr(scene.shaft, name)) for name in ("stations", "directions", "rolls")
        )
        parts = [
            _numbers(stations),
            _indented(_numbers(directions)),
            *([] if np.isnan(rolls).all() else [_numbers(rolls)]),
        ]
        lines.append(f"shaft = ShaftDirections{_block('(', parts, ')')}")
        named["shaft"] = "shaft"
    for name, there in {"fixtures": bool(scene.fixtures), "printed": scene.printed is not None}.items():
        if there:
            named[name] = _from(known, name, f"the scene's {name}")
    if not scene.bent_inspection:
        named["bent_inspection"] = "False"
    given = ["tree, robot, tool, base, q_start, path", *(f"{name}={value}" for name, value in named.items())]
    return [*lines, f"scene = Scene{_block('(', given, ')')}"]


def _block(opening: str, parts: list[str], closing: str) -> str:
    """Parts in brackets, one a line."""
    return f"{opening}\n{''.join(f'    {part},{chr(10)}' for part in parts)}{closing}"


def _indented(text: str) -> str:
    return text.replace("\n", "\n    ")


def _loaded(thing: RobotModel | Tool, parts: Any, known: str | None, call: str) -> str:
    """A shipped robot or tool by its name, another one from the known scene."""
    kind = type(thing)
    try:
        shipped = parts(kind.load(thing.name)) == parts(thing)
    except InputError:
        shipped = False
    return (
        f"{kind.__name__}.load({_text(thing.name)})"
        if shipped
        else _from(known, call, f"the {kind.__name__} {thing.name!r:.60}")
    )


def _zone(zone: Zone, place: int, known: str | None) -> str:
    """A protected structure by its shape; a surface from the known scene."""
    solid: Any = zone.solid
    if isinstance(solid, _SHAPES):
        values = {field.name: getattr(solid, field.name) for field in fields(solid)}
        again = type(solid)(**values)
        if all(np.array_equal(getattr(again, name), value) for name, value in values.items()):
            numbers = [repr(np.asarray(value, dtype=np.float64).tolist()) for value in values.values()]
            shape = f"{type(solid).__name__}({', '.join(numbers)})"
            return f"Zone({_text(zone.name)}, {shape}, margin_mm={zone.margin_mm!r})"
    return _from(known, f"zones[{place}]", f"the surface of the protected structure {zone.name!r:.60}")


def _from(known: str | None, part: str, what: str) -> str:
    if known is None:
        raise InputError(
            f"{what} cannot be written in a line of Python; rehearse the plan and use `vfix run python` of that run"
        )
    return f"{known}.{part}"


def _text(value: Any) -> str:
    """A text, or texts in a list or dict, in double quotes; every escape of JSON is one of Python."""
    if isinstance(value, str):
        return "".join(one if one.isprintable() else ascii(one)[1:-1] for one in json.dumps(value, ensure_ascii=False))
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_text(key)}: {_text(one)}" for key, one in value.items()) + "}"
    return "[" + ", ".join(_text(one) for one in value) + "]"


def _numbers(value: Any) -> str:
    """Numbers that read back as the same bits; of a table one row a line."""
    array = np.asarray(value, dtype=np.float64)
    if array.ndim == 2:
        return _block("[", [_numbers(row) for row in array], "]")
    return repr(array.tolist()).replace("nan", "np.nan")


def _changed(settings: ControlSettings) -> str:
    """The settings that differ from the defaults, as keywords."""
    default: Mapping[str, Any] = ControlSettings().to_dict()
    return ", ".join(f"{name}={value!r}" for name, value in settings.to_dict().items() if value != default[name])
