"""Geodesic engines beside the exact one of the core."""
