"""The headless job: from a lumen's surface and two clicks to a snake that has been driven through it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike

from ....anatomy.lumen.path_ends import PathEnds
from ....arrays import Array
from ....errors import InputError
from ....geometry.curve import Curve
from ....geometry.mesh import TriangleMesh
from ....pathway.fit import containment
from ....pathway.pathway import TissueMotion
from ....robots.snake import SnakeModel
from ....runtime.driver import Log
from ....snake.conform.conforming import driven_curve
from ....validate import point as checked_point
from ....validate import whole
from ..lumen import FAR_MARK_MM, Lumen, lumen_between
from ..narrow import narrowest
from ..settings import DriveSettings
from ..stepping.command import SnakeCommand
from ..stepping.constants import Start
from ..stepping.state import SnakeState
from .between_vertices import BetweenVertices
from .compare_controls import compare_controls
from .drive_report import DriveReport, Visit
from .drive_run import DriveRun
from .operators import OPERATORS, SnakeOperator, Stop, attacked, scripted, withdrawn
from .script import DriveSpec
from .snake_drive import SnakeDrive
from .wall_depth import WallDepth

__all__ = [
    "OPERATORS",
    "DriveReport",
    "DriveSettings",
    "Lumen",
    "Shot",
    "SnakeCommand",
    "SnakeDrive",
    "compare_controls",
    "drive_lumen",
    "lumen_between",
]


_ATTACK_STEPS = 2000  # of the adversarial operator at each place


@dataclass(frozen=True, eq=False)
class Shot:
    """A moment worth a picture: ``event`` is 'arrived', or 'bent' while the distal links look round."""

    name: str
    event: str
    position: Array
    snake: SnakeModel
    state: SnakeState
    lumen: Lumen

    @property
    def frames(self) -> Array:
        """(L + 1, 4, 4) of base and links in the patient frame."""
        return self.snake.frames(self.state.q, self.state.base)

    @property
    def camera(self) -> Array:
        """(4, 4) transform_camera_to_patient."""
        return self.snake.camera(self.state.q, self.state.base)


def drive_lumen(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    links: int | None,
    landmarks: Mapping[str, ArrayLike] | None = None,
    operator: str = "scripted",
    settings: DriveSettings | None = None,
    picture: Callable[[Shot], None] | None = None,
    *,
    snake: SnakeModel | None = None,
    tissue: TissueMotion | None = None,
    seed: int = 0,
    anyway: bool = False,
    back: bool = False,
    progress: Callable[[str], None] | None = None,
    record: Callable[[DriveSpec], Log | None] | None = None,
) -> DriveReport:
    """Insert a snake from ``start`` towards ``end`` as far as it reaches, and look round at each landmark on the way.

    Args:
        mesh: the lumen's surface, mm; start, end: (3,) clicks in the patient frame.
        links: of the snake; None: as many as it takes to the end.
        landmarks: places (3,) by name; none: one look-round where the tip ends.
        operator: 'scripted', or 'adversarial', who tries to leave the pathway at every landmark.
        picture: called at every landmark on arrival and while looking round.
        snake: the robot that ``links`` is taken of; None: the paper's.
        tissue: how the pathway moves; None: it is still.
        seed: of the adversarial operator; progress: called with what is being done.
        anyway: go also where the pathway is narrower than the robot, which is refused otherwise.
        back: draw the robot out again at the end.
        record: returns the destination of the recorded run for the spec of the drive, which is at its start; None:
            nothing is recorded.

    Raises:
        PathwayError: clicks or a surface that no path can be made of; a pathway that is narrower than the robot.
        InputError: an unknown operator, a landmark that is no point, more links than it takes to the end.
        RobotError: a number of links that no snake has.
    """
    settings, say = settings or DriveSettings(), progress or _silent
    if operator not in OPERATORS:
        raise InputError(f"the operator is one of {', '.join(OPERATORS)}, not {operator!r}")
    if not (landmarks is None or isinstance(landmarks, Mapping)):
        raise InputError(f"landmarks are places by name, not {landmarks!r:.60}")
    seed = whole("the seed", seed, 0)
    began = perf_counter()
    say("centreline, followable curve and pathway")
    model = snake or SnakeModel(1)
    lumen = lumen_between(mesh, start, end, model, settings, tissue)
    ready = perf_counter()
    curve = driven_curve(lumen.pathway, lumen.curve)  # arc lengths of one curve are not those of another
    robot = lumen.snake(model, links)
    target = min(curve.length, robot.reach_mm())
    visits, places = _visits(curve, landmarks, target)
    narrow = narrowest(lumen.pathway, robot, settings.bound_mm, target, lumen.curve, middle=lumen.centreline)
    ends = PathEnds.of(curve, start, end)
    if not anyway:
        narrow.refuse(robot)
    warnings = (*ends.warnings(), *narrow.warnings(settings.bound_mm))
    for words in warnings:
        say(f"warning: {words}")
    drive = SnakeDrive(robot, lumen.pathway, settings, lumen.curve, lumen.slack)
    if record is not None:
        drive.driver.log = record(DriveSpec.of(Start(drive.constants, drive.state), lumen))
    behind = WallDepth(mesh, lumen.pathway, curve, robot.links) if tissue is None else None
    between = BetweenVertices(robot, settings.vertices_per_link)
    run = DriveRun(drive, visits, behind, say, between)
    driving = _operator(operator, visits, target, seed)
    while (act := driving(drive.system, drive.state)) is not None:
        visit, event = run.carry_out(act), act.note.event
        if visit is not None and picture is not None and event in ("arrived", "bent"):
            picture(Shot(visit.name, event, places[visit.name], robot, drive.state, lumen))
        if operator == "scripted" and run.stalled is not None:
            break
    target = min(target, drive.length_mm)  # a path that moves may have become shorter
    stopped = run.finish(target)
    inserted, base, tip = drive.tip_s, drive.state.base[:3, 3], drive.tip
    if back:
        _drawn_back(run, say)
    outside = containment(mesh, lumen.pathway if tissue is None else lumen.pathway.moved(None))
    spent = {"lumen": ready - began, "drive": perf_counter() - ready}
    return DriveReport(
        robot.links, target, inserted, curve.length, run.tally, tuple(visits), outside.outside, outside.depth_mm,
        run.offset_mm, drive.state.refused_commands, spent, asdict(settings), stopped, tuple(run.retries), operator,
        robot.assumed, warnings, narrow, run.behind_wall, ends, base, tip, lumen.pathway,
        drive.tip_s if back else None, between.to_dict(),
    )  # fmt: skip


def _drawn_back(run: DriveRun, say: Callable[[str], None]) -> None:
    """Draw the robot back, until it is out or gets nowhere."""
    drive, driving = run.drive, withdrawn()
    run.go_on()
    while (act := driving(drive.system, drive.state)) is not None and run.stalled is None:
        run.carry_out(act)
    say(f"drawn back to {drive.tip_s:.0f} mm")


def _silent(_: str) -> None:
    pass


def _visits(
    curve: Curve, landmarks: Mapping[str, ArrayLike] | None, target: float
) -> tuple[list[Visit], dict[str, Array]]:
    """Landmarks in the order of their places along the curve; those out of reach stay unreached."""
    found, places = [], {}
    for name, given in (landmarks or {}).items():
        point = checked_point(f"the landmark {name!r}", given)
        s = curve.closest(point)
        away = float(np.linalg.norm(curve.position(s) - point))
        visit, places[name] = Visit(name, s), point
        if away > FAR_MARK_MM:
            visit.note = f"{away:.0f} mm from the path"
        elif s > target:
            visit.note = f"beyond the robot's reach of {target:.0f} mm"
        found.append(visit)
    if not found:
        found, places = [Visit("end", target)], {"end": curve.position(target)}
    return sorted(found, key=lambda visit: visit.s_mm), places


def _operator(name: str, visits: list[Visit], target: float, seed: int) -> SnakeOperator:
    stops = [Stop(visit.name, visit.s_mm) for visit in visits if not visit.note]
    return scripted(stops, target) if name == "scripted" else attacked(stops, target, _ATTACK_STEPS, seed)
