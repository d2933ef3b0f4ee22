"""A key as an operating system sends it: it repeats while it is down, whether the page keeps up or not."""

from __future__ import annotations

import json
import time
from typing import Any

from playwright.sync_api import Page

FIRST_REPEAT_S = 0.25
REPEAT_S = 1 / 30


class HeldKey:
    """The key ↑. Unlike Playwright's keyboard it repeats, and waits for no page, which may hang meanwhile."""

    def __init__(self, page: Page) -> None:
        info = page.context.new_cdp_session(page).send("Target.getTargetInfo")["targetInfo"]
        assert page.context.browser is not None
        self._browser = page.context.browser.new_browser_cdp_session()
        wish = {"targetId": info["targetId"], "flatten": False}  # a message to it is not awaited then
        self._session = self._browser.send("Target.attachToTarget", wish)["sessionId"]
        self._sent = 0

    def down(self, repeat: bool = False, age_s: float = 0.0) -> None:
        """Goes down, or repeats; age_s: how long ago."""
        self._send("rawKeyDown", autoRepeat=repeat, timestamp=time.time() - age_s)

    def up(self) -> None:
        self._send("keyUp")

    def repeat_for(self, seconds: float) -> None:
        """Repeat as a key that is down already."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self.down(repeat=True)
            time.sleep(REPEAT_S)

    def hold_for(self, seconds: float) -> None:
        """Down for so long, and up."""
        self.down()
        time.sleep(FIRST_REPEAT_S)
        self.repeat_for(seconds - FIRST_REPEAT_S)
        self.up()

    def _send(self, kind: str, **fields: Any) -> None:
        self._sent += 1
        key = {"type": kind, "key": "ArrowUp", "code": "ArrowUp", "windowsVirtualKeyCode": 38}
        message = {"id": self._sent, "method": "Input.dispatchKeyEvent", "params": key | fields}
        self._browser.send("Target.sendMessageToTarget", {"sessionId": self._session, "message": json.dumps(message)})
