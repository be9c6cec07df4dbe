"""What a file claims to hold, against what it can: checked before memory is taken."""

from pathlib import Path

from scruton.errors import InputError

LARGEST_ARRAY = 4 * 10**9  # bytes of one array once it is read: 20 million samples of 24 channels
SMALL_ARRAY = 10**8  # bytes; up to here a file may be packed as tightly as anything can be
PACKED = 100  # times smaller than what it holds: more than any record with noise in it
TIGHTEST = 1100  # what deflate can reach, on zeros alone
SLACK = 10**5  # bytes: fill values, headers


def check_claim(claimed: int, stored: int, path: Path, name: str) -> None:
    """Refuse what unpacks to more than so many stored bytes can hold.

    Parameters
    ----------
    claimed, stored : int
        Bytes once read, and bytes in the file.
    path : Path
    name : str
        Of the array.

    Raises
    ------
    InputError
        A claim beyond `allowance`.
    """
    if claimed > allowance(stored):
        raise InputError(
            path, name, f"{claimed:,} bytes of data in {stored:,} of the file", "a file that holds all of its samples"
        )


def allowance(stored: int) -> int:
    """Bytes that so many stored bytes may unpack to."""
    return min(LARGEST_ARRAY, TIGHTEST * stored + SLACK, max(SMALL_ARRAY, PACKED * stored))
