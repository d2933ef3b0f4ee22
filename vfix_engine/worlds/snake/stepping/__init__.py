"""One step of the driven snake, as functions of an immutable state."""
