"""`scruton.report(...)`: the report of a fit, from Python."""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from scruton.campaign.spelling import several
from scruton.errors import InputError

if TYPE_CHECKING:
    from scruton.infer.results import Fit
    from scruton.report.build import ReportPaths


def report(
    fit: "Fit | Path | str",
    out: Path | str | None = None,
    *,
    scruton_numbers: float | Sequence[float] = (),
    bridge: Path | str | None = None,
    limits: str | Sequence[str] = (),
    office: str | Sequence[str] = (),
    sizing: Path | str | None = None,
    other: Path | str | None = None,
) -> "ReportPaths":
    """Write the report of a fit: report.html, report.pdf, figures, tables and numbers.

    Of a folder nothing is sampled again; of a fit in hand the peak tests are predicted from each other, a fit each.

    Parameters
    ----------
    fit : Fit, or the folder of one
        Of a folder the diagnosis and the sizing that lie in it, or beside it, go into the report.
    out : Path or str, optional
        Folder for the report; "report" in the fit's own where that is a folder.
    scruton_numbers : float or sequence of float
        Design Scruton numbers to predict the stable amplitude at.
    bridge : Path or str, optional
        The bridge.toml, or its folder; its damping is sized anew. The fit has to be a folder.
    limits : str or sequence of str
        Rules beside those of the bridge.
    office : {"docx", "xlsx"} or a sequence of them
        Write a Word and an Excel file, too.
    sizing : Path or str, optional
        Folder of the sizing to report; if left out, the last one that lies in the fit's folder or beside.
    other : Path or str, optional
        Folder of the fit of the other motion, torsion beside heaving: its modes of the bridge, too, and the union.

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
    from scruton.report.parts import Asked
    from scruton.report.saved import beside, chosen_sizing, sizing_remark
    from scruton.sizing.size import check_other

    numbers, rules, office = several(scruton_numbers), several(limits), several(office)
    for form in office:
        check_office(form, "office")
    if not isinstance(fit, Path | str):
        for name, missing in (
            ("out", not out),
            ("bridge", bridge is not None),
            ("sizing", sizing is not None),
            ("other", other is not None),
        ):
            if missing:
                wanted = "a folder" if name == "out" else "the folder of a fit, as `write_fit` makes it"
                raise InputError("report", name, "a fit that is in no folder", wanted)
        return build_report(fit, Path(str(out)), design_sc=numbers, office=office)
    folder, loaded = Path(fit), load_fit(fit)
    named, chosen, across = (None if one is None else Path(one) for one in (bridge, sizing, other))
    check_other(across, named, "report")
    if named is None and (said := sizing_remark(folder, chosen_sizing(folder, loaded.summary, chosen))):
        logging.getLogger("scruton").warning("%s", said)
    place = folder / "report" if out is None else Path(out)
    asked = None if named is None else Asked(named, rules, across)
    content = beside(folder, loaded, asked=asked, design_sc=numbers, sizing=chosen, out=place)
    return build_report(loaded, place, office=office, **content)
