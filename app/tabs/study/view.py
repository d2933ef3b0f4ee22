"""The section of the Study tab, made of the stored study."""

from __future__ import annotations

from app.documents import Document
from app.studies.content import LedStudy
from app.studies.course import Place, chosen_of, course_of, file_of, following_of, next_of
from app.studies.driven import Driven, DrivenPlan, DrivenRoute
from app.studies.service import Studies
from app.tabs.study.sections import LedStudyView, LumenTrialView, PlanTrialView, SubjectView, TrialView


def study_view(document: Document[LedStudy], studies: Studies) -> LedStudyView:
    """Raises VfixError where a case or plan of the study is not here any more."""
    content = document.content
    study = file_of(content.text)
    subject = chosen_of(content)
    course, now = course_of(content, subject), next_of(content, subject)
    return {
        "id": document.id,
        "name": document.name,
        "revision": document.revision,
        "can_undo": document.can_undo,
        "can_redo": document.can_redo,
        "subjects": [_subject(content, code) for code in study.subjects.codes],
        "subject": subject,
        "next": now.what,
        "consent": study.consent,
        "trial": None if now.place is None else _trial(content, now.place, studies),
        "each": study.trials,
        "total": len(course),
        "break_min": study.break_min if now.rest else 0.0,
        "missing": [
            {"position": place.turn.position, "label": place.label, "reason": place.led.skipped}
            for place in course
            if place.led is not None and place.led.skipped
        ],
        "attached": [place.turn.position for place in course if place.led is not None and place.led.run],
        "following": following_of(content),
    }


def study_hint(content: LedStudy) -> str:
    """What to do next."""
    subject, following = chosen_of(content), following_of(content)
    now = next_of(content, subject)
    if now.what == "consent":
        return f"{subject} reads the consent; you confirm it."
    if now.what == "questionnaire":
        return f"{subject} moves each scale; then Save answers."
    if now.place is None:
        return f"{following} is next." if following else "Everybody is done: Save results."
    if now.place.led is not None:
        return f"The trial goes on in {'Drive' if file_of(content.text).routes else 'Rehearse'}."
    return f"{subject} drives {now.place.label} next: Begin trial."


def _subject(content: LedStudy, code: str) -> SubjectView:
    led = [place.led for place in course_of(content, code) if place.led is not None]
    return {"code": code, "done": sum(bool(one.run) for one in led), "skipped": sum(bool(one.skipped) for one in led)}


def _trial(content: LedStudy, place: Place, studies: Studies) -> TrialView:
    driven = studies.driven(content.text, place.condition)
    return {
        "position": place.turn.position,
        "number": place.turn.name.trial + 1,
        "label": place.label,
        "tab": driven.tab,
        "case_id": driven.case_id,
        "document_id": driven.document_id,
        "document": place.condition.plan,
        "plan": _plan(driven),
        "lumen": _lumen(driven),
        "view": driven.view,
        "running": place.led is not None and not place.settled,
    }


def _plan(driven: Driven) -> PlanTrialView | None:
    if not isinstance(driven, DrivenPlan):
        return None
    control, preset = driven.how
    return PlanTrialView(mode=control.mode, device=control.device, preset=preset)  # type: ignore[typeddict-item]


def _lumen(driven: Driven) -> LumenTrialView | None:
    if not isinstance(driven, DrivenRoute) or driven.how.task is None:
        return None
    return {"arm": driven.how.arm, "task": driven.how.task.task, "preset": driven.how.preset}
