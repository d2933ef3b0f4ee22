"""Geometry: triangle mesh, tool segments, spline path, proximity."""
