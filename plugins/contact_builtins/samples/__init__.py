"""Samples that the project makes itself: manipulators and objects, deterministic, watertight."""
