"""What editors ask for: the layout of a deck's text, and what stands at a place in it."""
