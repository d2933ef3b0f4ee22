"""What the tools of stored runs have swept, and how near they have passed to bone: made as jobs, of the run alone."""

from __future__ import annotations

import numpy as np

from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.drives.swept_file import check, packed
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.jobs import Job, Jobs, Progress
from app.store import Store
from vfix_engine.errors import InputError
from vfix_engine.runtime.run import TICKS, Run
from vfix_engine.study.series import series_of
from vfix_engine.study.swept import SweptPoses, near_passes, swept_volume
from vfix_engine.worlds.registry import spec_of

FILE = "swept-1.bin"  # the number changes where it is made in another way
_READ, _SWEPT = 0.05, 0.7  # shares of the time until each stage has ended


class SweptRuns:
    """Thread-safe. A file is stored as derived of the run's steps, which never change; it goes with the run."""

    def __init__(self, store: Store, runs: RunService, jobs: Jobs) -> None:
        self._store, self._runs, self._jobs = store, runs, jobs
        self._made: Cache[str, bytes] = Cache(4)

    def start(self, run_id: str) -> Job:
        """Make it as a job, or find it where it was made before. Raises NotFound, and InputError for a snake's run."""
        run = self._runs.get(run_id)
        key = _key(run)

        def work(progress: Progress) -> str:
            if self.known(run_id) is None:
                self._make(run, progress)
            return run_id

        return self._jobs.submit(
            work, kind="swept", lane="swept", case_id=run.case_id, subject="Swept volume", same=f"{FILE} {key}"
        )

    def known(self, run_id: str) -> bytes | None:
        """The file, see `swept_file`; None where it was not made, or is damaged. Raises as `start`."""
        key = _key(self._runs.get(run_id))
        path = self._store.derived.path(key, FILE)
        if path is None:
            return self._made.peek(key)
        try:
            return check(path.read_bytes())
        except (OSError, InputError):
            return None

    def _make(self, run: StoredRun, progress: Progress) -> None:
        progress("Reading the run", 0.0)
        with self._runs.laid_out(run.id) as place:
            read = Run.read(place)
        spec = spec_of(read)
        scene = spec.scene  # type: ignore[attr-defined]  # of a rigid tool, as `_key` has checked
        poses = SweptPoses.of(series_of(read, spec))
        swept = swept_volume(poses, progress=lambda stage, share: progress(stage, _READ + (_SWEPT - _READ) * share))
        passes = near_passes(
            np.asarray(scene.vertices),
            np.asarray(scene.faces),
            poses,
            progress=lambda stage, share: progress(stage, _SWEPT + (1.0 - _SWEPT) * share),
        )
        data = packed(swept, passes)
        if not self._store.writable:
            self._made.get(_key(run), lambda: data)
            return
        self._store.derived.put(_key(run), FILE, lambda file: file.write(data))
        try:
            self._runs.get(run.id)
        except NotFound:  # deleted meanwhile: nothing of it may remain
            self._store.derived.remove([_key(run)])
            raise


def _key(run: StoredRun) -> str:
    if run.mode is None:
        raise InputError("the run has no rigid tool.")
    if TICKS not in run.files:
        raise InputError("the run has no samples.")
    return run.files[TICKS].sha256
