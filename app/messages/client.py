"""Who speaks: a page or an external program, and what it may do with a robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

ClientRole = Literal["holds", "instructs", "watches"]


@dataclass(frozen=True)
class Client:
    """A client of the planner.

    role: 'holds' may take a robot's handle and drive it. 'instructs' may not, but may change mode, target and settings
    of a robot that somebody else drives. 'watches' sees everything. Whoever is there may pause a robot.
    """

    id: str
    role: ClientRole = "watches"

    @property
    def may_hold(self) -> bool:
        return self.role == "holds"
