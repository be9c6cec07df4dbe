"""The one error that means "the input is at fault": the command line turns it into exit code 2."""

from pathlib import Path

LONGEST = 1_000  # characters of each part of a message


class InputError(ValueError):
    """Input that cannot be used, said so that the user can mend it.

    Parameters
    ----------
    file : path or str
        The file at fault.
    field : str
        The field, column or table in it, as the user spells it; empty when it is the whole file.
    found : str
        What stands there.
    wanted : str
        What should stand there, with an example of the spelling.
    """

    def __init__(self, file: Path | str, field: str, found: str, wanted: str) -> None:
        self.file, self.field, self.found, self.wanted = str(file), field, found, wanted
        place = f"{_short(str(file))}: {_short(field)}" if field else _short(str(file))
        super().__init__(f"{place}: found {_short(found)}; wanted {_short(wanted)}.")

    def __reduce__(self) -> tuple[type["InputError"], tuple[str, str, str, str]]:
        """Let the error cross from one process to another with its parts."""
        return type(self), (self.file, self.field, self.found, self.wanted)


def _short(text: str) -> str:
    """A part of a message: a damaged file may hold a name of a million characters."""
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
