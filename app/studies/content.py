"""What is stored of a study that is led on the page: its file, and how far each subject is."""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta

from app.documents import struct_kind
from app.operations.fields import MaybeId
from vfix_engine.errors import InputError
from vfix_engine.study.own.file import parse_study
from vfix_engine.study.own.questionnaire import Ratings

MAX_TEXT = 64 << 10

Toml = Annotated[str, Meta(max_length=MAX_TEXT)]
Code = Annotated[str, Meta(pattern="^[A-Za-z0-9][A-Za-z0-9_-]{0,19}$")]
Position = Annotated[int, Meta(ge=1, le=1_000_000)]
Block = Annotated[int, Meta(ge=1, le=1_000_000)]
Time = Annotated[str, Meta(max_length=40)]
Reason = Annotated[str, Meta(max_length=200)]


class LedTrial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A trial that has begun. begun: ISO time. run: id of the stored run, '' without. skipped: why it is missing."""

    subject: Code
    position: Position
    begun: Time = ""
    run: MaybeId = ""
    skipped: Reason = ""


class TlxAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A questionnaire after a block. ratings: as of `vfix_engine.study.own.questionnaire`."""

    subject: Code
    block: Block
    ratings: Ratings


class LedStudy(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A study on the page. text: its file. consents: codes of those who confirmed; subject: who was chosen last."""

    text: Toml = ""
    subject: Annotated[str, Meta(max_length=20)] = ""
    consents: tuple[Code, ...] = ()
    trials: tuple[LedTrial, ...] = ()
    answers: tuple[TlxAnswer, ...] = ()


def _rules(content: LedStudy) -> LedStudy:
    if content.text:
        known = parse_study(content.text).subjects.codes
        driven, answered = (one.subject for one in content.trials), (one.subject for one in content.answers)
        used = {*content.consents, *driven, *answered}
        if unknown := used.difference(known):
            raise InputError(f"the study has no subject {min(unknown)!r:.40}.")
    return content


STUDY = struct_kind(name="study", noun="study", schema="vfix-led-study/1", content=LedStudy, rules=_rules)
