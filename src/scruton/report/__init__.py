"""Figures, tables and the report of a fit."""

from scruton.report.build import ReportPaths, build_report

__all__ = ["ReportPaths", "build_report"]
