"""What can be done to a study on the page."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta
from msgspec.structs import replace

from app.clock import utc_now
from app.documents import Document
from app.operations.fields import MaybeId
from app.operations.operation import Context, Creation, Edit
from app.operations.spec import DocumentSpec
from app.operations.standard import Delete, Redo, Rename, Restore, SetDeleted, Undo
from app.studies.content import STUDY, Code, LedStudy, LedTrial, Position, TlxAnswer, Toml
from app.studies.course import Next, Place, course_of, next_of, running_of
from app.studies.service import Studies
from vfix_engine.errors import InputError
from vfix_engine.study.own.questionnaire import Ratings

StudyContext = Context[LedStudy, Studies]
Why = Annotated[str, Meta(min_length=1, max_length=200)]


class OpenStudy(Creation, frozen=True):
    """Open the file of a study, in TOML; one that is open already keeps how far it is."""

    title = "Open study"
    rest = "POST /cases/{case_id}/studies"
    message = "study.new"
    text: Toml

    def create(self, context: StudyContext, case_id: str) -> Document[LedStudy]:
        return context.service.open(case_id, self.text)


class ChooseSubject(Edit, frozen=True):
    """Say whose session it is, by the subject's code."""

    title = "Subject of the study"
    rest = "PUT /studies/{id}/subject"
    message = "study.subject"
    of_open = True
    subject: Code

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        course_of(content, self.subject)
        _check_nobody_else(content, self.subject)
        return replace(content, subject=self.subject)


class ConfirmConsent(Edit, frozen=True):
    """Note that a subject has confirmed the text of consent; the session stays whose trial goes on."""

    title = "Confirm consent"
    rest = "POST /studies/{id}/consents"
    message = "study.consent"
    of_open = True
    subject: Code

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        if next_of(content, self.subject).what != "consent":
            raise InputError(f"{self.subject} has no consent to confirm.")
        going = running_of(content)
        subject = self.subject if going is None else going.subject
        return replace(content, consents=(*content.consents, self.subject), subject=subject)


class BeginTrial(Edit, frozen=True):
    """Begin the next trial of a subject; a run that begins from now on may be it."""

    title = "Begin trial"
    rest = "POST /studies/{id}/trials"
    message = "study.begin"
    of_open = True
    subject: Code

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        place = _trial(content, self.subject)
        _check_nobody_else(content, self.subject)
        begun = LedTrial(self.subject, place.turn.position, utc_now())
        return replace(_with(content, begun), subject=self.subject)


class AttachRun(Edit, frozen=True):
    """Make a run the trial that has begun: the one that is named, else the newest that began since then."""

    title = "Attach run"
    rest = "POST /studies/{id}/runs"
    message = "study.attach"
    of_open = True
    subject: Code
    run_id: MaybeId = ""

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        place = _trial(content, self.subject)
        if place.led is None:
            raise InputError("the trial has not begun; begin it first.")
        run = context.service.run_of(content, place, self.run_id)
        return _with(content, replace(place.led, run=run))


class SkipTrial(Edit, frozen=True):
    """Leave the next trial of a subject out, and say why; it is told as missing."""

    title = "Skip trial"
    rest = "POST /studies/{id}/skips"
    message = "study.skip"
    of_open = True
    subject: Code
    reason: Why

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        place = _trial(content, self.subject)
        led = place.led or LedTrial(self.subject, place.turn.position)
        return _with(content, replace(led, skipped=self.reason))


class RepeatTrial(Edit, frozen=True):
    """Do a trial of a subject again: its run is no trial any more, it is no longer skipped, or it has not begun."""

    title = "Repeat trial"
    rest = "POST /studies/{id}/repeats"
    message = "study.repeat"
    of_open = True
    subject: Code
    position: Position

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        going = running_of(content)
        if going is not None and (going.subject, going.position) != (self.subject, self.position):
            raise InputError(f"a trial of {going.subject} goes on; finish, skip or cancel it first.")
        kept = tuple(one for one in content.trials if (one.subject, one.position) != (self.subject, self.position))
        if len(kept) == len(content.trials):
            raise InputError(f"{self.subject} has not begun trial {self.position}.")
        return replace(content, trials=kept, subject=self.subject)


class AnswerQuestionnaire(Edit, frozen=True):
    """Answer NASA-TLX after a condition: mental, physical and temporal demand, performance, effort and frustration.

    Each is from 0 to 100 in steps of 5 (Hart and Staveland 1988); the raw index is their mean.
    """

    title = "Answer questionnaire"
    rest = "POST /studies/{id}/answers"
    message = "study.answer"
    of_open = True
    subject: Code
    ratings: Ratings

    def apply(self, content: LedStudy, context: StudyContext) -> LedStudy:
        now = next_of(content, self.subject)
        if now.what != "questionnaire" or now.place is None:
            raise InputError(f"{self.subject} has no questionnaire to answer now.")
        answer = TlxAnswer(self.subject, now.place.block, self.ratings)
        return replace(content, answers=(*content.answers, answer))


class RenameStudy(Rename, frozen=True):
    """Give it another name."""

    message = ""


class DeleteStudy(Delete, frozen=True):
    """Take it off the lists; it can be restored, and its runs stay."""

    message = ""


class RestoreStudy(Restore, frozen=True):
    """Bring it back to the lists."""

    message = ""


class UndoStudy(Undo, frozen=True):
    """Take the newest edit back."""

    title = "Undo in study"
    of_open = True


class RedoStudy(Redo, frozen=True):
    """Do again what was taken back."""

    title = "Redo in study"
    of_open = True


SPEC = DocumentSpec(
    kind=STUDY,
    path="studies",
    id="study_id",
    operations=(
        OpenStudy, ChooseSubject, ConfirmConsent, BeginTrial, AttachRun, SkipTrial, RepeatTrial, AnswerQuestionnaire,
        RenameStudy, SetDeleted, DeleteStudy, RestoreStudy, UndoStudy, RedoStudy,
    ),
    service="studies",
)  # fmt: skip


def _trial(content: LedStudy, subject: str) -> Place:
    """The next trial of a subject. Raises InputError where something else comes first, or all are done."""
    now: Next = next_of(content, subject)
    if now.what == "trial" and now.place is not None:
        return now.place
    words = {"consent": "confirm the consent first", "questionnaire": "answer the questionnaire first"}
    raise InputError(f"{subject} has no trial now: {words.get(now.what, 'all are done')}.")


def _check_nobody_else(content: LedStudy, subject: str) -> None:
    """Raises InputError where the trial of another subject goes on: its run would be taken for this one's."""
    going = running_of(content)
    if going is not None and going.subject != subject:
        raise InputError(f"a trial of {going.subject} goes on; finish, skip or cancel it first.")


def _with(content: LedStudy, trial: LedTrial) -> LedStudy:
    others = (one for one in content.trials if (one.subject, one.position) != (trial.subject, trial.position))
    return replace(content, trials=(*others, trial))
