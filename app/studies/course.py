"""Which trial of a study is next for a subject, and what comes before it; whose turn it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from msgspec.structs import replace

from app.studies.content import LedStudy, LedTrial
from vfix_engine.errors import InputError
from vfix_engine.study.own.file import StudyCondition, StudyFile, conditions, labels, parse_study
from vfix_engine.study.own.order import Turn, order_of

What = Literal["consent", "trial", "questionnaire", "done"]


@dataclass(frozen=True)
class Place:
    """A trial in its subject's course. block: 1, 2, … of the condition; label: of the condition, in words."""

    turn: Turn
    block: int
    label: str
    led: LedTrial | None

    @property
    def condition(self) -> StudyCondition:
        return self.turn.name.condition

    @property
    def settled(self) -> bool:
        """Whether it has a run, or was skipped."""
        return self.led is not None and bool(self.led.run or self.led.skipped)


@dataclass(frozen=True)
class Next:
    """What a subject does next. place: of the trial, or the last one before a questionnaire; None when all is done.

    rest: a break is due before it.
    """

    what: What
    place: Place | None
    rest: bool = False


@lru_cache(maxsize=8)
def file_of(text: str) -> StudyFile:
    """The study of a stored text. Raises InputError."""
    return parse_study(text)


def without_simulated(study: StudyFile) -> StudyFile:
    """The study of its people alone, whose order does not depend on simulated ones."""
    return replace(study, subjects=replace(study.subjects, simulated=0))


@lru_cache(maxsize=8)
def _turns(text: str) -> dict[str, list[Turn]]:
    return order_of(without_simulated(file_of(text)))


def course_of(content: LedStudy, subject: str) -> list[Place]:
    """Every trial of a subject, in its order. Raises InputError for a code that the study does not have."""
    turns = _turns(content.text).get(subject)
    if turns is None:
        raise InputError(f"the study has no subject {subject!r:.40}; choose one of its codes.")
    study = file_of(content.text)
    words = labels(conditions(study))
    led = {one.position: one for one in content.trials if one.subject == subject}
    return [
        Place(turn, 1 + (turn.position - 1) // study.trials, words[turn.name.condition], led.get(turn.position))
        for turn in turns
    ]


def next_of(content: LedStudy, subject: str) -> Next:
    """What the subject does next. Raises InputError for a code that the study does not have."""
    study, course = file_of(content.text), course_of(content, subject)
    if study.consent and subject not in content.consents:
        return Next("consent", course[0])
    answered = {one.block for one in content.answers if one.subject == subject}
    for place in course:
        last = place.turn.name.trial + 1 == study.trials
        if not place.settled:
            first = place.turn.name.trial == 0 and place.turn.position > 1 and place.led is None
            return Next("trial", place, rest=first and study.break_min > 0)
        if last and study.questionnaire != "none" and place.block not in answered:
            return Next("questionnaire", place)
    return Next("done", None)


def running_of(content: LedStudy) -> LedTrial | None:
    """The trial that has begun, and has neither a run nor was skipped; there is one at most."""
    return next((one for one in content.trials if not (one.run or one.skipped)), None)


def chosen_of(content: LedStudy) -> str:
    """Whose session it is: the subject chosen last, else the first with something left, else the first."""
    codes = file_of(content.text).subjects.codes
    return content.subject if content.subject in codes else following_of(content) or codes[0]


def following_of(content: LedStudy) -> str:
    """The first subject with something left to do, '' where everybody has done all."""
    codes = file_of(content.text).subjects.codes
    return next((code for code in codes if next_of(content, code).what != "done"), "")
