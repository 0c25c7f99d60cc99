"""Placers: where the contacts of a coarsely posed manipulator go on an object."""
