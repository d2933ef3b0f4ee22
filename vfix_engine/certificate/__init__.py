"""Certificate: the proof that a tool respects every margin during a whole motion, compiled."""
