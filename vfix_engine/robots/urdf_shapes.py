"""Visual shapes of a URDF, only for display: they are not obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..arrays import Array
from ..errors import RobotError
from .local_path import local_path
from .urdf_numbers import MAX_LENGTH_M, MM_PER_M, numbers, read_origin, short
from .xml_reader import Element

Colour = tuple[int, int, int]

GREY = (150, 157, 168)


@dataclass(frozen=True, eq=False)
class UrdfShape:
    """kind, size and file as in ``Visual``; origin: transform_shape_to_link (4, 4) in mm."""

    kind: str
    size: tuple[float, float, float]
    origin: Array
    colour: Colour
    file: Path | None = None


def check_file_names(robot: Element, folder: Path) -> None:
    """Raise RobotError for a file name anywhere in the document that points outside its folder (HAZ-19)."""
    waiting = [(robot, "the robot")]
    while waiting:
        element, where = waiting.pop()
        if element.tag in ("link", "material"):
            where = f"{element.tag} '{short(element.attributes.get('name', ''))}'"
        if element.tag in ("mesh", "texture"):
            try:
                local_path(folder, element.attributes.get("filename", ""))
            except RobotError as error:
                hint = f"put the file beside the URDF, or take this <{element.tag}> out; no distance is measured to it"
                raise RobotError(f"{where}: {error}; {hint}") from error
        waiting.extend((child, where) for child in element.children)


def materials(robot: Element) -> dict[str, Colour]:
    """Colours of the materials defined at the top of the robot."""
    found = {}
    for element in robot.all("material"):
        colour = _colour(element)
        if colour is not None:
            found[element.attributes.get("name", "")] = colour
    return found


def read_shapes(link: Element, name: str, folder: Path, colours: dict[str, Colour]) -> tuple[UrdfShape, ...]:
    """The shapes of one link's <visual> elements."""
    shapes = []
    for visual in link.all("visual"):
        where = f"link '{name}': visual"
        geometry = visual.first("geometry")
        if geometry is None or len(geometry.children) != 1:
            raise RobotError(f"{where} must have one geometry of one shape")
        kind, size, file = _geometry(geometry.children[0], where, folder)
        material = visual.first("material")
        colour = None if material is None else _colour(material) or colours.get(material.attributes.get("name", ""))
        shapes.append(UrdfShape(kind, size, read_origin(visual, where), colour or GREY, file))
    return tuple(shapes)


def _geometry(shape: Element, where: str, folder: Path) -> tuple[str, tuple[float, float, float], Path | None]:
    def sizes(key: str, count: int) -> list[float]:
        values = numbers(shape.attributes.get(key, ""), count, f"{where}: {key}", MAX_LENGTH_M)
        if min(values) <= 0:
            raise RobotError(f"{where}: {key} must be positive")
        return [MM_PER_M * value for value in values]

    if shape.tag == "box":
        x, y, z = sizes("size", 3)
        return "box", (x, y, z), None
    if shape.tag == "cylinder":
        return "cylinder", (sizes("radius", 1)[0], sizes("length", 1)[0], 0.0), None
    if shape.tag == "sphere":
        return "sphere", (sizes("radius", 1)[0], 0.0, 0.0), None
    if shape.tag == "mesh":
        x, y, z = (MM_PER_M * v for v in numbers(shape.attributes.get("scale", "1 1 1"), 3, f"{where}: scale", 1e6))
        if x * y * z == 0:
            raise RobotError(f"{where}: a scale of nothing")
        return "mesh", (x, y, z), local_path(folder, shape.attributes.get("filename", ""))
    raise RobotError(f"{where} has the shape <{short(shape.tag)}>, which is none of box, cylinder, sphere and mesh")


def _colour(material: Element) -> Colour | None:
    colour = material.first("color")
    if colour is None:
        return None
    red, green, blue, _ = numbers(colour.attributes.get("rgba", ""), 4, "a material's colour", 255.0)
    r, g, b = (min(max(round(255.0 * part), 0), 255) for part in (red, green, blue))
    return r, g, b
