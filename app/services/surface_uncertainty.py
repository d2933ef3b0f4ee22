"""The engine's `SurfaceUncertainty` under the name that it had here."""

from vfix_engine.imaging.surface_uncertainty import SurfaceUncertainty, report_words

__all__ = ["SurfaceUncertainty", "report_words"]
