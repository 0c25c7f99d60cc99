"""Pose solvers. The default one lives in `contact_core.solve.levenberg_marquardt`."""
