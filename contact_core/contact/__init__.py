"""Contact areas: patches and axes, placed, linked, transferred and paired on surfaces; brushes and strokes."""
