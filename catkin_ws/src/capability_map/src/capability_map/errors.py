"""The one error of this package: what went wrong, in a sentence that a user can act on."""

from fv_common.errors import UserError


class CapabilityMapError(UserError, ValueError):
    """A capability map cannot be built, stored, loaded or asked; the message says why and what is valid."""
