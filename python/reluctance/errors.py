"""Errors that a user can mend: the command line prints them on one line and exits with 2."""


class ParameterError(ValueError):
    """An input that cannot be used: what it is, its value, what is needed, what to do."""


def need(holds: bool, what: str, value: object, need: str) -> None:
    """Raises ParameterError unless it holds."""
    if not holds:
        raise ParameterError(f"{what} = {value}, need {need}")
