"""One trial of study I by a simulated person: driven, recorded, and measured by the recorded run."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...geometry.mesh import TriangleMesh
from ...runtime.driver import Driver
from ...runtime.run import Run, RunWriter
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.stepping.state import SnakeState
from ..polyps.progress import PolypProgress
from ..polyps.series import polyp_series, task_note
from ..polyps.sight import LumenSight
from ..polyps.table import TableIII, beyond_bound_mm, table_iii
from ..polyps.task import PolypTask
from .endoscopist import Endoscopist
from .picture import PolypEye
from .polyp_person import PolypPerson

LONGEST_S = 1200.0  # of simulated time, after which a trial ends without its end


class PolypTrial(NamedTuple):
    """What a trial came to: Table III, the most that a link was beyond its bound in mm, and what the person did."""

    table: TableIII
    beyond_bound_mm: float
    given_up: int
    joint_choices: int
    led: int


class Colon(NamedTuple):
    """Where study I takes place: the surface, the task, and the drive in each arm."""

    mesh: TriangleMesh
    task: PolypTask
    spec: DriveSpec


def run_trial(
    colon: Colon, who: Endoscopist, seed: int | np.random.SeedSequence, longest_s: float = LONGEST_S
) -> PolypTrial:
    """Run one trial of a person."""
    spec, task = colon.spec, colon.task
    system, dt = spec.build(), spec.drive.step_s
    sight, steps = LumenSight(colon.mesh, task), list[PolypProgress]()
    person = PolypPerson(PolypEye(task, Wall(colon.mesh), sight), who, spec.drive.arm, dt, seed)
    with tempfile.TemporaryDirectory(prefix="vfix-study-") as folder:
        place = Path(folder) / "run"
        writer = RunWriter(place, spec, spec.columns, 0)
        driver: Driver[SnakeState] = Driver(system, log=writer)
        driver.apply(task_note(task))
        progress, targets = PolypProgress.at_start(task), task.targets()
        seen = system.at_hand(driver.state)
        try:
            while not progress.completed and driver.state.t < longest_s:
                seen = system.at_hand(driver.act(person(seen, progress)))
                progress = progress.step(task, seen.camera, seen.progress_mm, seen.t, targets, sight)
                steps.append(progress)
        except BaseException:
            writer.abandon()
            raise
        writer.close()
        series = polyp_series(Run.read(place), sight, steps)
    return PolypTrial(
        table_iii(series), beyond_bound_mm(series), len(person.given_up), person.joint_choices, person.led
    )
