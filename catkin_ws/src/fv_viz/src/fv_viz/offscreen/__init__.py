"""Pictures without a screen: an X server of our own, RViz in a process of its own, and who watches over both."""
