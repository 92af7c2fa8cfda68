"""The thesis's figures, off-screen, from data of our own."""
