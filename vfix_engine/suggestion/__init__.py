"""Suggestion of paths for a rigid tool from an entry to a target, from distance fields, evaluated by dry runs.

The widest route of the tip is found first, then orientations of the shaft along it are ranked by bone and soft tissue;
the best few are simulated with the controller. docs/concepts.md describes the search.
"""

from .room import Passage, Room
from .shafts import Ranking, ranked_shafts
from .suggest import RANKINGS, Alternative, NoWay, SearchSpace, Suggestion, best_drives, drive_plan, suggest_path
from .way import LONGEST_MM, TipWay, smoothed, widest_way

__all__ = [
    "LONGEST_MM",
    "RANKINGS",
    "Alternative",
    "NoWay",
    "Passage",
    "Ranking",
    "Room",
    "SearchSpace",
    "Suggestion",
    "TipWay",
    "best_drives",
    "drive_plan",
    "ranked_shafts",
    "smoothed",
    "suggest_path",
    "widest_way",
]
