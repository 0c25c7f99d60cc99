"""Proposals: contacts and poses found together, shown as a ghost, and accepted as one undo step or dismissed."""
