"""A reader that never ends, in place of a worker's own.

It lies in a module by itself: the worker may read neither the application nor its test tools, and would fail on their
import.
"""

import tempfile
import time
from pathlib import Path

NEVER_S = 300.0  # an import that is waited for would last so long
BEGUN = "begun"  # file in the worker's folder from then on


def never_end(*_: object) -> None:
    (Path(tempfile.gettempdir()) / BEGUN).touch()
    time.sleep(NEVER_S)
