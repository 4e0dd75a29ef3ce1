"""Rigid bodies that a soft body meets."""

from softbody_core.contact.contact import Contact

__all__ = ["Contact"]
