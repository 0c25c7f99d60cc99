"""The job: a recipe file carried out, from two assets to a posed grasp with pictures and a report."""
