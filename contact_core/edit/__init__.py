"""Edits: commands that hold results, history, journal and recovery, and the verbs that make the commands."""
