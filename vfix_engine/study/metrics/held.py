"""What held the tool in a step of a run: the step is made anew from the recorded pose, as a row has no constraints."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...control.tasks import PathPoint
from ...runtime.command import Command, Master
from ...runtime.requests import Request, Reset
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...worlds.freehand.spec import FreehandSpec
from ...worlds.rigid.row import OUTCOMES, PHASES
from ...worlds.rigid.state import RehearsalState
from ...worlds.rigid.system import RigidSystem
from .samples import Samples

SAME = 1e-6  # in mm and rad: a step made anew that ends further from the recorded pose is not the recorded one
HELD = OUTCOMES.index("held")
END_WORDS = "an end of the path"


class HeldBy(NamedTuple):
    """The strongest constraint of a held step.

    kind, structure, part: as in ``runtime.snapshot.Blocker``; kind 'end' at an end of the path.
    words: for people; point: (3,) in LPS mm on the obstacle, None if there is none.
    """

    kind: str
    structure: str
    part: str
    words: str
    point: Array | None


def held_by(run: Run, spec: SystemSpec, samples: Samples, places: Iterable[int]) -> list[HeldBy | None]:
    """The constraints of some samples in which the tool was held.

    places: numbers of samples. None for a sample whose step ends at another pose when it is made anew, as by another
    version of the control.
    """
    wanted = list(places)
    if not wanted:
        return []
    if isinstance(spec, FreehandSpec):
        return [_touched(samples, place) for place in wanted]
    steps = _Steps(run, spec, samples)
    return [steps.held_by(place) for place in wanted]


def _touched(samples: Samples, place: int) -> HeldBy:
    """The deepest contact of a free tool."""
    depth = samples.distance[place]
    body, part = np.unravel_index(int(depth.argmin()), depth.shape)
    if depth[body, part] >= 0.0:
        return HeldBy("end", "", "", END_WORDS, None)
    structure, name = samples.structures[body], samples.tool.segment_names[part]
    return HeldBy("contact", structure, name, f"the {name} in {structure}", None)


class _Steps:
    """Makes steps of a rigid tool anew."""

    def __init__(self, run: Run, spec: SystemSpec, samples: Samples) -> None:
        system = spec.build()
        assert isinstance(system, RigidSystem)  # samples are those of a rigid tool, and free ones are told apart
        self._run, self._samples, self._system = run, samples, system
        joints = sum(column.name[0] == "q" for column in run.columns)
        self._q, self._v = (np.column_stack([run.column(f"{kind}{joint}") for joint in range(joints)]) for kind in "qv")
        self._force = np.column_stack([run.column(f"force_{axis}") for axis in "xyz"])

    def held_by(self, place: int) -> HeldBy | None:
        index, system = self._samples.first + place, self._system
        state = self._before(index)
        command = self._run.command(index)
        if command.master is not None:  # the motion before is not recorded, but what pulled the tool is
            stiffness = state.settings.master_stiffness_n_per_mm
            state = replace(state, lag=self._force[index] / stiffness)
            command = Command(command.force, command.drive, command.twist, Master(np.zeros(3), command.master.clutch))
        after = system.step(state, command)
        if not np.abs(after.q - self._q[index]).max() <= SAME:
            return None
        snapshot = system.snapshot(after)
        if not snapshot.blockers:
            return HeldBy("end", "", "", snapshot.reason or END_WORDS, None)
        one = snapshot.blockers[0]
        return HeldBy(one.kind, one.structure, one.part, one.words, one.point)

    def _before(self, index: int) -> RehearsalState:
        """The state before a step: of the row before it, then of what was asked for in between."""
        system, samples = self._system, self._samples
        asked = [event.content for event in self._run.events if event.at == index]
        if index == 0 or any(isinstance(one, Reset) for one in asked):
            state = system.start()
            first = max((i for i, one in enumerate(asked) if isinstance(one, Reset)), default=-1)
            asked = asked[first + 1 :]
        else:
            row = index - 1 - samples.first
            phase, path = PHASES[samples.phase[row]], samples.path
            near = None if path is None else PathPoint.at(path, float(samples.path_s[row]))
            settings = samples.settings[row]
            tool = system.measure(self._q[index - 1], self._v[index - 1], settings)
            state = RehearsalState(
                tool,
                mode_of(phase),
                phase,
                near,
                int(samples.target[row]),
                index,
                settings,
                deflection=samples.deflection[row],
            )
        for request in asked:
            if isinstance(request, Request):
                state = system.apply(state, request)
        return state


def mode_of(phase: str) -> str:
    """The task of a phase: 'path', 'inspect' or 'free'."""
    return "free" if phase == "free" else "inspect" if phase.startswith("inspect") else "path"
