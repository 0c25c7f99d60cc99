"""Grasp samplers and scores."""
