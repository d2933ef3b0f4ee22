"""Robot and tool of a plan over REST, with URDFs of one's own."""

from __future__ import annotations

import json

from rest_client import CASE, Client

from tests.engine.urdf_texts import GOOD


def test_robot_and_tool_are_set_and_travel_with_an_export(client: Client) -> None:
    plan = client.post(f"{CASE}/plans", json={"name": "Robots"}).json()
    path = f"/api/v1/plans/{plan['id']}"
    assert (plan["tool"], plan["tool_shape"], plan["robot"]["urdf"]) == ("bent_30", {}, None)
    tool = client.patch(path, json={"tool": {"name": "shaver_40", "bend_deg": 30.0}}).json()
    assert (tool["tool"], tool["tool_shape"]) == ("shaver_40", {"bend_deg": 30.0})
    refused = client.patch(path, json={"tool": {"name": "shaver_40", "bend_deg": 130.0}})
    assert refused.status_code == 422
    assert "0 and 120°" in refused.json()["error"]["message"]
    assert client.patch(path, json={"robot": {"name": "arm_6"}}).json()["robot"]["name"] == "arm_6"
    assert client.patch(path, json={"robot": {"name": "spoon"}}).status_code == 422

    own = client.post("/api/v1/robots", files={"file": ("mine.urdf", GOOD.encode())}).json()
    assert (own["name"], own["links"], own["tool_frame"]) == ("mine", ["b", "c"], "c")
    robot = {name: own[name] for name in ("name", "urdf", "tool_frame")}
    assert client.patch(path, json={"robot": robot}).json()["robot"]["urdf"] == own["urdf"]
    text = client.get(f"{path}/export").text
    assert json.loads(text)["urdf"] == GOOD
    again = client.post(f"{CASE}/plans/import", files={"file": ("plan.json", text.encode())}).json()
    assert (again["robot"]["urdf"], again["robot"]["tool_frame"]) == (own["urdf"], "c")
    for made in (plan["id"], again["id"]):
        client.delete(f"/api/v1/plans/{made}")


def test_a_urdf_that_is_none_is_refused_in_words(client: Client) -> None:
    answer = client.post("/api/v1/robots", files={"file": ("bad.urdf", b"<robot name='x'><link name='a'/></robot>")})
    assert answer.status_code == 422
    assert "no joint" in answer.json()["error"]["message"]
