"""Studies of the store: opened from their files, and what their trials are driven with."""

from __future__ import annotations

from dataclasses import dataclass

from app.cases.service import CaseService
from app.documents import Document
from app.documents.documents import Documents
from app.drives.runs import RunService, StoredRun
from app.kit.errors import NotFound
from app.plans.service import PlanService
from app.store import Store
from app.studies.content import STUDY, LedStudy, LedTrial
from app.studies.course import file_of
from vfix_engine.errors import InputError
from vfix_engine.study.own.file import OWN_TOOL, PLAIN, StudyCondition, conditions, parse_study

_PRESETS = {PLAIN: None, "none": None, "li2004": "li2004", "li2007": "li2007"}


@dataclass(frozen=True)
class Driven:
    """What a condition is driven with. preset: a paper's parameters, None for the plan's own."""

    case_id: str
    plan_id: str
    mode: str
    preset: str | None
    view: str | None


class Studies:
    """Thread-safe."""

    def __init__(self, store: Store, cases: CaseService, plans: PlanService, runs: RunService) -> None:
        self.documents: Documents[LedStudy] = Documents(store, STUDY)
        self._cases, self._plans, self._runs = cases, plans, runs

    def open(self, case_id: str, text: str) -> Document[LedStudy]:
        """Store a study of people, or return the one that is there of the same file, with how far it is.

        Raises:
            NotFound, InputError: a case or plan is not here, or the page cannot do what the file says.
        """
        study = parse_study(text)
        if not study.subjects.codes:
            raise InputError("the study has no codes of people; give [subjects] codes.")
        for condition in conditions(study):
            self.driven(text, condition)
        there = (one for one in self.documents.list(case_id) if not one.unreadable and one.content.text == text)
        return next(there, None) or self.documents.create(case_id, study.name, LedStudy(text))

    def driven(self, text: str, condition: StudyCondition) -> Driven:
        """What the page sets for a trial. Raises NotFound, and InputError for what it cannot set."""
        if condition.tool != OWN_TOOL:
            raise InputError(f"the page drives the plan's own tool, not {condition.tool!r:.40}; set tools = ['plan'].")
        if condition.arm not in _PRESETS:
            raise InputError(f"the page has no arm {condition.arm!r:.40}; use plain, li2004 or li2007.")
        cases = {case.id for case in self._cases.list() if condition.case in (case.id, case.name)}
        plans = [one for one in self._plans.titles() if one.case_id in cases and condition.plan in (one.id, one.name)]
        if not plans:
            raise NotFound(f"the plan {condition.plan!r:.80} of the study is not here; import its case and plan first.")
        if len(plans) > 1:
            raise InputError(f"several plans are named {condition.plan!r:.80}; name it by its id.")
        view = file_of(text).views.get(condition.mode)
        return Driven(plans[0].case_id, plans[0].id, condition.mode, _PRESETS[condition.arm], view)

    def run_of(self, content: LedStudy, trial: LedTrial, condition: StudyCondition, run_id: str = "") -> str:
        """The id of a run that is this trial: the one that is named, else the newest since the trial began.

        Raises:
            NotFound: there is no such run.
            InputError: it is another trial's already, or was driven otherwise than the condition says.
        """
        wanted = self.driven(content.text, condition)
        taken = {one.run for one in content.trials}
        if run_id:
            found = self._runs.get(run_id)
        else:
            runs = self._runs.list(plan_id=wanted.plan_id)
            since = (one for one in runs if one.recorded >= trial.begun and one.id not in taken)
            newest = next(since, None)
            if newest is None:
                raise NotFound("no run was stored since the trial began; drive it, and press Finish run.")
            found = newest
        if found.id in taken:
            raise InputError("that run is another trial already.")
        if wrong := _differences(found, wanted):
            raise InputError(f"the run is not of this trial: {'; '.join(wrong)}. Repeat the trial.")
        return found.id


def _differences(run: StoredRun, wanted: Driven) -> list[str]:
    found = []
    if run.plan_id != wanted.plan_id:
        found.append("it is of another plan")
    if run.mode != wanted.mode:
        found.append(f"it was driven {run.mode}, not {wanted.mode}")
    if wanted.mode != "freehand" and run.manifest.get("preset") != wanted.preset:
        found.append("it has other parameters")
    if run.origin != "page":
        found.append("nobody drove it on the page")
    return found
