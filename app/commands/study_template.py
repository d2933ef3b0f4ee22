"""The file of a study that `vfix study new` writes."""

TEMPLATE = """\
# A study for `vfix study run`; docs/studies.md. Not for clinical use.
name = "My study"
seed = 1                    # of the order, the simulated people and their trials

# Every subject does this many trials in each combination of plan, mode, arm and tool.
trials = 5
modes = ["freehand", "hands-on", "teleoperated"]
arms = ["plain"]            # "plain", "li2004", "li2007", or of an entry point of the group vfix.arms
tools = ["plan"]            # "plan": that of the plan; or a shipped tool's name, or a tool file
metrics = ["time_s", "path_error_mm", "smoothness", "contacts", "least_clearance_mm"]
order = "williams"          # counterbalanced: "williams", or "latin" for a cyclic Latin square
# rate_hz = 50              # of control, of arms without a printed one; else that of the plan

[[plans]]                   # one or more
case = "head-phantom"       # a case's id or name, or a surface or CT file
plan = "head-phantom-sample"  # a plan's id or name, or a file

[subjects]
simulated = 10              # simulated people, drawn from the seed
codes = []                  # codes of real people, such as ["P01", "P02"]; never names

# A study in lumens has [[routes]] in place of modes, tools and [[plans]]: docs/studies.md#in-a-lumen.

# On the page, for real people; before [[plans]]:
# consent = "I take part of my own will, and may stop at any time."
# break_min = 5             # between conditions
# questionnaire = "nasa-tlx"  # after each condition
# views = { freehand = "endoscope", hands-on = "outside" }  # the view of a mode

# operator = "person"       # of the simulated people: "person", "steady", or of an entry point vfix.operators
# [person]                  # medians of the simulated people's parameters that differ from the defaults
# tremor_mm = 0.2
"""
