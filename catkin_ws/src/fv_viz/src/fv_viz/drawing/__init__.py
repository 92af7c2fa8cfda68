"""From messages to markers and legends: colours, shapes, layers, what is packed. No node."""
