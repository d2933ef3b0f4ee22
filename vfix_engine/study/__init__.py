"""Studies of recorded and simulated drives: what a run is worth (``metrics``), and a model of a person."""
