"""REST over the services: cases, plans, jobs, runs, pictures and exports. Not for clinical use.

The routes are loaded when they are first asked for: making them takes as long as all else of a start.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from app.api.routes import described, router

__all__ = ["described", "router"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from app.api import routes

        return getattr(routes, name)
    raise AttributeError(f"module {__name__} has no attribute {name!r}")
