"""Synthetic head: a CT, its bone and its landmarks, made from named anatomical parts. Not for clinical use.

`parts` holds the anatomy as data, `shapes` the few solids it is made of, `anatomy` puts them together, `hounsfield`
turns tissues into a CT, `generate` does it all. What `scripts/make_head_phantom.py` made of it is shipped and read by
`shipped`, which a start of the planner needs alone.
"""

from vfix_engine.imaging.phantom.shipped import (
    Landmarks,
    load_bone_surface,
    load_display_surfaces,
    load_head_ct,
    load_landmarks,
    load_nose_ct,
)

__all__ = [
    "Landmarks",
    "load_bone_surface",
    "load_display_surfaces",
    "load_head_ct",
    "load_landmarks",
    "load_nose_ct",
]
