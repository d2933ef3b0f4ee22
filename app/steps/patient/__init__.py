"""Patient: which case is open, and how a new one comes in."""
