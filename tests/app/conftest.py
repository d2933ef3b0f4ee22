"""A small head of a few triangles, and services over a home of its own."""

import tarfile
from collections.abc import Iterator
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from rest_client import Client, opened_client
from sqlalchemy import delete, insert, select

from app.cases.files import CaseFiles
from app.cases.model import HEAD_PHANTOM, CaseContent
from app.cases.overlays import Overlays
from app.cases.service import Case, CaseFrame, CaseService
from app.planning.rehearsal_options import NO_OPTIONS
from app.plans import shipped_head as embedded
from app.plans.service import PlanService
from app.services import Services, build_services
from app.settings import Settings
from app.store import Store
from app.store.models import Base
from vfix_engine.geometry.mesh import TriangleMesh

OLD_HOME = Path(__file__).resolve().parents[1] / "data" / "old_home" / "home.tar.xz"


def tetrahedron() -> TriangleMesh:
    corners = np.array([[0.1, 0, 0], [10, 0, 1 / 3], [0, 10, 0], [0, 0, 10]])
    return TriangleMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


@pytest.fixture(autouse=True, scope="session")
def head_read_once() -> Iterator[None]:
    """The head that travels with vfix is read once for all homes of the tests: it takes longer than all else of one."""
    read, found = embedded._content, dict[str, CaseContent]()

    def kept(files: CaseFiles) -> CaseContent:
        assets = embedded.shipped_hash()
        if assets not in found:
            found[assets] = read(files)
        return found[assets]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(embedded, "_content", kept)
        yield


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(home=tmp_path / "home", port=0)


@pytest.fixture
def store(settings: Settings) -> Iterator[Store]:
    opened = Store(settings)
    yield opened
    opened.close()


@pytest.fixture
def cases(store: Store) -> CaseService:
    return CaseService(store)


@pytest.fixture
def plans(store: Store, cases: CaseService) -> PlanService:
    """Without a dry run and registrations that would refuse anything."""
    made = PlanService(store)
    made.connect(cases, mock.Mock(), mock.Mock(), Overlays(cases))
    return made


@pytest.fixture
def case(cases: CaseService) -> Case:
    return cases.create("Tetra", frame=CaseFrame("LPS", assumed=False), surfaces={"bone": tetrahedron()})


@pytest.fixture(scope="session")
def shared_phantom(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Services]:
    """Services with the embedded head, whose fields and trees are made once for all files."""
    services = build_services(Settings(home=tmp_path_factory.mktemp("phantom"), port=0))
    yield services
    services.close()


@pytest.fixture(scope="module")
def phantom_services(shared_phantom: Services) -> Iterator[Services]:
    """Those services with nothing but the embedded head; what the tests of a file leave, the next file does not see."""
    tables = Base.metadata.sorted_tables
    with shared_phantom.store.reading() as session:
        found = {table: [dict(row) for row in session.execute(select(table)).mappings()] for table in tables}
    yield shared_phantom
    with shared_phantom.store.writing() as session:
        for table in reversed(tables):
            session.execute(delete(table))
        for table in tables:
            if found[table]:
                session.execute(insert(table), found[table])
    for plan in shared_phantom.plans.list(HEAD_PHANTOM):
        shared_phantom.rehearsal_options.choose(plan.id, NO_OPTIONS)


@pytest.fixture(scope="module")
def client(phantom_services: Services) -> Iterator[Client]:
    """The REST routes over those services."""
    opened = opened_client(phantom_services)
    yield opened
    opened.close()


@pytest.fixture
def old_home(tmp_path: Path) -> Iterator[Services]:
    """A home of an earlier version, which holds a run of each world."""
    with tarfile.open(OLD_HOME) as archive:
        archive.extractall(tmp_path, filter="data")
    opened = build_services(Settings(home=tmp_path / "home", port=0))
    yield opened
    opened.close()
