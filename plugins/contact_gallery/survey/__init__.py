"""Blind comparison of two sets of pictures: a page to hand out, a key that stays at home, and the tally.

The paper's qualitative assessment (its section "Qualitative Assessments"), for anyone who wants to run it.
"""
