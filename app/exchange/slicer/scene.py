"""A scene of 3D Slicer: an XML index (.mrml) of nodes, each with its data file and display attributes.

Elements and attributes are named as 3D Slicer 5 writes them; see its documentation, "MRML Overview". The file of a
storage node is relative to the scene and percent-encoded. Slicer uses its defaults for missing attributes.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple
from urllib.parse import quote
from xml.sax.saxutils import quoteattr

from app.plans.model import NOTICE

NodeKind = Literal["Curve", "Fiducial", "Line", "Plane", "ROI", "Model", "Volume", "Transform"]
_VERSION = "Slicer 5.6.2"
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # not allowed in XML 1.0
_SLICES = ("Red", "Yellow", "Green")


class _Names(NamedTuple):
    """Element and class of a node, of its storage and of its display; '' if it has no display."""

    node: tuple[str, str]
    storage: tuple[str, str]
    display: tuple[str, str]


def _markup(kind: str, storage: str = "Markups", display: str = "Markups") -> _Names:
    return _Names(
        (f"Markups{kind}", f"vtkMRMLMarkups{kind}Node"),
        (f"{storage}JsonStorage", f"vtkMRML{storage}JsonStorageNode"),
        (f"{display}Display", f"vtkMRML{display}DisplayNode"),
    )


_NAMES: dict[NodeKind, _Names] = {
    "Curve": _markup("Curve"),
    "Line": _markup("Line"),
    "Fiducial": _markup("Fiducial", display="MarkupsFiducial"),
    "Plane": _markup("Plane", "MarkupsPlane", "MarkupsPlane"),
    "ROI": _markup("ROI", "MarkupsROI", "MarkupsROI"),
    "Model": _Names(
        ("Model", "vtkMRMLModelNode"),
        ("ModelStorage", "vtkMRMLModelStorageNode"),
        ("ModelDisplay", "vtkMRMLModelDisplayNode"),
    ),
    "Volume": _Names(
        ("Volume", "vtkMRMLScalarVolumeNode"),
        ("VolumeArchetypeStorage", "vtkMRMLVolumeArchetypeStorageNode"),
        ("VolumeDisplay", "vtkMRMLScalarVolumeDisplayNode"),
    ),
    "Transform": _Names(
        ("LinearTransform", "vtkMRMLLinearTransformNode"),
        ("TransformStorage", "vtkMRMLTransformStorageNode"),
        ("", ""),
    ),
}
_IN_LPS = {"coordinateSystem": "LPS"}  # of a file's positions; Slicer's own are RAS
_STORAGE: dict[NodeKind, dict[str, str]] = {
    "Model": _IN_LPS,
    "Volume": {"centerImage": "0", "UseOrientationFromFile": "1"},
    "Transform": {},
}


@dataclass(frozen=True)
class SceneNode:
    """A node of the scene: its name, its file in the folder of the scene, its colour '#rrggbb' and opacity.

    visible: whether it is shown when the scene is opened. description: text for the user. window: width and centre of
    the grey values of a volume. glyph_mm: diameter of a markup's points, and twice that of its lines; None for Slicer's
    own size, relative to the window. named: whether a markup's name is written next to it.
    """

    kind: NodeKind
    name: str
    file: str
    colour: str = "#cccccc"
    opacity: float = 1.0
    visible: bool = True
    description: str = ""
    window: tuple[float, float] | None = None
    glyph_mm: float | None = None
    named: bool = True


def scene_text(nodes: Sequence[SceneNode]) -> str:
    """Return the scene of these nodes as XML; the first volume is shown in the slices."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f"<!-- {NOTICE} -->"]
    lines.append(f'<MRML version="{_VERSION}" userTags="">')
    numbers: dict[str, int] = {}
    for node in nodes:
        lines += _elements(node, numbers)
    volume = next((node for node in nodes if node.kind == "Volume"), None)
    if volume is not None:
        lines += [_slice(colour, f"{_NAMES['Volume'].node[1]}1") for colour in _SLICES]
    return "\n".join([*lines, "</MRML>", ""])


def _elements(node: SceneNode, numbers: dict[str, int]) -> list[str]:
    """Return the elements of storage, display and node, in the order in which Slicer writes them."""
    names = _NAMES[node.kind]

    def new_id(class_name: str) -> str:
        numbers[class_name] = numbers.get(class_name, 0) + 1
        return f"{class_name}{numbers[class_name]}"

    storage = new_id(names.storage[1])
    stored = {"id": storage, "name": names.storage[0], "fileName": quote(node.file), "useCompression": "1"}
    found = [_element(names.storage[0], stored | _STORAGE.get(node.kind, _IN_LPS))]
    references = f"storage:{storage};"
    if names.display[0]:
        display = new_id(names.display[1])
        found.append(_element(names.display[0], {"id": display, "name": names.display[0], **_look(node)}))
        references = f"display:{display};{references}"
    own = {"id": new_id(names.node[1]), "name": node.name, "description": node.description or NOTICE}
    found.append(_element(names.node[0], own | {"selectable": "true", "references": references, "userTags": ""}))
    return found


def _look(node: SceneNode) -> dict[str, str]:
    """Return the attributes of a display node."""
    if node.kind == "Volume":
        look = {"colorNodeID": "vtkMRMLColorTableNodeGrey", "autoWindowLevel": "1" if node.window is None else "0"}
        if node.window is not None:
            look |= {"window": f"{node.window[0]:g}", "level": f"{node.window[1]:g}"}
        return look
    colour = " ".join(f"{int(node.colour[at : at + 2], 16) / 255:.6g}" for at in (1, 3, 5))
    shown = "true" if node.visible else "false"
    look = {"color": colour, "selectedColor": colour, "opacity": f"{node.opacity:g}", "visibility": shown}
    if node.kind == "Model":
        return look | {"visibility2D": "true", "sliceIntersectionThickness": "2", "backfaceCulling": "false"}
    look |= {"activeColor": colour, "propertiesLabelVisibility": "true" if node.named else "false"}
    look["occludedVisibility"] = "true"  # faintly through bone
    if node.glyph_mm is None:
        return look
    size = {"useGlyphScale": "false", "glyphSize": f"{node.glyph_mm:g}"}
    return look | size | {"curveLineSizeMode": "UseLineDiameter", "lineDiameter": f"{node.glyph_mm / 2.0:g}"}


def _slice(colour: str, volume: str) -> str:
    attributes = {
        "id": f"vtkMRMLSliceCompositeNode{colour}",
        "name": "SliceComposite",
        "singletonTag": colour,
        "layoutName": colour,
        "backgroundVolumeID": volume,
        "references": f"backgroundVolume:{volume};",
    }
    return _element("SliceComposite", attributes)


def _element(tag: str, attributes: dict[str, str]) -> str:
    # Slicer's reader drops line breaks in attributes, which a description may contain.
    words = " ".join(f"{name}={quoteattr(_xml_text(' '.join(value.split())))}" for name, value in attributes.items())
    return f" <{tag} {words}></{tag}>"


def _xml_text(text: str) -> str:
    """Replace characters not allowed in XML; a stored name may be older than the rule that refuses them."""
    return _NO_XML.sub("\ufffd", text)
