"""The worlds that the runtime drives: the rigid tool, the snake robot, a free hand; ``registry`` knows all of them."""

import warnings
from typing import Any


def __getattr__(name: str) -> Any:
    """Names that lie in ``registry`` since 0.2."""
    if name not in ("RIGID", "SNAKE", "WORLDS", "World", "prepare", "spec_of"):
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    from . import registry

    message = f"vfix_engine.worlds.{name} is vfix_engine.worlds.registry.{name} now"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return getattr(registry, name)
