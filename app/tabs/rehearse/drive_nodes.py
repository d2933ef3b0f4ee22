"""A drive in the scene: the robot, its tool, and the hand on the grip."""

from __future__ import annotations

from collections.abc import Sequence

from app.scene.floor import FloorNodes
from app.scene.hand import HandNodes
from app.scene.robot import RobotNodes, ToolNodes
from app.scene.view import SceneView
from vfix_engine.arrays import Array
from vfix_engine.robots import Visual


class DriveNodes:
    """Parts of a robot on their links, tool capsules, grip, force, virtual point and position of the obstacle."""

    def __init__(self, view: SceneView, visuals: Sequence[Visual]) -> None:
        self._view = view
        self._robot = RobotNodes(view.scene, visuals)
        self._tool = ToolNodes(view.scene)
        self._floor = FloorNodes(view.scene, visuals)
        self.hand = HandNodes(view.scene, view.labels, view.events.grip_dragged)

    def show(
        self, link_placements: Array | None, tool: tuple[Array, Array, Array], grip: Array, force: Array, mine: bool
    ) -> None:
        """Draw a state of the drive.

        link_placements (n, 4, 4): from links to the patient, mm; None without a robot. tool: starts, ends (S, 3) and
        radii (S,) of its capsules, LPS mm. grip (3,): LPS mm. force (3,): N. mine: this client controls the drive, so
        that its grip can be dragged.
        """
        with self._view.atomic():
            if link_placements is not None:
                self._robot.place(link_placements)
                self._floor.place(link_placements[0])
            self._tool.place(*tool)
            self.hand.show(grip, force, mine)
        self._view.flush()

    def remove(self) -> None:
        for part in (self._robot, self._tool, self._floor, self.hand):
            part.remove()
