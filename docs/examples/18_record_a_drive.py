"""Record a drive, read it with numpy alone, and replay it: every row is equal bit by bit."""

import json
import tempfile
from pathlib import Path

import numpy as np

from vfix_engine.robots.snake import SnakeModel
from vfix_engine.runtime import Command, Driver, InlineWorker, Run, RunWriter
from vfix_engine.runtime.replay import replay
from vfix_engine.worlds.registry import spec_of
from vfix_engine.worlds.snake import LumenContours, SnakeSystemSpec

angle = np.linspace(0.0, 2.2, 61)
centre = 130.0 * np.column_stack([1.0 - np.cos(angle), 0.0 * angle, np.sin(angle)])  # mm, LPS
spec = SnakeSystemSpec(LumenContours(centre, np.full((61, 1), 13.0)), SnakeModel(6), tip_s=140.0)

with tempfile.TemporaryDirectory() as folder:
    system, file = spec.build(), Path(folder) / "drive.run"
    log = RunWriter(file, spec, system.row_layout)
    driver = Driver(system, InlineWorker(spec.worker(), age_steps=20), log)  # plans are 20 steps old, on any machine
    for axes in [(0.0, 0.0, 1.0)] * 300 + [(1.0, 0.3, 0.0)] * 500:  # in, then the camera to the right
        driver.step(Command(np.zeros(3), axes=axes))
    log.close()

    columns = [name for name, unit in json.loads((file / "manifest.json").read_text())["columns"]]
    ticks = np.fromfile(file / "ticks.f64", dtype="<f8").reshape(-1, len(columns))
    tip, beyond = ticks[:, columns.index("tip_s")], ticks[:, columns.index("beyond_bound")]

    run = Run.read(file)
    again = replay(run, spec_of(run))  # another process would do as well

print(f"{len(ticks)} steps, {tip[0]:.1f} to {tip[-1]:.1f} mm, no link nearer to its bound than {-beyond.max():.1f} mm")
assert again.same
assert beyond.max() <= 0.0
assert tip[-1] > 141.0
