"""Swing the view about a point: target inspection.

The view is drawn onto the target at the hand's speed; then it stays there while the hand swings the tool about it.
"""

import trimesh

from vfix_engine import Simulation, TriangleMesh

tunnel = trimesh.creation.annulus(r_min=15.0, r_max=18.0, height=80.0).subdivide_to_size(4.0)
mesh = TriangleMesh(tunnel.vertices, tunnel.faces)
simulation = Simulation(mesh, path=[[0, 0, -20], [0, 0, 0]], targets=[[4.0, 2.0, 0.0]], tool="endoscope_30")
simulation.task("inspect", target=0)
while simulation.now.phase != "inspect_hold":
    simulation.step(drive=1)  # towards the target
before = simulation.q
off = [simulation.step(force=[1.0, 0.0, 0.0]).target_error_mm for _ in range(500)]  # N at the grip
turned = abs(simulation.q - before)[[3, 4, 6]].max()  # the revolute joints
print(f"the view stayed within {max(off):.4f} mm of the target while the tool turned {turned:.3f} rad")
assert max(off) <= simulation.rehearsal.settings.target_tolerance_mm
assert turned > 0.01
