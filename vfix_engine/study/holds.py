"""When a run was held, or touched bone, and why: a list that a replay can open at its moments."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..arrays import Array, BoolArray
from ..runtime.run import Run
from ..runtime.system import SystemSpec
from ..worlds.freehand.spec import FreehandSpec
from ..worlds.registry import spec_of
from .metrics.held import HELD, held_by
from .metrics.samples import Samples, samples_of
from .spans import spans

UNKNOWN_WORDS = "not known: this version of the control makes another step there"


@dataclass(frozen=True)
class RunHold:
    """A time in which something held the tool; or touched it, which in a free hand nothing prevents.

    t_s: driven time since the last return to the start at which it begins, duration_s: until it ends; held_s: of that
        without the interruptions, as ``held_s`` of a score counts.
    kind, structure, part: as in ``runtime.snapshot.Blocker``; kind 'contact' where a free tool is in a structure, 'end'
        at an end of the path, '' where the reason is not known. reason: in words.
    place: (3,) in LPS mm, on the obstacle where that is known, else the tip.
    depth_mm: of a contact, its largest; 0 of a hold.
    """

    t_s: float
    duration_s: float
    held_s: float
    kind: str
    structure: str
    part: str
    reason: str
    place: tuple[float, float, float]
    depth_mm: float = 0.0

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def holds_of(run: Run, spec: SystemSpec | None = None) -> tuple[RunHold, ...]:
    """The holds of a run of a rigid tool in the order of time; of a free hand its contacts.

    A hold's reason is the strongest constraint of its first step.

    spec: that the run was driven with; None: made of its manifest.

    Raises:
        InputError: the run has no samples or no rigid tool, or its spec is not in the manifest.
    """
    spec = spec_of(run) if spec is None else spec
    samples = samples_of(run, spec)
    time = np.cumsum(samples.period_s)
    if isinstance(spec, FreehandSpec):
        return tuple(sorted(_contacts(samples, time), key=lambda one: one.t_s))
    return tuple(_holds(run, spec, samples, time))


def _holds(run: Run, spec: SystemSpec, samples: Samples, time: Array) -> Iterator[RunHold]:
    is_held = samples.outcome == HELD
    held = spans(is_held, time)
    reasons = held_by(run, spec, samples, [first for first, _ in held])
    for (first, last), why in zip(held, reasons, strict=True):
        point = samples.tip[first] if why is None or why.point is None else why.point
        kind, structure, part, words = ("", "", "", UNKNOWN_WORDS) if why is None else why[:4]
        yield RunHold(*_when(samples, time, is_held, first, last), kind, structure, part, words, _place(point))


def _contacts(samples: Samples, time: Array) -> Iterator[RunHold]:
    """Contacts by structure and part."""
    for body, structure in enumerate(samples.structures):
        for part, name in enumerate(samples.tool.segment_names):
            distance = samples.distance[:, body, part]
            for first, last in spans(distance < 0.0, time):
                depth = -float(distance[first : last + 1].min())
                deepest = first + int(distance[first : last + 1].argmin())
                words = f"the {name} was {depth:.1f} mm in {structure}"
                when = _when(samples, time, distance < 0.0, first, last)
                yield RunHold(*when, "contact", structure, name, words, _place(samples.tip[deepest]), depth)


def _when(samples: Samples, time: Array, active: BoolArray, first: int, last: int) -> tuple[float, float, float]:
    """``t_s``, ``duration_s`` and ``held_s`` of a hold."""
    begin, span = float(time[first] - samples.period_s[first]), slice(first, last + 1)
    return begin, float(time[last]) - begin, float(samples.period_s[span][active[span]].sum())


def _place(point: Array) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
