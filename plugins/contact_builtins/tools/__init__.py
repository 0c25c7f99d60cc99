"""The artist's tools: paint and erase, axes, patches moved and shaped, transfer, links, pairs, places and poses."""
