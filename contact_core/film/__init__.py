"""A film in files: strips of pictures, movies, figures, and animations that other programs play."""
