"""app: the browser application around vfix_engine (gateway, store, services, page)."""
