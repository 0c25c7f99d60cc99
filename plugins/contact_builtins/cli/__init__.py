"""Sub-commands of `contact` that the built-ins bring."""
