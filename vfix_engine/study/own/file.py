"""The file of a study: TOML with plans or routes, how they are driven, subjects, and metrics; docs/studies.md."""

from __future__ import annotations

import difflib
import itertools
import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
from msgspec import Meta

from ...errors import InputError
from ...runtime.control_mode import FREEHAND, MODES, ControlMode
from ...worlds.snake.settings import ARMS
from ..endoscopy.endoscopist import USED_OF_PERSON, Endoscopist
from ..person import Person

MAX_BYTES = 1 << 20
MOST_LABELS = 6  # of kwok2, `diathermy.placing.LABELS`, which is slow to load
MOST_TRIALS = 1_000_000
PLAIN, NO_ARM, OWN_TOOL = "plain", "none", "plan"

Name = Annotated[str, Meta(min_length=1, max_length=200)]
TaskName = Literal["kwok1", "kwok2"]
View = Literal["outside", "endoscope"]

VIEW_OF_LUMEN: View = "endoscope"  # Kwok 2013, section IV.C: people see the picture of the endoscope alone
_CODE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,19}")
_SIMULATED = "sim"

# Keys that only studies in heads have, and only those in lumens; and what the latter have where the file says nothing.
_OF_PLANS, _OF_ROUTES = ("plans", "modes", "tools", "rate_hz"), ("routes", "parameters")
_LUMEN_DEFAULTS: dict[str, Any] = {"arms": list(ARMS), "metrics": ["time_s", "completed", "beyond_bound_mm"]}


class PlanOfStudy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A plan in a case, each by name, id or file, as for `vfix rehearse`."""

    case: Name
    plan: Name


class RouteOfStudy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A route through a lumen, case and route each by name or id, and the task of Kwok 2013 that is done there.

    task: 'kwok1', polyps of a colon, or 'kwok2', labels in the body cavity. places: of polyps, drawn by the seed where
    the robot can view them, or those that were put on the route. seed: of what is drawn, the same for everybody.
    count: of what is drawn, hold_s: for how long each polyp has to be viewed; None: as in the paper.
    """

    case: Name
    route: Name
    task: TaskName
    places: Literal["seed", "route"] = "seed"
    seed: Annotated[int, Meta(ge=0, le=2**31 - 1)] = 0
    count: Annotated[int, Meta(ge=1, le=20)] | None = None
    hold_s: Annotated[float, Meta(ge=0.1, le=60.0)] | None = None


class Subjects(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """simulated: how many simulated people; codes: of real ones, whose recorded runs are attached."""

    simulated: Annotated[int, Meta(ge=0, le=100_000)] = 0
    codes: tuple[str, ...] = ()


class StudyFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A study: every subject does ``trials`` trials in each combination of plan, mode, arm and tool.

    Or it has routes in lumens instead, and every subject meets each of them in each arm.
    arms: in a head 'plain', a preset, or of an entry point, a free hand has none; in a lumen those of
    `vfix_engine.worlds.snake.settings`. tools: 'plan' for that of the plan, or as of `vfix rehearse`. operator, person:
    of simulated people, and medians of their parameters that differ from the defaults. rate_hz: of control, for arms
    without a printed one; None for that of the plan. parameters: in a lumen, those of the route, or the paper's.
    Of real people on the page: consent, a text that each confirms before the first trial, '' for none; break_min,
    between conditions; questionnaire, after each condition; views, by mode, or in a lumen by arm, the view that is
    shown.
    """

    name: Annotated[str, Meta(min_length=1, max_length=80)]
    subjects: Subjects
    plans: Annotated[tuple[PlanOfStudy, ...], Meta(min_length=1)] = ()
    routes: Annotated[tuple[RouteOfStudy, ...], Meta(min_length=1)] = ()
    seed: Annotated[int, Meta(ge=0, le=2**62)] = 0
    trials: Annotated[int, Meta(ge=1, le=1000)] = 5
    modes: Annotated[tuple[ControlMode, ...], Meta(min_length=1)] = MODES
    arms: Annotated[tuple[Name, ...], Meta(min_length=1)] = (PLAIN,)
    tools: Annotated[tuple[Name, ...], Meta(min_length=1)] = (OWN_TOOL,)
    operator: Name = "person"
    person: dict[str, float] = {}
    metrics: Annotated[tuple[Name, ...], Meta(min_length=1)] = ("time_s", "path_error_mm", "contacts")
    order: Literal["williams", "latin"] = "williams"
    rate_hz: Annotated[float, Meta(ge=50.0, le=10_000.0)] | None = None
    parameters: Literal["route", "kwok2013"] = "route"
    consent: Annotated[str, Meta(max_length=4000)] = ""
    break_min: Annotated[float, Meta(ge=0.0, le=120.0)] = 0.0
    questionnaire: Literal["none", "nasa-tlx"] = "none"
    views: dict[str, View] = {}

    @property
    def median(self) -> Person:
        """The median simulated person at a head. Raises InputError."""
        return Person(**self.person)

    @property
    def median_endoscopist(self) -> Endoscopist:
        """The median simulated person at a lumen. Raises InputError."""
        of_hand = {name: value for name, value in self.person.items() if name in USED_OF_PERSON}
        own = {name: value for name, value in self.person.items() if name not in USED_OF_PERSON}
        return Endoscopist(person=Person(**of_hand), **own)

    def view_of(self, condition: StudyCondition) -> View | None:
        """The view of a condition's trials on the page, None for any."""
        return self.views.get(condition.arm, VIEW_OF_LUMEN) if self.routes else self.views.get(condition.mode)

    def route_of(self, condition: StudyCondition) -> RouteOfStudy:
        """The route of a condition of a study in lumens."""
        wanted = condition.case, condition.plan, condition.mode
        return next(one for one in self.routes if (one.case, one.route, one.task) == wanted)

    @property
    def codes(self) -> tuple[str, ...]:
        """Every subject, the simulated ones first."""
        return (*(f"{_SIMULATED}{number + 1:03d}" for number in range(self.subjects.simulated)), *self.subjects.codes)


class StudyCondition(NamedTuple):
    """A combination that every subject meets.

    In a lumen plan is the route, mode the task, and tool that of the route, called 'plan' as well.
    """

    case: str
    plan: str
    mode: ControlMode | TaskName
    arm: str
    tool: str


class TrialName(NamedTuple):
    """One trial of a study; trial: 0, 1, … of this subject in this condition."""

    subject: str
    condition: StudyCondition
    trial: int


def read_study(file: Path) -> StudyFile:
    """Read and check the file of a study.

    Raises:
        InputError: it cannot be read, is no TOML, has a key that is not known, or a value that cannot be used.
    """
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise InputError(f"{file.name} has more than {MAX_BYTES:,} bytes: it is no file of a study")
        text = data.decode("utf-8")
    except OSError as error:
        raise InputError(f"{file.name} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{file.name} is no TOML: {error}") from None
    return parse_study(text, file.name)


def parse_study(text: str, name: str = "the study") -> StudyFile:
    """The study that a text in TOML says. Raises InputError, as `read_study`."""
    try:
        told = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name} is no TOML: {error}") from None
    return checked_study(told, name)


def checked_study(told: dict[str, Any], name: str = "the study") -> StudyFile:
    """The study that plain values say. Raises InputError."""
    _check_keys(told, StudyFile.__struct_fields__, name)
    lumens = _in_lumens(told, name)
    people = (*USED_OF_PERSON, *Endoscopist().own()) if lumens else (*Person.__dataclass_fields__,)
    for key, found, known in (
        ("[[plans]]", told.get("plans"), PlanOfStudy.__struct_fields__),
        ("[[routes]]", told.get("routes"), RouteOfStudy.__struct_fields__),
        ("[subjects]", [told.get("subjects")], Subjects.__struct_fields__),
        ("[person]", [told.get("person")], people),
    ):
        for table in _tables(found):
            _check_keys(table, known, f"{key} of {name}")
    try:
        study = msgspec.convert(_LUMEN_DEFAULTS | told if lumens else told, StudyFile)
    except msgspec.ValidationError as error:
        words = str(error).replace("Object missing required field", "it lacks").replace(" - at `$.", " - at `")
        raise InputError(f"{name} is no study: {words[:1].lower()}{words[1:]}") from None
    _check_values(study, name)
    return study


def conditions(study: StudyFile) -> list[StudyCondition]:
    """Every combination; of a free hand without arms."""
    if study.routes:
        driven = itertools.product(study.routes, study.arms)
        return [StudyCondition(route.case, route.route, route.task, arm, OWN_TOOL) for route, arm in driven]
    every = itertools.product(study.plans, study.modes, study.arms, study.tools)
    made = (
        StudyCondition(plan.case, plan.plan, mode, NO_ARM if mode == FREEHAND else arm, tool)
        for plan, mode, arm, tool in every
    )
    return list(dict.fromkeys(made))


def labels(found: Sequence[StudyCondition]) -> dict[StudyCondition, str]:
    """What tells the conditions apart, in words, such as 'hands-on, li2007'."""
    differ = [
        place for place in range(len(StudyCondition._fields)) if len({one[place] for one in found} - {NO_ARM}) > 1
    ]
    shown = differ or [StudyCondition._fields.index("mode")]
    return {one: ", ".join(one[place] for place in shown if one[place] != NO_ARM) for one in found}


def is_simulated(code: str) -> bool:
    """Whether a subject is a simulated one."""
    return code.startswith(_SIMULATED)


def nearest(name: str, known: Sequence[str]) -> str:
    """'; did you mean …' for a name that is like a known one, else ': …' with all of them."""
    like = difflib.get_close_matches(name, known, 1)
    return f"; did you mean '{like[0]}'?" if like else f"; there are {', '.join(sorted(known))}"


def _tables(told: Any) -> list[dict[str, Any]]:
    return [one for one in told if isinstance(one, dict)] if isinstance(told, list) else []


def _check_keys(told: dict[str, Any], known: Sequence[str], where: str) -> None:
    for key in told:
        if key not in known:
            raise InputError(f"{where} has the unknown key {key!r:.60}{nearest(key, known)}")


def _in_lumens(told: dict[str, Any], name: str) -> bool:
    """Whether a study is one in lumens. Raises InputError where it is one of both, or of neither."""
    plans, routes = ([key for key in keys if key in told] for keys in (_OF_PLANS, _OF_ROUTES))
    if plans and routes:
        raise InputError(
            f"{name} has '{plans[0]}', which is of heads, and '{routes[0]}', which is of lumens; a study compares one "
            "or the other: make two files"
        )
    if "plans" not in told and "routes" not in told:
        raise InputError(f"{name} is no study: it lacks [[plans]] in heads, or [[routes]] in lumens")
    return "routes" in told


def _check_values(study: StudyFile, name: str) -> None:
    """What types cannot say."""
    try:
        study.median_endoscopist if study.routes else study.median  # noqa: B018 - it checks the values
    except InputError as error:
        raise InputError(f"[person] of {name}: {error}") from None
    for field in ("plans", "modes", "arms", "tools", "metrics"):
        values = getattr(study, field)
        if len(set(values)) < len(values):
            raise InputError(f"'{field}' of {name} names something twice")
    if len(set(conditions(study))) < len(study.routes) * len(study.arms):
        raise InputError(f"'routes' of {name} has a route and its task twice")
    for arm in study.arms if study.routes else ():
        if arm not in ARMS:
            raise InputError(f"a lumen has no arm {arm!r:.60}{nearest(arm, ARMS)}")
    for one in study.views:
        if one not in (known := ARMS if study.routes else MODES):
            raise InputError(f"'views' of {name} has {one!r:.60}{nearest(one, known)}")
    for route in study.routes:
        if route.task == "kwok2" and (route.places != "seed" or route.hold_s is not None):
            raise InputError(f"'places' and 'hold_s' of {name} are of polyps, and kwok2 has labels")
        if route.task == "kwok2" and (route.count or 0) > MOST_LABELS:
            raise InputError(f"'count' of {name} is {route.count}, and kwok2 has {MOST_LABELS} labels at most")
    codes = study.subjects.codes
    for code in codes:
        if not _CODE.fullmatch(code) or is_simulated(code):
            raise InputError(
                f"the subject's code {code!r:.40} cannot be used: up to 20 letters, digits, '-' and '_', and none that "
                f"begins with '{_SIMULATED}', as those of simulated people do"
            )
    if len({code.lower() for code in codes}) < len(codes):
        raise InputError(f"two subjects of {name} have one code")
    if not study.codes:
        raise InputError(f"{name} has no subjects; give [subjects] simulated = 10, or codes of people")
    if len(study.codes) * study.trials * len(conditions(study)) > MOST_TRIALS:
        raise InputError(f"{name} has more than {MOST_TRIALS:,} trials")
