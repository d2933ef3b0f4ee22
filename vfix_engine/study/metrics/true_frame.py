"""The samples of a run in the true frame: the error chain over its rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ..error_chain import ErrorChain, Sample, TrueTool
from .samples import Samples, hand_on_robot


@dataclass(frozen=True, eq=False)
class TrueFrame:
    """The truth of every sample of ``Samples``; LPS, mm.

    believed, tip: (n, 3) tips; rotation: (n, 3, 3) true.
    clearance: (n,) of the true tool to the anatomy, cut at the boundary threshold.
    margin_mm: (n,) that the true tool keeps if the certificate covers its errors: without what is added for deflection.
    """

    believed: Array
    tip: Array
    rotation: Array
    clearance: Array
    margin_mm: Array

    def report(self) -> dict[str, Any]:
        """The figures beside the error, as ``TruthTally.report``."""
        return {
            "largest_difference_mm": float(np.linalg.norm(self.tip - self.believed, axis=1).max()),
            "min_true_clearance_mm": float(self.clearance.min()),
            "steps_below_margin": int((self.clearance < self.margin_mm).sum()),
            "steps_in_bone": int((self.clearance < 0.0).sum()),
        }


def true_frame(run: Run, spec: SystemSpec, samples: Samples, chain: ErrorChain) -> TrueFrame:
    """Follow the samples of a run with an error chain.

    spec: that the run was driven with. A hand is on the robot where no master drives it.
    """
    scene = spec.scene.build()  # type: ignore[attr-defined]  # samples_of has refused others
    on_robot = run.manifest["world"] != "freehand"
    follower = TrueTool(chain, scene.tool, scene.placed_robot() if on_robot else None)
    rows, held = run.rows[samples.first :], hand_on_robot(run)[samples.first :]
    at = {column.name: place for place, column in enumerate(run.columns)}
    joints = rows[:, [at[f"q{i}"] for i in range(len(scene.robot.joints))]] if on_robot else None
    found, clearance = [], samples.distance[:, 0].min(axis=1)
    for i, t in enumerate(samples.t.tolist()):
        sample = Sample(
            t,
            i + 1,
            None if joints is None else joints[i],
            samples.tip[i],
            samples.rotation[i],
            samples.force[i] if held[i] else None,
            samples.deflection[i],
        )
        truth = follower.at(sample)
        found.append((truth.believed, truth.true, truth.rotation))
        if not chain.empty:
            clearance[i] = scene.tree.clearance(truth.segments, samples.settings[i].reach_mm)
    believed, tip, rotation = (np.array(part) for part in zip(*found, strict=True))
    return TrueFrame(
        believed, tip, rotation, clearance, np.array([one.kept_mm - one.deflection_mm for one in samples.settings])
    )
