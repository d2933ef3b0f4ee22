"""Geometry: triangle mesh, spline path, capsules, shapes."""
