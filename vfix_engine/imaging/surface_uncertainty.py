"""How far a bone surface may lie from bone, as sentences, and whether a margin covers that."""

from __future__ import annotations

from dataclasses import dataclass

from vfix_engine.imaging.bone import SurfaceReport, slices_may_hide_mm


@dataclass(frozen=True)
class SurfaceUncertainty:
    """thinning_mm: the largest deviation of the surface that the margin is kept to from the one it was thinned from.

    voxel_mm: distance of the CT's voxels where they are furthest apart, or the thickness of its slices; 0 without a CT.
    Of a surface that came without a CT it is not known how far it was off before that.
    """

    thinning_mm: float
    voxel_mm: float

    @property
    def off_mm(self) -> float:
        """How far bone may lie from the surface, both causes together."""
        return self.thinning_mm + slices_may_hide_mm(self.voxel_mm)

    def words(self) -> str:
        """What there is to say, with the figures and without a full stop; '' where that is nothing."""
        if self.voxel_mm:
            return self._figures()
        unknown = "how far bone may lie off its surface is not known, since it came without a CT"
        return f"{unknown}; it was thinned by up to {self.thinning_mm:.2f} mm" if self.thinning_mm else unknown

    def _figures(self) -> str:
        causes = []
        if hidden := slices_may_hide_mm(self.voxel_mm):
            causes.append(f"{hidden:.2f} mm: slices {self.voxel_mm:g} mm apart")
        if self.thinning_mm:
            causes.append(f"{self.thinning_mm:.2f} mm: surface thinned")
        further = ", thin bone further" if hidden else ""
        return f"bone may lie {self.off_mm:.2f} mm off its surface{further} ({'; '.join(causes)})" if causes else ""

    def warning(self, margin_mm: float) -> str:
        """The same where the margin does not cover it, else ''."""
        return f"{self._figures()}, more than the margin of {margin_mm:.2f} mm" if self.off_mm > margin_mm else ""


def report_words(report: SurfaceReport) -> str:
    """What making a surface cost, with the figures."""
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
    return "; ".join(parts)
