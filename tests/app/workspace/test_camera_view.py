"""The standard views of a client's scene."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from app.scene.camera import CameraPose
from app.workspace.camera_view import CameraView

CENTRE, RADIUS = np.array([1.0, -20.0, 30.0]), 120.0


def test_a_near_view_of_nothing_stays_outside_the_head() -> None:
    """A rehearsal of an empty plan has no position to show: as far away as a view of the whole head."""
    seen: list[CameraPose] = []
    labels = SimpleNamespace(leave_to_page=lambda by_page: None)
    scene: Any = SimpleNamespace(look_from=seen.append, lens=None, labels=labels)
    view = CameraView(SimpleNamespace(extent=lambda: (CENTRE, RADIUS)))  # type: ignore[arg-type]
    view.attach(scene)
    for name in ("nose", "anterior"):
        view.look_from(name)
    view.places = lambda: [(0.0, -90.0, 0.0), (0.0, -60.0, 5.0)]
    view.look_from("nose")
    empty, whole, near = (float(np.linalg.norm(pose.position - pose.look_at)) for pose in seen)
    assert empty == whole > near
