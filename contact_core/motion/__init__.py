"""Poses and contacts over time: solving, reducing, reporting and detecting motion, as functions on values."""
