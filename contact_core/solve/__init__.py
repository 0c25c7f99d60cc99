"""The solve: bodies and contact pairs as a pose problem, its terms, and the solvers that find the pose."""
