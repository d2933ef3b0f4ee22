"""A run in a report, and what reports on a rigid tool and on a robot in a lumen say alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

from app.exchange.run_report.page import HoldRow, ReportedRun, RunReportPage, ScoreRow
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.run import Run
from vfix_engine.study.holds import RunHold, holds_of
from vfix_engine.study.lumen import LumenScore, LumenSeries, lumen_holds_of, lumen_series_of, score_lumen_run
from vfix_engine.study.metrics import RunScore, score_run
from vfix_engine.study.metrics.samples import samples_of
from vfix_engine.study.series import RunSeries, series_of
from vfix_engine.worlds.registry import arm_of, spec_of
from vfix_engine.worlds.rigid.spec import RigidSpec

if TYPE_CHECKING:  # a folder is reported without a store
    from app.drives.live_comments import RunComment

_SIDES = ("LR", "PA", "SI")  # letters of the positive and of the negative side of each LPS axis
_MOST_HOLDS = 14
LUMEN_RATE_HZ = 30.0  # of the curves of a run in a lumen


class ScoredRecording(Protocol):
    """What a score says of the recording."""

    @property
    def whole(self) -> bool: ...

    @property
    def lost(self) -> int: ...


@dataclass(frozen=True, eq=False)
class RunToReport:
    """A run, its id or folder, the names of what was driven, and when (an ISO time); '' where that is not known.

    comments: on it, in the order of time. wall: of its case's lumen, for the score of a task with lines of sight.
    """

    run: Run
    id: str
    plan: str = ""
    case: str = ""
    recorded: str = ""
    comments: Sequence[RunComment] = ()
    wall: TriangleMesh | None = None

    @cached_property
    def spec(self) -> RigidSpec:
        """Of a rigid tool; one in a free hand has the same scene and settings."""
        spec = spec_of(self.run)
        if getattr(spec, "scene", None) is None:
            raise InputError(f"a run of '{spec.world}' has no rigid tool")
        return spec  # type: ignore[return-value]

    @cached_property
    def score(self) -> RunScore:
        return score_run(self.run, self.spec)

    @cached_property
    def series(self) -> RunSeries:
        return series_of(self.run, self.spec)

    @cached_property
    def kept_mm(self) -> tuple[float, float]:
        """Smallest and largest distance that the certificate kept to bone in its samples."""
        kept = [one.kept_mm for one in samples_of(self.run, self.spec).settings]
        return min(kept), max(kept)

    @cached_property
    def holds(self) -> tuple[RunHold, ...]:
        return holds_of(self.run, self.spec)

    @property
    def words(self) -> str:
        """How it was driven, such as 'freehand, without the certificate'."""
        manifest = self.run.manifest
        if self.arm is not None:
            return self.arm if self.arm == "certified" else f"{self.arm}, without the certificate"
        more = [text for text in (manifest.get("preset"), manifest.get("device")) if text]
        certificate = () if self.score.certified else ("without the certificate",)
        return ", ".join([self.score.mode or self.score.world, *more, *certificate])

    @property
    def arm(self) -> str | None:
        """Of a robot in a lumen; None of a rigid tool."""
        return arm_of(self.run.manifest)

    @cached_property
    def lumen_score(self) -> LumenScore:
        """Of a robot in a lumen."""
        return score_lumen_run(self.run, wall=self.wall)

    @cached_property
    def lumen_series(self) -> LumenSeries:
        """Of a robot in a lumen."""
        return lumen_series_of(self.run, LUMEN_RATE_HZ)

    @cached_property
    def lumen_holds(self) -> tuple[RunHold, ...]:
        """Of a robot in a lumen."""
        return lumen_holds_of(self.run)


def page_of(
    runs: Sequence[RunToReport],
    shown: Sequence[ReportedRun],
    driven: Sequence[str],
    scores: Sequence[ScoreRow],
    figures: Sequence[tuple[str, str]],
    holds: Sequence[HoldRow],
) -> RunReportPage:
    """The page. driven: tools and robots in words, beside the cases; of a single run also how and when."""
    cases = list(dict.fromkeys(one.case for one in runs if one.case))
    alone = [runs[0].words, when(runs[0].recorded)] if len(runs) == 1 else []
    return RunReportPage(
        title=_title(runs),
        subtitle="; ".join(text for text in (*cases, *driven, *alone) if text),
        runs=tuple(shown),
        scores=tuple(scores),
        figures=tuple(figures),
        holds=tuple(holds[:_MOST_HOLDS]),
        more_holds=max(len(holds) - _MOST_HOLDS, 0),
        comments=_comments(runs, shown),
    )


def _title(runs: Sequence[RunToReport]) -> str:
    plans = list(dict.fromkeys(one.plan for one in runs if one.plan))
    what = "Run" if len(runs) == 1 else f"{len(runs)} runs"
    return f"{what} of {', '.join(plans)}" if plans else what


def recording_rows(scores: Sequence[ScoredRecording]) -> list[ScoreRow]:
    """What runs lack, where any lacks something: what came after, or in between, is in no figure."""
    values = ["whole" if one.whole else "interrupted" for one in scores]
    told = [f"{one.lost} steps lost" if one.lost else value for one, value in zip(scores, values, strict=True)]
    lacking = tuple(number for number, value in enumerate(told) if value != "whole")
    return [ScoreRow("Recording", tuple(told), lacking)] if lacking else []


def _comments(runs: Sequence[RunToReport], shown: Sequence[ReportedRun]) -> tuple[tuple[str, ...], ...]:
    """Label of the run, time and text of every comment."""
    return tuple(
        (run.label, "before" if said.t_s is None else f"{said.t_s:.1f} s", said.text)
        for one, run in zip(runs, shown, strict=True)
        for said in one.comments
    )


def side(value: float, axis: int) -> str:
    """One LPS coordinate by the side of the patient: 'R 24.5'."""
    rounded = round(float(value), 1)
    return f"{_SIDES[axis][rounded < 0.0]} {abs(rounded):.1f}"


def when(recorded: str) -> str:
    """An ISO time as '26 Nov, 07:15 UTC'."""
    if not recorded:
        return ""
    at = datetime.fromisoformat(recorded).astimezone(UTC)
    return f"{at.day} {at:%b, %H:%M} UTC"
