"""Sections that belong to no single tab."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from app.kit.jobs import Job, JobKind, JobState
from app.tabs.spec import Endoscope, Input
from app.workspace.sections import CameraSection, LabelView, SceneSection


class TabSection(TypedDict):
    """The active tab, what keys and clicks do in it, the tabs that can be opened, and the hint.

    endoscope: whether the tab has the picture of one.
    offered: the tabs that are for cases of the open kind; a page shows no other.
    """

    name: str
    input: Input
    endoscope: NotRequired[Endoscope]
    available: list[str]
    hint: str
    offered: list[str]


class JobEntry(TypedDict):
    """A waiting or running job, as in REST; REST alone has `result` and `error`, at its end."""

    id: str
    kind: JobKind
    case_id: str | None
    subject: str
    document_id: str | None
    created: str
    state: JobState
    stage: str
    fraction: float


class JobsSection(TypedDict):
    """All waiting and running jobs, oldest first; one that is missing has ended.

    version: number of changes so far; it also counts a job that began and ended between two messages.
    """

    version: int
    items: list[JobEntry]


def jobs_section(version: int, jobs: tuple[Job, ...]) -> JobsSection:
    items: list[JobEntry] = [
        {
            "id": job.id,
            "kind": job.kind,
            "case_id": job.case_id,
            "subject": job.subject,
            "document_id": job.document_id,
            "created": job.created,
            "state": job.state,
            "stage": job.stage,
            "fraction": job.fraction,
        }
        for job in jobs
    ]
    return {"version": version, "items": items}


class SessionSections(TypedDict, total=False):
    """The active tab, the scene with its labels, the camera of a client, and all jobs."""

    step: TabSection
    scene: SceneSection
    camera: CameraSection
    labels: list[LabelView]
    jobs: JobsSection
