"""Versioned changes of the store's tables, applied at every start."""
