"""Made lumens under the name that scripts know; they live in ``anatomy.synthetic``."""

from .anatomy.synthetic import synthetic_colon, synthetic_course, write_stl

__all__ = ["synthetic_colon", "synthetic_course", "write_stl"]
