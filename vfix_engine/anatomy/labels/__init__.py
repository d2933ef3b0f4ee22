"""Segmentations: label maps of several formats, and the surface of each label."""
