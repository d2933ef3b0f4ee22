"""Hollow organs: voxels inside the wall, centreline, curves along it, and synthetic lumens."""
