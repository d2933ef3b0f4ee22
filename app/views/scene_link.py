"""Between a workspace and its scene: draws what changed since it was last drawn, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from app.scene import camera
from app.scene.anatomy import Look, SlicePicture
from app.scene.plan import PlanItem
from app.scene.view import SceneView
from app.steps.plan.edited_plan import Ghost
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import PlacedRobot
from vfix_engine.simulation.snapshot import Snapshot

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Head:
    """The head as it is drawn. key: what tells two heads apart."""

    key: str
    mesh: TriangleMesh
    bounds: Floats  # (2, 3) LPS [mm]


@dataclass(frozen=True)
class Picture:
    """Everything that a still scene shows."""

    head: Head | None = None
    look: Look = field(default_factory=Look)
    slices_key: Any = None
    slices: Callable[[], list[SlicePicture]] = field(default=list, compare=False)
    items: tuple[PlanItem, ...] = ()
    selected: str | None = None
    locked: bool = False
    curve_key: Any = None
    curve: Callable[[], tuple[Floats | None, Floats | None]] = field(default=lambda: (None, None), compare=False)
    ghost: Ghost | None = None


class SceneLink:
    """Owns the view of one tab while its scene is connected."""

    def __init__(self, view: SceneView) -> None:
        self.view = view
        self._drawn = Picture()
        self._started = False
        self._rehearsed: Any = None

    def draw(self, wanted: Picture) -> None:
        drawn, view = self._drawn, self.view
        new_head = (wanted.head.key if wanted.head else None) != (drawn.head.key if drawn.head else None)
        if new_head or not self._started:
            drawn = Picture(look=wanted.look)
            if wanted.head is None:
                view.clear()
            else:
                view.show_head(wanted.head.mesh, wanted.head.bounds, wanted.look)
            self._rehearsed = None
            self._started = True
        if wanted.look != drawn.look:
            view.show_look(wanted.look)
        if wanted.slices_key != drawn.slices_key:
            view.show_slices(wanted.slices() if wanted.slices_key is not None else [])
        if (wanted.items, wanted.selected, wanted.locked) != (drawn.items, drawn.selected, drawn.locked):
            view.show_items(list(wanted.items), wanted.selected, wanted.locked)
        if wanted.curve_key != drawn.curve_key:
            view.show_curve(*wanted.curve())
        if wanted.ghost != drawn.ghost:
            ghost = wanted.ghost
            view.show_ghost(None if ghost is None else np.array(ghost.position), "" if ghost is None else ghost.words)
        self._drawn = wanted

    def draw_rehearsal(self, snapshot: Snapshot | None, robot: PlacedRobot | None, mine: bool) -> None:
        """Robot, tool and hand of a snapshot; None takes them out."""
        if snapshot is None or robot is None:
            self.view.hide_rehearsal()
            self._rehearsed = None
            return
        shown = (id(robot), snapshot.t, snapshot.steps, snapshot.mode, snapshot.running, mine, tuple(snapshot.force))
        if shown == self._rehearsed and not self.view.hand_moved():
            return  # a picture that stands still costs the browser nothing
        self._rehearsed = shown
        tool = (snapshot.segments_start, snapshot.segments_end, snapshot.radius)
        links = robot.link_placements(snapshot.q)
        self.view.show_rehearsal(robot.robot.visuals, links, tool, snapshot.grip, snapshot.force, mine)
        inspecting = snapshot.mode == "inspect"
        self.view.show_sight(snapshot.tip, snapshot.virtual_point if inspecting else None)
        self.view.show_blocked(snapshot.blocking_point if snapshot.held or snapshot.slowed else None)

    def look_from(self, name: str, centre: Floats, radius_mm: float) -> None:
        self.view.look_from(camera.standard_view(name, centre, radius_mm))
