"""Rigid transforms in files: ITK's text format, as 3D Slicer and ANTs write it, and JSON. LPS, mm.

Direction
    A transform here maps a point of the moving frame to the fixed frame, as ``Registration.transform`` does. An ITK
    file contains the inverse: to resample a moving image ITK maps each point of the fixed image to the moving image. 3D
    Slicer follows that: the file of a linear transform contains 'from parent', from the node's parent, which is the
    fixed frame or the world, to what the node moves. So the transform is inverted once when it is written and once when
    it is read, and in 3D Slicer it moves the image (moving) to the patient (fixed). Point coordinates are LPS in the
    file; 3D Slicer displays the same matrix in RAS.

Several transforms
    Those of a `CompositeTransform`, as 3D Slicer writes a hardened chain, are composed as in ITK: x is mapped to
    T0(T1(… Tn(x))), so that the last one of the file is applied first
    (https://www.itk.org/Doxygen/html/classitk_1_1CompositeTransform.html). Their composition must be rigid. Several
    transforms without that heading are a list, e.g. of the images of a series, from which none can be selected.

Rounding
    Seventeen digits are written, so that the transform is reproduced to 1e-12. A file of six digits deviates from a
    rotation by about 1e-6; up to 1e-4 the nearest rotation is used, beyond that it is refused as a scale or a shear.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..frames import inverse
from ..json_text import parse_json
from ..validate import real_array, rigid_transform

JSON_SCHEMA = "vfix-transform/1"
LARGEST_BYTES = 1_000_000
MOVING_NAMES, FIXED_NAMES = ("moving", "image"), ("fixed", "patient", "base")  # names of the frames, in JSON
ROTATION_OFF = 1e-4  # tolerance of RᵀR − I, absolute

_MAGIC = "#Insight Transform File V1.0"
_KINDS = {  # number of parameters; those with a centre have it as fixed parameters
    "MatrixOffsetTransformBase": 12,
    "AffineTransform": 12,
    "Rigid3DTransform": 12,
    "Euler3DTransform": 6,
    "VersorRigid3DTransform": 6,
    "QuaternionRigidTransform": 7,
    "TranslationTransform": 3,
    "IdentityTransform": 0,
}
_WITHOUT_CENTRE = ("TranslationTransform", "IdentityTransform")
_NEXT = "#Transform "  # heading of each transform of a file, followed by its number
_COMPOSITE = "CompositeTransform_"
_DEFORMABLE = ("Spline", "DisplacementField", "DeformationField", "VelocityField", "Warp")  # parts of names


def write_transform(file: Path | str, transform: ArrayLike) -> None:
    """Write a transform from the moving to the fixed frame (4, 4) as `.tfm` or `.json`, by the file name.

    Raises:
        InputError: it is not rigid, or the suffix is another one.
    """
    path = Path(file)
    suffix = path.suffix.lower()
    if suffix not in (".tfm", ".txt", ".json"):
        raise InputError(f"a transform is written as .tfm or .json, not as '{path.suffix}'")
    path.write_text(json_text(transform) if suffix == ".json" else tfm_text(transform), encoding="utf-8")


def read_transform(file: Path | str) -> Array:
    """Read the transform from the moving to the fixed frame (4, 4) from a `.tfm` (or `.txt`) or `.json` file.

    Raises:
        InputError: another kind of file, or as ``transform_from_tfm`` and ``transform_from_json``.
    """
    path = Path(file)
    suffix = path.suffix.lower()
    if suffix in (".h5", ".hdf5", ".mat"):
        raise InputError(f"'{suffix}' transforms are not read; save the transform as text, .tfm")
    if suffix not in (".tfm", ".txt", ".json"):
        raise InputError(f"a transform is read from .tfm, .txt or .json, not from '{suffix}'")
    if path.stat().st_size > LARGEST_BYTES:
        raise InputError("the file is too large for a transform; a rigid one has a few hundred characters")
    text = path.read_text(encoding="utf-8", errors="replace")
    return transform_from_json(text) if suffix == ".json" else transform_from_tfm(text)


def tfm_text(transform: ArrayLike, comments: Sequence[str] = ()) -> str:
    """Format an ITK file, an `AffineTransform_double_3_3` about the origin; see above for its direction.

    Args:
        transform: (4, 4), from the moving to the fixed frame, in mm.
        comments: lines below the first one, which readers ignore.

    Raises:
        InputError: the transform is not rigid, or a comment has more than one line.
    """
    back = inverse(transform)
    if any(len(comment.splitlines()) > 1 for comment in comments):
        raise InputError("a comment of a transform is one line; give several")
    told = "".join(f"# {comment.strip()}\n" for comment in comments)
    numbers = " ".join(f"{value:.17g}" for value in [*back[:3, :3].ravel(), *back[:3, 3]])
    return (
        f"{_MAGIC}\n{told}#Transform 0\nTransform: AffineTransform_double_3_3\nParameters: {numbers}\n"
        "FixedParameters: 0 0 0\n"
    )


def transform_from_tfm(text: str) -> Array:
    """Parse the transform from the moving to the fixed frame (4, 4) from an ITK file; see above for its direction.

    Supported are affine and matrix-offset transforms that are rigid, Euler (both orders), versor, quaternion and
    translation transforms in three dimensions, about any centre, and compositions of them.

    Raises:
        InputError: not an ITK text file, several transforms that are not composed, a deformable or unknown kind, wrong
            numbers, a missing centre, a reflection, scale or shear, or a truncated file.
    """
    forth = np.eye(4)
    for kind, parameters, fixed in _transforms(text):
        one = np.eye(4)
        one[:3, :3], one[:3, 3] = _matrix_and_offset(kind, parameters, fixed)
        with np.errstate(over="ignore", invalid="ignore"):
            forth = forth @ one
    if not np.isfinite(forth).all():
        raise InputError("the composition of the file's transforms is not finite; save them anew")
    forth[:3, :3] = _rotation(forth[:3, :3])
    return inverse(forth)


def tfm_comments(text: str) -> list[tuple[str, str]]:
    """Parse comments of the form 'key: value', in their order, wherever they are; other comments are ignored.

    Raises InputError if it is not an ITK file.
    """
    found = []
    for line in _lines(text)[1:]:
        if not line.startswith("#") or line.startswith(_NEXT):
            continue
        key, colon, value = line.lstrip("#").partition(":")
        if colon:
            found.append((key.strip(), value.strip()))
    return found


def json_text(
    transform: ArrayLike, *, moving: str = "moving", fixed: str = "fixed", origin: Mapping[str, Any] | None = None
) -> str:
    """Format a transform as JSON: its rows, and its direction in words.

    Args:
        transform: (4, 4), from the moving to the fixed frame, in mm.
        moving, fixed: the frames' names: 'moving' or 'image', and 'fixed', 'patient' or 'base'.
        origin: further fields, which readers ignore.

    Raises:
        InputError: the transform is not rigid, or a frame has another name.
    """
    for name, known in ((moving, MOVING_NAMES), (fixed, FIXED_NAMES)):
        if name not in known:
            raise InputError(f"a frame of a transform is named {' or '.join(map(repr, known))}, not {name!r:.40}")
    rows = rigid_transform(transform, "the transform").tolist()
    content = {"schema": JSON_SCHEMA, "unit": "mm", "axes": "LPS", "from": moving, "to": fixed, "transform": rows}
    return json.dumps({**(origin or {}), **content}, indent=2) + "\n"


def transform_from_json(text: str) -> Array:
    """Parse the result of ``json_text``.

    Raises:
        InputError: not JSON, another schema, unit, frame or direction, or not rigid.
    """
    try:
        content: Any = parse_json(text)
    except ValueError as error:
        raise InputError(f"the file is not valid JSON: {error}; write it again") from error
    wanted = {"schema": (JSON_SCHEMA,), "unit": ("mm",), "axes": ("LPS",), "from": MOVING_NAMES, "to": FIXED_NAMES}
    if not isinstance(content, dict):
        raise InputError(f"a transform in JSON is an object with the schema {JSON_SCHEMA!r}")
    for name, values in wanted.items():
        if content.get(name) not in values:
            allowed = " or ".join(map(repr, values))
            raise InputError(f"a transform in JSON has {name} {allowed}, not {content.get(name)!r:.40}")
    return rigid_transform(real_array("the transform", content.get("transform", ())), "the transform")


def _transforms(text: str) -> list[tuple[str, list[float], list[float]]]:
    """Kind, parameters and fixed parameters of the file's only transform, or of the composed ones, in order."""
    blocks = _blocks(text)
    composed = bool(blocks) and blocks[0]["Transform"].startswith(_COMPOSITE)
    members = blocks[1:] if composed else blocks
    if not members or (len(members) > 1 and not composed):
        raise InputError(
            f"the file has {len(members)} transforms; give one with a single rigid one, or with a composite of rigid "
            "ones (in 3D Slicer: harden the transforms into one, and save that)"
        )
    return [_transform(block) for block in members]


def _blocks(text: str) -> list[dict[str, str]]:
    """Group the lines of each transform in the file by their names."""
    lines = _lines(text)
    if not text.endswith(("\n", "\r")):  # ITK ends every line; a truncated number would go unnoticed
        raise InputError("the file ends in the middle of a line: it was cut; save the transform again")
    if next((line for line in reversed(lines) if line), "").startswith(_NEXT):
        raise InputError("the file ends where its next transform begins: it was cut; save the transform again")
    blocks: list[dict[str, str]] = []
    for line in lines[1:]:
        name, colon, value = line.partition(":")
        if line.startswith("#") or not line:
            continue
        if not colon or name not in ("Transform", "Parameters", "FixedParameters"):
            raise InputError(f"the line {line!r:.60} does not belong into an ITK transform")
        if name == "Transform":
            blocks.append({})
        elif not blocks or name in blocks[-1]:
            raise InputError(f"'{name}' has to stand once, below its transform's name")
        blocks[-1][name] = value.strip()
    return blocks


def _lines(text: str) -> list[str]:
    """Return the stripped lines of a file, after checking its first one."""
    lines = [line.strip() for line in text.lstrip("\ufeff").splitlines()]
    if not lines or not lines[0].startswith(_MAGIC):
        raise InputError(f"no ITK transform in text form: its first line is '{_MAGIC}'; save the transform as .tfm")
    return lines


def _transform(block: dict[str, str]) -> tuple[str, list[float], list[float]]:
    """Kind, parameters and fixed parameters of one transform, with its dimensions checked."""
    kind, *dimensions = block["Transform"].split("_")
    if any(part in kind for part in _DEFORMABLE):
        raise InputError(
            f"the file holds a {kind:.60}, which deforms; only a rigid transform can place a patient: register again "
            "without deformation"
        )
    if kind not in _KINDS:
        raise InputError(f"the transform is of the kind {kind!r:.60}, which is not rigid or not known")
    if dimensions not in (["double", "3", "3"], ["float", "3", "3"]):
        raise InputError(f"the transform {block['Transform']!r:.60} is not one of three dimensions")
    parameters = _numbers("Parameters", block)
    if len(parameters) != _KINDS[kind]:
        raise InputError(f"a {kind} has {_KINDS[kind]} parameters, not {len(parameters)}")
    return kind, parameters, _numbers("FixedParameters", block)


def _numbers(name: str, block: dict[str, str]) -> list[float]:
    text = block.get(name, "")
    try:
        if "_" in text or not text.isascii():  # which Python accepts within a number
            raise ValueError(text)
        values = [float(word) for word in text.split()]
    except ValueError as error:
        raise InputError(f"'{name}' of the transform are not numbers") from error
    if not all(math.isfinite(value) for value in values):
        raise InputError(f"'{name}' of the transform are not finite")
    return values


def _matrix_and_offset(kind: str, parameters: Sequence[float], fixed: Sequence[float]) -> tuple[Array, Array]:
    """Matrix M (3, 3) and offset (3,) of x → M x + offset; the offset is t + c − M c about a centre c, as in ITK."""
    if kind in _WITHOUT_CENTRE:
        return np.eye(3), np.array(parameters or np.zeros(3), dtype=np.float64)
    most = 4 if kind == "Euler3DTransform" else 3
    if len(fixed) not in (3, most):
        raise InputError(
            f"a {kind} has its centre as three fixed parameters, not {len(fixed)}; without it the place is open: save "
            "the transform again"
        )
    given, centre = np.array(parameters), np.array(fixed[:3])
    if kind == "Euler3DTransform":
        matrix = _euler(given[:3], zyx=len(fixed) == 4 and fixed[3] != 0.0)
    elif kind == "VersorRigid3DTransform":
        matrix = _versor(given[:3])
    elif kind == "QuaternionRigidTransform":
        matrix = _quaternion(given[:4])
    else:
        matrix = given[:9].reshape(3, 3)
    return matrix, given[-3:] + centre - matrix @ centre


def _euler(angles: Array, zyx: bool) -> Array:
    """Rotation by angles about x, y and z: Rz Rx Ry, or Rz Ry Rx if ``zyx``."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(angles), np.sin(angles)
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    rotation: Array = about_z @ about_y @ about_x if zyx else about_z @ about_x @ about_y
    return rotation


def _versor(vector: Array) -> Array:
    """Rotation of a unit quaternion by its vector part (3,)."""
    size = float(vector @ vector)
    if size > 1.0 + 1e-9:
        raise InputError("the versor of the transform is longer than 1; it is no rotation")
    return _quaternion(np.append(vector, math.sqrt(max(1.0 - size, 0.0))))


def _quaternion(quaternion: Array) -> Array:
    """Rotation of a quaternion (x, y, z, w) of length 1."""
    size = float(np.linalg.norm(quaternion))
    if abs(size - 1.0) > ROTATION_OFF:
        raise InputError("the quaternion of the transform is not of length 1; it is no rotation")
    x, y, z, w = quaternion / size
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: Array = np.eye(3) + 2.0 * w * cross + 2.0 * (cross @ cross)
    return rotation


def _rotation(matrix: Array) -> Array:
    """Return the rotation nearest to a matrix that is a rotation up to rounding."""
    u, scales, vt = np.linalg.svd(matrix)
    if np.linalg.det(matrix) < 0.0:
        raise InputError("the transform is a mirror, not a motion; left and right would be swapped: export it as rigid")
    if np.abs(matrix.T @ matrix - np.eye(3)).max() > ROTATION_OFF:
        raise InputError(
            f"the transform scales or shears, by {scales.min():.6g} to {scales.max():.6g}; only a rigid one can place "
            "a patient: register again without scale"
        )
    rotation: Array = u @ vt
    return rotation
