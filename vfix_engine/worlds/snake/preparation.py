"""Compilation of every kernel that a snake needs in the control process and in a scripted drive.

`python -m vfix_engine.worlds.snake.preparation drive` is its process; see ``kernels/preparation.py``.
"""

from __future__ import annotations

import sys

import numpy as np

from ...geometry.mesh import TriangleMesh
from ...kernels.preparation import compile_parts
from ...robots.snake import SnakeModel
from .offline.drive_lumen import drive_lumen
from .settings import DriveSettings
from .spec import LumenContours, SnakeSystemSpec


def _drive() -> None:
    """The control process's kernels, then those of a drive from a surface on."""
    line = np.column_stack([np.zeros((21, 2)), np.linspace(0.0, 200.0, 21)])
    spec = SnakeSystemSpec(LumenContours(line, np.full((21, 1), 12.0)), SnakeModel(3))
    spec.build().prepare()
    mesh = _tube()
    settings = DriveSettings(bound_mm=3.0, contours=12, interpolated=45, vertices_per_link=20)
    drive_lumen(mesh, (0.0, 0.0, 8.0), (0.0, 0.0, 190.0), 4, settings=settings)


def _tube() -> TriangleMesh:
    """A closed tube of 12 mm radius along z, 200 mm long."""
    around, along = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False), np.linspace(0.0, 200.0, 60)
    z, angle = np.meshgrid(along, around, indexing="ij")
    vertices = np.column_stack([12.0 * np.cos(angle).ravel(), 12.0 * np.sin(angle).ravel(), z.ravel()])
    i, j = (one.ravel() for one in np.meshgrid(np.arange(len(along) - 1), np.arange(24), indexing="ij"))
    a, b = i * 24 + j, i * 24 + (j + 1) % 24
    last, k = len(vertices) - 24, np.arange(24)
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 200.0]])
    floor = np.column_stack([np.full(24, len(vertices)), (k + 1) % 24, k])
    lid = np.column_stack([np.full(24, len(vertices) + 1), last + k, last + (k + 1) % 24])
    faces = np.concatenate([np.column_stack([a, b, a + 24]), np.column_stack([b, b + 24, a + 24]), floor, lid])
    return TriangleMesh(np.concatenate([vertices, ends]), faces.astype(np.int32))


if __name__ == "__main__":
    compile_parts(sys.argv[1:], {"drive": _drive})
