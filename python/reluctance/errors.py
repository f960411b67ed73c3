"""Errors that a user can mend: the command line prints them on one line and exits with 2."""


class ParameterError(ValueError):
    """An input that cannot be used: what it is, its value, what is needed, what to do."""
