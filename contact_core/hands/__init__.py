"""What a hand is, told from a rig: palm, digits, thumb, flexion and pads; and the freedoms that follow."""
