"""Operators: whatever takes the place of the person who drives, such as a script, an adversary or a model of a person.

An operator of one world is called once before every step with the system and its present state, of which it may read
everything, and returns what it does. It may keep a memory; one with a seed does the same in the same states.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Protocol, TypeVar

from .command import Command
from .requests import Request
from .system import System

S = TypeVar("S")
Sys = TypeVar("Sys", contravariant=True)  # a system
State = TypeVar("State", contravariant=True)


class Act(NamedTuple):
    """What an operator does in one control period.

    command: for this step; units and frames as in ``Command``.
    requests: applied in this order before the step.
    note: what the operator has to say about it to whoever runs it; neither applied nor recorded.
    """

    command: Command
    requests: tuple[Request, ...] = ()
    note: Any = None


class Operator(Protocol[Sys, State]):
    """A function, or an object with a memory, from a system and its state to an act.

    It never changes either of them. None: it has finished, and is not called again.
    """

    def __call__(self, system: Sys, state: State, /) -> Act | None:
        """Return what it does next."""
        ...


def after(system: System[S], state: S, act: Act) -> S:
    """Return the state after the requests and the step of an act.

    Raises:
        ControlError, InputError: a request cannot be carried out; see ``System.apply``.
    """
    for request in act.requests:
        state = system.apply(state, request)
    return system.step(state, act.command)
