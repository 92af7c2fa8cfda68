"""Drawing of everything that the exploration knows; listens to messages, is imported by nobody."""
