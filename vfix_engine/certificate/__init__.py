"""May the tool move so: the proof that a whole motion keeps every margin, compiled."""
