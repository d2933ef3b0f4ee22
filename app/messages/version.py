"""The version of the messages between planner and clients."""

VERSION = 1  # raised with every change that a client of before would not understand
