"""The head: bone and skin with opacity and cut-away, CT planes, and the letters of the anatomical directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt
import trimesh
import viser

from app.scene import palette
from app.scene.labels import SceneLabels
from app.scene.picking import Cut
from vfix_engine.arrays import Array
from vfix_engine.geometry.mesh import TriangleMesh

if TYPE_CHECKING:
    from app.scene.view import SceneView


LETTER_GAP_MM = 14.0
LETTER_RISE = 0.5
AIR_GREY = 60  # darker pixels are air, drawn translucent so that the path and the tool behind show
AIR_ALPHA = 110
_LETTERS = {"R": (-1, 0, 0), "L": (1, 0, 0), "A": (0, -1, 0), "P": (0, 1, 0), "I": (0, 0, -1), "S": (0, 0, 1)}


@dataclass(frozen=True)
class Look:
    """How the head is shown."""

    opacity: float = 1.0
    cut: Cut = "whole"
    cut_at: float = 0.0  # [mm] x of the cut
    slices: str = "none"  # 'none', an axis, or 'all'
    skin: bool = False
    skin_opacity: float = 0.5


@dataclass(frozen=True)
class SlicePicture:
    """A CT slice for the scene: a grey image and the transform of its pixel centres."""

    axis: str
    image: npt.NDArray[np.uint8]  # (h, w)
    transform_pixel_to_lps: Array  # (4, 4)


class SurfaceNode:
    """A surface of the head as one mesh; a cut replaces its geometry, opacity and visibility are only properties."""

    name: ClassVar[str]

    def __init__(self, scene: viser.SceneApi, mesh: TriangleMesh, colour: tuple[int, int, int]) -> None:
        self.colour = colour
        self._surface = trimesh.Trimesh(vertices=mesh.vertices, faces=mesh.faces, process=False, validate=False)
        self._scene = scene
        self._geometry: tuple[Cut, float] = ("whole", 0.0)
        self._opacity = 1.0
        self._node = self._add(self._surface)

    def _add(self, surface: trimesh.Trimesh) -> viser.MeshHandle:
        return self._scene.add_mesh_simple(
            self.name,
            np.asarray(surface.vertices, dtype=np.float32),
            np.asarray(surface.faces, dtype=np.uint32),
            color=self.colour,
            opacity=None if self._opacity >= 1.0 else self._opacity,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _show(self, look: Look, opacity: float) -> None:
        geometry = (look.cut, 0.0 if look.cut == "whole" else round(look.cut_at, 2))
        if geometry != self._geometry:
            self._geometry, self._opacity = geometry, opacity
            self._node = self._add(self._cut(*geometry))
        elif opacity != self._opacity:
            self._opacity = opacity
            self._node.opacity = None if opacity >= 1.0 else opacity

    def _cut(self, cut: Cut, cut_at: float) -> trimesh.Trimesh:
        if cut == "whole":
            return self._surface
        # the named half is removed
        normal = [-1.0, 0.0, 0.0] if cut == "left" else [1.0, 0.0, 0.0]
        vertices, faces, _ = trimesh.intersections.slice_faces_plane(
            self._surface.vertices, self._surface.faces, normal, [cut_at, 0.0, 0.0]
        )
        return trimesh.Trimesh(vertices, faces, process=False, validate=False) if len(faces) else self._surface

    def remove(self) -> None:
        self._node.remove()


class BoneNode(SurfaceNode):
    """The bone of a head, or the wall of a lumen."""

    name = "/head/bone"

    def show(self, look: Look) -> None:
        self._show(look, look.opacity)


class SkinNode(SurfaceNode):
    """The skin; the page draws it after everything that it covers, see `see-through.js`."""

    name = "/head/skin"

    def __init__(self, scene: viser.SceneApi, mesh: TriangleMesh) -> None:
        super().__init__(scene, mesh, palette.SKIN)

    def show(self, look: Look) -> None:
        if look.skin:
            self._show(look, look.skin_opacity)
        if self._node.visible != look.skin:
            self._node.visible = look.skin


class AnatomyNodes:
    """A case's anatomy and the letters around it."""

    def __init__(self, view: SceneView, mesh: TriangleMesh, bounds: Array, colour: tuple[int, int, int]) -> None:
        """bounds: (2, 3), LPS mm."""
        self._bone = BoneNode(view.scene, mesh, colour)
        self._letters = LetterNodes(view.labels, bounds)

    def show(self, look: Look) -> None:
        self._bone.show(look)

    def remove(self) -> None:
        self._bone.remove()
        self._letters.remove()


class SliceNodes:
    """The three CT planes in the scene."""

    def __init__(self, view: SceneView) -> None:
        self._scene = view.scene
        self._nodes: dict[str, viser.ImageHandle] = {}
        self._shapes: dict[str, tuple[int, ...]] = {}

    def show(self, pictures: list[SlicePicture]) -> None:
        shown = {picture.axis for picture in pictures}
        for axis, node in self._nodes.items():
            if axis not in shown:
                node.visible = False
        for picture in pictures:
            self._place(picture)

    def _place(self, picture: SlicePicture) -> None:
        rows, columns = picture.image.shape
        affine = picture.transform_pixel_to_lps
        u, v = affine[:3, 0], affine[:3, 1]
        centre = affine[:3, :3] @ np.array([(columns - 1) / 2.0, (rows - 1) / 2.0, 0.0]) + affine[:3, 3]
        x, y = u / np.linalg.norm(u), v / np.linalg.norm(v)
        # viser's image lies in its x-y plane, with x to the right and y down
        rotation = np.stack([x, y, np.cross(x, y)], axis=-1)
        wxyz = trimesh.transformations.quaternion_from_matrix(rotation)
        image = np.repeat(picture.image[:, :, None], 4, axis=2)
        image[:, :, 3] = np.where(picture.image < AIR_GREY, AIR_ALPHA, 255)
        node = self._nodes.get(picture.axis)
        if node is None or self._shapes[picture.axis] != picture.image.shape:
            node = self._scene.add_image(
                f"/head/slice_{picture.axis}",
                image,
                float(columns * np.linalg.norm(u)),
                float(rows * np.linalg.norm(v)),
                format="png",
                cast_shadow=False,
                receive_shadow=False,
                wxyz=wxyz,
                position=centre,
            )
            self._nodes[picture.axis], self._shapes[picture.axis] = node, picture.image.shape
            return
        node.image = image
        node.position = centre
        node.visible = True

    def remove(self) -> None:
        for node in self._nodes.values():
            node.remove()


class LetterNodes:
    """R L A P I S around the head."""

    def __init__(self, labels: SceneLabels, bounds: Array) -> None:
        centre, half = bounds.mean(axis=0), (bounds[1] - bounds[0]) / 2.0
        rise = np.array([0.0, 0.0, LETTER_RISE * half[2]])  # keeps the letters away from the middle of the face
        self._nodes = [
            labels.add(
                f"/head/letter_{letter}",
                letter,
                "letter",
                position=centre + np.array(side) * (half + LETTER_GAP_MM) + (rise if side[2] == 0 else 0.0),
                font_screen_scale=1.1,
                anchor="center-center",
                depth_test=True,
            )
            for letter, side in _LETTERS.items()
        ]

    def remove(self) -> None:
        for node in self._nodes:
            node.remove()
