"""Shared by all tabs of the page: the open case, its surface in the scene, camera and slices."""
