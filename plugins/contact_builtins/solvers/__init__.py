"""Pose solvers. The default one lives in `contact_core.pose.levenberg_marquardt`."""
