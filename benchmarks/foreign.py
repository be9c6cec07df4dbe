"""Folders of records as other programs write them, each with the campaign.toml that a reader of it would write by hand.

They are made to see how `scruton init` does on what it was not tuned on: `python -m benchmarks.first_look --foreign`.
What oscillates is a cosine under an amplitude that decays, or comes to a stable one by Gompertz's law, with offset,
drift and noise: no part of the program makes it.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scruton.arrays import FloatArray

Writer = Callable[[Path], None]


class Shot(NamedTuple):
    """One transient by hand: its file, kind, and window [s] where it is not the whole file."""

    file: str
    kind: str
    start: float | None = None
    stop: float | None = None
    keys: str = ""  # further lines of its table


def held(t: FloatArray, release: float, at: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Time since the release (0 before), and where the body is held until then."""
    return np.maximum(t - release, 0.0), np.where(t < release, at, 0.0)


def ringing(t: FloatArray, first: float, f: float, xi: float, release: float = 0.0) -> FloatArray:
    """A ring-down from `first` at damping ratio `xi`, held there until the release."""
    since, rest = held(t, release, first)
    y = first * np.exp(-2.0 * np.pi * f * xi * since) * np.cos(2.0 * np.pi * f * since)
    return np.where(t < release, rest, y)


def locked(t: FloatArray, first: float, stable: float, f: float, rate: float, release: float = 0.0) -> FloatArray:
    """A growth or decay towards a stable amplitude; at `first` and still until the release."""
    since, rest = held(t, release, first)
    a = stable * (first / stable) ** np.exp(-rate * since)
    return np.where(t < release, rest, a * np.cos(2.0 * np.pi * f * since))


def noisy(y: FloatArray, seed: int, share: float = 0.004, offset: float = 0.0) -> FloatArray:
    """With white noise of a share of the largest amplitude, an offset and a slow drift of twice the noise."""
    level = share * float(np.ptp(y)) / 2.0
    drift = 2.0 * level * np.linspace(-1.0, 1.0, len(y)) ** 2
    return y + level * np.random.default_rng(seed).standard_normal(len(y)) + offset + drift


def clock(seconds: float, rate: float, first: float = 0.0) -> FloatArray:
    """Times of samples [s]."""
    return first + np.arange(round(seconds * rate)) / rate


def campaign(folder: Path, motion: str, still: Sequence[Shot], wind: Sequence[Shot], common: str = "") -> None:
    """Write the campaign by hand: one rig, one test."""
    lines = ["format = 1", "[section]", f'motion = "{motion}"', 'width = "0.5 m"', 'depth = "0.1 m"']
    lines += ["[defaults.records]", common] if common else []
    lines += ["[[rigs]]", 'name = "rig"', 'frequency = "5 Hz"', "damping_ratio = 0.004"]
    lines += ['mass = "6 kg/m"' if motion == "heaving" else 'inertia = "0.1 kg*m^2/m"']
    for owner, shots in (("rigs", still), ("tests", wind)):
        if owner == "tests" and shots:
            lines += ["[[tests]]", 'name = "test"', 'rig = "rig"', 'air_density = "1.2 kg/m^3"', 'wind_speed = "4 m/s"']
        for shot in shots:
            lines += [f"[[{owner}.records]]", f"file = {json.dumps(shot.file)}", f'kind = "{shot.kind}"', shot.keys]
            lines += [f'{key} = "{value} s"' for key, value in (("start", shot.start), ("stop", shot.stop)) if value]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def whole_files(folder: Path, motion: str, names: Iterable[str], common: str) -> None:
    """Write the campaign of three files: a ring-down, a growth and a decay, each from end to end."""
    still, growth, decay = names
    campaign(folder, motion, [Shot(still, "free-decay")], [Shot(growth, "growth"), Shot(decay, "decay")], common)


def rows(*columns: FloatArray, sep: str, decimal: str = ".", form: str = "%.6f", tail: str = "") -> str:
    """Lines of numbers."""
    lines = (sep.join(form % value for value in row) + tail for row in zip(*columns, strict=True))
    return "\n".join(lines).replace(".", decimal) + "\n"


def labview_text(folder: Path) -> None:
    """LabVIEW's own text (.lvm): two header blocks, X_Value and channels, a column of comments, decimal commas."""
    head = (
        "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{d}\n"
        "Multi_Headings\tNo\nX_Columns\tOne\nTime_Pref\tRelative\nOperator\tlab\nDate\t2026/03/04\n"
        "Time\t14:12:07,123\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t{n}\t{n}\t\n"
        "Date\t2026/03/04\t2026/03/04\t\nTime\t14:12:07,1\t14:12:07,1\t\nY_Unit_Label\tmm\tV\t\n"
        "X_Dimension\tTime\tTime\t\nX0\t0,0E+0\t0,0E+0\t\nDelta_X\t0,002\t0,002\t\n***End_of_Header***\t\t\t\n"
        "X_Value\tLaser A\tPressure\tComment\n"
    )
    t = clock(30, 500)
    signals = {
        "still_1.lvm": ringing(t, 6.0, 4.3, 0.004),
        "still_2.lvm": ringing(t, 3.0, 4.3, 0.004, release=5.0),
        "growth.lvm": locked(t, 0.3, 4.0, 4.28, 0.25),
        "decay.lvm": locked(t, 9.0, 4.0, 4.28, 0.25),
    }
    for i, (name, y) in enumerate(signals.items()):
        other = np.random.default_rng(90 + i).standard_normal(len(t)) * 0.01 + 2.0
        text = head.format(d=",", n=len(t)) + rows(t, noisy(y, i, offset=1.2), other, sep="\t", decimal=",")
        (folder / name).write_bytes(text.replace("\n", "\r\n").encode("latin-1"))
    keys = (
        'skip_rows = 22\ndelimiter = "\\t"\ndecimal = ","\ncolumns = { time = "X_Value", displacement = "Laser A" }\n'
    )
    keys += 'units = { time = "s", displacement = "mm" }'
    campaign(
        folder, "heaving", [Shot("still_1.lvm", "free-decay"), Shot("still_2.lvm", "free-decay", 5.0)],
        [Shot("growth.lvm", "growth"), Shot("decay.lvm", "decay")], keys,
    )  # fmt: skip


def german_logger(folder: Path) -> None:
    """A data logger's text: keys above, umlauts in Latin-1, tabs, decimal commas, units in the heading."""
    t = clock(40, 300)
    signals = {
        "Versuch_01_Ausschwingen.txt": ringing(t, 8.0, 5.1, 0.003),
        "Versuch_02_Ausschwingen.txt": ringing(t, 4.0, 5.1, 0.003),
        "Versuch_03_Wind_Aufklingen.txt": locked(t, 0.2, 3.0, 5.1, 0.2, release=9.0),
        "Versuch_04_Wind_Abklingen.txt": locked(t, 8.0, 3.0, 5.1, 0.2, release=6.0),
    }
    for i, (name, y) in enumerate(signals.items()):
        head = (
            "Datenlogger V 3.2\nPrüfstand\tWindkanal Süd\nDatum\t04.03.2026\nMessrate\t300 Hz\nKanäle\t3\n\n"
            "Zeit [s]\tWeg vorne [mm]\tWind [m/s]\n"
        )
        speed = 0.02 * np.random.default_rng(40 + i).standard_normal(len(t)) + (4.4 if "Wind" in name else 0.0)
        text = head + rows(t, noisy(y, 10 + i, offset=-0.7), speed, sep="\t", decimal=",", form="%.4f")
        (folder / name).write_text(text, encoding="latin-1")
    first, second, third, fourth = signals
    keys = 'encoding = "latin-1"\nskip_rows = 6\ndelimiter = "\\t"\ndecimal = ","\n'
    keys += 'columns = { time = "Zeit", displacement = "Weg vorne" }'
    campaign(
        folder, "heaving", [Shot(first, "free-decay"), Shot(second, "free-decay")],
        [Shot(third, "growth", 9.0), Shot(fourth, "decay", 6.0)], keys,
    )  # fmt: skip


def units_below(folder: Path) -> None:
    """Names in one line, units in the next, semicolons; a column of numbers of samples in front."""
    t = clock(25, 200)
    signals = {
        "R1-freedecay.csv": ringing(t, 0.05, 6.0, 0.005),
        "R1-gtr.csv": locked(t, 0.001, 0.02, 6.0, 0.3),
        "R1-dtr.csv": locked(t, 0.06, 0.02, 6.0, 0.3),
        "R1-steady.csv": 0.02 * np.cos(2.0 * np.pi * 6.0 * t),
    }
    for i, (name, y) in enumerate(signals.items()):
        number = np.arange(len(t))
        lines = [f"{n};{a:.5f};{b:.7f};{c:.4f}" for n, a, b, c in
                 zip(number, t, noisy(y, 20 + i, 0.02), noisy(np.ones(len(t)), i), strict=True)]  # fmt: skip
        text = "Nr;Time;Heave;Temperature\n-;s;m;degC\n" + "\n".join(lines) + "\n"
        (folder / name).write_text(text, encoding="utf-8")
    names = list(signals)
    keys = 'skip_rows = 2\ndelimiter = ";"\ncolumns = { time = 1, displacement = 2 }\n'
    keys += 'units = { time = "s", displacement = "m" }'
    kinds = ("growth", "decay", "steady")
    shots = [Shot(name, kind) for name, kind in zip(names[1:], kinds, strict=True)]
    campaign(folder, "heaving", [Shot(names[0], "free-decay")], shots, keys)


def savetxt(folder: Path) -> None:
    """What numpy.savetxt writes under a commented line; several plucks of a pitching model in one file, and rest."""
    t = clock(90, 100)
    y = np.zeros(len(t))
    for release, first in ((5.0, 3.0), (33.0, 2.0), (61.0, 4.0)):
        inside = (t >= release) & (t < release + 27.0)
        y[inside] = ringing(t[inside] - release, first, 3.2, 0.007)
    np.savetxt(folder / "plucks.txt", np.c_[t, noisy(y, 30, 0.002)], fmt="%.6f", header="time [s] pitch [deg]")
    keys = 'delimiter = " "\ncolumns = { time = "time", rotation = "pitch" }'
    windows = ((5.5, 27.0), (33.5, 55.0), (61.5, 83.0))
    campaign(folder, "torsional", [Shot("plucks.txt", "free-decay", *window) for window in windows], [], keys)


def matlab_struct(folder: Path) -> None:
    """A struct of MATLAB 5 with a rate and no times."""
    from scipy.io import savemat

    t = clock(20, 256)
    signals = {
        "ring_down.mat": ringing(t, 5.0, 7.5, 0.004),
        "growth_01.mat": locked(t, 0.2, 2.5, 7.5, 0.4),
        "decay_01.mat": locked(t, 6.0, 2.5, 7.5, 0.4),
    }
    for i, (name, y) in enumerate(signals.items()):
        savemat(folder / name, {"run": {"fs": 256.0, "heave": noisy(y, 50 + i)[:, None], "note": "mm"}})
    keys = 'sample_rate = "256 Hz"\nvariables = { displacement = "run.heave" }\nunits = { displacement = "mm" }'
    whole_files(folder, "heaving", signals, keys)


def matlab_hdf(folder: Path) -> None:
    """MATLAB 7.3, which is HDF5: a matrix of time and motion."""
    import h5py

    t = clock(30, 200)
    signals = {
        "freevib.mat": ringing(t, 0.04, 4.0, 0.006),
        "lockin_growth.mat": locked(t, 0.002, 0.03, 4.0, 0.3),
        "lockin_decay.mat": locked(t, 0.09, 0.03, 4.0, 0.3),
    }
    for i, (name, y) in enumerate(signals.items()):
        with h5py.File(folder / name, "w", userblock_size=512) as file:
            data = file.create_dataset("meas", data=np.c_[t, noisy(y, 60 + i)].T)  # MATLAB's own order
            data.attrs["MATLAB_class"] = np.bytes_("double")
        with (folder / name).open("r+b") as stream:
            stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    keys = 'variables = { time = "meas[:,0]", displacement = "meas[:,1]" }\nunits = { time = "s", displacement = "m" }'
    whole_files(folder, "heaving", signals, keys)


def tdms(folder: Path) -> None:
    """LabVIEW's binary file: a waveform with its step and unit beside a channel of volts."""
    from nptdms import ChannelObject, TdmsWriter

    t = clock(24, 400)
    signals = {
        "still air.tdms": ringing(t, 7.0, 5.5, 0.004),
        "wind on growth.tdms": locked(t, 0.2, 3.0, 5.5, 0.35),
        "wind on decay.tdms": locked(t, 10.0, 3.0, 5.5, 0.35),
    }
    for i, (name, y) in enumerate(signals.items()):
        about = {"wf_increment": 0.0025, "wf_start_offset": 0.0}
        with TdmsWriter(folder / name) as writer:
            writer.write_segment([
                ChannelObject("Run", "Laser", noisy(y, 70 + i), properties=about | {"unit_string": "mm"}),
                ChannelObject("Run", "Bridge", noisy(y, 75 + i, 0.5) / 50.0, properties=about | {"unit_string": "V"}),
            ])  # fmt: skip
    keys = 'variables = { displacement = "Run/Laser" }'
    whole_files(folder, "heaving", signals, keys)


def hdf5(folder: Path) -> None:
    """HDF5 with groups, units as attributes, and a rotation in degrees."""
    import h5py

    t = clock(30, 150)
    signals = {
        "free_decay.h5": ringing(t, 2.0, 4.4, 0.005),
        "growth.h5": locked(t, 0.1, 1.4, 4.4, 0.3),
        "decay.h5": locked(t, 4.0, 1.4, 4.4, 0.3),
    }
    for i, (name, y) in enumerate(signals.items()):
        with h5py.File(folder / name, "w") as file:
            for key, values, unit in (("time", t, "s"), ("alpha", noisy(y, 80 + i), "deg"), ("p", np.sin(t), "Pa")):
                file.create_dataset(f"run/{key}", data=values).attrs["unit"] = unit
    keys = 'variables = { time = "run.time", rotation = "run.alpha" }\nunits = { time = "s", rotation = "deg" }'
    whole_files(folder, "torsional", signals, keys)


def npz(folder: Path) -> None:
    """NumPy archives: time, motion, and the wind speed as a number; milliseconds that begin late."""
    t = clock(30, 250, first=12.0)
    signals = {
        "a.npz": (ringing(t - 12.0, 0.03, 8.0, 0.003), 0.0),
        "b.npz": (locked(t - 12.0, 0.0008, 0.012, 8.0, 0.3), 6.1),
        "c.npz": (locked(t - 12.0, 0.03, 0.012, 8.0, 0.3), 6.1),
    }
    for i, (name, (y, speed)) in enumerate(signals.items()):
        np.savez(folder / name, t=t, z=noisy(y, 100 + i), U=speed)
    keys = 'variables = { time = "t", displacement = "z" }\nunits = { time = "s", displacement = "m" }'
    whole_files(folder, "heaving", signals, keys)


def bare(folder: Path) -> None:
    """Two columns without any header, by scientific numbers and tabs."""
    t = clock(20, 100)
    signals = {
        "free1.dat": ringing(t, 4.0, 3.7, 0.006),
        "free2.dat": ringing(t, 4.0, 3.7, 0.006, release=4.0),
        "gtr.dat": locked(t, 0.2, 2.4, 3.7, 0.35),
        "dtr.dat": locked(t, 7.0, 2.4, 3.7, 0.35),
    }
    for i, (name, y) in enumerate(signals.items()):
        (folder / name).write_text(rows(t, noisy(y, 110 + i), sep="\t", form="%.6E"), encoding="utf-8")
    one, two, three, four = signals
    keys = 'delimiter = "\\t"\ncolumns = { time = 0, displacement = 1 }\nunits = { time = "s", displacement = "mm" }'
    campaign(
        folder, "heaving", [Shot(one, "free-decay"), Shot(two, "free-decay", 4.0)],
        [Shot(three, "growth"), Shot(four, "decay")], keys,
    )  # fmt: skip


def milliseconds(folder: Path) -> None:
    """Times in milliseconds and a motion in micrometres, quoted headings."""
    t = clock(20, 200)
    signals = {
        "free decay 1.csv": ringing(t, 900.0, 6.3, 0.005),
        "growth 1.csv": locked(t, 40.0, 700.0, 6.3, 0.4),
        "decay 1.csv": locked(t, 2000.0, 700.0, 6.3, 0.4),
    }
    for i, (name, y) in enumerate(signals.items()):
        text = '"Time (ms)","Displacement (um)","Trigger"\n'
        text += rows(1000.0 * t, noisy(y, 120 + i), np.zeros(len(t)), sep=",", form="%.3f")
        (folder / name).write_text(text, encoding="utf-8")
    keys = 'columns = { time = "Time", displacement = "Displacement" }'
    whole_files(folder, "heaving", signals, keys)


def accelerations(folder: Path) -> None:
    """What an accelerometer reads, and nothing else."""
    t = clock(20, 250)
    signals = {
        "free_decay.csv": ringing(t, 0.3, 5.0, 0.005),
        "growth.csv": locked(t, 0.02, 0.25, 5.0, 0.4),
        "decay.csv": locked(t, 0.7, 0.25, 5.0, 0.4),
    }
    for i, (name, y) in enumerate(signals.items()):
        text = "Time [s],Acc 1 [g]\n" + rows(t, noisy(y, 130 + i), sep=",")
        (folder / name).write_text(text, encoding="utf-8")
    keys = 'columns = { time = "Time", acceleration = "Acc 1" }'
    whole_files(folder, "heaving", signals, keys)


FOLDERS: dict[str, Writer] = {
    writer.__name__.replace("_", "-"): writer
    for writer in (labview_text, german_logger, units_below, savetxt, matlab_struct, matlab_hdf, tdms, hdf5, npz, bare,
                   milliseconds, accelerations)
}  # fmt: skip


def make(root: Path) -> list[Path]:
    """Write every folder below a root."""
    made: list[Path] = []
    for name, write in FOLDERS.items():
        folder = root / name
        folder.mkdir(parents=True)
        write(folder)
        made.append(folder)
    return made
