"""Scores and series of stored runs: computed from the run when first asked for, the scores stored beside it."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.kit.cache import Cache
from app.store import Store
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.runtime.run import TICKS, Run
from vfix_engine.runtime.system import SystemSpec
from vfix_engine.study.holds import holds_of
from vfix_engine.study.metrics import score_run
from vfix_engine.study.series import RunSeries, series_of
from vfix_engine.worlds.registry import WORLDS, spec_of
from vfix_engine.worlds.rigid.row import PHASES
from vfix_engine.worlds.snake.row import LIMITS

if TYPE_CHECKING:
    from vfix_engine.study.lumen import LumenSeries, TaskReplay

VERSION = 8  # of the definitions of the score and of a hold
RATE_HZ = 30.0
MOST_SAMPLES = 36_000  # of one answer; longer runs have fewer a second
LUMEN_RATE_HZ, MOST_LUMEN_SAMPLES = 20.0, 12_000  # the same of a robot with many links

_NO_SAMPLES = "the run has no samples."
_DONE = PHASES.index("done")


class RunScores:
    """Scores of runs of a rigid tool, and of a robot in a lumen. Thread-safe.

    A score is stored as a derived file of the run's steps and goes with them; its name has a hash of all of the run's
    files, which never change.

    wall_of: of the case of a run, by its id, for a task with lines of sight; None where there is no such wall.
    """

    def __init__(
        self,
        store: Store,
        runs: RunService,
        wall_of: Callable[[str | None], TriangleMesh | None] = lambda case_id: None,
    ) -> None:
        self._store, self._runs, self._wall_of = store, runs, wall_of
        self._scores: Cache[str, dict[str, Any]] = Cache(256)
        self._series: Cache[str, bytes] = Cache(4)
        self._tasks: Cache[str, TaskReplay] = Cache(4)

    def of(self, run_id: str) -> dict[str, Any]:
        """`RunScore` or `LumenScore` as plain values, with `holds` and `completed`.

        Raises NotFound, and InputError for a run that cannot be scored.
        """
        run = self._runs.get(run_id)
        return self.known(run) or self._scores.get(score_file(run), lambda: self._make(run))

    def known(self, run: StoredRun) -> dict[str, Any] | None:
        """The score where it was computed before. Never waits."""
        if TICKS not in run.files:
            return None
        key = score_file(run)
        found = self._scores.peek(key)
        path = None if found is not None else self._store.derived.path(run.files[TICKS].sha256, key)
        if path is None:
            return found
        stored = _unsealed(path)
        return None if stored is None else self._scores.get(key, lambda: stored)

    def series(self, run_id: str) -> bytes:
        """The series of a run as JSON, see `SeriesPublic` and `LumenSeriesPublic`.

        Raises NotFound, and InputError for a run of another world.
        """
        run = self._runs.get(run_id)

        def make() -> bytes:
            with self._runs.laid_out(run_id) as place:
                read = Run.read(place)
            plain = _lumen_series if _in_lumen(read) else _rigid_series
            return json.dumps(plain(read, run), allow_nan=False).encode()

        if TICKS not in run.files:
            raise InputError(_NO_SAMPLES)
        return self._series.get(run.id, make)

    def task(self, run_id: str) -> TaskReplay:
        """The task of a run in a lumen over its time, without a moment where it is of none; takes as long as a score.

        Raises NotFound, and InputError for a run of another world, or where the wall of its task is not at hand.
        """
        run = self._runs.get(run_id)

        def make() -> TaskReplay:
            from vfix_engine.study.lumen import task_replay  # imported here: loads the snake's world

            with self._runs.laid_out(run_id) as place:
                read = Run.read(place)
            return task_replay(read, _lumen_rate(read), self._wall_of(run.case_id))

        if TICKS not in run.files:
            raise InputError(_NO_SAMPLES)
        return self._tasks.get(run.id, make)

    def _make(self, run: StoredRun) -> dict[str, Any]:
        with self._runs.laid_out(run.id) as place:
            read = Run.read(place)
        spec = spec_of(read)
        wall = self._wall_of(run.case_id) if _in_lumen(read) else None
        score = _lumen_score(read, spec, wall) if _in_lumen(read) else _rigid_score(read, spec)
        score = json.loads(json.dumps(score, allow_nan=False))  # as it is read again
        lacking = (score.get("task") or {}).get("lacking")  # it is scored once the case with its wall is there again
        if self._store.writable and not lacking:
            sealed = _sealed(score)
            self._store.derived.put(run.files[TICKS].sha256, score_file(run), lambda file: file.write(sealed))
        return dict(score)


def _in_lumen(run: Run) -> bool:
    world = WORLDS.get(str(run.manifest["world"]))
    return world is not None and world.arms


def _rigid_score(run: Run, spec: SystemSpec) -> dict[str, Any]:
    score = score_run(run, spec).to_dict()
    score["completed"] = bool((run.column("phase")[-score["samples"] :] == _DONE).any())
    score["reach_mm"] = float(series_of(run, spec).reach.min())
    score["holds"] = [hold.to_dict() for hold in holds_of(run, spec)]
    return score


def _lumen_score(run: Run, spec: SystemSpec, wall: TriangleMesh | None) -> dict[str, Any]:
    from vfix_engine.study.lumen import lumen_holds_of, score_lumen_run  # imported here: loads the snake's world

    score = score_lumen_run(run, spec, wall).to_dict()
    score["holds"] = [hold.to_dict() for hold in lumen_holds_of(run, spec)]
    return score


def _rigid_series(read: Run, run: StoredRun) -> dict[str, Any]:
    series = series_of(read)
    rate = min(RATE_HZ, MOST_SAMPLES / float(series.t[-1]))
    return plain_series(series.thinned(rate), run)


def _lumen_series(read: Run, run: StoredRun) -> dict[str, Any]:
    from vfix_engine.study.lumen import lumen_series_of  # imported here: loads the snake's world

    return plain_lumen_series(lumen_series_of(read, _lumen_rate(read)), run)


def _lumen_rate(read: Run) -> float:
    return min(LUMEN_RATE_HZ, MOST_LUMEN_SAMPLES / float(read.column("t").max()))


def plain_lumen_series(series: LumenSeries, run: StoredRun) -> dict[str, Any]:
    """The same of a run in a lumen."""
    return {
        "run": run.id,
        "world": run.world,
        "arm": run.arm,
        "certified": run.certified,
        "limits": [name or "" for name in LIMITS],
        "radius_mm": series.radius_mm,
        "t_s": _plain(series.t),
        "chain_mm": _plain(series.chain, 2),
        "eye": _plain(series.eye, 3),
        "shaft": _plain(series.shaft),
        "side": _plain(series.side),
        "depth_mm": _plain(series.depth, 2),
        "speed_mm_per_s": _plain(series.speed, 2),
        "deviation_mm": _plain(series.deviation, 3),
        "bound_mm": _plain(series.bound, 3),
        "link": series.link.tolist(),
        "beyond_mm": _plain(series.beyond, 6),
        "distal_mm": _plain(series.distal, 3),
        "bend": _plain(series.bend),
        "force_n": _plain(series.force),
        "guidance_n": _plain(series.guidance),
        "guidance_xy_n": _plain(series.guidance_xy, 2),
        "resistance_xy_n": _plain(series.resistance_xy, 2),
        "held": series.held.astype(int).tolist(),
        "limit": series.limit.tolist(),
        "limit_link": series.limit_link.tolist(),
    }


def plain_series(series: RunSeries, run: StoredRun) -> dict[str, Any]:
    """A series as plain values, rounded to 0.1 µm, errors to 1 nm; what does not exist is None."""
    plane = series.plane
    return {
        "run": run.id,
        "world": run.world,
        "mode": run.mode,
        "certified": run.certified,
        "structures": list(series.structures),
        "joints": [{"name": one.name, "unit": one.unit} for one in series.joints],
        "radii_mm": _plain(series.radius),
        "phases": list(PHASES),
        "t_s": _plain(series.t),
        "tip": _plain(series.tip),
        "segments": _plain(np.concatenate([series.start, series.end], axis=2)),
        "side": _plain(series.side),
        "speed": _plain(series.speed.T, 6),
        "clearance_mm": _plain(np.where(series.clearance < series.reach[:, None], series.clearance, np.nan).T),
        "reach_mm": _plain(series.reach),
        "nearest": series.nearest.tolist(),
        "force_n": _plain(np.linalg.norm(series.force, axis=1)),
        "error_mm": _plain(series.error, 6),
        "progress_mm": _plain(series.progress),
        "flat_mm": None if plane is None else _plain(series.flat),
        "across_mm": None if plane is None else _plain(series.across.T, 6),
        "path_mm": None if plane is None else _plain(plane.curve),
        "phase": series.phase.tolist(),
        "held": series.held.astype(int).tolist(),
    }


def score_file(run: StoredRun) -> str:
    """Name of the derived file of a run's score, by all of its files. Raises InputError for a run without steps."""
    if TICKS not in run.files:
        raise InputError(_NO_SAMPLES)
    digest = hashlib.sha256("".join(f"{name}:{file.sha256};" for name, file in sorted(run.files.items())).encode())
    return f"score-{VERSION}-{digest.hexdigest()[:32]}.json"


def _sealed(score: dict[str, Any]) -> bytes:
    """A score as it is stored, with a hash by which damage is seen."""
    text = json.dumps(score)
    return json.dumps({"sha256": hashlib.sha256(text.encode()).hexdigest(), "score": score}).encode()


def _unsealed(path: Path) -> dict[str, Any] | None:
    """A stored score; None where it is damaged, so that it is computed again."""
    try:
        stored = json.loads(path.read_text(encoding="utf-8"))
        score: dict[str, Any] = stored["score"]
        sound = stored["sha256"] == hashlib.sha256(json.dumps(score).encode()).hexdigest()
    except (OSError, ValueError, TypeError, LookupError, RecursionError):
        return None
    return score if sound else None


def _plain(values: Array, digits: int = 4) -> Any:
    """Nested lists of rounded numbers, None for those that are not finite."""
    rounded = np.round(values, digits)
    if np.isfinite(rounded).all():
        return rounded.tolist()
    return [_plain(one, digits) if one.ndim else _number(float(one)) for one in rounded]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
