"""A virtual fixture of your own: rows for one step, and a check of the predicted state.

This one keeps the tip behind a plane, which it comes near only as fast as it can still stop. The rows guide;
`is_admissible` is hard, so nothing that they miss gets through.
"""

from dataclasses import dataclass

import numpy as np
import trimesh

from vfix_engine import Simulation, TriangleMesh
from vfix_engine.virtual_fixtures import Constraint, Rows, Situation, StepState


@dataclass(frozen=True)
class BehindPlane:
    """z of the tip stays at or below a height in mm."""

    height: float

    def rows(self, now: Situation) -> Rows:
        jacobian = now.state.tip.jacobian[2:3]  # of the tip's z, over the joints
        matrix = np.column_stack([jacobian, np.zeros(1)])  # and nothing over the progress variable
        bound = now.stop_before(self.height - now.state.tip.position[2])  # the slack itself leaves no way to stop
        return Rows((), (Constraint("plane", matrix, bound, np.arange(1), ("the plane",)),))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        return bool(after.tip.position[2] <= max(self.height, before.tip.position[2]) + 1e-9)


tunnel = trimesh.creation.annulus(r_min=8.0, r_max=11.0, height=60.0).subdivide_to_size(3.0)
simulation = Simulation(
    TriangleMesh(tunnel.vertices, tunnel.faces), path=[[0, 0, -20], [0, 0, 20]], fixtures=[BehindPlane(-15.0)]
)
for _ in range(1500):
    now = simulation.step(drive=1)
print(f"the tip stands at z = {now.tip[2]:.4f} mm; {'held' if now.held else 'free'}: {now.reason}")
assert now.tip[2] <= -15.0 + 1e-9
assert "the plane" in simulation.active
assert now.emergencies == 0
