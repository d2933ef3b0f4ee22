"""Structures of a case that were imported: added out of a segmentation, renamed, recoloured, deleted."""

from __future__ import annotations

import re
import secrets
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.cases.model import Case, CaseContent
from app.cases.service import CaseService
from app.cases.structures import Provenance, Structure, encloses
from app.kit.errors import NotFound
from app.kit.names import COLOUR, MAX_NAME, check_name
from app.store.models import DocumentRow, DocumentStateRow
from vfix_engine.anatomy.bone import slice_uncertainty_mm
from vfix_engine.anatomy.labels.reading import AnatomyPlace, Segmentation
from vfix_engine.anatomy.labels.surfaces import LabelSurface
from vfix_engine.errors import InputError

MAX_STRUCTURES = 400  # of a case
OUTLINE_COLOUR = "#f2c14e"  # of bone in the slices
_ALIKE = 30  # of 255, in each channel
# For labels whose file has no colour: far apart from each other and from bone, with every common colour blindness.
_PALETTE = ("#e69f00", "#56b4e9", "#009e73", "#f0e442", "#cc79a7", "#d55e00", "#0072b2", "#9f7fd6")


def _is_bones(colour: str) -> bool:
    """Whether a colour is taken for that of bone's outline."""
    one, bone = (np.frombuffer(bytes.fromhex(text[1:]), np.uint8).astype(int) for text in (colour, OUTLINE_COLOUR))
    return bool(np.abs(one - bone).max() < _ALIKE)


class CaseStructures:
    """Imported structures, by case and id; may be used from any thread."""

    def __init__(self, cases: CaseService) -> None:
        self._cases = cases

    def place(self, case_id: str) -> AnatomyPlace:
        """Where the anatomy of a case lies, for the reader of a segmentation. Raises NotFound."""
        case = self._cases.get(case_id)
        volume = self._cases.volume(case)
        if volume is None:
            return AnatomyPlace(self._cases.case_surface(case_id).bounds)
        k, j, i = volume.hu.shape
        return AnatomyPlace(volume.bounds, volume.transform_index_to_lps, (i, j, k))

    def add(self, case_id: str, found: Segmentation) -> tuple[Structure, ...]:
        """Store every label as a structure; returns the new ones.

        The notes of the file as a whole are those of each of its structures. A name that the case has already gets a
        number, such as 'Liver 2'.
        Raises NotFound, and InputError where the case would have too many.
        """
        made: list[tuple[Structure, LabelSurface]] = []
        structures: list[Structure] = []
        before = len(self._cases.get(case_id).protectable)
        if before + len(found.surfaces) > MAX_STRUCTURES:
            raise InputError(
                f"a case may have {MAX_STRUCTURES} imported structures; delete some of the {before} first."
            )
        for number, surface in enumerate(found.surfaces):
            made.append((self._stored(surface, before + number, found.notes), surface))
        infos = tuple(self._cases.files.put_surface(item.surface, surface.mesh) for item, surface in made)

        def added(content: CaseContent, _: Session) -> CaseContent:
            taken = {item.name for item in content.structures}
            for (item, _surface), info in zip(made, infos, strict=True):
                structures.append(replace(item, geometry=info.source, name=_untaken(item.name, taken)))
                taken.add(structures[-1].name)
            surfaces = content.surfaces + infos
            return replace(content, surfaces=surfaces, structures=(*content.structures, *structures))

        self._cases.change_content(case_id, added)
        return tuple(structures)

    @staticmethod
    def _stored(surface: LabelSurface, number: int, notes: Sequence[str]) -> Structure:
        structure_id = f"structure-{secrets.token_hex(4)}"
        voxel_mm = float(surface.voxel_mm.max())
        provenance, off_mm = Provenance("segmentation", None, surface.value, voxel_mm), slice_uncertainty_mm(voxel_mm)
        coarse = (
            f"Its voxels are up to {voxel_mm:g} mm long: its surface may be {off_mm:.2f} mm off, by which the margin "
            "of a hard zone grows."
        )
        return Structure(
            structure_id,
            usable_name(surface.name, f"Label {surface.value}"),
            "spare",
            structure_id,
            "",
            provenance,
            off_mm,
            encloses(surface.mesh),
            colour=_PALETTE[number % len(_PALETTE)]
            if surface.colour is None or _is_bones(surface.colour)
            else surface.colour,
            notes=(*surface.notes, *notes, *([coarse] if off_mm else [])),
        )

    def change(self, case_id: str, structure_id: str, *, name: str | None = None, colour: str | None = None) -> Case:
        """Rename or recolour an imported structure. Raises NotFound and InputError."""
        if name is not None:
            check_name(name, "structure's name")
        if colour is not None and not re.fullmatch(COLOUR, colour):
            raise InputError("a structure's colour is written as '#rrggbb', in lower case.")
        if colour is not None and _is_bones(colour):
            raise InputError("that colour is bone's outline in the slices; choose another for the structure.")

        def changed(item: Structure) -> Structure:
            return replace(item, name=name or item.name, colour=colour or item.colour)

        return self._cases.change_content(case_id, lambda content, _: _with(content, structure_id, changed))

    def delete(self, case_id: str, structure_id: str) -> Case:
        """Take an imported structure off a case. Raises NotFound, and InputError where a document refers to it."""

        def without(content: CaseContent, session: Session) -> CaseContent:
            gone = _imported(content, structure_id)
            if used := _documents_with(session, case_id, structure_id):
                raise InputError(f"the structure is used in {used}; take it out of that first.")
            return replace(
                content,
                surfaces=tuple(item for item in content.surfaces if item.name != gone.surface),
                structures=tuple(item for item in content.structures if item.id != structure_id),
            )

        source = self._cases.get(case_id).structure(structure_id).geometry
        case = self._cases.change_content(case_id, without)
        self._cases.remove_unused(source)
        return case


def _with(content: CaseContent, structure_id: str, change: Callable[[Structure], Structure]) -> CaseContent:
    changed = change(_imported(content, structure_id))
    structures = tuple(changed if item.id == structure_id else item for item in content.structures)
    return replace(content, structures=structures)


def _imported(content: CaseContent, structure_id: str) -> Structure:
    found = next((item for item in content.structures if item.id == structure_id), None)
    if found is None:
        raise NotFound(f"this case has no structure {structure_id!r:.40}.")
    if found.role != "spare":
        raise InputError(f"the structure {structure_id!r:.40} is what the case was made of; it stays as it is.")
    return found


def _documents_with(session: Session, case_id: str, structure_id: str) -> str:
    """Names of the documents of a case whose present state refers to a structure, in words; '' where none does."""
    query = (
        select(DocumentRow.kind, DocumentRow.name, DocumentStateRow.refs)
        .join(DocumentStateRow, DocumentStateRow.document_id == DocumentRow.id)
        .where(DocumentRow.case_id == case_id, DocumentRow.deleted_at.is_(None))
        .where(DocumentStateRow.position == DocumentRow.cursor)
    )
    named = [
        f"the {kind} {name!r}"
        for kind, name, refs in session.execute(query)
        if {"kind": "structure", "id": structure_id} in refs
    ]
    return " and ".join(named)


def _untaken(name: str, taken: set[str]) -> str:
    """The name, or the first of 'name 2', 'name 3', ... that is not taken."""
    if name not in taken:
        return name
    numbered = (f"{name[: MAX_NAME - 5]} {number}" for number in count(2))
    return next(one for one in numbered if one not in taken)


def usable_name(text: str, otherwise: str) -> str:
    """A name out of a file, without what a name may not hold; `otherwise` where nothing that is seen is left."""
    kept = "".join(" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in text)
    kept = "".join(c for c in kept if unicodedata.category(c) not in ("Cf", "Cs"))
    shortened = " ".join(kept.split())[:MAX_NAME]
    try:
        return check_name(shortened, "structure's name")
    except InputError:
        return otherwise
