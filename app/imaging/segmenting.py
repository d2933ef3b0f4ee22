"""Segmentation of a case's CT: a structure from a band of Hounsfield units, as a job."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, replace

from sqlalchemy.orm import Session

from app.cases.model import CaseContent
from app.cases.segments import MAX_STRUCTURES
from app.cases.service import CaseService
from app.cases.structures import Provenance, Structure, is_closed
from app.kit.jobs import Job, Jobs, Progress
from app.kit.names import check_name
from app.kit.values import Position
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.anatomy.segmentation import HIGHEST_HU, LOWEST_HU, PRESETS, Band, Segmented, SegmentRequest, segment
from vfix_engine.anatomy.surface import Dropped
from vfix_engine.anatomy.tissue_regions import MUCOSA_MM, SHEET_MM
from vfix_engine.errors import InputError
from vfix_engine.files.volume import BONE_HU
from vfix_engine.progress import ProgressCallback, no_progress

# Colours by preset; OWN_COLOUR is for a threshold chosen by the user.
COLOURS = {
    "bone": "#e3d9c6",
    "thin_bone": "#e69f00",
    "soft_tissue": "#cc79a7",
    "air": "#56b4e9",
    "mucosa": "#d55e00",
    "unseen_bone": "#f0e442",
}
OWN_COLOUR = "#009e73"


@dataclass(frozen=True)
class StructureRequest:
    """A segmentation request with the name and colour '#rrggbb' of the new structure."""

    request: SegmentRequest
    name: str
    colour: str = OWN_COLOUR


def structure_request(
    name: str, preset: str | None, low: float | None, high: float | None, crop: tuple[Position, Position] | None,
    largest: bool, least_mm3: float | None, smooth_mm: float,
) -> StructureRequest:  # fmt: skip
    """Return the request for a preset, or for the band from low to high in HU.

    low, high: with a preset they replace the ends of its band. Raises InputError or ImageError.
    """
    if preset is None and (low is None or high is None):
        raise InputError("give a preset, or both ends of the threshold in HU.")
    base = Band(0.0, 0.0) if preset is None else PRESETS[preset]
    band = replace(base, low_hu=base.low_hu if low is None else low, high_hu=base.high_hu if high is None else high)
    colour = OWN_COLOUR if preset is None else COLOURS[preset]
    return StructureRequest(SegmentRequest(band, crop, largest, least_mm3, smooth_mm), name, colour)


class Segmenting:
    """Makes structures from the CT of cases. Thread-safe."""

    def __init__(self, cases: CaseService, jobs: Jobs) -> None:
        self._cases, self._jobs = cases, jobs

    def start(self, case_id: str, wanted: StructureRequest) -> Job:
        """Segment as a job, whose result is the id of the new structure.

        Raises NotFound, and InputError for a case without a CT or with too many structures, or for an invalid name.
        """
        self._check(case_id, wanted)

        def work(progress: Progress) -> str:
            return self.run(case_id, wanted, progress).id

        return self._jobs.submit(work, kind="segmentation", lane="import", case_id=case_id, subject=wanted.name)

    def run(self, case_id: str, wanted: StructureRequest, progress: ProgressCallback = no_progress) -> Structure:
        """Segment and store the structure. Raises as `start`, and ImageError if nothing is found."""
        self._check(case_id, wanted)
        volumes = self._cases.volumes(self._cases.get(case_id))
        found = segment(volumes[0], wanted.request, progress)
        progress("Storing the structure", 1.0)
        return self._stored(case_id, wanted, found)

    def _check(self, case_id: str, wanted: StructureRequest) -> None:
        check_name(wanted.name, "structure's name")
        case = self._cases.get(case_id)
        if not case.volumes:
            raise InputError("this case was made of a surface; only a CT can be segmented.")
        if len(case.protectable) >= MAX_STRUCTURES:
            raise InputError(f"a case may have {MAX_STRUCTURES} structures beside its anatomy; delete some first.")

    def _stored(self, case_id: str, wanted: StructureRequest, found: Segmented) -> Structure:
        structure_id = f"structure-{secrets.token_hex(4)}"
        report = SurfaceReport(0.0, 0.0, Dropped(), 0.0, 0, found.smoothed_mm, found.resampled_mm)
        info = self._cases.files.put_surface(structure_id, found.mesh, report)
        band = wanted.request.band
        threshold = band.high_hu if band.inside_body else band.low_hu
        structure = Structure(
            structure_id, wanted.name, "spare", structure_id, info.source, Provenance("ct", threshold), report.error_mm,
            is_closed(found.mesh), colour=wanted.colour, notes=_notes(wanted.request, found),
        )  # fmt: skip

        def added(content: CaseContent, _: Session) -> CaseContent:
            return replace(content, surfaces=(*content.surfaces, info), structures=(*content.structures, structure))

        self._cases.change_content(case_id, added)
        return structure


def band_words(band: Band) -> str:
    """Describe a band, which may be open at an end: 'from 120 HU on', 'up to 119 HU', 'from -300 to 119 HU'."""
    below, above = band.low_hu <= LOWEST_HU, band.high_hu >= HIGHEST_HU
    if below and above:
        return "of every HU"
    if above:
        return f"from {band.low_hu:g} HU on"
    return f"up to {band.high_hu:g} HU" if below else f"from {band.low_hu:g} to {band.high_hu:g} HU"


def _notes(request: SegmentRequest, found: Segmented) -> tuple[str, ...]:
    """Describe the chosen band, and what was left out, smoothed and resampled, in sentences."""
    band = request.band
    where = " within the body" if band.inside_body else ""
    notes = [f"Voxels {band_words(band)}{where}, {found.volume_mm3 / 1000.0:.1f} ml."]
    notes.append(f"Its surface encloses {found.enclosed_mm3 / 1000.0:.1f} ml.")
    if band.region == "mucosa":
        notes.append(f"Only within {MUCOSA_MM:g} mm of air in the body.")
    if band.region == "sheets":
        notes.append(
            f"Bone was not seen here but is expected: sheets thinner than {SHEET_MM:g} mm between two air spaces, "
            f"{found.volume_mm3 / 1000.0:.2f} ml below {BONE_HU:g} HU. The border of air stands in for bone."
        )
    if request.crop_mm is not None:
        notes.append("Cropped to a box: beyond it nothing is known of this structure.")
    if found.left_out:
        notes.append(f"{found.left_out:,} of {found.islands:,} islands were left out.")
    if found.smoothed_mm:
        notes.append(f"Smoothing moved its border by up to {found.smoothed_mm:.2f} mm: give its margin that much more.")
    if found.resampled_mm:
        notes.append(f"Slices were resampled; the border may have moved by {found.resampled_mm:.2f} mm.")
    return tuple(note.replace("-", "\N{MINUS SIGN}") if note.startswith("Voxels") else note for note in notes)
