"""The pairs of the papers' covariance tree beside those of the product's tree (Li 2004, III; Li 2007, eq. 6-8)."""

from __future__ import annotations

from ...control import Controller
from ...proximity.covariance.tree import CovarianceTree
from ...virtual_fixtures import StepState

FLAT_MM = 3.0  # thickest box of a node, with its triangles, that is grouped: assumed, the papers print none


class CovarianceWatch:
    """Counts the pairs within the boundary threshold by both trees in every pose.

    A grouped node gives one pair on its box instead of one for each triangle; such pairs make rows, never the
    certificate, which needs exact distances.
    """

    def __init__(self, controller: Controller):
        self._tree = CovarianceTree(controller.tree.mesh)
        self._exact: list[int] = []
        self._grouped: list[int] = []
        self.differing = 0  # poses in which both trees find other pairs

    def watch(self, controller: Controller, state: StepState) -> None:
        """Count in one pose."""
        reach = controller.settings.reach_mm
        ours = controller.tree.pairs_within(state.segments, reach)
        theirs = self._tree.pairs_within(state.segments, reach)
        grouped = self._tree.pairs_within(state.segments, reach, group_flat=FLAT_MM)
        pairs = [sorted(zip(one.segment.tolist(), one.triangle.tolist(), strict=True)) for one in (ours, theirs)]
        self.differing += pairs[0] != pairs[1]
        self._exact.append(len(theirs))
        self._grouped.append(len(grouped))

    def report(self) -> dict[str, object]:
        """Poses, smallest and largest numbers of pairs, and in how many poses the pairs differ."""
        found: dict[str, object] = {
            "poses": len(self._exact),
            "poses_with_other_pairs": self.differing,
            "flat_mm": FLAT_MM,
        }
        for name, counts in (("pairs", self._exact), ("grouped_pairs", self._grouped)):
            found[name] = {"min": min(counts, default=0), "max": max(counts, default=0)}
        return found
