"""Elaboration: from the nested deck to one level, with parameters evaluated and models looked up."""

from .flatten import flatten

__all__ = ["flatten"]
