"""Proximity: how near segments come to triangles, exactly, by a tree of boxes."""
