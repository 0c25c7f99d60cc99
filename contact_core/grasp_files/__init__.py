"""Grasps between files and folders: `contact grasp`, `contact library`, and how the starter library is made."""
