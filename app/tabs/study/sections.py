"""The section of the Study tab."""

from __future__ import annotations

from typing import Literal, TypedDict


class SubjectView(TypedDict):
    """A subject, by its code, and how far it is."""

    code: str
    done: int
    skipped: int


class MissingView(TypedDict):
    """A trial that was skipped, and why."""

    position: int
    label: str
    reason: str


class PlanTrialView(TypedDict):
    """device: of a teleoperated trial, else without effect. preset: a paper's parameters, None for the plan's own."""

    mode: Literal["freehand", "hands-on", "teleoperated"]
    device: Literal["position", "rate"]
    preset: Literal["li2004", "li2007"] | None


class LumenTrialView(TypedDict):
    """preset: a paper's parameters, None for those of the route."""

    arm: Literal["manual", "guided", "certified"]
    task: Literal["polyps", "labels"]
    preset: Literal["kwok2013"] | None


class TrialView(TypedDict):
    """The next trial. position: in the subject's order; number: of the condition; running: it has begun.

    tab: that drives it. document_id: of the plan or route, document: its name. plan, lumen: how it is driven, one of
    them. view: that is shown, None for any.
    """

    position: int
    number: int
    label: str
    tab: Literal["rehearse", "drive"]
    case_id: str
    document_id: str
    document: str
    plan: PlanTrialView | None
    lumen: LumenTrialView | None
    view: Literal["outside", "endoscope"] | None
    running: bool


class LedStudyView(TypedDict):
    """The open study. consent: its text; next: what the subject does next; each, total: trials of a condition, of all.

    trial: the next one; the last before a questionnaire; None when all is done. break_min: due before it, 0 for none.
    missing, attached: of the subject; those with a run by their position. following: the first subject with something
    left to do, '' where everybody has done all.
    """

    id: str
    name: str
    revision: int
    can_undo: bool
    can_redo: bool
    subjects: list[SubjectView]
    subject: str
    next: Literal["consent", "trial", "questionnaire", "done"]
    consent: str
    trial: TrialView | None
    each: int
    total: int
    break_min: float
    missing: list[MissingView]
    attached: list[int]
    following: str


class StudySections(TypedDict):
    """The open study; None where none is open."""

    study: LedStudyView | None
