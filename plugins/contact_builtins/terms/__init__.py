"""Terms of the pose objective. The paper's three live in `contact_core.solve.terms`."""
