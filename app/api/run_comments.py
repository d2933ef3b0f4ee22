"""Comments at a time of a run."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field

from app.api.dependencies import ERRORS, Identifier, Number, RequestBody, ServicesDep
from app.drives.live_comments import MAX_CHARACTERS, RunComment

router = APIRouter(prefix="/runs/{run_id}/comments", tags=["runs"], responses=ERRORS)

CommentText = Annotated[str, Field(strict=True, min_length=1, max_length=MAX_CHARACTERS)]


class CommentPublic(BaseModel):
    """A comment. t_s: driven time since the last return to the start; null where the tool was returned after it.

    step: number of recorded steps before it.
    """

    id: str
    t_s: float | None
    step: int
    text: str
    written: str

    @classmethod
    def of(cls, comment: RunComment) -> CommentPublic:
        return cls(**vars(comment))


class NewComment(RequestBody):
    """at_s: driven time since the last return to the start; text: one line."""

    at_s: Number
    text: CommentText


class CommentChange(RequestBody):
    """Another text, another time, or both."""

    at_s: Number | None = None
    text: CommentText | None = None


@router.get("")
def list_run_comments(run_id: Identifier, services: ServicesDep) -> list[CommentPublic]:
    """The comments on a run, in the order of time."""
    return [CommentPublic.of(one) for one in services.runs.get(run_id).comments]


@router.post("", status_code=201)
def add_run_comment(run_id: Identifier, comment: NewComment, services: ServicesDep) -> CommentPublic:
    """Comment on a run at a time."""
    return CommentPublic.of(services.run_comments.add(run_id, comment.at_s, comment.text))


@router.patch("/{comment_id}")
def change_run_comment(
    run_id: Identifier, comment_id: Identifier, change: CommentChange, services: ServicesDep
) -> CommentPublic:
    """Change the text or the time of a comment."""
    return CommentPublic.of(services.run_comments.edit(run_id, comment_id, change.text, change.at_s))


@router.delete("/{comment_id}", status_code=204, response_class=Response)
def delete_run_comment(run_id: Identifier, comment_id: Identifier, services: ServicesDep) -> None:
    """Delete a comment."""
    services.run_comments.delete(run_id, comment_id)
