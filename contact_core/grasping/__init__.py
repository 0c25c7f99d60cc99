"""Grasps from two files: a hand that describes itself closes on an object, in many ways, and the best are shown."""
