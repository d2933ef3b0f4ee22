"""Messages between the planner and its clients: the page and external programs speak the same ones."""
