"""The hand of an installed package that does study I or II of Kwok 2013, by the name of its entry point.

It has what the simulated person has: the picture, and the force on its hand. The robot's state, the places of polyps
and labels, and what the certificate says are not in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import TissueMotion
from ...runtime.command import BUTTON_CUT, BUTTON_STRAIGHTEN, no_command
from ...runtime.operator import Act
from ...runtime.requests import Request
from ...worlds.snake.offline.script import ScriptSystem
from ...worlds.snake.requests import ChooseJoint, GetReady, SetPeriod
from ...worlds.snake.settings import Arm
from ...worlds.snake.snapshot import SnakeSnapshot
from ...worlds.snake.stepping.manual import JOINTS
from ...worlds.snake.stepping.state import SnakeState
from ..diathermy.oracle import OracleView
from ..own.plugins import part_named
from ..polyps.progress import PolypProgress, Sight
from ..polyps.task import PolypTask
from .cavity_picture import LabelEye, SeenCavity
from .picture import PolypEye, SeenLumen

OPERATORS = "vfix.lumen_operators"  # group of entry points
SCRIPTED = "scripted"  # the oracle of `vfix lumen task`
KNOWS = "the picture and the force on its hand"
STEP_S, LOOK_S = 0.01, 0.05  # of a step; between two pictures, as of the simulated person
LONGEST_S = 1200.0  # of simulated time, after which study I ends without its end
_FASTEST_MM_PER_S = 1000.0  # of a hand; the robot has its own limits


@dataclass(frozen=True)
class LumenHandAtWork:
    """What a hand of a trial is made of.

    study: 'kwok1', polyps in a colon, or 'kwok2', labels in a cavity. arm: what holds the links. joints: how many a
    manual hand can choose of. step_s: time of a step in s. seed: of every random number.
    """

    study: Literal["kwok1", "kwok2"]
    arm: Arm
    joints: int
    step_s: float
    seed: int


@dataclass(frozen=True, eq=False)
class LumenView:
    """What a hand sees and feels before a step.

    t: s, since the beginning. picture: of study I or II, a new one every 0.05 s. force: (2,) N on the hand, to the
    right and down in the picture; 0 in the arm 'manual'.
    """

    t: float
    picture: SeenLumen | SeenCavity
    force: Array


@dataclass(frozen=True)
class LumenMotion:
    """What a hand does in a step.

    camera_mm_per_s: of the camera to the right and down in its picture; in the arm 'manual' it turns the chosen joint.
    insert_mm_per_s: of the insertion, negative to draw back; the bend is locked meanwhile. straighten: the tip becomes
    straight. cut: the button of study II is held. joint: that a manual hand turns from now on, 1: the last; None: as
    before.
    """

    camera_mm_per_s: tuple[float, float] = (0.0, 0.0)
    insert_mm_per_s: float = 0.0
    straighten: bool = False
    cut: bool = False
    joint: int | None = None


LumenHand = Callable[[LumenView], LumenMotion | None]  # None: it has finished, or gives up
HandMaker = Callable[[LumenHandAtWork], LumenHand]


def hand_named(name: str, own: Iterable[str] = (SCRIPTED,)) -> HandMaker:
    """The maker of a hand by its entry point in the group ``OPERATORS``. own: what else can be named, for the message.

    Raises:
        InputError: a name that is not installed, or what cannot be loaded.
    """
    found: Any = part_named(OPERATORS, dict.fromkeys(own), name, "operator")
    if not callable(found):
        raise InputError(f"the operator '{name}' cannot be called; name a class or a function of a LumenHandAtWork")
    return found  # type: ignore[no-any-return]


class OwnHand:
    """A hand of one's own in a trial, which gets a picture every ``LOOK_S`` and whose answers are checked.

    Args:
        name, maker: as of ``hand_named``. at: the trial.

    Raises:
        InputError: the hand fails, or does what no hand can; so does every call.
    """

    def __init__(self, name: str, maker: HandMaker, at: LumenHandAtWork) -> None:
        self._name, self._at = name, at
        self._due_s = -math.inf
        self._picture: SeenLumen | SeenCavity | None = None
        self._hand: LumenHand = self._of_its_own(lambda: maker(at))

    def act(
        self,
        snapshot: SnakeSnapshot,
        hand_joint: int,
        look: Callable[[], SeenLumen | SeenCavity],
        asked: tuple[Request, ...] = (),
    ) -> Act | None:
        """What it does before a step, None at its end.

        hand_joint: that was chosen before; look: makes a picture; asked: requests that go with it.
        """
        if self._picture is None or snapshot.t >= self._due_s - 1e-9:
            self._picture, self._due_s = look(), snapshot.t + LOOK_S
        found = self._motion(LumenView(snapshot.t, self._picture, snapshot.forces[:2]))
        if found is None:
            return None
        if found.joint not in (None, hand_joint) and self._at.arm == "manual":
            asked = (*asked, ChooseJoint(found.joint))
        buttons = (BUTTON_STRAIGHTEN if found.straighten else 0) | (BUTTON_CUT if found.cut else 0)
        right, down = found.camera_mm_per_s
        axes = (float(right), float(down), float(found.insert_mm_per_s))
        return Act(replace(no_command(), axes=axes, buttons=buttons), asked)

    def _motion(self, seen: LumenView) -> LumenMotion | None:
        found = self._of_its_own(lambda: self._hand(seen))
        if found is None:
            return None
        if not isinstance(found, LumenMotion):
            raise InputError(f"the operator '{self._name}' returned {found!r:.60}; a LumenMotion or None is needed")
        moves = found.camera_mm_per_s, found.insert_mm_per_s
        speeds = self._of_its_own(lambda: np.array([*moves[0], moves[1]], dtype=np.float64))
        if speeds.shape != (3,) or not (np.abs(speeds) <= _FASTEST_MM_PER_S).all():
            raise InputError(
                f"the operator '{self._name}' moves at {speeds.tolist()} mm/s; three finite numbers are needed, of at "
                f"most {_FASTEST_MM_PER_S:g}"
            )
        if found.joint is not None and found.joint not in range(1, self._at.joints + 1):
            raise InputError(
                f"the operator '{self._name}' chose joint {found.joint!r:.20}; there are 1 to {self._at.joints}"
            )
        return found

    def _of_its_own(self, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except Exception as error:
            raise InputError(f"the operator '{self._name}' failed: {type(error).__name__}: {error}") from error


class OwnPolypOperator:
    """A hand of one's own in study I, in place of ``PolypOperator``.

    progress: of the task, after the last step. attempts: none, which only the oracle tells.

    Args:
        name, maker: as of ``hand_named``. mesh: the lumen's surface; sight: lines of sight in it; motion: of its
            tissue.

    Raises:
        InputError: the hand fails, or does what no hand can; so does every call.
    """

    def __init__(
        self, name: str, maker: HandMaker, task: PolypTask, sight: Sight, mesh: TriangleMesh, arm: Arm,
        motion: TissueMotion | None = None,
    ) -> None:  # fmt: skip
        self.task, self.progress = task, PolypProgress.at_start(task)
        self.attempts: list[Any] = []
        self._hand = OwnHand(name, maker, LumenHandAtWork("kwok1", arm, JOINTS, STEP_S, task.seed))
        self._eye, self._sight, self._motion = PolypEye(task, Wall(mesh), sight, motion), sight, motion

    def __call__(self, system: ScriptSystem, state: SnakeState) -> Act | None:
        snapshot: SnakeSnapshot = system.snapshot(state)
        if state.steps:
            targets = self.task.targets(self._motion, state.t)
            self.progress = self.progress.step(self.task, snapshot.camera, state.tip_s, state.t, targets, self._sight)
        if self.progress.completed or state.t > LONGEST_S:
            return None
        again = () if state.period_s == STEP_S else (SetPeriod(STEP_S),)
        return self._hand.act(snapshot, state.hand_joint, lambda: self._eye.seen(snapshot, self.progress), again)


class OwnLabelOperator:
    """A hand of one's own in study II, in place of an oracle.

    given_up: none, which only an oracle tells. choices: how often a manual hand chose another joint.

    Args:
        name, maker: as of ``hand_named``. eye: what makes the picture. joints: of the robot; step_s: time of a step.

    Raises:
        InputError: as of ``OwnPolypOperator``.
    """

    def __init__(
        self, name: str, maker: HandMaker, eye: LabelEye, arm: Arm, joints: int, step_s: float, seed: int
    ) -> None:
        self.given_up: dict[int, str] = {}
        self.choices = 0
        self._hand, self._eye = OwnHand(name, maker, LumenHandAtWork("kwok2", arm, joints, step_s, seed)), eye

    def __call__(self, seen: OracleView) -> Act | None:
        state, task = seen.state, seen.task
        if task.done:
            return None
        snapshot: SnakeSnapshot = seen.system.snapshot(state)
        asked = () if state.steps else (GetReady(),)
        act = self._hand.act(snapshot, state.hand_joint, lambda: self._eye.seen(snapshot, task), asked)
        self.choices += act is not None and any(isinstance(one, ChooseJoint) for one in act.requests)
        return act
