"""`scruton.report(...)`: the report of a fit, from Python."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.errors import InputError

if TYPE_CHECKING:
    from scruton.infer.results import Fit
    from scruton.report.build import ReportPaths


def report(
    fit: "Fit | Path | str",
    out: Path | str | None = None,
    *,
    scruton_numbers: Sequence[float] = (),
    bridge: Path | str | None = None,
    limits: Sequence[str] = (),
    office: Sequence[str] = (),
) -> "ReportPaths":
    """Write the report of a fit: report.html, report.pdf, figures, tables and numbers.

    Of a folder nothing is sampled again; of a fit in hand the peak tests are predicted from each other, a fit each.

    Parameters
    ----------
    fit : Fit, or the folder of one
        Of a folder the diagnosis and the sizing that lie in it, or beside it, go into the report.
    out : Path or str, optional
        Folder for the report; "report" in the fit's own where that is a folder.
    scruton_numbers : sequence of float
        Design Scruton numbers to predict the stable amplitude at.
    bridge : Path or str, optional
        The bridge.toml, or its folder; its damping is sized anew. The fit has to be a folder.
    limits : sequence of str
        Rules beside those of the bridge.
    office : sequence of {"docx", "xlsx"}
        Write a Word and an Excel file, too.

    Returns
    -------
    ReportPaths

    Raises
    ------
    InputError
        Whatever is wrong with what is given.
    """
    from scruton.infer.store import load_fit
    from scruton.report.build import build_report
    from scruton.report.office import check_office
    from scruton.report.saved import beside

    for form in office:
        check_office(form, "office")
    if not isinstance(fit, Path | str):
        for name, value in (("out", out or ""), ("bridge", None if bridge is None else "")):
            if value == "":
                wanted = "a folder" if name == "out" else "the folder of a fit, as `write_fit` makes it"
                raise InputError("report", name, "a fit that is in no folder", wanted)
        return build_report(fit, Path(str(out)), design_sc=scruton_numbers, office=office)
    folder, loaded = Path(fit), load_fit(fit)
    named = None if bridge is None else Path(bridge)
    content = beside(folder, loaded, bridge=named, limits=limits, design_sc=scruton_numbers)
    return build_report(loaded, folder / "report" if out is None else Path(out), office=office, **content)
