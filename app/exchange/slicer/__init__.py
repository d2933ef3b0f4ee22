"""A plan with its anatomy as a folder that 3D Slicer opens: markups, surfaces, volumes, transforms and a scene."""

from app.exchange.slicer.export import SCENE, SlicerExport

__all__ = ["SCENE", "SlicerExport"]
