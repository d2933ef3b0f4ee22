"""What trials in heads and trials in lumens do each in their own way, so that nothing else of a study asks which."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from .file import StudyCondition, StudyFile, TrialName
from .plugins import Metric


class TrialKind(NamedTuple):
    """The trials of one kind of study; a setting is how a condition is driven.

    check: raises InputError for metrics that the study cannot have. metric, operator: by name, raise InputError.
    bench: what a setting is built to, once in a process; drive: one simulated trial on it, scored.
    told: the median person, and of a setting all that results rest on, whose repr is the same for the same.
    scored: a recorded run with its spec, and the wall of a lumen where it is there.
    unlike: why a recorded run with its spec is not of a condition that has a setting, a reason each.
    """

    check: Callable[[StudyFile], None]
    metric: Callable[[str], Metric]
    operator: Callable[[str], object]
    bench: Callable[[Any], Any]
    drive: Callable[[StudyFile, TrialName, Any], Any]
    told: Callable[[StudyFile, Any], list[Any]]
    scored: Callable[[Run, Any, TriangleMesh | None], Any]
    unlike: Callable[[Run, Any, StudyCondition, Any], list[str]]


def kind_of(study: StudyFile) -> TrialKind:
    """The kind of a study's trials."""
    if study.routes:
        from .lumen_trials import LUMENS  # slow to load

        return LUMENS
    from .head_trials import HEADS

    return HEADS
