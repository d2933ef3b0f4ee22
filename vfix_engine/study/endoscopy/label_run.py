"""One trial of study II by a simulated person."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...anatomy.lumen.wall import Wall
from ...geometry.mesh import TriangleMesh
from ...runtime.command import BUTTON_CUT
from ...runtime.driver import Driver
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.requests import GetReady
from ...worlds.snake.stepping.state import SnakeState
from ..diathermy.labels import Label
from ..diathermy.task import DiathermySample, DiathermyState, first_state, stepped
from .cavity_picture import LabelEye
from .endoscopist import Endoscopist
from .label_person import LabelPerson

LONGEST_S = 300.0  # of simulated time, after which a trial ends


class Cavity(NamedTuple):
    """Where study II takes place: the surface, the labels, and the drive in each arm."""

    mesh: TriangleMesh
    labels: tuple[Label, ...]
    spec: DriveSpec


class LabelTrial(NamedTuple):
    """What a trial came to: the task at its end, the most that a link was beyond its bound in mm, and the person."""

    task: DiathermyState
    beyond_bound_mm: float
    given_up: int
    joint_choices: int


def run_trial(
    cavity: Cavity, who: Endoscopist, seed: int | np.random.SeedSequence, longest_s: float = LONGEST_S
) -> LabelTrial:
    """Run one trial of a person, until all labels are done or left."""
    spec, labels = cavity.spec, cavity.labels
    system, dt = spec.build(), spec.drive.step_s
    driver: Driver[SnakeState] = Driver(system)
    driver.apply(GetReady())
    wall = Wall(cavity.mesh)
    person = LabelPerson(LabelEye(labels, wall), who, spec.drive.arm, spec.snake.links, dt, seed)
    task, beyond, pressed = first_state(labels), 0.0, False
    seen = system.at_hand(driver.state)
    while task.traced + len(person.given_up) < len(labels) and driver.state.t < longest_s:
        act = person(seen, task)
        state = driver.act(act)
        seen, pressed = system.at_hand(state), bool(act.command.buttons & BUTTON_CUT)
        task = stepped(labels, task, DiathermySample(state.t, seen.camera, pressed), wall.free)
        beyond = max(beyond, float((state.deviation.depth - state.bound).max()))
    return LabelTrial(task, beyond, len(person.given_up), person.joint_choices)
