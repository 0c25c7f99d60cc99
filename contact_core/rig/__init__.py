"""The rig: a joint tree with its skin and its degrees of freedom, poses of it, and how they are stored."""
