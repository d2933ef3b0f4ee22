"""The samples of a run of a snake in a lumen, as arrays with names."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, BoolArray, IndexArray
from ...errors import InputError
from ...robots.snake import SnakeModel
from ...runtime.requests import Reset
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...worlds.registry import spec_of
from ...worlds.snake.row import LIMITS, OUTCOMES
from ...worlds.snake.spec import SnakeSystemSpec

HELD = list(OUTCOMES.values()).index("held")
_INFINITE = ("beyond_bound", "bound")  # while no link is inside


@dataclass(frozen=True, eq=False)
class LumenSamples:
    """The samples after the last return to the start that is followed by any, n of them; patient frame, LPS mm.

    first: index of the first one in the run; t, period_s: (n,) driven time at the end of each control period, and its
        length, s.
    depth: (n,) mm, arc length of the tip along its way; tip: (n, 3). q: (n, 2L) rad, base: (n, 3, 4).
    outside: (n, m) mm, depth of each of the last links outside the pathway, 0 inside (Kwok 2013, eq. 9, a_i = 0);
        m = 0 in a run recorded before rows had them.
    beyond: (n,) mm, the most that any link is beyond its bound b_i, negative within it and −∞ while none is inside.
    deviation, bound: (n,) mm, of the link that has used most of its bound, whose number from the base is ``link``,
        (n,) from 1; NaN and 0 while none is inside.
    bend: (n,) r of the bending links. force, guidance: (n, 2) N, on the hand, and the part of it by (33)-(35).
    outcome, limit: (n,) codes of ``worlds.snake.row.OUTCOMES`` and ``LIMITS``; limit_link: (n,) the link whose bound
        limits, 0 for none.
    snake: the robot.
    """

    first: int
    t: Array
    period_s: Array
    depth: Array
    tip: Array
    q: Array
    base: Array
    outside: Array
    beyond: Array
    deviation: Array
    bound: Array
    link: IndexArray
    bend: Array
    force: Array
    guidance: Array
    outcome: IndexArray
    limit: IndexArray
    limit_link: IndexArray
    snake: SnakeModel

    @property
    def held(self) -> BoolArray:
        """(n,) whether a command was held."""
        held: BoolArray = self.outcome == HELD
        return held

    @property
    def distal(self) -> Array:
        """(n,) mm, the largest depth of the last links outside the pathway."""
        found: Array = self.outside.max(axis=1, initial=0.0)
        return found


def lumen_samples_of(run: Run, spec: SystemSpec | None = None) -> LumenSamples:
    """Read the samples of a run.

    spec: that it was driven with; None: made of its manifest.

    Raises:
        InputError: the run has no samples, is of another world, or has values that are not numbers.
    """
    spec = spec_of(run) if spec is None else spec
    if not isinstance(spec, SnakeSystemSpec):
        raise InputError(f"a run of the world '{run.manifest['world']}' has no robot in a lumen")
    starts = [event.at for event in run.events if isinstance(event.content, Reset) and event.at < len(run.ticks)]
    first = max(starts, default=0)
    rows = run.rows[first:]
    if not len(rows):
        raise InputError("the run has no samples")
    at = {column.name: place for place, column in enumerate(run.columns)}
    _check_rows(rows, at)

    def of(*names: str) -> Array:
        found: Array = rows[:, [at[name] for name in names]]
        return found

    def added(name: str, missing: float) -> Array:
        return of(name)[:, 0] if name in at else np.full(len(rows), missing)

    t = np.maximum.accumulate(of("t")[:, 0])
    distal = [name for name in at if name.startswith("outside_link")]
    link, bound = added("link", 0.0).astype(np.int64), added("bound", np.nan)
    base = of(*(f"base_{row}{column}" for row in range(3) for column in range(4)))
    return LumenSamples(
        first=first,
        t=t,
        period_s=np.diff(t, prepend=0.0),
        depth=of("tip_s")[:, 0],
        tip=of(*(f"tip_{axis}" for axis in "xyz")),
        q=of(*(f"q{joint}" for joint in range(spec.snake.dof))),
        base=base.reshape(-1, 3, 4),
        outside=of(*distal) if distal else np.empty((len(rows), 0)),
        beyond=of("beyond_bound")[:, 0],
        deviation=np.where(link > 0, added("deviation", np.nan), np.nan),
        bound=np.where(np.isfinite(bound), bound, np.nan),
        link=link,
        bend=of("bend")[:, 0] if "bend" in at else np.hypot(*of("u", "v").T),
        force=of("force_x", "force_y"),
        guidance=np.column_stack([added("guidance_x", np.nan), added("guidance_y", np.nan)]),
        outcome=of("outcome")[:, 0].astype(np.int64),
        limit=added("limit", 0.0).astype(np.int64),
        limit_link=added("limit_link", 0.0).astype(np.int64),
        snake=spec.snake,
    )


def last_of_intervals(t: Array, rate_hz: float) -> IndexArray:
    """Of samples at ``t`` (n,), s, ascending, the last one in every interval of ``1 / rate_hz`` that has any."""
    interval = np.floor(t * rate_hz * (1.0 - 1e-9)).astype(np.int64)
    last: IndexArray = np.flatnonzero(np.diff(interval, append=interval[-1] + 1))
    return last


def _check_rows(rows: Array, at: dict[str, int]) -> None:
    """Refuse what no comparison would tell: NaN is below no bound. Raises InputError."""
    for name, place in at.items():
        values = rows[:, place]
        wrong = np.isnan(values) if name in _INFINITE else ~np.isfinite(values)
        if wrong.any():
            row = int(wrong.argmax())
            raise InputError(f"the run is damaged: '{name}' is {values[row]} in its sample {row + 1}")
    for name, count in (("outcome", len(OUTCOMES)), ("limit", len(LIMITS))):
        codes = rows[:, at[name]] if name in at else np.zeros(1)
        if not ((codes >= 0) & (codes < count) & (codes == np.floor(codes))).all():
            raise InputError(f"the run is damaged: '{name}' is not a number from 0 to {count - 1} in every sample")
