"""Sections that belong to no single tab."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from app.tabs.spec import Input
from app.workspace.sections import CameraSection, LabelView, SceneSection


class TabSection(TypedDict):
    """The tab that is shown, what keys and clicks do in it, the tabs that can be gone to, and what to do next.

    offered: the tabs that are for cases of the open kind; a page shows no other.
    """

    name: str
    input: Input
    available: list[str]
    hint: str
    offered: NotRequired[list[str]]


class SessionSections(TypedDict, total=False):
    """The tab, the scene with its labels, and the camera of a client."""

    step: TabSection
    scene: SceneSection
    camera: CameraSection
    labels: list[LabelView]
