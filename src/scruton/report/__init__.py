"""Figures, tables and the report of a fit; called, `scruton.report(fit)`, it writes it: see `scruton.report.call`."""

import sys
from types import ModuleType
from typing import Any

from scruton.report.build import ReportPaths, build_report

__all__ = ["ReportPaths", "build_report"]


class _Report(ModuleType):
    """The room that can be called, since it bears the name of what users call."""

    __module__ = "scruton.report.call"  # where what is called is described

    def __call__(self, *arguments: Any, **settings: Any) -> ReportPaths:
        from scruton.report.call import report

        return report(*arguments, **settings)


sys.modules[__name__].__class__ = _Report
