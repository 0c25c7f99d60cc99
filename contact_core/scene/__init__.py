"""The scene: what a host can do for the core, the host in memory, and how a document is bound to scene objects."""
