"""Routes of the store, and the cases that they lead through."""

from __future__ import annotations

from app.cases.service import CaseService
from app.documents.documents import Documents
from app.kit.jobs import Jobs
from app.lumen.document import ROUTE, Route
from app.lumen.paths import RoutePaths
from app.lumen.tasks import RouteTasks
from app.lumen.views import RouteViews
from app.store import Store


class RouteService:
    """What operations on routes need; may be used from any thread."""

    def __init__(self, store: Store, cases: CaseService, jobs: Jobs) -> None:
        self.documents: Documents[Route] = Documents(store, ROUTE)
        self.cases = cases
        self.paths = RoutePaths(cases, jobs)
        self.views = RouteViews(cases, jobs, self.paths)
        self.tasks = RouteTasks(cases, self.paths, self.views)
