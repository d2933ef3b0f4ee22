"""Assignments: a plan that a trainee drives a number of times, and what each run has to reach."""
