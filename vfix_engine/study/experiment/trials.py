"""One trial of an experiment: a person drives the path, or looks at the target, in one mode; arrays come out.

Errors of registration, compliance and tracker are put on afterwards (``measured``), since nothing of them comes back to
the person: the display shows the robot's own belief. So a sweep over them costs no simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import ControlError
from ...geometry.shapes import CapsuleShape, Sphere
from ...runtime.command import Command
from ...runtime.driver import Driver
from ...runtime.requests import SetTask
from ...runtime.snapshot import Snapshot
from ...virtual_fixtures import Zone
from ...worlds.freehand.snapshot import FreehandSnapshot
from ...worlds.freehand.system import FreehandSystem
from ...worlds.rigid.operators import ScriptedOperator
from ...worlds.rigid.rehearsal import Rehearsal
from ...worlds.rigid.snapshot import RigidSnapshot
from ..drive import LONGEST_S, drive
from ..operator import PursuitOperator
from ..person import SPREADS, DriftNoise, Person
from .apparatus import PAPERS, Apparatus, StudyCase, apparatus

Mode = Literal["freehand", "hands-on", "teleoperated", "inspection"]
MODES: tuple[Mode, ...] = ("freehand", "hands-on", "teleoperated", "inspection")  # a mode's place is in the seeds
INSPECTION_S = 15.0  # assumed: how long the target is looked at is not printed
INSPECTION_N = 1.0  # rms of the hand's force on the handle meanwhile, on each axis: assumed
AXIS_MM = 0.5  # of the tool, between the places whose distance to a protected structure is measured
INSPECTION_DRIFT_S = 2.0  # in which that force changes: assumed


class TrialKey(NamedTuple):
    """Names one trial: the same key is the same trial, whoever runs it in whatever order."""

    study: int
    subject: int
    trial: int
    mode: Mode


@dataclass(frozen=True, eq=False)
class Trial:
    """What was recorded in one trial of n samples; patient frame LPS, mm.

    tip: (n, 3) as the encoders have it, of a free hand the tip itself; q: (n, 7) joints, (n, 0) in free hand.
    force: (n, 3) in N on the handle, 0 where no hand is there. error_mm: (n,) of the tip to the path or the target.
    progress_mm: (n,) along the path. contacts, max_depth_mm: of the whole tool with bone.
    rows: (n,) of the quadratic program. finished: the end was reached. max_depth_mm: of a free hand.
    clearance_mm: least distance of the tool to bone, as far as it is measured. structures_mm: the same to the protected
    structures of the case, which protect in one of its variants only; infinite without. case: what it was driven in.
    """

    key: TrialKey
    finished: bool
    dt_s: float
    tip: Array
    q: Array
    force: Array
    error_mm: Array
    progress_mm: Array
    rows: Array
    contacts: int
    max_depth_mm: float
    clearance_mm: float
    structures_mm: float = float("inf")
    case: StudyCase = PAPERS

    @property
    def time_s(self) -> float:
        """Duration."""
        return len(self.tip) * self.dt_s


def seeds(study: int, *names: int) -> np.random.SeedSequence:
    """The seed with a name; independent of every other one, and of the order in which they are used."""
    return np.random.SeedSequence(study, spawn_key=names)


def subject_of(key: TrialKey, median: Person, spreads: Mapping[str, float] = SPREADS) -> Person:
    """The subject of a trial, with the practice of the trials before it; the same person in every mode.

    spreads: see ``Person.drawn``.
    """
    drawn = median.drawn(np.random.default_rng(seeds(key.study, key.subject)), spreads)
    return drawn.practised(key.trial)


def run_trial(
    key: TrialKey, person: Person, variant: str = "li2007", anatomy: str = "phantom", head: str = ""
) -> Trial:
    """Run one trial of a person in a case, see ``apparatus``.

    Raises:
        ControlError: the target cannot be looked at.
    """
    case = StudyCase(variant, anatomy, head)
    around, seed = apparatus(*case), seeds(key.study, key.subject, key.trial + 1, MODES.index(key.mode))
    kept: list[Snapshot] = []
    if key.mode == "inspection":
        _look(around, person, np.random.default_rng(seed), kept.append)
        return _trial(key, True, around.settings.dt_s, kept, True, case)
    if key.mode == "freehand":
        free = FreehandSystem(around.free_scene, around.free_settings)
        hand = PursuitOperator(around.guide, person, free.scene.tool, around.free_settings, seed)
        done = drive(free, hand, kept.append, longest_s=LONGEST_S)
        return _trial(key, done.finished, around.free_settings.dt_s, kept, False, case)
    system, tool = Rehearsal(around.scene, around.settings).system, around.scene.tool
    axes = around.scene.base[:3, :3] if key.mode == "teleoperated" else None
    robot = drive(system, PursuitOperator(around.guide, person, tool, around.settings, seed, axes), kept.append)
    return _trial(key, robot.finished, around.settings.dt_s, kept, key.mode == "hands-on", case)


def _look(around: Apparatus, person: Person, random: np.random.Generator, keep: Callable[[Snapshot], object]) -> None:
    """Bring the tip onto the target, and swing the tool about it by a hand on the handle for a while."""
    rehearsal = Rehearsal(around.scene, around.settings)
    driver: Driver[Any] = Driver(rehearsal.system)
    goal = around.path.closest(around.scene.targets[0])[0]
    scripted, most = ScriptedOperator(), round(LONGEST_S / around.settings.dt_s)

    def until(stop: Callable[[RigidSnapshot], bool]) -> None:
        for _ in range(most):
            if stop(rehearsal.system.snapshot(driver.state)):
                return
            driver.act(scripted(rehearsal.system, driver.state))
        raise ControlError("the target of the study cannot be looked at from its path")

    until(lambda now: now.progress_mm >= goal)
    driver.apply(SetTask("inspect", 0))
    until(lambda now: now.phase == "inspect_hold")
    force = DriftNoise(random, around.settings.dt_s, INSPECTION_DRIFT_S)
    twist = DriftNoise(random, around.settings.dt_s, INSPECTION_DRIFT_S)
    strength = INSPECTION_N * person.force_n / Person().force_n
    for _ in range(round(INSPECTION_S / around.settings.dt_s)):
        driver.step(Command(strength * force.next(), twist=float(np.clip(twist.next()[0], -1.0, 1.0))))
        keep(rehearsal.system.snapshot(driver.state))


def _trial(key: TrialKey, finished: bool, dt_s: float, kept: list[Any], on_handle: bool, case: StudyCase) -> Trial:
    """Arrays of the snapshots of a rigid tool."""
    free = isinstance(kept[0], FreehandSnapshot)
    target = key.mode == "inspection"
    touching = np.array([one.clearance_mm for one in kept]) < 0.0
    contacts = kept[-1].contacts if free else ()
    return Trial(
        key,
        finished,
        dt_s,
        np.array([one.tip for one in kept]),
        np.zeros((len(kept), 0)) if free else np.array([one.q for one in kept]),
        np.array([one.force for one in kept]) if on_handle else np.zeros((len(kept), 3)),
        np.array([one.target_error_mm if target else one.tip_error_mm for one in kept]),
        np.array([one.progress_mm for one in kept]),
        np.array([0 if free else one.rows for one in kept]),
        sum(one.count for one in contacts) if free else begun(touching),
        max((one.max_depth_mm for one in contacts), default=0.0),
        min(float(one.clearance_mm) for one in kept),
        _to_structures(kept, apparatus(*case).structures),
        case,
    )


def begun(touching: NDArray[np.bool_]) -> int:
    """How often samples (n,) that touch begin."""
    return int((touching[1:] & ~touching[:-1]).sum()) + int(touching[0])


def _to_structures(kept: list[Any], structures: tuple[Zone, ...]) -> float:
    """Least distance in mm of the tool to spheres and capsules, over its axis in steps of ``AXIS_MM``."""
    least = float("inf")
    for one in kept if structures else ():
        for x in one.capsules:
            start, end, radius = x[:3], x[3:6], float(x[6])
            count = 2 + int(np.linalg.norm(end - start) / AXIS_MM)
            axis = start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)
            least = min(least, *(float(_outside(zone.solid, axis).min()) - radius for zone in structures))
    return least


def _outside(solid: object, points: Array) -> Array:
    """Distances (n,) of points (n, 3) to the surface of a sphere or a capsule."""
    if isinstance(solid, Sphere):
        return np.asarray(np.linalg.norm(points - solid.centre, axis=1) - solid.radius)
    assert isinstance(solid, CapsuleShape)
    way = solid.end - solid.start
    share = np.clip((points - solid.start) @ way / (way @ way), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - solid.start - share[:, None] * way, axis=1) - solid.radius)
