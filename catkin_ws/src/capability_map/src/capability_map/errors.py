"""The one error of this package: what went wrong, in a sentence that a user can act on."""


class CapabilityMapError(ValueError):
    """A capability map cannot be built, stored, loaded or asked; the message says why and what is valid."""
