"""A user's own study: its file, the order of its trials, simulated trials, results, and their statistics."""
