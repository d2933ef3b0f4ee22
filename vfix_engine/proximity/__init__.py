"""Proximity: exact distances between segments and triangles by a bounding volume hierarchy, and distance fields."""
