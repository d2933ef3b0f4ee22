"""Sections that belong to no single step."""

from __future__ import annotations

from typing import TypedDict

from app.views.sections import CameraSection, SceneSection


class StepSection(TypedDict):
    """The step that is shown, those that can be gone to, and what to do next."""

    name: str
    available: list[str]
    hint: str


class SessionSections(TypedDict, total=False):
    """The step, the scene and the camera of a client."""

    step: StepSection
    scene: SceneSection
    camera: CameraSection
