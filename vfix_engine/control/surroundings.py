"""What is near the tool: a coherent view of the anatomy that follows it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry.capsules import Segments
from ..geometry.proximity import CandidateList, Pairs, ProximityTree, reduce_pairs
from .settings import ControlSettings

# Nearer to the margin than this every triangle gives its own pair. A grouped pair lies on an inflated box, nearer than
# bone: it must be too far away to hold the tool in one step.
EXACT_BEYOND_MARGIN_MM = 0.7
SLACK_MM = 0.75  # how far the tool may move before the candidates are gathered anew


class Surroundings:
    """Queries around one tool among one anatomy.

    Rows of the boundary come from the covariance tree, far flat patches grouped (Li 2007, III.D.2).
    Verdicts come from exact triangles: those that can matter are kept until the tool has moved out of their validity.
    The kept list is a cache only; answers are exact for every pose, whatever was asked before.
    """

    def __init__(self, tree: ProximityTree, settings: ControlSettings):
        self._tree, self._threshold = tree, settings.reach_mm
        self._margins = np.array([settings.margin_mm])
        self._group_flat = settings.group_flat_mm if settings.group_flat_mm > 0.0 else None
        self._exact_within = settings.margin_mm + EXACT_BEYOND_MARGIN_MM
        self._candidates: CandidateList | None = None

    def pairs(self, segments: Segments) -> Pairs:
        """The pairs within the threshold that say something of their own, nearest first."""
        found = self._tree.pairs_within(
            segments, self._threshold, group_flat=self._group_flat, exact_within=self._exact_within
        )
        return reduce_pairs(found)

    @property
    def margins(self) -> NDArray[np.float64]:
        """Margin (B,) of every body in mm."""
        return self._margins

    def distances(self, segments: Segments) -> NDArray[np.float64]:
        """Smallest distance (B, S) of every segment's surface to every body; no more than the threshold is told."""
        if self._candidates is None or not self._candidates.valid_for(segments, self._threshold):
            self._candidates = self._tree.candidates(segments, self._threshold + SLACK_MM)
        return np.minimum(self._candidates.min_distance_per_segment(segments), self._threshold)[None, :]
