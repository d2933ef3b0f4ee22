"""The robot and its tool in the scene: each part drawn once, then only moved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh
import viser

from app.scene import palette, shapes
from vfix_engine.arrays import Array
from vfix_engine.proximity.axes import rotation_z_to
from vfix_engine.robots import Visual


class RobotNodes:
    """Boxes, cylinders and balls that follow the links; visuals that are mesh files are omitted."""

    def __init__(self, scene: viser.SceneApi, visuals: Sequence[Visual]) -> None:
        self._visuals = tuple(visual for visual in visuals if visual.kind != "mesh")
        self._nodes = [self._add(scene, index, visual) for index, visual in enumerate(self._visuals)]

    def _add(self, scene: viser.SceneApi, index: int, visual: Visual) -> viser.MeshHandle:
        if visual.kind == "box":
            mesh = trimesh.creation.box(extents=visual.size)
        elif visual.kind == "sphere":
            mesh = trimesh.creation.icosphere(subdivisions=3, radius=visual.size[0])
        else:
            mesh = trimesh.creation.cylinder(radius=visual.size[0], height=visual.size[1], sections=32)
        return scene.add_mesh_simple(
            f"/robot/part_{index}",
            np.asarray(mesh.vertices),
            np.asarray(mesh.faces),
            color=visual.colour,
            flat_shading=visual.kind == "box",
            cast_shadow=False,
            receive_shadow=False,
        )

    def place(self, link_placements: Array) -> None:
        """Move every part to its link. link_placements (n, 4, 4): from links to the patient, mm."""
        for visual, node in zip(self._visuals, self._nodes, strict=True):
            placement = link_placements[visual.link]
            node.position = placement[:3, :3] @ np.array(visual.position) + placement[:3, 3]
            node.wxyz = shapes.quaternion(placement[:3, :3] @ visual.rotation)

    def remove(self) -> None:
        for node in self._nodes:
            node.remove()


class ToolNodes:
    """The tool as the controller sees it: capsules around axis segments."""

    def __init__(self, scene: viser.SceneApi, name: str = "/robot/tool", opacity: float | None = None) -> None:
        self._scene, self._name, self._opacity = scene, name, opacity
        self._nodes: list[tuple[float, float, viser.MeshHandle]] = []

    def place(self, start: Array, end: Array, radius: Array) -> None:
        """Move the capsules. start, end (S, 3): ends of their axes, LPS mm. radius (S,): mm."""
        lengths = np.linalg.norm(end - start, axis=1)
        while len(self._nodes) > len(start):
            self._nodes.pop()[2].remove()
        for index in range(len(start)):
            key = (round(float(radius[index]), 3), round(float(lengths[index]), 3))
            if index >= len(self._nodes):
                self._nodes.append((*key, self._add(index, *key)))
            elif self._nodes[index][:2] != key:
                self._nodes[index] = (*key, self._add(index, *key))
            node = self._nodes[index][2]
            node.position = start[index]
            node.wxyz = shapes.quaternion(rotation_z_to(end[index] - start[index]))

    def _add(self, index: int, radius: float, length: float) -> viser.MeshHandle:
        vertices, faces = shapes.capsule(radius, length)
        return self._scene.add_mesh_simple(
            f"{self._name}_{index}",
            vertices,
            faces,
            color=palette.TOOL,
            opacity=self._opacity,
            cast_shadow=False,
            receive_shadow=False,
        )

    def remove(self) -> None:
        for _, _, node in self._nodes:
            node.remove()
