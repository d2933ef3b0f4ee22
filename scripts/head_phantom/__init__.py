"""Generator of the synthetic head: a CT, its bone and its landmarks, made from named anatomical parts.

`parts` holds the anatomy as data, `shapes` defines its solids, `anatomy` assembles them, `hounsfield` converts tissues
to a CT, and `generate` runs all of it. `make_head_phantom.py` writes the files shipped under assets/head_phantom.
"""
