"""When a snake in a lumen was held, and by what: a list that a replay can open at its moments."""

from __future__ import annotations

from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...worlds.snake.row import LIMITS
from ..holds import UNKNOWN_WORDS, RunHold
from ..spans import spans
from .samples import LumenSamples, lumen_samples_of

_STRUCTURE = "lumen"
_WORDS = {
    "bound": "a link at its bound",
    "speed": "joints as fast as they may be",
    "step": "the largest step of an insertion",
    "bends": "no bend moves the camera that way",
    "bent": "the tip is bent: it has to be straightened first",
    "range": "a joint at the end of its range",
    "end": "the end of the way",
    "tissue": "no pathway in the moving tissue",
    "insertion": "the insertion goes before the camera",
    "planning": "waiting for the computer",
}


def lumen_holds_of(run: Run, spec: SystemSpec | None = None) -> tuple[RunHold, ...]:
    """The holds of a run of a snake in the order of time; the reason is that of a hold's first step.

    kind: the limit by its name in ``worlds.snake.row.LIMITS``; part: the link whose bound it is. place: of the tip.
    '' and "not known" in a run recorded before its rows had the limit.

    Raises:
        InputError: as ``lumen_samples_of``.
    """
    samples = lumen_samples_of(run, spec)
    return tuple(_hold(samples, first, last) for first, last in spans(samples.held, samples.t))


def _hold(samples: LumenSamples, first: int, last: int) -> RunHold:
    limit, link = LIMITS[samples.limit[first]], int(samples.limit_link[first])
    part = f"link {link}" if link else ""
    words = UNKNOWN_WORDS if limit is None else f"{part} at its bound" if part else _WORDS[limit]
    begin, span = float(samples.t[first] - samples.period_s[first]), slice(first, last + 1)
    held = float(samples.period_s[span][samples.held[span]].sum())
    x, y, z = (float(value) for value in samples.tip[first])
    structure = _STRUCTURE if limit in ("bound", "tissue", "end") else ""
    return RunHold(begin, float(samples.t[last]) - begin, held, limit or "", structure, part, words, (x, y, z))
