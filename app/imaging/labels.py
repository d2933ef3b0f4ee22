"""Painted labels of cases: strokes on the slices with undo, their voxels, exported files, and structures from them."""

from __future__ import annotations

import dataclasses
import secrets
from typing import Any

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace

from app.cases.files import STORED
from app.cases.model import Case, CaseContent, SurfaceInfo, VolumeInfo
from app.cases.segments import MAX_STRUCTURES
from app.cases.service import CaseService
from app.cases.structures import Provenance, Structure, encloses
from app.documents import Document
from app.documents.documents import Documents
from app.imaging.label_document import FIRST_COLOUR, LABEL, MOST_STORED_POINTS, MOST_STROKES, LabelStroke, PaintedLabel
from app.kit.array_files import ArraysUnusable, read_arrays
from app.kit.cache import Cache
from app.kit.errors import NotFound, TooLarge
from app.kit.jobs import Job, Jobs, Progress
from app.store import Store
from app.store.errors import StorageError
from vfix_engine.anatomy.labels.label_map import CroppedLabel
from vfix_engine.anatomy.labels.painting import draw_stroke, reaches
from vfix_engine.anatomy.labels.surfaces import surface_of
from vfix_engine.anatomy.labels.voxelized import voxels_inside
from vfix_engine.anatomy.labels.writing import label_file
from vfix_engine.arrays import BoolArray
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback, no_progress

PaintedDocument = Document[PaintedLabel]
_VALUE = 1  # value of the label's voxels in files
_BORDER_FROM = 0.3  # fraction of the work on a surface that draws the strokes


class PaintedLabels:
    """Painted labels by id. Thread-safe. Every change is durable before its method returns."""

    def __init__(self, store: Store, cases: CaseService, jobs: Jobs) -> None:
        self.documents = Documents(store, LABEL)
        self._files, self._cases, self._jobs = store.files, cases, jobs
        self._masks: Cache[str, BoolArray] = Cache(3)

    def create(
        self,
        case_id: str,
        name: str,
        *,
        colour: str = FIRST_COLOUR,
        volume: str | None = None,
        structure_id: str | None = None,
    ) -> PaintedDocument:
        """Create a label of a case, empty or with the voxels inside a structure.

        volume: name of the case's volume whose grid it uses; by default the one with the finest voxels.
        Raises NotFound, and InputError for a case without a CT, or a structure that is open or outside of that volume.
        """
        case = self._cases.get(case_id)
        info = _grid_of(case, volume)
        start = ""
        if structure_id is not None:
            structure = case.structure(structure_id)
            if structure.has_inside is False:
                raise InputError(
                    f"the surface of {structure.name!r} is open and has no inside; make a structure "
                    "of the CT by a threshold, and begin with that."
                )
            mesh, grid = self._cases.structure_mesh(case_id, structure_id), self._volume(case, info.name)
            mask = voxels_inside(mesh, grid.transform_index_to_lps, grid.hu.shape)
            if not mask.any():
                raise InputError(f"no voxel of the volume {info.name!r} lies inside that structure.")
            start = self._store_mask(mask)
        return self.documents.create(case_id, name, PaintedLabel(info.name, colour, start, ()))

    def case_of(self, document: PaintedDocument) -> Case:
        """Return the case of a label. Raises NotFound."""
        return self._cases.get(document.case_id)

    def check_reach(self, label_id: str, stroke: LabelStroke) -> None:
        """Raise InputError for a stroke that reaches no voxel of a label's grid."""
        document = self.documents.get(label_id)
        grid = self._volume(self.case_of(document), document.content.volume)
        if not reaches(grid.hu.shape, grid.transform_index_to_lps, stroke.stroke):
            raise InputError("the stroke is beyond the scan: it reaches no voxel.")

    def with_stroke(self, case_id: str, content: PaintedLabel, stroke: LabelStroke) -> PaintedLabel:
        """Return a label with one more stroke; if it has many, the earlier ones are replaced by a stored mask."""
        points = sum(len(each.points) for each in content.strokes) + len(stroke.points)
        if len(content.strokes) < MOST_STROKES and points <= MOST_STORED_POINTS:
            return replace(content, strokes=(*content.strokes, stroke))
        mask = self.mask(self._cases.get(case_id), content)
        return replace(content, start=self._store_mask(mask), strokes=(stroke,))

    def mask(self, case: Case, content: PaintedLabel) -> BoolArray:
        """Return the voxels (K, J, I) of a label, read-only. Raises NotFound and StorageError."""
        return self._masks.get(_key(case, content), lambda: self._drawn(case, content))

    def label(self, document: PaintedDocument, progress: ProgressCallback | None = None) -> CroppedLabel:
        """Return the label of a document on the whole grid. progress: may raise to cancel the drawing."""
        case, content = self._cases.get(document.case_id), document.content
        grid = self._volume(case, content.volume)
        if progress is None or self._masks.has(_key(case, content)):
            mask = self.mask(case, content)
        else:  # not through the cache: a cancellation would also fail other callers that wait for the same mask
            mask = self._drawn(case, content, progress)
        first = np.zeros(3, dtype=np.int64)
        return CroppedLabel(_VALUE, document.name, document.content.colour, mask, first, grid.transform_index_to_lps)

    def file(self, label_id: str, form: str) -> bytes:
        """Return a label as the content of a file, 'seg.nrrd' or 'nii.gz'. Raises ImageError for an empty one."""
        return label_file(self.label(self.documents.get(label_id)), form)

    def structure(self, case: Case, document: PaintedDocument) -> tuple[Structure | None, bool]:
        """Return the structure made from a label, or None, and whether the label has changed since."""
        own = _structure_id(document.id)
        found = next((item for item in case.structures if item.id == own), None)
        return found, found is not None and found.provenance.made_of != document.content.key

    def start(self, label_id: str) -> Job:
        """Make a structure from a label as a job, whose result is the id of the structure."""
        document = self._to_use(label_id)

        def work(progress: Progress) -> str:
            return self.run(label_id, progress).id

        return self._jobs.submit(
            work,
            kind="segmentation",
            lane="import",
            case_id=document.case_id,
            subject=document.name,
            document_id=document.id,
        )

    def run(self, label_id: str, progress: ProgressCallback = no_progress) -> Structure:
        """Make a structure of the case from the surface of a label, or update the one made before.

        Raises NotFound, and InputError for a label without voxels or a case with too many structures.
        """
        document = self._to_use(label_id)
        label = self.label(document, progress)
        if not label.mask.any():
            raise InputError("the label is empty; paint something first.")
        progress("Finding the border", _BORDER_FROM)
        found = surface_of(_cropped(label))
        progress("Storing the structure", 0.9)
        own, voxel = _structure_id(document.id), float(found.voxel_mm.max())
        name = f"{own}-{secrets.token_hex(3)}"  # new for each surface, since caches use the name as a key
        info = self._cases.files.put_surface(name, found.mesh)
        note = f"Painted on a grid of {voxel:g} mm, {found.volume_ml:.2f} ml: its border is known to half a voxel."
        made = Structure(
            own, document.name, "spare", name, info.source,
            Provenance("painted", None, None, voxel, document.content.key), 0.0, encloses(found.mesh),
            colour=document.content.colour, notes=(note,),
        )  # fmt: skip
        before = [item.geometry for item in self._cases.get(document.case_id).structures if item.id == own]
        self._cases.change_content(document.case_id, lambda content, _: _with(content, made, info))
        for source in before:
            if source != info.source:
                self._cases.remove_unused(source)
        return made

    def _to_use(self, label_id: str) -> PaintedDocument:
        """Return a label that a structure can be made from. Raises NotFound and InputError."""
        document = self.documents.get(label_id)
        if document.deleted_at:
            raise InputError("the painted label is deleted; restore it first.")
        others = self._cases.get(document.case_id).protectable
        if len(others) >= MAX_STRUCTURES and _structure_id(document.id) not in [item.id for item in others]:
            raise InputError(f"a case may have {MAX_STRUCTURES} structures beside its anatomy; delete some first.")
        return document

    def _volume(self, case: Case, name: str) -> Volume:
        volume = self._cases.volume(case, name)
        assert volume is not None
        return volume

    def _drawn(self, case: Case, content: PaintedLabel, progress: ProgressCallback = no_progress) -> BoolArray:
        """Draw the voxels: the last stroke on the cached mask before it, or else all strokes on the initial mask."""
        grid, strokes = self._volume(case, content.volume), content.strokes
        before = replace(content, strokes=strokes[:-1])
        if strokes and self._masks.has(_key(case, before)):
            mask, strokes = self.mask(case, before).copy(), strokes[-1:]
        elif content.start:
            mask = self._stored_mask(content.start, grid.hu.shape)
        else:
            mask = np.zeros(grid.hu.shape, dtype=bool)
        drawn, points = 0, sum(len(stroke.points) for stroke in strokes)

        def go_on() -> None:
            nonlocal drawn
            progress("Drawing the strokes", _BORDER_FROM * drawn / points)
            drawn += 1

        for stroke in strokes:
            draw_stroke(mask, grid.transform_index_to_lps, stroke.stroke, go_on)
        mask.setflags(write=False)
        return mask

    def _store_mask(self, mask: BoolArray) -> str:
        """Store a mask packed and compressed; return its source."""
        bits, shape = np.packbits(mask), np.array(mask.shape)
        key: str = self._files.put_with(lambda file: np.savez_compressed(file, bits=bits, shape=shape))
        return STORED + key

    def _stored_mask(self, source: str, shape: tuple[int, ...]) -> BoolArray:
        path = self._files.path(source.removeprefix(STORED))
        try:
            arrays = read_arrays(path)
            bits: npt.NDArray[Any] = arrays["bits"]
            if tuple(arrays["shape"].tolist()) != shape:
                raise ValueError("another grid")
            mask: BoolArray = np.unpackbits(bits, count=int(np.prod(shape))).astype(bool).reshape(shape)
        except (OSError, ArraysUnusable, TooLarge, ValueError, TypeError, KeyError) as error:
            raise StorageError(
                f"the stored mask {path.name[:12]} of the label is damaged; undo to before it."
            ) from error
        return mask


def _grid_of(case: Case, name: str | None) -> VolumeInfo:
    if not case.volumes:
        raise InputError("this case was made of a surface; only on a CT can be painted.")
    if name is None:
        return min(case.volumes, key=lambda info: float(np.prod(info.spacing_mm)))
    found = next((info for info in case.volumes if info.name == name), None)
    if found is None:
        raise NotFound(f"this case has no volume {name!r:.40}; it has: {', '.join(i.name for i in case.volumes)}.")
    return found


def _key(case: Case, content: PaintedLabel) -> str:
    return f"{case.id} {content.key}"


def _structure_id(label_id: str) -> str:
    return f"painted-{label_id.removeprefix('label-')}"


def _cropped(label: CroppedLabel) -> CroppedLabel:
    """Return the label cropped to the bounding box of its voxels."""
    from scipy.ndimage import find_objects  # imported here: slow to load

    (box,) = find_objects(label.mask.astype(np.uint8))
    first = np.array([part.start for part in box[::-1]], dtype=np.int64)
    return dataclasses.replace(label, mask=label.mask[box], first=first)


def _with(content: CaseContent, made: Structure, info: SurfaceInfo) -> CaseContent:
    """Return the content with a structure added or replaced by id; the name and colour of a replaced one stay."""
    old = next((item for item in content.structures if item.id == made.id), None)
    if old is None:
        return dataclasses.replace(content, surfaces=(*content.surfaces, info), structures=(*content.structures, made))
    kept = dataclasses.replace(made, name=old.name, colour=old.colour)
    return dataclasses.replace(
        content,
        surfaces=(*(item for item in content.surfaces if item.name != old.surface), info),
        structures=tuple(kept if item.id == made.id else item for item in content.structures),
    )
