"""Proximity query: deviation of every vertex of the robot from the pathway, on the CPU and on a GPU."""
