"""Studies of the store: opened from their files, and what their trials are driven with."""

from __future__ import annotations

from collections.abc import Callable

from app.cases.service import CaseService
from app.documents import Document
from app.documents.documents import Documents
from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound
from app.lumen.service import RouteService
from app.plans.service import PlanService
from app.store import Store
from app.studies.content import STUDY, LedStudy
from app.studies.course import Place, course_of, file_of, without_simulated
from app.studies.driven import Conditions, Driven
from vfix_engine.errors import InputError, VfixError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.run import Run
from vfix_engine.study.own.file import StudyCondition, StudyFile, conditions, parse_study
from vfix_engine.study.own.kinds import kind_of
from vfix_engine.study.own.order import Turn, order_of
from vfix_engine.study.own.questionnaire import AnsweredTlx
from vfix_engine.study.own.recorded import recorded_trial
from vfix_engine.study.own.results import StudyResults
from vfix_engine.worlds.registry import spec_of

MOST_TRIALS = 10_000  # each is looked at whenever the page is told what is next


class Studies:
    """Thread-safe."""

    def __init__(
        self, store: Store, cases: CaseService, plans: PlanService, runs: RunService, routes: RouteService
    ) -> None:
        self.documents: Documents[LedStudy] = Documents(store, STUDY)
        self._runs, self._routes = runs, routes
        self.conditions = Conditions(cases, plans, routes)

    def open(self, case_id: str, text: str) -> Document[LedStudy]:
        """Store a study of people, or return the one that is there of the same file, with how far it is.

        Raises:
            NotFound, InputError: a case or plan is not here, or the page cannot do what the file says.
        """
        study = parse_study(text)
        if not study.subjects.codes:
            raise InputError("the study has no codes of people; give [subjects] codes.")
        if len(study.subjects.codes) * study.trials * len(conditions(study)) > MOST_TRIALS:
            raise InputError(f"the page leads up to {MOST_TRIALS:,} trials of people.")
        kind_of(study).check(study)
        for condition in conditions(study):
            self.driven(text, condition)
        there = (one for one in self.documents.list(case_id) if not one.unreadable and one.content.text == text)
        return next(there, None) or self.documents.create(case_id, study.name, LedStudy(text))

    def driven(self, text: str, condition: StudyCondition) -> Driven:
        """What the page sets for a trial. Raises NotFound, and InputError for what it cannot set."""
        return self.conditions.driven(file_of(text), condition)

    # -- results

    def stored(self, study: StudyFile, study_id: str | None = None) -> Document[LedStudy]:
        """The study on the page whose people have the order of a file.

        Raises NotFound where there is none, or the named one is of another file, and InputError where several are.
        """
        every = self.documents.list() if study_id is None else (self.documents.get(study_id),)
        people = _order_of_people(study)
        there = [one for one in every if not one.unreadable and _order_of_people(file_of(one.content.text)) == people]
        if not there:
            raise NotFound("no study on the page has this file's people and order; was it changed?")
        if len(there) > 1:
            raise InputError(f"several studies are of this file; say --session: {', '.join(one.id for one in there)}.")
        return there[0]

    def collect(
        self,
        content: LedStudy,
        study: StudyFile,
        results: StudyResults,
        progress: Callable[[float], object] = lambda part: None,
    ) -> list[str]:
        """Score the runs of a study, and write them, questionnaires and why trials are missing into results.

        What the results have of its people from before is replaced. Returns which runs could not be scored, and why.
        """
        notes, answered = list[str](), {(one.subject, one.block): one.ratings for one in content.answers}
        places = [(code, place) for code in study.subjects.codes for place in course_of(content, code)]
        for number, (code, place) in enumerate(places, 1):
            name = place.turn.name
            results.forget(name)
            if place.led is not None and place.led.run:
                try:
                    run, wall = self._read(place.led.run)
                    results.write(recorded_trial(study, name, run, spec_of(run), place.led.run, wall))
                except (VfixError, ValueError) as error:
                    notes.append(f"{code}, trial {place.turn.position}: {error}")
                    results.write_skip(name, f"its run cannot be scored: {error}")
            elif place.led is not None and place.led.skipped:
                results.write_skip(name, place.led.skipped)
            if name.trial == 0:
                results.forget_answer(code, place.condition)
                if ratings := answered.get((code, place.block)):
                    results.write_answer(AnsweredTlx.of(code, place.condition, ratings))
            progress(number / len(places))
        return notes

    def _read(self, run_id: str) -> tuple[Run, TriangleMesh | None]:
        """A run, and the wall of its lumen where it is one. Raises NotFound, and as ``Run.read``."""
        with self._runs.laid_out(run_id) as folder:
            run = Run.read(folder)
        return run, self._routes.tasks.known_wall(self._runs.get(run_id).case_id)

    # -- runs

    def run_of(self, content: LedStudy, place: Place, run_id: str = "") -> str:
        """The id of a run that is a trial that has begun: the one that is named, else the newest begun since then.

        Raises:
            NotFound: there is no such run.
            InputError: it is another trial's already, or was driven otherwise than the condition says.
        """
        begun = "" if place.led is None else place.led.begun
        wanted, taken = self.driven(content.text, place.condition), {one.run for one in content.trials}
        if run_id:
            found = self._runs.get(run_id)
        else:  # a run of before may be stored after the trial has begun: what counts is when it began
            runs = self._runs.list(plan_id=wanted.document_id)
            newest = next((one for one in runs if one.began >= begun and one.id not in taken), None)
            if newest is None:
                raise NotFound("no recorded run of it has begun since the trial did. Drive it, and press Finish run.")
            found = newest
        if found.id in taken:
            raise InputError("that run is another trial already.")
        wrong = wanted.differences(found, lambda: self._read(found.id)[0].events)
        wrong += self._changes_since(content, found)
        if wrong:
            raise InputError(f"the run is not of this trial: {'; '.join(wrong)}. Drive it again.")
        return found.id

    def _changes_since(self, content: LedStudy, found: StoredRun) -> list[str]:
        """What was changed since the first trial of the plan, and the first that was driven in this way."""
        trials = [run for one in content.trials if one.run and (run := self._there(one.run)) is not None]
        same_plan = [run for run in trials if run.plan_id == found.plan_id and run.plan_sha256 is not None]
        alike = [run for run in same_plan if _driven_by(run) == _driven_by(found)]
        changed = []
        if same_plan and found.plan_sha256 != same_plan[0].plan_sha256:
            changed.append("the plan or route was changed since the first trial")
        if alike and _settings(found) != _settings(alike[0]):
            changed.append("its settings are not those of the first trial of this condition")
        return changed

    def _there(self, run_id: str) -> StoredRun | None:
        try:
            return self._runs.get(run_id)
        except NotFound:  # deleted since
            return None


def _order_of_people(study: StudyFile) -> dict[str, list[Turn]]:
    return order_of(without_simulated(study))


def _driven_by(run: StoredRun) -> tuple[object, ...]:
    return run.mode, run.arm, run.manifest.get("preset")


def _settings(run: StoredRun) -> object:
    spec = run.manifest.get("spec", {})
    return spec.get("settings"), spec.get("drive")
