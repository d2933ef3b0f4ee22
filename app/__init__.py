"""app: the browser application around vfix_engine (gateway, store, services, page)."""

__version__ = "0.1.0"
