"""In real time: a process with a clock of its own, hand input in, snapshots out."""

import time

import numpy as np
import trimesh

from vfix_engine import ControlSettings, Simulation, TriangleMesh
from vfix_engine.worlds.rigid.realtime import RehearsalProcess, SceneSpec

if __name__ == "__main__":  # the process starts this module anew
    tunnel = trimesh.creation.annulus(r_min=6.0, r_max=9.0, height=80.0).subdivide_to_size(3.0)
    path = np.array([[0.0, 0.0, -20.0], [0.0, 0.0, 20.0]])
    placed = Simulation(TriangleMesh(tunnel.vertices, tunnel.faces), path=path).rehearsal.scene
    spec = SceneSpec(
        tunnel.vertices, tunnel.faces, "steady_hand", "bent_30", placed.base, placed.q_start, path, np.zeros((0, 3)), ()
    )
    process = RehearsalProcess(spec, ControlSettings())
    process.start()
    try:
        process.wait_ready()
        process.run()
        for _ in range(20):
            process.drive(1)  # also the heartbeat: a hand that falls silent lets go within 0.1 s
            time.sleep(0.05)
        now = process.snapshot()
    finally:
        process.close()
    timing = now.timing
    print(f"{now.progress_mm:.1f} mm in a second, {timing.loop_hz:.0f} Hz, late by {timing.lateness_us_p50:.0f} µs")
    assert now.progress_mm > 1.0
