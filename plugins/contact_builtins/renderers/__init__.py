"""Renderers that need nothing but numpy."""
