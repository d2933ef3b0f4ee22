"""The tabs of the page, a folder each; they do not import each other."""
