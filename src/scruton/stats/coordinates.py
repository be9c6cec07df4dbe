"""Sampled coordinates by name: which column, or columns, of an array of walkers a parameter has."""

from collections.abc import Iterator, Mapping

from scruton.arrays import FloatArray


class Values:
    """Coordinates by name: `values["damping_ratio"]` is a view of its column (...), or of its columns (..., members).

    Assigning to a name writes into the array.  Made by `Coordinates.of`.
    """

    __slots__ = ("_places", "_u")

    def __init__(self, u: FloatArray, places: Mapping[str, int | slice]) -> None:
        self._u, self._places = u, places

    def __getitem__(self, name: str) -> FloatArray:
        column: FloatArray = self._u[..., self._places[name]]
        return column

    def __setitem__(self, name: str, value: FloatArray) -> None:
        self._u[..., self._places[name]] = value


class Coordinates(Mapping[str, int | slice]):
    """Where each parameter stands among the sampled coordinates, in the order given.

    Parameters
    ----------
    members : mapping
        By name, the number of members of a parameter that has one coordinate for each of them (a rig, a test, a
        record), which stand side by side; None for a parameter with a single coordinate.
    start : int
        Column of the first parameter.

    Examples
    --------
    >>> layout = Coordinates({"stable_amplitude": None, "damping": 3})
    >>> layout["stable_amplitude"], layout["damping"], layout.size
    (0, slice(1, 4, None), 4)
    """

    def __init__(self, members: Mapping[str, int | None], start: int = 0) -> None:
        self._places: dict[str, int | slice] = {}
        self.start = self.stop = start
        for name, count in members.items():
            self._places[name] = self.stop if count is None else slice(self.stop, self.stop + count)
            self.stop += 1 if count is None else count

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.stop - self.start

    @property
    def block(self) -> slice:
        """All of these coordinates, side by side."""
        return slice(self.start, self.stop)

    def __getitem__(self, name: str) -> int | slice:
        return self._places[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)

    def of(self, u: FloatArray) -> Values:
        """Coordinates by name, from an array with them on its last axis."""
        return Values(u, self._places)
