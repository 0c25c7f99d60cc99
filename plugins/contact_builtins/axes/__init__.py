"""Default axes: the paper's two (farthest pair, medial axis), and three that its users asked for."""
