"""Volumes that lie over a head: an MR or another scan, stored with its case; never what bone is judged by."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from sqlalchemy.orm import Session

from app.cases.import_names import WantedName, sort_of_volume
from app.cases.model import Bounds, Case, CaseContent, Overlay
from app.cases.second_volume import SecondVolume
from app.cases.service import CaseService, volume_named
from app.kit.errors import NotFound
from app.kit.names import check_name
from vfix_engine.anatomy.overlay import OverlayVolume
from vfix_engine.errors import InputError, PlanError

MAX_OVERLAYS = 8  # of a case


class Overlays:
    """Volumes over heads, by case and id; may be used from any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases

    def add(self, case_id: str, wanted: WantedName, found: OverlayVolume, notes: Sequence[str]) -> Overlay:
        """Store a volume that was read. Raises NotFound and InputError."""
        wanted.check()
        self.check_room(case_id)
        overlay_id = f"overlay-{secrets.token_hex(6)}"
        info = self._cases.files.put_volume(overlay_id, found.volume)
        made: list[Overlay] = []

        def added(content: CaseContent, _: Session) -> CaseContent:
            taken = {item.name for item in content.overlays}
            name, more = wanted.among(taken, sort_of_volume(found.modality), found.description)
            made.append(Overlay(overlay_id, name, found.window, found.level, info, (*notes, *more)))
            return replace(content, overlays=(*content.overlays, made[-1]))

        self._cases.change_content(case_id, added)
        return made[-1]

    def check_room(self, case_id: str) -> None:
        """Raises NotFound, and InputError where a case has as many as it may have."""
        if len(self._cases.get(case_id).overlays) >= MAX_OVERLAYS:
            raise InputError(f"a case may have {MAX_OVERLAYS} volumes laid over it; delete one first.")

    def rename(self, case_id: str, overlay_id: str, name: str) -> Case:
        """Give one another name. Raises NotFound and InputError."""
        check_name(name, "volume's name")

        def renamed(content: CaseContent, _: Session) -> CaseContent:
            _found(content, overlay_id)
            others = (replace(item, name=name) if item.id == overlay_id else item for item in content.overlays)
            return replace(content, overlays=tuple(others))

        return self._cases.change_content(case_id, renamed)

    def check_laid(self, case_id: str, second: SecondVolume) -> None:
        """Raise PlanError where a second volume is not there, or would lie beside the head of a case.

        One of another case has to be confirmed as this patient's (HAZ-38).
        """
        try:
            over = self._cases.get(second.case)
            if not over.volumes and second.volume is None:
                raise PlanError(f"the head {over.name!r} came without a CT; nothing of it can be laid over.")
            info = volume_named(over, second.volume)
        except NotFound as error:
            raise PlanError(f"the second volume is not there: {error}") from error
        head = self._cases.get(case_id)
        if over.id != head.id and not second.other_head:
            raise PlanError(
                f"the volume belongs to another head, {_dated(over)}, than the plan, {_dated(head)}. If both show the "
                "same patient, confirm it with other_head."
            )
        if not head.volumes:
            return
        apart = _apart_mm(info.bounds_lps_mm, second, head.volumes[0].bounds_lps_mm)
        if apart > 0.0:
            raise PlanError(f"the second volume would lie {apart:.0f} mm beside the head's CT; check its transform.")

    def delete(self, case_id: str, overlay_id: str) -> Case:
        """Take one off a case, with its file; a plan that lays it over says that it is gone. Raises NotFound."""
        gone: list[Overlay] = []

        def without(content: CaseContent, _: Session) -> CaseContent:
            gone.append(_found(content, overlay_id))
            return replace(content, overlays=tuple(item for item in content.overlays if item.id != overlay_id))

        case = self._cases.change_content(case_id, without)
        self._cases.remove_unused(gone[-1].volume.source)
        return case


def _dated(case: Case) -> str:
    return f"{case.name!r:.80} of {case.created[:10]}"


def _apart_mm(bounds: Bounds, second: SecondVolume, head: Bounds) -> float:
    """How far the box around a laid volume is from the head's along an axis, in mm; 0 where they meet."""
    transform = np.array(second.transform).reshape(4, 4)
    corners = np.array(list(product(*zip(*bounds, strict=True)))) @ transform[:3, :3].T + transform[:3, 3]
    low, high = np.array(head)
    gaps = np.maximum(corners.min(axis=0) - high, low - corners.max(axis=0))
    return max(0.0, float(gaps.max()))


def _found(content: CaseContent, overlay_id: str) -> Overlay:
    found = next((item for item in content.overlays if item.id == overlay_id), None)
    if found is None:
        raise NotFound(f"this case has no volume {overlay_id!r:.40} laid over it.")
    return found
