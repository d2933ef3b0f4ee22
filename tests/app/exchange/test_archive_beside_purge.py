"""One planner imports an archive while another one purges a case with the same files."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from session_doubles import other_case
from sqlalchemy.orm import Session

from app.cases.model import CaseContent
from app.cases.purge import referred_files
from app.cases.service import Case
from app.exchange.archive.reading import ArchiveReader
from app.services import Services, build_services
from app.settings import Settings
from app.store.errors import StoreBusy
from vfix_engine.errors import InputError


@pytest.fixture
def one(settings: Settings) -> Iterator[Services]:
    made = build_services(settings)
    yield made
    made.close()


@pytest.fixture
def other(settings: Settings, one: Services, monkeypatch: pytest.MonkeyPatch) -> Iterator[Services]:
    """Another planner of the same data folder, which does not wait for one that writes."""
    with monkeypatch.context() as impatient:
        impatient.setattr("app.store.database.BUSY_SECONDS", 0.0)
        made = build_services(settings)
    yield made
    made.close()


@pytest.fixture
def head(one: Services) -> Case:
    return other_case(one)


@pytest.fixture
def archive(one: Services, head: Case, tmp_path: Path) -> Path:
    path = tmp_path / "case.zip"
    with path.open("xb") as file:
        one.archive_writer.write(head.id, file)
    return path


def test_it_is_not_stored_between_the_look_for_unused_files_and_their_removal(
    one: Services, other: Services, head: Case, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It would find its files there, and have none of them afterwards."""
    looks: list[set[str]] = []

    def looked(session: Session) -> set[str]:
        looks.append(referred_files(session))
        if len(looks) == 3:  # before and after the rows are removed, and before the files are
            with pytest.raises(StoreBusy):
                other.archive_reader.read(archive)
        return looks[-1]

    monkeypatch.setattr("app.cases.purge.referred_files", looked)
    assert one.purge.run(head.id).files > 0
    assert len(looks) == 3
    made = other.archive_reader.read(archive)
    assert len(one.cases.case_surface(made.id).faces) == 4


def test_files_that_go_before_it_is_stored_are_missed(
    one: Services, other: Services, head: Case, archive: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    examined = ArchiveReader._examined

    def then_purged(self: ArchiveReader, found: object) -> CaseContent:
        content = examined(self, found)  # type: ignore[arg-type]
        one.purge.run(head.id)
        return content

    with monkeypatch.context() as meanwhile:
        meanwhile.setattr(ArchiveReader, "_examined", then_purged)
        with pytest.raises(InputError, match="removed meanwhile"):
            other.archive_reader.read(archive)
    assert one.cases.list() == other.cases.list()
    assert len(one.cases.case_surface(other.archive_reader.read(archive).id).faces) == 4
