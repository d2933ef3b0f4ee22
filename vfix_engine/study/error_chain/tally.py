"""The figures of a drive in the true frame, snapshot by snapshot."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...worlds.rigid.scene import Scene
from ...worlds.rigid.system import ON_PATH_MM
from .chain import ErrorChain
from .true_tool import TrueTool, Truth, sample_of

PATH_WINDOW_MM = (
    5.0  # the nearest point of the path is searched this far from the believed one, and the difference more
)
SAME_MM = 1e-9  # a tool that is displaced by less was displaced by rounding


class TruthTally:
    """Follows a drive and counts where its tool truly was.

    scene, margin_mm: of the drive; the margin is what the certificate keeps to bone.
    on_robot: False for a free hand.
    """

    def __init__(self, chain: ErrorChain, scene: Scene, margin_mm: float, on_robot: bool = True):
        self._scene, self._margin_mm, self._on_robot = scene, margin_mm, on_robot
        self._tool = TrueTool(chain, scene.tool, scene.placed_robot() if on_robot else None)
        self.chain = chain
        self._errors: list[float] = []
        self._on_path, self._steps, self._below, self._inside = False, 0, 0, 0
        self._least, self._largest = np.inf, 0.0

    def add(self, snapshot: Any) -> Truth:
        """Count one snapshot of a rigid tool, and return its truth."""
        truth = self._tool.at(sample_of(snapshot, self._scene.tool))
        self._steps += 1
        self._largest = max(self._largest, truth.difference_mm)
        self._measure(snapshot, truth)
        if snapshot.mode == "free":
            self._errors.clear()  # without the fixture the path is no reference
        if self._counts(snapshot):
            self._errors.append(self._error(snapshot, truth))
        return truth

    def _counts(self, snapshot: Any) -> bool:
        """Whether the tip error of this snapshot counts: on the path, without the approach to it."""
        if not self._on_robot:
            return bool(snapshot.phase != "approach")
        self._on_path = snapshot.mode == "path" and (self._on_path or snapshot.tip_error_mm <= ON_PATH_MM)
        return self._on_path

    def _error(self, snapshot: Any, truth: Truth) -> float:
        path = self._scene.path
        if path is None or np.array_equal(truth.true, truth.believed):
            return float(snapshot.tip_error_mm)
        window = PATH_WINDOW_MM + truth.difference_mm
        nearest = path.closest(truth.true, float(snapshot.progress_mm), window)[1]
        return float(np.linalg.norm(nearest - truth.true))

    def _measure(self, snapshot: Any, truth: Truth) -> None:
        """The true clearance, exactly where it can be the least so far or below the margin."""
        reach = float(snapshot.threshold_mm)
        ends = snapshot.capsules[:, :3], snapshot.capsules[:, 3:6]
        moved = zip((truth.segments.start, truth.segments.end), ends, strict=True)
        apart = max(float(np.linalg.norm(new - old, axis=1).max()) for new, old in moved)
        self._least = min(self._least, reach)  # cut there
        found = float(snapshot.clearance_mm)
        if found - apart >= max(self._margin_mm, self._least):
            return
        if apart > SAME_MM:
            found = self._scene.tree.clearance(truth.segments, reach)
        self._least = min(self._least, found)
        self._below += found < self._margin_mm
        self._inside += found < 0.0

    def report(self) -> dict[str, Any]:
        """``error_chain``, ``true_error_mm`` {mean, max} or None where nothing followed a path, and ``truth``.

        truth: largest distance of both tips; least true clearance to bone, cut at the boundary threshold; and the
        steps whose true clearance was below the certificate's margin, and below 0.
        """
        error = {"mean": float(np.mean(self._errors)), "max": float(np.max(self._errors))} if self._errors else None
        truth = {
            "largest_difference_mm": self._largest,
            "min_true_clearance_mm": self._least if self._steps else None,
            "steps_below_margin": self._below,
            "steps_in_bone": self._inside,
        }
        return {"error_chain": self.chain.to_dict(), "true_error_mm": error, "truth": truth}
