"""The headless job: from a lumen's surface and two clicks to a snake that has been driven through it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...given import point as checked_point
from ...given import whole
from ...robots.snake import SnakeModel
from ..anatomy.centreline import Centreline, centreline_between
from ..anatomy.curve import Curve
from ..anatomy.path_ends import PathEnds
from ..conform.conforming import driven_curve
from ..conform.follow import followable
from ..pathway.fit import containment, fit_pathway
from ..pathway.pathway import Pathway, TissueMotion
from .compare import compare_controls
from .drive_report import DriveReport, Tally, Visit
from .drive_state import Command, DriveSettings, DriveState
from .narrow import WallDepth, narrowest
from .operators import OPERATORS, Order, Retry, Stop, adversarial, scripted
from .snake_drive import SnakeDrive

__all__ = [
    "OPERATORS",
    "Command",
    "DriveReport",
    "DriveSettings",
    "DriveState",
    "Lumen",
    "Shot",
    "SnakeDrive",
    "compare_controls",
    "drive_lumen",
    "lumen_between",
]

Array = NDArray[np.float64]

_FAR_MM = 60.0  # [mm] a landmark farther from the curve is not on this path
_MOST_SLACK_MM = 4.0  # [mm] a robot that uses more of a wide place is turned the wrong way for the narrow one behind it
_REMEDY = "a larger bound, a thinner robot or other waypoints may get past"
_ATTACK_STEPS = 2000  # of the adversarial operator at each place


@dataclass(frozen=True, eq=False)
class Lumen:
    """A lumen made ready: its centreline, the curve a snake is to follow, and the pathway around that.

    slack: (N,) mm at the curve's points, how far a joint centre may leave the curve before the snake touches the wall.
    """

    centreline: Centreline
    curve: Curve
    slack: Array
    pathway: Pathway


@dataclass(frozen=True, eq=False)
class Shot:
    """A moment worth a picture: ``event`` is 'arrived', or 'bent' while the distal links look round."""

    name: str
    event: str
    position: Array
    snake: SnakeModel
    state: DriveState
    lumen: Lumen

    @property
    def frames(self) -> Array:
        """(L + 1, 4, 4) of base and links in the patient frame."""
        return self.snake.frames(self.state.q, self.state.base)

    @property
    def camera(self) -> Array:
        """(4, 4) transform_camera_to_patient."""
        return self.snake.camera(self.state.q, self.state.base)


def lumen_between(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    snake: SnakeModel,
    settings: DriveSettings,
    tissue: TissueMotion | None = None,
) -> Lumen:
    """Centreline, followable curve and pathway from two clicks in a lumen.

    Raises:
        PathwayError: as ``centreline_between`` and ``fit_pathway``.
    """
    centreline = centreline_between(mesh, start, end)
    curve = followable(centreline, snake)
    pathway = fit_pathway(
        mesh, curve, settings.contours, settings.interpolated, settings.angles, quantile=settings.quantile
    )
    slack = _slack(curve, pathway, snake)
    if tissue is not None:
        pathway = pathway.moved(tissue)
    return Lumen(centreline, curve, slack, pathway)


def _slack(curve: Curve, pathway: Pathway, snake: SnakeModel) -> Array:
    """How far the robot may leave the curve: the pathway's least radius there less its own, and never far."""
    at = np.arange(len(curve.points)) * curve.step_mm * (pathway.length / curve.length)
    radius = np.interp(at, pathway.s, pathway.contours().radius.min(axis=1))
    found: Array = np.clip(radius - snake.radius_mm, 0.0, _MOST_SLACK_MM)
    return found


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
    progress: Callable[[str], None] | None = None,
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

    Raises:
        PathwayError: clicks or a surface that no path can be made of.
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
    length = curve.length
    robot = _with_links(model, links if links is not None else math.ceil(length / model.length_mm))
    target = min(length, robot.reach_mm())
    visits, places = _visits(curve, landmarks, target)
    narrow = narrowest(lumen.pathway, robot.sphere_mm, settings.bound_mm, target)
    ends = PathEnds.of(curve, start, end)
    warnings = ends.warnings() + narrow.warnings(robot.sphere_mm, settings.bound_mm)
    for words in warnings:
        say(f"warning: {words}")
    drive = SnakeDrive(robot, lumen.pathway, settings, lumen.curve, lumen.slack)
    behind = WallDepth(mesh, lumen.pathway, curve) if tissue is None else None
    tally = Tally(robot.q_max, drive.bound)
    offsets: list[Array] = []
    retries: list[Retry] = []
    for order in _orders(drive, operator, visits, target, seed):
        before = drive.q.copy()
        drive.step(order.command, order.dt)
        tally.add(before, drive.state, order.dt)
        offsets.append(drive.offset_mm)
        if behind is not None:
            behind.look(drive, order.event is not None)
        if order.retry is not None:
            retries.append(order.retry)
            say(f"{order.retry.words}; {order.retry.outcome}")
        visit = _note(order, drive, visits)
        if visit is not None and order.event is not None:
            say(f"{order.event} {visit.name}, {drive.tip_s:.0f} mm in")
            if picture is not None and order.event in ("arrived", "bent"):
                picture(Shot(visit.name, order.event, places[visit.name], robot, drive.state, lumen))
    target = min(target, drive.length_mm)  # a path that moves may have become shorter
    stopped = _why_it_ended(drive, target, retries)
    _close(visits, drive, stopped)
    if behind is not None:
        say(behind.words)
    outside = containment(mesh, lumen.pathway if tissue is None else lumen.pathway.moved(None))
    offset = np.concatenate(offsets) if offsets else np.zeros(1)
    spent = {"lumen": ready - began, "drive": perf_counter() - ready}
    return DriveReport(
        robot.links, target, drive.tip_s, length, tally, tuple(visits), outside.outside, outside.depth_mm,
        (float(np.median(offset)), float(offset.max())), drive.refused_commands, spent, asdict(settings), stopped,
        tuple(retries), operator, robot.assumed, tuple(warnings), narrow, None if behind is None else behind.told(),
        ends, drive.state.base[:3, 3], drive.tip, lumen.pathway,
    )  # fmt: skip


def _silent(_: str) -> None:
    pass


def _with_links(model: SnakeModel, links: int) -> SnakeModel:
    from dataclasses import replace

    return replace(model, links=links)


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
        if away > _FAR_MM:
            visit.note = f"{away:.0f} mm from the path"
        elif s > target:
            visit.note = f"beyond the robot's reach of {target:.0f} mm"
        found.append(visit)
    if not found:
        found, places = [Visit("end", target)], {"end": curve.position(target)}
    return sorted(found, key=lambda visit: visit.s_mm), places


def _orders(drive: SnakeDrive, operator: str, visits: list[Visit], target: float, seed: int) -> Iterator[Order]:
    stops = [Stop(visit.name, visit.s_mm) for visit in visits if not visit.note]
    for order in scripted(drive, stops, target):
        if operator == "scripted" or order.event in (None, "arrived"):
            yield order
        if operator == "adversarial" and order.event == "arrived":
            yield from adversarial(drive, _ATTACK_STEPS, seed)


def _note(order: Order, drive: SnakeDrive, visits: list[Visit]) -> Visit | None:
    """What an order about a landmark came to."""
    if order.stop is None:
        return None
    state = drive.state
    visit = next(one for one in visits if one.name == order.stop.name)
    visit.reached = True
    visit.looked = visit.looked or order.event == "looked"
    if order.event == "arrived" and not drive.can_look:
        visit.note = "too near the entrance to look round: the links that bend are not inside yet"
    elif order.event == "gave up":
        visit.note = f"the look-round was not finished: {order.reason}"
    if order.looked is not None:
        visit.looked_from_mm, visit.sides = order.looked.s_mm, order.looked.sides
    if state.mode == "looking":
        visit.steps += 1
        rest, view = drive.snake.camera(state.q_conformed, state.base), drive.snake.camera(state.q, state.base)
        x, y, _ = rest[:3, :3].T @ view[:3, 2]
        steered = drive.settings.control == "parameterised"
        visit.turned(state.steering if steered else None, (float(x), float(y)))
        visit.deviation_max_mm = max(visit.deviation_max_mm, float(state.deviation.depth.max()))
        visit.force_max_n = max(visit.force_max_n, float(np.linalg.norm(state.forces.total)))
    return visit


def _why_it_ended(drive: SnakeDrive, target: float, retries: Sequence[Retry]) -> str | None:
    """What ended the drive before its target, in words; None where it is there."""
    if drive.lost or drive.tip_s >= target - 1e-6:
        return drive.lost
    if retries and not retries[-1].passed:  # the robot has drawn back since it was held
        last = retries[-1]
        failed = sum(one.at_mm == last.at_mm for one in retries)
        came = f", the last one {last.outcome}" if last.beyond_mm > 0.0 else ""
        return f"{last.words}; {failed} more attempts failed there{came}; {_REMEDY}"
    return drive.state.held_by or "steps that hardly move it"


def _close(visits: list[Visit], drive: SnakeDrive, stopped: str | None) -> None:
    for visit in visits:
        if not visit.reached and not visit.note:
            visit.note = f"not reached: the tip ended at {drive.tip_s:.0f} mm" + (f", {stopped}" if stopped else "")
