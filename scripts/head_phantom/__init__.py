"""Generator of the synthetic head: a CT, its bone and its landmarks, made from named anatomical parts.

`parts` holds the anatomy as data, `shapes` the solids it is made of, `anatomy` puts them together, `hounsfield` turns
tissues into a CT, `generate` does it all. `make_head_phantom.py` writes what is shipped under assets/head_phantom.
"""
