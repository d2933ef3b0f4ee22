"""The snake's world as plain values and arrays, for the control process and a run's manifest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import Pathway, TissueMotion
from ...pathway.tissue_motion import Breathing, Peristalsis, Together
from ...robots.snake import SnakeModel
from ...runtime.snapshot import Snapshot
from ...runtime.system import Worker
from ...snake.conform.conforming import driven_curve
from .lumen import Lumen, lumen_between
from .narrow import narrowest
from .plans.planner import Planner
from .settings import DriveSettings, SnakeSettings
from .snapshot import SnakeSnapshot
from .stepping.constants import start_of
from .system import SnakeSystem

# Drive settings of runs recorded before there were these.
_BEFORE: dict[str, Any] = {"lock_bend": False, "arm": "certified", "yield_mm_per_s_per_n": 0.0}
_FIXED = ("base", "q_nominal")  # arrays of a fixed base; runs of before have none, and were inserted
_MOTIONS: dict[str, type[Breathing] | type[Peristalsis]] = {"breathing": Breathing, "peristalsis": Peristalsis}


@dataclass(frozen=True, eq=False)
class LumenSurface:
    """A lumen as its surface, vertices (V, 3) mm and faces (F, 3), and the clicks (3,) at its two ends, LPS."""

    vertices: Array
    faces: NDArray[np.int32]
    start: Array
    end: Array


@dataclass(frozen=True, eq=False)
class LumenContours:
    """A lumen as the control contours of its pathway; see ``Pathway`` for centre, radius, count, knots.

    curve_points, curve_step_mm: followed while the tissue is still, None: the pathway's own centres;
    slack: (N,) mm at its points, how far a joint may leave it. wall_radius: of the surface from which it was made.
    first: (3,) direction of the polar angle 0, None: arbitrary.
    """

    centre: Array
    radius: Array
    count: int = 197
    knots: Array | None = None
    curve_points: Array | None = None
    curve_step_mm: float = 0.0
    slack: Array | None = None
    wall_radius: Array | None = None
    first: Array | None = None

    @classmethod
    def of(cls, made: Lumen) -> Self:
        """From a prepared lumen."""
        path, curve = made.pathway, made.curve
        return cls(
            path.centre, path.radius, path.count, path.knots, curve.points, curve.step_mm, made.slack,
            path.wall_radius, path.first,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class SnakeSystemSpec:
    """A snake in a lumen.

    Args:
        lumen: contours, or a surface with two clicks, from which they are made when the system is built.
        snake: the whole robot.
        settings: at the start; drive: settings fixed for the whole drive.
        tissue: motion of the lumen in simulated time, None: it is still. For motions of ``tissue_motion`` a manifest
            can be written.
        tip_s: mm, initial arc length of the tip.
        anyway: accept a lumen that is narrower than the robot within its range.
        base, q_nominal: of a robot on a fixed base, (4, 4) transform_base_to_patient and (2L,) rad, None: straight; all
            its links are bent, and nothing is inserted (Kwok 2013, study II). base None: it is inserted.
    """

    lumen: LumenContours | LumenSurface
    snake: SnakeModel
    settings: SnakeSettings = field(default_factory=SnakeSettings)
    drive: DriveSettings = field(default_factory=DriveSettings)
    tissue: TissueMotion | None = None
    tip_s: float = 0.0
    anyway: bool = False
    base: Array | None = None
    q_nominal: Array | None = None

    @property
    def world(self) -> str:
        """'snake'."""
        return "snake"

    @property
    def snapshot_type(self) -> type[Snapshot]:
        """``SnakeSnapshot``."""
        return SnakeSnapshot

    @property
    def snapshot_numbers(self) -> int:
        """Columns of the joints, of each link its capsule, deviation and bound, and of the control bends."""
        bends = 3 * self.drive.bends * (min(self.drive.manipulated, self.snake.links) + 1)
        return self.snake.dof + 9 * self.snake.links + bends

    @property
    def has_worker(self) -> bool:
        """True: shapes and bends take longer than a tick."""
        return True

    def with_contours(self) -> SnakeSystemSpec:
        """The same with contours fitted to its surface; takes a few seconds.

        Raises:
            PathwayError: clicks or a surface that give no path.
        """
        if isinstance(self.lumen, LumenContours):
            return self
        surface = self.lumen
        mesh = TriangleMesh(surface.vertices, surface.faces)
        made = lumen_between(mesh, surface.start, surface.end, self.snake, self.drive)
        contours = LumenContours.of(made)
        return SnakeSystemSpec(
            contours, self.snake, self.settings, self.drive, self.tissue, self.tip_s, self.anyway, self.base,
            self.q_nominal,
        )  # fmt: skip

    def build(self) -> SnakeSystem:
        """The system itself.

        Raises:
            PathwayError: the lumen gives no pathway, or is narrower than the robot.
            InputError: a robot, settings or start that do not fit it.
        """
        pathway, curve, slack, given = self._parts()
        settings = self.settings.of_drive(self.drive)
        if not self.anyway:
            narrowest(pathway, self.snake, None, min(curve.length, self.snake.reach_mm()), given).refuse(self.snake)
        start = start_of(
            self.snake, pathway, settings, curve, slack, self.tip_s, adjusted=self.settings, base=self.base,
            q_nominal=self.q_nominal,
        )  # fmt: skip
        return SnakeSystem(start, Planner(self.snake, pathway, curve, slack, settings))

    def way_mm(self) -> tuple[float, float]:
        """Length of the curve that the robot follows at rest, and how far along it the tip can come, mm.

        Raises:
            PathwayError: the lumen gives no pathway.
        """
        _, curve = self.way()
        return curve.length, min(curve.length, self.snake.reach_mm())

    def way(self) -> tuple[Pathway, Curve]:
        """The pathway, and the curve that the robot follows at rest.

        Raises:
            PathwayError: the lumen gives no pathway.
        """
        return self._parts()[:2]

    def worker(self) -> Worker:
        """The planner, in the worker process; it has made one plan of each kind, so its kernels are loaded."""
        system = self.build()
        system.prepare()
        return system.planner

    def _parts(self) -> tuple[Pathway, Curve, Array | None, Curve | None]:
        """Pathway, the curve that is followed at first, the slack about it, and the curve that is given."""
        found = self.with_contours().lumen
        assert isinstance(found, LumenContours)
        pathway = Pathway(
            found.centre, found.radius, found.count, motion=self.tissue, knots=found.knots,
            wall_radius=found.wall_radius, first=found.first,
        )  # fmt: skip
        given = None if found.curve_points is None else Curve(found.curve_points, found.curve_step_mm)
        curve = driven_curve(pathway, given)
        return pathway, curve, found.slack if given is not None and curve is given else None, given

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """Plain values for JSON, and arrays by name.

        Raises:
            InputError: a user-defined tissue motion, which cannot be written.
        """
        names, kind = _arrays_of(self.lumen), "contours" if isinstance(self.lumen, LumenContours) else "surface"
        arrays = {name: np.asarray(value) for name in names if (value := getattr(self.lumen, name)) is not None}
        arrays |= {name: np.asarray(value) for name in _FIXED if (value := getattr(self, name)) is not None}
        values: dict[str, Any] = {
            "lumen": kind, "snake": asdict(self.snake), "settings": self.settings.to_dict(),
            "drive": asdict(self.drive), "tissue": _motion_values(self.tissue), "tip_s": self.tip_s,
            "anyway": self.anyway,
        }  # fmt: skip
        if isinstance(self.lumen, LumenContours):
            values |= {"count": self.lumen.count, "curve_step_mm": self.lumen.curve_step_mm}
        return values, arrays

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The inverse.

        Raises:
            InputError: a part is missing or does not fit.
        """
        try:
            lumen: LumenContours | LumenSurface
            if values["lumen"] == "surface":
                lumen = LumenSurface(*(arrays[name] for name in ("vertices", "faces", "start", "end")))
            else:
                lumen = LumenContours(
                    arrays["centre"], arrays["radius"], values["count"], arrays.get("knots"),
                    arrays.get("curve_points"), values["curve_step_mm"], arrays.get("slack"), arrays.get("wall_radius"),
                    arrays.get("first"),
                )  # fmt: skip
            return cls(
                lumen, SnakeModel(**values["snake"]), SnakeSettings.from_dict(values["settings"]),
                DriveSettings(**(_BEFORE | values["drive"])), _motion_of(values["tissue"]), values["tip_s"],
                values.get("anyway", True),  # runs of versions without this check are replayed
                **{name: arrays.get(name) for name in _FIXED},
            )  # fmt: skip
        except (KeyError, TypeError) as error:
            raise InputError(f"the parts of a snake's world do not fit: {error}") from error


def _arrays_of(lumen: LumenContours | LumenSurface) -> tuple[str, ...]:
    if isinstance(lumen, LumenSurface):
        return "vertices", "faces", "start", "end"
    return "centre", "radius", "knots", "curve_points", "slack", "wall_radius", "first"


def _motion_values(motion: TissueMotion | None) -> Any:
    if motion is None:
        return None
    if isinstance(motion, Together):
        return {"together": [_motion_values(one) for one in motion.motions]}
    for name, kind in _MOTIONS.items():
        if isinstance(motion, kind):
            return {name: asdict(motion)}
    raise InputError(f"a tissue motion of one's own cannot be written: {motion!r:.60}")


def _motion_of(values: Any) -> TissueMotion | None:
    if values is None:
        return None
    ((name, given),) = values.items()
    if name == "together":
        motions = [_motion_of(one) for one in given]
        return Together(tuple(one for one in motions if one is not None))
    if name not in _MOTIONS:
        raise InputError(f"no tissue motion is called '{name}'; there are together, {', '.join(_MOTIONS)}")
    if name == "breathing":
        given = given | {"along": tuple(given["along"])}
    return _MOTIONS[name](**given)
