"""Grasps on the shelf: saved with what other hands and objects need to take them over, and applied to those."""
