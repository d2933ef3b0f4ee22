"""Previews of the islands of a threshold while it is chosen: at half resolution immediately, in full as a job."""

from __future__ import annotations

import secrets
import threading
from collections import OrderedDict
from dataclasses import replace

from app.cases.service import CaseService
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.jobs import Job, Jobs, Progress
from vfix_engine.anatomy.islands import Islands, islands, region_at
from vfix_engine.anatomy.segmentation import SegmentRequest
from vfix_engine.arrays import BoolArray
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.progress import no_progress

HALF = 2
_KEPT = 3  # full results; the page shows the newest


class IslandPreviews:
    """Islands in the widest CT of a case; nothing is stored. Thread-safe."""

    def __init__(self, cases: CaseService, jobs: Jobs) -> None:
        self._cases, self._jobs = cases, jobs
        self._regions: Cache[tuple[object, ...], BoolArray | None] = Cache(3)
        self._full: OrderedDict[str, Islands] = OrderedDict()
        self._lock = threading.Lock()

    def half(self, case_id: str, request: SegmentRequest) -> Islands:
        """Return the islands at half resolution, in about 0.1 s.

        Raises NotFound, InputError without a CT, and ImageError.
        """
        return self._found(case_id, request, HALF)

    def full(self, case_id: str, request: SegmentRequest) -> Islands:
        """Return the islands at full resolution. Raises as `half`."""
        return self._found(case_id, request, 1)

    def start(self, case_id: str, request: SegmentRequest) -> Job:
        """Find the islands at full resolution as a job; its result is a key for `result`.

        Raises NotFound and InputError.
        """
        name = self._cases.get(case_id).name
        self._volume(case_id)

        def work(progress: Progress) -> str:
            found = self._found(case_id, request, 1, progress)
            key = f"islands-{secrets.token_hex(6)}"
            with self._lock:
                self._full[key] = found
                while len(self._full) > _KEPT:
                    self._full.popitem(last=False)
            return key

        return self._jobs.submit(work, kind="islands", lane=f"islands {case_id}", case_id=case_id, subject=name)

    def result(self, key: str) -> Islands:
        """Return the islands of a job; only the newest few are kept. Raises NotFound."""
        with self._lock:
            if key not in self._full:
                raise NotFound("these islands are not kept any more; ask for them again.")
            return self._full[key]

    def _found(self, case_id: str, request: SegmentRequest, step: int, progress: Progress | None = None) -> Islands:
        source, volume = self._volume(case_id)
        band = replace(request.band, low_hu=0.0, high_hu=0.0)  # the region is the same for every threshold
        inside = self._regions.get((source, band, step), lambda: region_at(volume, band, step))
        return islands(volume, request, step, inside, progress or no_progress)

    def _volume(self, case_id: str) -> tuple[str, Volume]:
        case = self._cases.get(case_id)
        volume = self._cases.volume(case)
        if volume is None:
            raise InputError("this case was made of a surface; only a CT can be segmented.")
        return case.volumes[0].source, volume
