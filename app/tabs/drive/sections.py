"""Sections of the Drive tab."""

from __future__ import annotations

from typing import TypedDict

from app.drives.sections import DetailsSection, DriveSection
from app.workspace.sections import ScopeSection


class LinkView(TypedDict):
    """The link that is nearest to its bound: its number from the base, deviation and bound in mm."""

    link: int
    deviation_mm: float
    bound_mm: float


class SnakeView(TypedDict):
    """Figures of the snake robot. depth_mm: of the tip along the pathway.

    nearest: the link nearest to its bound, None while none is inside. bend: r of the bending links, 1 where they bend
    no further; straight: they have the pathway's shape. can_look: the camera can be moved. doing: a request under way.
    insertion_mm_per_s, camera_mm_per_s: speeds of an axis that is fully deflected. breathing_mm: 0 where it is still.
    """

    depth_mm: float
    length_mm: float
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


class LumenDriveSections(TypedDict):
    """The drive of the open route, its figures, and its endoscope."""

    rehearsal: DriveSection
    details: DetailsSection
    snake: SnakeView | None
    scope: ScopeSection | None
