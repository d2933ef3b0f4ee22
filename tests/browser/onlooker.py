"""Watches a rehearsal without a browser, by the planner's own clock."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from workstation import PATIENCE_S

from app.messages.version import VERSION


class Onlooker:
    """Reads the session's websocket and notes when the tip moved: when figures were taken, not when they came."""

    INTERVAL_S = 0.1  # two states of the page are so far apart at most

    def __init__(self, base: str, token: str, plan_id: str) -> None:
        query = f"tab=onlooker-{plan_id}&case=head-phantom&step=rehearse&plan={plan_id}"  # a session stays at its plan
        address = f"{base.replace('http', 'ws')}/session?{query}"
        self._socket = connect(address, additional_headers={"Authorization": f"Bearer {token}"}, max_size=None)
        self._socket.send(json.dumps({"type": "hello", "version": VERSION, "role": "watches"}))
        self._moves: list[float] = []
        self.progress_mm = 0.0
        self._taken = 0.0
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self) -> Onlooker:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()
        self._thread.join(PATIENCE_S)

    def _read(self) -> None:
        tip = None
        try:
            for text in self._socket:
                now = json.loads(text).get("sections", {}).get("rehearsal") or {}
                if now.get("tip") is None or not now.get("taken_ms"):
                    continue
                if tip is not None and now["tip"] != tip:
                    self._moves.append(self._taken)
                self.progress_mm = now["progress_mm"]
                tip, self._taken = now["tip"], now["taken_ms"] / 1000.0
        except ConnectionClosed:
            pass

    def wait_for_motion(self, hold_on: Callable[[], None]) -> None:
        """Until the tip has been seen moving for a while, by a hand that holds on."""
        deadline = time.monotonic() + PATIENCE_S
        seen = len(self._moves)
        while len(self._moves) < seen + 5:
            assert time.monotonic() < deadline, "the tip does not move"
            hold_on()
            time.sleep(0.02)

    def wait_until(self, moment: float) -> None:
        """Until figures were read that were taken after a moment, in seconds since 1970."""
        deadline = time.monotonic() + PATIENCE_S
        while self._taken < moment:
            assert time.monotonic() < deadline, "no figures come any more"
            time.sleep(0.02)

    def last_motion(self) -> float:
        """The moment after which the tip was last seen to move, in seconds since 1970."""
        return self._moves[-1]
