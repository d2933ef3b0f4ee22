"""REST: where the tool lies along a plan's path."""

import numpy as np
import pytest
from rest_client import CASE, PLAN, Client

from app.cases.model import HEAD_PHANTOM
from app.plans.shipped_head import SAMPLE_PLAN
from app.services import Services


def test_poses_are_those_of_the_dry_run(client: Client, phantom_services: Services) -> None:
    made = client.post(f"{CASE}/plans", json={"name": "not driven", "copy_of": SAMPLE_PLAN}).json()["id"]
    client.patch(f"/api/v1/plans/{made}", json={"settings": {"margin_mm": 0.4317}})
    refused = client.get(f"/api/v1/plans/{made}/tool-poses")
    assert refused.status_code == 404, refused.text[:300]
    assert refused.json()["error"]["code"] == "not_found"
    assert "evaluation" in refused.json()["error"]["message"]

    evaluation = phantom_services.planning.evaluate(phantom_services.plans.get(SAMPLE_PLAN))
    told = client.get(f"{PLAN}/tool-poses").json()
    at, segments = np.array(told["s_mm"]), np.array(told["segments"])
    assert at[0] == pytest.approx(0.0, abs=0.3)
    assert at[-1] == pytest.approx(evaluation.reached_mm, abs=1e-3), "the last pose, often the tightest, is shown"
    assert np.diff(at).max() < 1.0
    assert segments.shape == (len(at), len(told["radii_mm"]), 2, 3)
    tips = segments[:, 0, 1]
    nearest = np.linalg.norm(tips[:, None] - evaluation.positions[None], axis=2).min(axis=1)
    assert nearest.max() < 0.5, "the tip is on the path"
    off = phantom_services.cases.get(HEAD_PHANTOM).uncertainty.added_mm
    assert off > 0.0
    assert told["margin_mm"] == pytest.approx(0.3 + off), "the ring is where the controller holds the tool"
