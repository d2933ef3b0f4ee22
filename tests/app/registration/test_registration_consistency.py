"""Registrations from outside whose transform is not that of what they say it is made of: nothing goes by them."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from registration_contents import content_of
from session_doubles import other_case

from app.live.outgoing import no_registration, registration_messages
from app.plans.model import PlanContent
from app.plans.operations.instruments import UseRegistration
from app.registration.document import IDENTITY, RegistrationContent
from app.registration.driven import driven_registration
from app.registration.files import export_text
from app.registration.fit_report import inconsistency, refitted, report_of
from app.registration.kind import REGISTRATION
from app.registration.target_errors import error_table
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.errors import InputError, PlanError


def _shifted(by_mm: float) -> RegistrationContent:
    content = content_of(0.1)
    moved = content.registration.transform.copy()
    moved[0, 3] += by_mm
    return replace(content, transform=tuple(moved.ravel().tolist()))


def _in_one_place() -> RegistrationContent:
    content = content_of()
    one = content.pairs[0]
    pairs = tuple(replace(pair, in_image=one.in_image, measured=one.measured) for pair in content.pairs)
    return replace(content, pairs=pairs)


CONTENTS: dict[str, tuple[Callable[[], RegistrationContent], str]] = {
    "50 mm off": (lambda: _shifted(50.0), "not that of its points"),
    "0.9 mm off": (lambda: _shifted(0.9), "not that of its points"),
    "no surface": (lambda: replace(_shifted(50.0), made_from="surface"), "no points were touched"),
    "all in one place": (_in_one_place, "cannot be fitted"),
    "two points": (lambda: replace(content_of(), pairs=content_of().pairs[:2]), "cannot be fitted"),
    "not fitted": (lambda: replace(content_of(), made_from="none", transform=IDENTITY), "can be fitted"),
}


@pytest.fixture(scope="module")
def services(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    made = build_services(Settings(home=tmp_path_factory.mktemp("consistency"), port=0))
    yield made
    made.close()


def test_what_edits_make_is_consistent() -> None:
    content = content_of(0.3)
    for one in (content, RegistrationContent(), refitted(replace(content, pairs=content.pairs[:2]))):
        assert inconsistency(one) == ""
    assert inconsistency(replace(_shifted(50.0), made_from="given")) == ""


@pytest.mark.parametrize("name", CONTENTS)
def test_nothing_goes_by_it(services: Services, name: str, tmp_path: Path) -> None:
    """Report, plan, drive, files and the live link say the same, and an archive leaves it out."""
    content, words = CONTENTS[name][0](), CONTENTS[name][1]
    case = other_case(services)
    made = services.registrations.create(case.id, "Odd", content_of())
    plan = services.plans.create(case.id, "Way", PlanContent(registration=made.id))
    document = services.registrations.editor(made.id).edit(lambda before: content)
    report = report_of(content)
    assert (report.state, report.usable, words in report.words) == ("inconsistent", False, True)
    used = services.registering.registration_of(plan)
    assert (used.state, words in used.words, used.registration) == ("inconsistent", True, None)
    with pytest.raises(PlanError, match="Nothing is driven by it"):
        driven_registration(used)
    with pytest.raises(PlanError, match="contradicts itself"):
        services.plans.do(plan.id, UseRegistration(registration=made.id))
    with pytest.raises(InputError, match=words):
        export_text(document, "tfm")
    table = error_table(content, plan)
    assert (table.targets, words in table.words) == ((), True)
    for sent, none in zip(registration_messages(plan, [document]), no_registration(), strict=True):
        np.testing.assert_array_equal(sent.matrix, none.matrix)
    assert not [one for one in services.slicer.write(plan, tmp_path / "slicer") if one.startswith("registration")]
    target = io.BytesIO()
    services.archive_writer.write(case.id, target)
    with zipfile.ZipFile(target) as packed:
        (left,) = json.loads(packed.read("manifest.json"))["left_out"]
    assert (left["id"], words in left["why"]) == (made.id, True)


@pytest.mark.parametrize("name", CONTENTS)
def test_an_archive_with_it_is_refused(services: Services, name: str, tmp_path: Path) -> None:
    content, words = CONTENTS[name][0](), CONTENTS[name][1]
    case = other_case(services)
    services.registrations.create(case.id, "Odd", content_of())
    target = io.BytesIO()
    services.archive_writer.write(case.id, target)
    with zipfile.ZipFile(target) as packed:
        entries = {one: packed.read(one) for one in packed.namelist() if one != "SHA256SUMS"}
    (at,) = (one for one in entries if one.startswith(f"documents/{REGISTRATION.name}/"))
    entries[at] = json.dumps({**json.loads(entries[at]), "content": REGISTRATION.write(content)}).encode()
    sums = "".join(f"{hashlib.sha256(data).hexdigest()}  {one}\n" for one, data in entries.items())
    with zipfile.ZipFile(tmp_path / "odd.zip", "w") as packed:
        for one, data in {**entries, "SHA256SUMS": sums.encode()}.items():
            packed.writestr(one, data)
    before = len(services.cases.list())
    with pytest.raises(InputError, match=f"Odd.*contradicts itself.*{words}"):
        services.archive_reader.read(tmp_path / "odd.zip")
    assert len(services.cases.list()) == before
