"""The tasks of Kwok 2013 as the work of a trial: how each begins and goes on, and who of vfix can do it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...geometry.mesh import TriangleMesh
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...worlds.snake.offline.script import DriveSpec, ScriptSystem
from ...worlds.snake.requests import GetReady
from ...worlds.snake.snapshot import SnakeSnapshot
from ...worlds.snake.stepping.manual import JOINTS
from ...worlds.snake.stepping.state import SnakeState
from ..diathermy import table as label_table
from ..diathermy.bend_map import BendMap
from ..diathermy.oracle import BendOracle, JointOracle, OracleView
from ..diathermy.placing import PlacedLabels
from ..diathermy.task import DiathermySample, DiathermyState, first_state, stepped
from ..endoscopy import label_run, polyp_run
from ..endoscopy.cavity_picture import LabelEye
from ..endoscopy.endoscopist import Endoscopist
from ..endoscopy.label_person import LabelPerson
from ..endoscopy.own_hand import HandMaker, LumenHandAtWork, OwnHand
from ..endoscopy.picture import PolypEye
from ..endoscopy.polyp_person import PolypPerson
from ..polyps import series as polyp_series
from ..polyps.operator import PolypOperator
from ..polyps.progress import PolypProgress
from ..polyps.sight import LumenSight
from ..polyps.task import PolypTask

P = TypeVar("P")


class LumenMoment(NamedTuple):
    """What an operator is called with before a step: the system, its state and snapshot, and the task's progress.

    A model of a person reads the snapshot's picture and forces, and what the task draws; an oracle all of it.
    """

    system: ScriptSystem
    state: SnakeState
    snapshot: SnakeSnapshot
    progress: Any


Hand = Callable[[LumenMoment], Act | None]  # None once nothing is left to do


class Work(Protocol[P]):
    """A task in a lumen; P is the type of its progress.

    longest_s: of simulated time, after which a trial ends; requests: with which its run begins.
    """

    longest_s: float
    requests: tuple[Request, ...]

    def begin(self) -> P:
        """The progress before the first step."""
        ...

    def after(self, progress: P, snapshot: SnakeSnapshot, pressed: bool) -> P:
        """The progress after a step; pressed: the button of the tool was held in it."""
        ...

    def done(self, progress: P) -> bool:
        """Whether the task has ended."""
        ...

    def person(self, spec: DriveSpec, who: Endoscopist, seed: np.random.SeedSequence) -> Hand:
        """A simulated person who does it."""
        ...

    def oracle(self, spec: DriveSpec) -> Hand:
        """A script that knows where everything is."""
        ...

    def own(self, spec: DriveSpec, name: str, maker: HandMaker, seed: int) -> Hand:
        """A hand of an installed package, as of ``hand_named``."""
        ...


class PolypWork:
    """Study I in tissue that is still."""

    longest_s = polyp_run.LONGEST_S

    def __init__(self, mesh: TriangleMesh, wall: Wall, task: PolypTask) -> None:
        self.task, self.sight = task, LumenSight(mesh, task)
        self._wall, self._targets = wall, task.targets()
        self.requests: tuple[Request, ...] = (polyp_series.task_note(task),)

    def begin(self) -> PolypProgress:
        return PolypProgress.at_start(self.task)

    def after(self, progress: PolypProgress, snapshot: SnakeSnapshot, pressed: bool) -> PolypProgress:
        at = snapshot.camera, snapshot.progress_mm, snapshot.t
        return progress.step(self.task, *at, self._targets, self.sight)

    def done(self, progress: PolypProgress) -> bool:
        return progress.completed

    def person(self, spec: DriveSpec, who: Endoscopist, seed: np.random.SeedSequence) -> Hand:
        eye = PolypEye(self.task, self._wall, self.sight)
        person = PolypPerson(eye, who, spec.drive.arm, spec.drive.step_s, seed)
        return lambda moment: person(moment.snapshot, moment.progress)

    def oracle(self, spec: DriveSpec) -> Hand:
        operator = PolypOperator(self.task, self.sight)
        return lambda moment: operator(moment.system, moment.state)

    def own(self, spec: DriveSpec, name: str, maker: HandMaker, seed: int) -> Hand:
        at = LumenHandAtWork("kwok1", spec.drive.arm, JOINTS, spec.drive.step_s, seed)
        return _own(OwnHand(name, maker, at), PolypEye(self.task, self._wall, self.sight))


class LabelWork:
    """Study II in a cavity. surface: ``surface_hash`` of its wall."""

    longest_s = label_run.LONGEST_S

    def __init__(self, wall: Wall, placed: PlacedLabels, surface: str) -> None:
        self.placed, self._wall = placed, wall
        note = label_table.task_note(placed.labels, placed.seed, surface)
        self.requests: tuple[Request, ...] = (note, GetReady())

    def begin(self) -> DiathermyState:
        return first_state(self.placed.labels)

    def after(self, progress: DiathermyState, snapshot: SnakeSnapshot, pressed: bool) -> DiathermyState:
        sample = DiathermySample(snapshot.t, snapshot.camera, pressed)
        return stepped(self.placed.labels, progress, sample, self._wall.free)

    def done(self, progress: DiathermyState) -> bool:
        return progress.done

    def person(self, spec: DriveSpec, who: Endoscopist, seed: np.random.SeedSequence) -> Hand:
        labels = self.placed.labels
        eye = LabelEye(labels, self._wall)
        person = LabelPerson(eye, who, spec.drive.arm, spec.snake.links, spec.drive.step_s, seed)

        def hand(moment: LumenMoment) -> Act | None:
            left = len(labels) - moment.progress.traced - len(person.given_up)
            return person(moment.snapshot, moment.progress) if left > 0 else None

        return hand

    def oracle(self, spec: DriveSpec) -> Hand:
        steered = replace(spec, drive=replace(spec.drive, arm="certified", control="parameterised"))
        kind = JointOracle if spec.drive.arm == "manual" else BendOracle
        oracle = kind(BendMap(steered.build()), self.placed)
        return lambda moment: oracle(OracleView(moment.system, moment.state, moment.progress))

    def own(self, spec: DriveSpec, name: str, maker: HandMaker, seed: int) -> Hand:
        at = LumenHandAtWork("kwok2", spec.drive.arm, spec.snake.links, spec.drive.step_s, seed)
        return _own(OwnHand(name, maker, at), LabelEye(self.placed.labels, self._wall))


def _own(hand: OwnHand, eye: PolypEye | LabelEye) -> Hand:
    """A hand that sees by an eye."""

    def act(moment: LumenMoment) -> Act | None:
        return hand.act(moment.snapshot, moment.state.hand_joint, lambda: eye.seen(moment.snapshot, moment.progress))

    return act
