"""Proposals: contacts and poses found together, shown as a ghost, and accepted as one undo step or dismissed."""

# Of settling: rounds, and how far a contact looks for a place, in manipulator lengths.
ROUNDS, REACH = 3, 0.2
# Of sliding: manipulator lengths, radians (45 degrees), and what going all the way costs.
SLACK, TURN, PENALTY = 0.1, 0.785398, 0.1
