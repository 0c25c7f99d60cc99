"""Brushes: the paper's two (vertices, screen-space curve), and disk, lasso, eraser and the host's own selection."""
