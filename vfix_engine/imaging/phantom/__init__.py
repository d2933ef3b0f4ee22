"""Synthetic head: a CT, its bone and its landmarks, made from named anatomical parts. Not for clinical use.

`parts` holds the anatomy as data, `shapes` the few solids it is made of, `anatomy` puts them together, `hounsfield`
turns tissues into a CT. What `scripts/make_head_phantom.py` made of it is shipped and read by `shipped`.
"""

from vfix_engine.imaging.phantom.generate import NOSE_BOX, generate
from vfix_engine.imaging.phantom.shipped import (
    Landmarks,
    load_bone_surface,
    load_display_surfaces,
    load_head_ct,
    load_landmarks,
    load_nose_ct,
)

__all__ = [
    "NOSE_BOX",
    "Landmarks",
    "generate",
    "load_bone_surface",
    "load_display_surfaces",
    "load_head_ct",
    "load_landmarks",
    "load_nose_ct",
]
