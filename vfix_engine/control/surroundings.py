"""What is near the tool: a coherent view of the anatomy that follows it."""

from __future__ import annotations

import numpy as np

from ..geometry.capsules import Segments
from ..geometry.proximity import CandidateList, Pairs, ProximityTree

SLACK_MM = 0.75  # how far the tool may move before the candidates are gathered anew


class Surroundings:
    """Queries around one tool; keeps the triangles that can matter until the tool has moved out of their validity.

    The kept list is a cache only: answers are exact for every pose, whatever was asked before.
    """

    def __init__(self, tree: ProximityTree, threshold_mm: float):
        self._tree, self._threshold = tree, threshold_mm
        self._candidates: CandidateList | None = None

    @property
    def threshold_mm(self) -> float:
        return self._threshold

    def pairs(self, segments: Segments) -> Pairs:
        """All exact pairs within the threshold."""
        return self._near(segments).pairs_within(segments, self._threshold)

    def clearance(self, segments: Segments) -> float:
        """Smallest distance from the tool's surface to the anatomy; no more than the threshold is told."""
        return min(self._near(segments).clearance(segments), self._threshold)

    def clearance_per_segment(self, segments: Segments) -> np.ndarray:
        """The same for every segment (S,)."""
        return np.minimum(self._near(segments).min_distance_per_segment(segments), self._threshold)

    def _near(self, segments: Segments) -> CandidateList:
        if self._candidates is None or not self._candidates.valid_for(segments, self._threshold):
            self._candidates = self._tree.candidates(segments, self._threshold + SLACK_MM)
        return self._candidates
