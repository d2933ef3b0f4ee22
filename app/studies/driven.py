"""What a trial of a condition is driven with on the page, in a head or in a lumen, and why a run is none of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol, TypeVar

from app.cases.model import Case
from app.cases.service import CaseService
from app.drives.plan_drive import PlanDrive
from app.drives.stored_run import StoredRun
from app.kit.errors import NotFound
from app.lumen.document import Route
from app.lumen.drive_options import LumenDriveOptions
from app.lumen.service import RouteService
from app.lumen.tasks import TaskChoice, TaskName, route_polyps, tasks_in
from app.plans.service import PlanService
from vfix_engine.errors import InputError
from vfix_engine.runtime.control_mode import FREEHAND, TELEOPERATED, Control
from vfix_engine.runtime.run import RunEvent
from vfix_engine.study.own.file import OWN_TOOL, PLAIN, RouteOfStudy, StudyCondition, StudyFile, View
from vfix_engine.study.polyps.printed import HOLD_S, POLYPS

_PRESETS = {PLAIN: None, "none": None, "li2004": "li2004", "li2007": "li2007"}
_TASKS: dict[str, TaskName] = {"kwok1": "polyps", "kwok2": "labels"}

Events = Callable[[], Sequence[RunEvent]]


@dataclass(frozen=True)
class Driven:
    """tab: that drives it. document_id: of the plan or route. view: that is shown, None for any."""

    case_id: str
    document_id: str
    view: View | None

    @property
    def tab(self) -> Literal["rehearse", "drive"]:
        raise NotImplementedError

    @property
    def how(self) -> object:
        """As the tab has it, for a ``FixedDrive``."""
        raise NotImplementedError

    def differences(self, run: StoredRun, events: Events) -> list[str]:
        """Why a run of the page is none of it. events: reads those of the run."""
        other = [] if run.plan_id == self.document_id else ["it is of another plan or route"]
        nobody = [] if run.origin == "page" else ["nobody drove it on the page"]
        return other + self._differences(run, events) + nobody

    def _differences(self, run: StoredRun, events: Events) -> list[str]:
        raise NotImplementedError


@dataclass(frozen=True)
class DrivenPlan(Driven):
    """A plan, driven in Rehearse."""

    plan: PlanDrive

    tab = "rehearse"

    @property
    def how(self) -> PlanDrive:
        return self.plan

    def _differences(self, run: StoredRun, events: Events) -> list[str]:
        found, control = [], self.plan.control
        if run.mode != control.mode:
            found.append(f"it was driven {run.mode}, not {control.mode}")
        elif control.mode == TELEOPERATED and run.manifest.get("device") != control.device:
            found.append(f"its device was one of {run.manifest.get('device')}, not of {control.device}")
        if control.mode != FREEHAND and run.manifest.get("preset") != self.plan.preset:
            found.append("it has other parameters")
        return found


@dataclass(frozen=True)
class DrivenRoute(Driven):
    """A route with a task, driven in Drive."""

    options: LumenDriveOptions
    route: RouteOfStudy

    tab = "drive"

    @property
    def how(self) -> LumenDriveOptions:
        return self.options

    def _differences(self, run: StoredRun, events: Events) -> list[str]:
        from vfix_engine.study.own.told_task import ToldTask  # slow to load

        found = []
        if run.arm != self.options.arm:
            found.append(f"it was driven {run.arm}, not {self.options.arm}")
        if run.manifest.get("preset") != self.options.preset:
            found.append("it has other parameters")
        if ToldTask.in_events(events()) != ToldTask.of_route(self.route):
            found.append("its task is another one")
        return found


class Conditions:
    """Finds what conditions are driven with. Thread-safe."""

    def __init__(self, cases: CaseService, plans: PlanService, routes: RouteService) -> None:
        self._cases, self._plans, self._routes = cases, plans, routes

    def driven(self, study: StudyFile, condition: StudyCondition) -> Driven:
        """What the page sets for a trial. Raises NotFound, and InputError for what it cannot set."""
        return (self.route if study.routes else self._plan)(study, condition)

    def _named(self, condition: StudyCondition) -> dict[str, Case]:
        return {case.id: case for case in self._cases.list() if condition.case in (case.id, case.name)}

    def _plan(self, study: StudyFile, condition: StudyCondition) -> DrivenPlan:
        if condition.tool != OWN_TOOL:
            raise InputError(f"the page drives the plan's own tool, not {condition.tool!r:.40}; set tools = ['plan'].")
        if condition.arm not in _PRESETS:
            raise InputError(f"the page has no arm {condition.arm!r:.40}; use plain, li2004 or li2007.")
        cases = self._named(condition)
        if any(case.kind == "lumen" for case in cases.values()):
            raise InputError(f"{condition.case!r:.80} is a lumen, which has routes; name it in [[routes]].")
        titles = [one for one in self._plans.titles() if one.case_id in cases]
        plan = _only(titles, condition.plan, "plan", "import its case and plan first")
        control = Control(condition.mode, "rate" if condition.mode == TELEOPERATED else "position")  # type: ignore[arg-type]
        how = PlanDrive(control, _PRESETS[condition.arm])
        return DrivenPlan(plan.case_id, plan.id, study.view_of(condition), how)

    def route(self, study: StudyFile, condition: StudyCondition) -> DrivenRoute:
        """The same of a study in lumens."""
        cases, of_file = self._named(condition), study.route_of(condition)
        titles = [one for one in self._routes.documents.titles() if one.case_id in cases]
        found = _only(titles, condition.plan, "route", "import its case and make the route first")
        route = self._routes.documents.get(found.id)
        self._check(route.content, cases[route.case_id], of_file)
        task = task_choice(of_file)
        options = LumenDriveOptions(condition.arm, paper_of(study), task=task)  # type: ignore[arg-type]  # checked
        return DrivenRoute(route.case_id, route.id, study.view_of(condition), options, of_file)

    @staticmethod
    def _check(route: Route, case: Case, of_file: RouteOfStudy) -> None:
        """Raises InputError where the task cannot be done on a route."""
        if _TASKS[of_file.task] not in tasks_in(case):
            labels = of_file.task == "kwok2"
            other = "labels are traced in the body cavity" if labels else "polyps are viewed in a colon"
            raise InputError(f"{case.name!r:.80} has no task {of_file.task}: {other}.")
        if route.entry is None or route.end is None:
            raise InputError(f"the route {of_file.route!r:.80} has no {'entry' if route.entry is None else 'end'} yet.")
        if of_file.places == "route" and not len(route_polyps(route)):
            raise InputError(f"the route {of_file.route!r:.80} has no polyps; put some on the wall in Route.")


def task_choice(route: RouteOfStudy) -> TaskChoice:
    """The task of a route as Drive has it."""
    hold_s = HOLD_S if route.hold_s is None else route.hold_s
    return TaskChoice(_TASKS[route.task], route.places, route.seed, route.count or POLYPS, hold_s)


def paper_of(study: StudyFile) -> Literal["kwok2013"] | None:
    """The paper whose parameters drives of a study in lumens have, None for those of their routes."""
    return None if study.parameters == "route" else study.parameters


class _Title(Protocol):
    @property
    def id(self) -> str: ...

    @property
    def name(self) -> str: ...


_T = TypeVar("_T", bound=_Title)


def _only(titles: Sequence[_T], named: str, what: str, do: str) -> _T:
    """The document with an id or name. Raises NotFound, and InputError where several have the name."""
    found = [one for one in titles if named in (one.id, one.name)]
    if not found:
        raise NotFound(f"the {what} {named!r:.80} of the study is not here; {do}.")
    if len(found) > 1:
        raise InputError(f"several {what}s are named {named!r:.80}; name it by its id.")
    return found[0]
