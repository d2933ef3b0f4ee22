"""The proximity query: how far every vertex of the robot deviates from the pathway, on the CPU and on a GPU."""
