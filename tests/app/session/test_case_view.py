"""The open case: which is opened, and where its slices stand."""

from __future__ import annotations

import numpy as np
from session_doubles import HEAD, Later, other_case

from app.cases.model import COLON_PHANTOM, SHIPPED
from app.services import Services
from app.workspace.case_view import CaseView
from app.workspace.slice_view import SliceView
from vfix_engine.files.volume import Volume


def test_a_deleted_embedded_head_is_not_opened(phantom_services: Services) -> None:
    services = phantom_services
    services.cases.delete(HEAD)
    try:
        view = CaseView(services, Later(), lambda request: None)
        view.open_first(None)
        assert view.case_id == COLON_PHANTOM  # the first that is left
        for shipped in SHIPPED:
            if shipped != HEAD:
                services.cases.delete(shipped)
        view = CaseView(services, Later(), lambda request: None)
        view.open_first(None)
        assert view.case_id is None
        other = other_case(services)
        view.open_first(HEAD)
        assert view.case_id == other.id
        services.cases.delete(other.id)
    finally:
        for shipped in SHIPPED:
            services.cases.restore(shipped)


def test_slices_stay_inside_the_volume() -> None:
    volume = Volume(np.zeros((6, 5, 4), dtype=np.int16), np.array([1.0, 2.0, 3.0]), np.ones(3), np.eye(3))
    view = SliceView(volume, np.array([99.0, 99.0, 99.0]))
    assert view.cross.tolist() == [4.0, 6.0, 8.0]
    view.move("axial", -1e4)
    assert view.cross.tolist() == [4.0, 6.0, 3.0]
    plane = view.section()["planes"]["coronal"]
    assert (plane["columns"], plane["rows"], plane["position"]) == (4, 6, 6.0)
    assert plane["origin"][1] == 6.0
