"""Uncertainty of a surface of anatomy in words, and a check whether a margin covers it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vfix_engine.anatomy.bone import SurfaceReport, slice_uncertainty_mm
from vfix_engine.errors import InputError


@dataclass(frozen=True)
class SurfaceUncertainty:
    """Sources of error of a surface of anatomy, such as bone.

    thinning_mm: upper bound of the displacement by decimation and smoothing; the controller adds it to the margin.
    resampled_mm: upper bound of the displacement by resampling within tilted slices, which is added as well.
    voxel_mm: the larger of largest voxel spacing and slice thickness of the CT; 0 without a CT, where the error before
        decimation is unknown.

    Raises InputError if one is negative or not finite, since it would reduce a margin.
    """

    thinning_mm: float
    voxel_mm: float
    resampled_mm: float = 0.0

    def __post_init__(self) -> None:
        causes = (("thinning", self.thinning_mm), ("voxels", self.voxel_mm), ("resampling", self.resampled_mm))
        for what, value in causes:
            if not 0.0 <= value < math.inf:
                raise InputError(f"a surface cannot be off by {value:g} mm because of its {what}; import it again.")

    @property
    def off_mm(self) -> float:
        """Upper bound of the distance of the anatomy from the surface in mm: the sum of all."""
        return self.added_mm + slice_uncertainty_mm(self.voxel_mm)

    @property
    def added_mm(self) -> float:
        """Distance that the controller adds to every margin."""
        return self.thinning_mm + self.resampled_mm

    def words(self, anatomy: str = "bone") -> str:
        """The uncertainty of the anatomy of this name as a phrase with numbers; '' if there is none.

        Only bone is kept away from by a margin, to which errors are added, and is missing from a CT where it is thin.
        """
        bone = anatomy == "bone"
        if self.voxel_mm:
            return self._figures(anatomy, bone)
        unknown = f"how far {anatomy} may lie off its surface is not known, since it came without a CT"
        grows = ", which the margin grows by" if bone else ""
        moved = f"{unknown}; thinning and smoothing moved it by up to {self.thinning_mm:.2f} mm{grows}"
        return moved if self.thinning_mm else unknown

    def _figures(self, anatomy: str = "bone", bone: bool = True) -> str:
        causes, added = [], ", added to the margin" if bone else ""
        if hidden := slice_uncertainty_mm(self.voxel_mm):
            causes.append(f"{hidden:.2f} mm: slices {self.voxel_mm:g} mm apart")
        if self.thinning_mm:
            causes.append(f"{self.thinning_mm:.2f} mm: surface thinned or smoothed{added}")
        further = ", thin bone further" if hidden and bone else ""
        if self.resampled_mm:
            causes.append(f"{self.resampled_mm:.2f} mm: tilted slices resampled{added}")
        return (
            f"{anatomy} may lie {self.off_mm:.2f} mm off its surface{further} ({'; '.join(causes)})" if causes else ""
        )

    def warning(self, margin_mm: float) -> str:
        """A phrase if the margin, with what is added to it, is smaller than the uncertainty, else ''."""
        kept = margin_mm + self.added_mm
        return f"{self._figures()}, more than the {kept:.2f} mm that are kept" if self.off_mm > kept else ""


def uncertainty_of(report: SurfaceReport, voxel_mm: float) -> SurfaceUncertainty:
    """Uncertainty of a surface from its report and the largest spacing or thickness of its CT."""
    return SurfaceUncertainty(report.error_mm - report.resampled_mm, voxel_mm, report.resampled_mm)


def describe_report(report: SurfaceReport) -> str:
    """A phrase on removed components, decimation and smoothing, with numbers."""
    dropped, parts = report.dropped, []
    if dropped.pieces:
        what = "1 loose piece" if dropped.pieces == 1 else f"{dropped.pieces} loose pieces"
        largest = "" if dropped.pieces == 1 else "the largest "
        parts.append(f"{what} left out ({dropped.triangles} triangles, {largest}{dropped.extent_mm:.1f} mm across)")
    if report.max_deviation_mm:
        parts.append(
            f"thinned: off by {report.mean_deviation_mm:.2f} mm on average, {report.max_deviation_mm:.2f} mm at most"
        )
    else:
        parts.append("not thinned")
    if report.put_back:
        parts.append(f"{report.put_back:,} triangles that thinning had moved too far are put back")
    if report.certified_mm:
        parts.append(f"no point of the bone is farther than {report.certified_mm:.2f} mm from it")
    if report.smoothed_mm:
        parts.append(f"smoothed by {report.smoothed_mm:.2f} mm at most")
    if report.resampled_mm:
        parts.append(f"made of resampled slices, which may have moved it by {report.resampled_mm:.2f} mm")
    return "; ".join(parts)
