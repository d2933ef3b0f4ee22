"""The rigid tool as a world that the runtime drives: scene, rehearsal, operators, recorder, real-time process."""
