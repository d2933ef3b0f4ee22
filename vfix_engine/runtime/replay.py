"""Replay of a recorded run: the same commands, requests and adoptions at the same steps."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .command import COMMAND_SIZE
from .driver import Driver
from .requests import Request
from .run import Run, RunEvent
from .system import SystemSpec
from .versions import versions

# Columns of a snake that came after the first runs, at the end; no other column did.
_LATER = ("outside_link", "deviation", "bound", "link", "guidance_", "limit", "arm", "bend")

_CLOCKLESS = (
    "rigid",
    "freehand",
)  # whose first column was steps · present period, before manifests had one

S = TypeVar("S")


@dataclass(frozen=True, eq=False)
class Replay(Generic[S]):
    """Result of a replay.

    states: the initial state and that after every step; only the initial one with ``keep_states`` False.
    rows: (n, w) of the replay.
    first_difference: first step whose row is not bitwise equal to the recorded one, None if all are.
    sha256: of the replayed commands and rows, in the recorded columns; that of ``end.json`` if all are equal.
    largest_difference: between the rows, 0 if all are equal, inf where only one of two values is finite;
        other_arithmetic: versions that differ from the recording's, by name, as (then, now).
    """

    states: tuple[S, ...]
    rows: Array
    first_difference: int | None
    sha256: str
    largest_difference: float
    other_arithmetic: dict[str, tuple[str, str]]

    @property
    def same(self) -> bool:
        """Whether every row is bitwise equal to the recorded one."""
        return self.first_difference is None


class _Rows:
    """A log that collects the rows."""

    def __init__(self) -> None:
        self.lines: list[Array] = []

    def tick(self, line: Array) -> None:
        self.lines.append(line.copy())

    def event(self, kind: str, content: Any) -> None:
        pass


def replay(
    run: Run, spec: SystemSpec, keep_states: bool = True, each: Callable[[int, Driver[Any]], None] | None = None
) -> Replay[Any]:
    """Replay a run from its start.

    Args:
        spec: of the same system, such as ``worlds.spec_of(run)``.
        keep_states: False for a long run, whose states do not fit into memory.
        each: called after every step with its number from 0 and the driver; it must not change anything.

    Raises:
        InputError: the run lost ticks, has no ticks, or its columns are not the system's. A run of an earlier version
            may lack columns that were appended since; the others are compared.
    """
    if run.lost:
        raise InputError(f"the run lost {run.lost} steps while it was recorded; it can be looked at, not replayed")
    if not len(run.ticks):
        raise InputError("the run has no steps that could be compared")
    system, rows = spec.build(), _Rows()
    system.prepare()
    own, later = list(system.row_layout), list(system.row_layout)[len(run.columns) :]
    if list(run.columns) != own[: len(run.columns)] or not all(one.name.startswith(_LATER) for one in later):
        raise InputError("the run has other columns than this version of the system; replay it with its own version")
    driver: Driver[Any] = Driver(system, log=rows)
    of_before = "clock" not in run.manifest and run.manifest["world"] in _CLOCKLESS
    events, states = list(run.events), [driver.state]
    for index in range(len(run.ticks)):
        while events and events[0].at <= index:
            _again(driver, events.pop(0))
        state = driver.step(run.command(index))
        if of_before:
            rows.lines[-1][COMMAND_SIZE] = system.steps(state) * system.period_s(state)
        if keep_states:
            states.append(state)
        if each is not None:
            each(index, driver)
    for event in events:
        _again(driver, event)
    lines = np.array(rows.lines).reshape(len(run.ticks), COMMAND_SIZE + len(own))
    found = np.ascontiguousarray(lines[:, : run.ticks.shape[1]])
    differs = (found.view(np.uint64) != run.ticks.view(np.uint64)).any(axis=1)
    first = int(differs.argmax()) if differs.any() else None
    largest = _apart(found[differs], run.ticks[differs])
    then, now = run.manifest["versions"], versions()
    other = {name: (str(then.get(name, "")), now[name]) for name in now if then.get(name, "") != now[name]}
    digest = hashlib.sha256(found.tobytes()).hexdigest()
    return Replay(tuple(states), lines[:, -len(system.row_layout) :], first, digest, largest, other)


def _apart(found: Array, recorded: Array) -> float:
    """The largest difference of two arrays of the same shape, inf where only one of two values is finite."""
    with np.errstate(invalid="ignore"):  # a row may contain infinities
        apart = np.abs(found - recorded)
    apart[(found == recorded) | (np.isnan(found) & np.isnan(recorded))] = 0.0
    return float(np.nan_to_num(apart, nan=np.inf, posinf=np.inf).max(initial=0.0))


def _again(driver: Driver[Any], event: RunEvent) -> None:
    """Repeat a recorded request or adoption."""
    if event.kind == "adopt":
        driver.adopt(event.content["result"], event.content["steps"])
    elif isinstance(event.content, Request):
        driver.apply(event.content)
    else:
        raise InputError(f"the run has an event '{event.kind}', which this version does not know")
