"""Recipes: what a job is asked to do, as a value, and the strict reader of their files."""
