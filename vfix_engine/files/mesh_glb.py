"""Surfaces in binary glTF 2.0 (`.glb`): triangles with their nodes' transforms, from the file's own buffer.

https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html. Nothing outside the file is opened; materials, pictures and
animations are ignored.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.errors import MeshError
from vfix_engine.files.mesh_parts import MeshArrays
from vfix_engine.json_text import parse_json

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES = 4
_NO_SURFACE = (0, 1, 2, 3)  # points and lines
_MAX_NODES = 10_000
_NOT_READ = {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"}


def read_glb(data: bytes) -> MeshArrays:
    """Read vertices (n, 3) in the file's units and triangles (m, 3). Raises MeshError."""
    try:
        return _File(data).surface()
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, RecursionError, struct.error):
        raise MeshError("the GLB file is damaged or cut off.") from None


class _File:
    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2:
            raise MeshError("the file is not binary glTF 2.0 (.glb).")
        if length != len(data):
            why = "it is cut off or damaged" if length > len(data) else "something was added to it; save it again"
            raise MeshError(f"the GLB file claims {length:,} bytes, {len(data):,} are there; {why}.")
        chunks: dict[int, bytes] = {}
        at = 12
        while at + 8 <= len(data):
            size, kind = struct.unpack_from("<II", data, at)
            chunks.setdefault(kind, data[at + 8 : at + 8 + size])
            at += 8 + size
        self._json, self._bin = parse_json(chunks[_JSON]), chunks.get(_BIN, b"")
        if packed := _NOT_READ & set(self._json.get("extensionsRequired", ())):
            words = ", ".join(sorted(packed))
            raise MeshError(f"the GLB file is packed ({words}), which is not read; save it unpacked.")

    def surface(self) -> MeshArrays:
        vertices: list[npt.NDArray[Any]] = []
        faces: list[npt.NDArray[Any]] = []
        count = 0
        for mesh, transform in self._placed():
            for primitive in self._json["meshes"][mesh]["primitives"]:
                mode = primitive.get("mode", _TRIANGLES)
                if mode in _NO_SURFACE:
                    continue
                if mode != _TRIANGLES:
                    raise MeshError(
                        "the GLB file holds strips or fans of triangles, which are not read; save triangles."
                    )
                corners = self._accessor(primitive["attributes"]["POSITION"]).astype(np.float64)
                index = primitive.get("indices")
                named = np.arange(len(corners)) if index is None else self._accessor(index).ravel().astype(np.int64)
                turned = named.reshape(-1, 3)
                vertices.append(corners @ transform[:3, :3].T + transform[:3, 3])
                faces.append((turned[:, ::-1] if np.linalg.det(transform[:3, :3]) < 0 else turned) + count)
                count += len(corners)
        if not vertices:
            raise MeshError("the file holds no triangles.")
        return np.concatenate(vertices), np.concatenate(faces)

    def _placed(self) -> Iterator[tuple[int, npt.NDArray[np.float64]]]:
        """Iterate over the meshes of the scene with their transforms; over all meshes if there is no scene."""
        nodes = self._json.get("nodes", [])
        scenes = self._json.get("scenes", [])
        if not scenes:
            yield from ((number, np.eye(4)) for number in range(len(self._json.get("meshes", []))))
            return
        waiting = [(int(n), np.eye(4)) for n in scenes[self._json.get("scene", 0)].get("nodes", [])]
        seen = 0
        while waiting:
            number, above = waiting.pop()
            seen += 1
            if seen > _MAX_NODES:
                raise MeshError("the nodes of the GLB file form a circle, or are too many.")
            node = nodes[number]
            transform = above @ _local(node)
            if "mesh" in node:
                yield int(node["mesh"]), transform
            waiting += [(int(child), transform) for child in node.get("children", [])]

    def _accessor(self, number: int) -> npt.NDArray[Any]:
        accessor = self._json["accessors"][number]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise MeshError("the GLB file holds sparse arrays, which are not read; save it without.")
        view = self._json["bufferViews"][accessor["bufferView"]]
        if view["buffer"] != 0 or "uri" in self._json["buffers"][0]:
            raise MeshError("the GLB file names another file for its corners; save all in one file.")
        width, kind = _WIDTHS[accessor["type"]], np.dtype(_TYPES[accessor["componentType"]])
        count, start = int(accessor["count"]), int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        stride = int(view.get("byteStride") or width * kind.itemsize)
        if min(count - 1, start, stride - width * kind.itemsize) < 0:
            raise ValueError
        end = start + stride * (count - 1) + width * kind.itemsize
        if end > len(self._bin) or end > int(view.get("byteOffset", 0)) + int(view["byteLength"]):
            raise MeshError("the GLB file is cut off: it claims more corners or triangles than it has.")
        shape, strides = (count, width), (stride, kind.itemsize)
        return np.ndarray(shape, kind, self._bin, start, strides).copy()


def _local(node: dict[str, Any]) -> npt.NDArray[np.float64]:
    """Transform (4, 4) of a node: its matrix, stored by columns, or translation, rotation (x, y, z, w) and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = (float(value) for value in node.get("rotation", (0.0, 0.0, 0.0, 1.0)))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    transform = np.eye(4)
    transform[:3, :3] = rotation * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    transform[:3, 3] = np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=np.float64)
    return transform
