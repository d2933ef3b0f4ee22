"""One protocol of operators drives any world: requests, then a command, recorded like a person's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from tiny import Jump, TinySpec, TinyState, TinySystem

from vfix_engine.runtime import Act, Command, Driver, Operator
from vfix_engine.runtime.operator import after
from vfix_engine.runtime.replay import replay
from vfix_engine.runtime.run import Run, RunWriter


class Pursuer:
    """Follows a target that it moves on by a request, and has finished after three of them."""

    def __init__(self) -> None:
        self.left = [0.02, -0.01, 0.03]

    def __call__(self, system: TinySystem, state: TinyState) -> Act | None:
        if abs(state.x - self.left[0]) < 2e-3:
            self.left.pop(0)
            if not self.left:
                return None
            return Act(Command(np.zeros(3)), (Jump(0.0), Jump(0.5 * self.left[0])), "there")
        return Act(Command(np.array([np.sign(self.left[0] - state.x), 0.0, 0.0])))


def test_an_operator_drives_a_world_and_its_run_is_driven_again(tmp_path: Path) -> None:
    spec, operator = TinySpec(), Pursuer()
    system = spec.build()
    writer = RunWriter(tmp_path / "run", spec, system.row_layout)
    driver: Driver[TinyState] = Driver(system, log=writer)
    by_driver: Operator[TinySystem, TinyState] = operator
    states, notes, alone = [driver.state], [], driver.state
    while (act := by_driver(system, driver.state)) is not None:
        alone = after(system, alone, act)
        states.append(driver.act(act))
        notes += [act.note] if act.note else []
        assert alone == driver.state
    writer.close()
    assert notes == ["there"] * 2
    assert [state.x for state in states if state.x == 0.5 * 0.03]
    run = Run.read(tmp_path / "run")
    assert [type(event.content) for event in run.events] == [Jump] * 4
    again = replay(run, spec)
    assert again.same
    assert again.states == tuple(states)
