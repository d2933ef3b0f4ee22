"""Assignments of the store: opened from files, and the results of their runs."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from msgspec.structs import replace

from app.assignments.content import Assignment
from app.assignments.file import AssignmentFile, read_assignment
from app.assignments.kind import ASSIGNMENT
from app.assignments.results import Results, RunResult, asked, judged
from app.cases.service import CaseService
from app.documents import Document
from app.documents.documents import Documents
from app.drives.run_scores import RunScores
from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound
from app.plans.model import driven_hash
from app.plans.service import PlanService
from app.store import Store
from vfix_engine.errors import InputError, VfixError

PLAN_CHANGED = "plan changed"


class Assignments:
    """Thread-safe."""

    def __init__(
        self, store: Store, cases: CaseService, plans: PlanService, runs: RunService, scores: RunScores
    ) -> None:
        self.documents: Documents[Assignment] = Documents(store, ASSIGNMENT)
        self._cases, self._plans, self._runs, self._scores = cases, plans, runs, scores

    def open(self, data: bytes) -> Document[Assignment]:
        """Store the assignment of a file; one that is there already is not made again, and keeps its runs.

        Raises InputError and TooLarge for a file that is none, NotFound for a plan that is not there.
        """
        file = read_assignment(data)
        plan_id, case_id = self.plan_of(file)
        content = file.content(plan_id)
        there = self._same(case_id, file.name, content)
        return there or self.documents.create(case_id, file.name, self._with_plan(content))

    def plan_of(self, file: AssignmentFile) -> tuple[str, str]:
        """Ids of the plan of a file and of its case. Raises NotFound, and InputError for a name of several plans."""
        named = file.plan
        plans = self._plans.titles()
        if named.id:
            found = [plan for plan in plans if plan.id == named.id]
        else:
            cases = {case.id for case in self._cases.list() if named.case in (case.id, case.name)}
            found = [plan for plan in plans if plan.case_id in cases and plan.name == named.name]
        if not found:
            raise NotFound("the plan of the assignment is not here; import its case and plan first.")
        if len(found) > 1:
            raise InputError("several plans have the name of the assignment's; name it by its 'id'.")
        return found[0].id, found[0].case_id

    def results(self, assignment_id: str) -> Results:
        """Of a stored assignment; each run is scored where it was not yet. Raises NotFound."""
        document = self.documents.get(assignment_id)
        return self._results(document.name, document.content, document.content.since or document.created)

    def results_of_file(self, data: bytes) -> Results:
        """Of a file: since its 'since', else since it was opened here, else of all runs. Raises as `open`.

        The plan is the one that it was when the file was opened here, else the present one.
        """
        file = read_assignment(data)
        plan_id, case_id = self.plan_of(file)
        content = file.content(plan_id)
        same = self._same(case_id, file.name, content)
        if same is None:
            return self._results(file.name, self._with_plan(content), content.since)
        return self._results(file.name, same.content, content.since or same.created)

    def _same(self, case_id: str, name: str, content: Assignment) -> Document[Assignment] | None:
        there: Iterable[Document[Any]] = self.documents.list(case_id)
        return next((one for one in there if not one.unreadable and one.name == name and _is_of(one, content)), None)

    def _with_plan(self, content: Assignment) -> Assignment:
        """With the hash of its plan as that is now: whoever changes the plan drives another one."""
        return replace(content, plan_sha256=driven_hash(self._plans.get(content.plan_id).content))

    def _results(self, name: str, content: Assignment, since: str) -> Results:
        runs = [run for run in self._runs.list(plan_id=content.plan_id)[::-1] if _counts(run, content, since)]
        judged_runs = tuple(self._judged(content, run) for run in runs)
        criteria = asked(content.criteria)
        return Results(name, content.plan_id, content.mode, since, content.runs, criteria, judged_runs)

    def _judged(self, content: Assignment, run: StoredRun) -> RunResult:
        try:
            score = self._scores.of(run.id)
        except (VfixError, ValueError) as error:  # the other runs have their results all the same
            return judged(content.criteria, run.id, run.recorded, None, f"unreadable: {error}")
        changed = run.plan_sha256 not in (None, content.plan_sha256)
        return judged(content.criteria, run.id, run.recorded, score, PLAN_CHANGED if changed else "")


def _is_of(document: Document[Assignment], content: Assignment) -> bool:
    """Whether it is of a file with this content, which does not say what the plan contains."""
    return replace(document.content, plan_sha256="") == content


def _counts(run: StoredRun, content: Assignment, since: str) -> bool:
    """Whether a run is one of the assignment's: driven by a person, not by a script or an operator of a study."""
    if run.origin != "page":
        return False
    preset = content.preset is None or run.manifest.get("preset") == content.preset
    return run.mode == content.mode and preset and run.recorded >= since
