"""Closed manifold surfaces that stand for broken ones (hook `contact_proxy_makers`)."""
