"""The settings that were in force at every step of a run of a rigid tool, and with them the time that was driven."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array
from ...control import ControlSettings
from ...errors import InputError
from ...runtime.requests import Reset, SetSettings
from ...runtime.run import Run
from ...runtime.settings import checked_settings


def first_settings(run: Run) -> ControlSettings:
    """The settings at the start, as the manifest has them. Raises InputError where it has none that can be used."""
    settings = run.manifest["spec"].get("settings")
    if not isinstance(settings, dict):
        raise InputError("the run does not hold its spec, so nobody knows its settings")
    return ControlSettings.from_dict(settings)


def settings_of(run: Run, first: ControlSettings) -> list[ControlSettings]:
    """Settings at each of the n steps.

    first: of the spec; a return to the start brings them back.

    Raises:
        InputError: recorded settings are out of their ranges, or the run lost steps, which leave its events without
            a place.
    """
    if run.lost and any(event.at for event in run.events):
        raise InputError(f"the run lost {run.lost} steps while it was recorded, so nobody knows when its events were")
    changes = [(0, first)]
    for event in run.events:
        if isinstance(event.content, Reset):
            changes.append((event.at, first))
        elif isinstance(event.content, SetSettings):
            changes.append((event.at, checked_settings(event.content.settings, ControlSettings, "a rigid tool")))
    found: list[ControlSettings] = []
    for (at, settings), (until, _) in pairwise([*changes, (len(run.ticks), first)]):
        found += [settings] * (min(until, len(run.ticks)) - max(at, len(found)))
    return found


def driven_s(period_s: ArrayLike) -> Array:
    """Driven time (n,) in s at the end of each step, by its period (n,) in s; products, as in ``DrivenClock``.

    The column ``t`` of a run begins again with a return to the start, and in runs of before with another period.
    """
    periods = np.asarray(period_s, dtype=np.float64)
    found, at = np.empty(len(periods)), 0.0
    bounds = [0, *(np.flatnonzero(np.diff(periods)) + 1).tolist(), len(periods)]
    for begin, end in pairwise(bounds):
        found[begin:end] = at + np.arange(1, end - begin + 1) * periods[begin : begin + 1]
        at = float(found[end - 1]) if end else at
    return found
