"""Sections of the Drive tab."""

from __future__ import annotations

from typing import Literal, TypedDict

from app.drives.sections import DetailsSection, DriveSection
from app.workspace.sections import ScopeSection
from app.workspace.task_sections import TaskMomentView
from vfix_engine.worlds.snake.settings import Arm


class LinkView(TypedDict):
    """The link that is nearest to its bound: its number from the base, deviation and bound in mm."""

    link: int
    deviation_mm: float
    bound_mm: float


class LinkValuesView(TypedDict):
    """Of one distal link: b_i, None by the route, a_i and k_i."""

    bound_mm: float | None
    threshold_mm: float
    spring_n_per_mm: float


class DriveOptionsView(TypedDict):
    """What is chosen for the drive that is there, or comes next. links: the distal ones, the last one last.

    open: this client may choose.
    """

    arm: Arm
    preset: Literal["kwok2013"] | None
    links: list[LinkValuesView]
    open: bool


class BehindWallView(TypedDict):
    """How much of the pathway's surface is behind the wall, and how deep at most: so deep can a certified link be.

    bound_mm: by how much deeper, the largest bound of any link; between_mm: by how much between the
        vertices at which it is measured.
    """

    share: float
    depth_mm: float
    bound_mm: float
    between_mm: float


class DeepestLinkView(TypedDict):
    """The link that is deepest behind the wall, by its number from the base, and its bound; 0 mm, 0 and None where none
    is.
    """

    depth_mm: float
    link: int
    bound_mm: float | None


class SnakeView(TypedDict):
    """Figures of the snake robot. depth_mm: of the tip along its way; passed: the last landmark behind it, '' for
    none.

    nearest: the link nearest to its bound, None while none is inside. bend: r of the bending links, 1 where they bend
    no further; straight: they have the pathway's shape. can_look: the camera can be moved. doing: a request under way.
    insertion_mm_per_s, camera_mm_per_s: speeds of an axis that is fully deflected. breathing_mm: 0 where there is none.
    arm: of this drive; certified: in the arm of that name only. joint: that a manual hand turns, 1: the last.
    yield_mm_per_s_per_n: admittance by which a guided pull yields to the force, 0 in other arms.
    behind: of the pathway; deepest: of the links, None where the tissue moves. steered: the control has control
    bends; shown: whether this window shows them.
    lens_mm: from the lens to the wall, negative behind it; None where the tissue moves.
    fixed: the robot stands on a fixed base and bends; nothing is inserted.
    """

    depth_mm: float
    length_mm: float
    passed: str
    links: int
    links_inside: int
    nearest: LinkView | None
    bend: float
    straight: bool
    can_look: bool
    doing: str
    insertion_mm_per_s: float
    camera_mm_per_s: float
    breathing_mm: float
    arm: Arm
    certified: bool
    joint: int
    yield_mm_per_s_per_n: float
    behind: BehindWallView | None
    deepest: DeepestLinkView | None
    steered: bool
    shown: bool
    lens_mm: float | None
    fixed: bool


class DriveTaskView(TaskMomentView):
    """The task that is chosen for the drive that is there, or comes next; None for none.

    offered: what can be done in this case. marks: polyps of the route, which may be the task's. open: this client may
    choose.
    """

    offered: list[Literal["polyps", "labels"]]
    task: Literal["polyps", "labels"] | None
    places: Literal["seed", "route"]
    seed: int
    marks: int
    open: bool


class LumenDriveSections(TypedDict):
    """The drive of the open route, its figures, and its endoscope."""

    rehearsal: DriveSection
    details: DetailsSection
    snake: SnakeView | None
    drive_options: DriveOptionsView
    drive_task: DriveTaskView
    scope: ScopeSection | None
