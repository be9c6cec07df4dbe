"""The figures of a report: pure functions from results to a figure with its caption, registered with their chapter."""

from scruton.report.figures import style
from scruton.report.figures.registry import FigureWithCaption, all_figures, chapter_of, figure, figures_from, save

__all__ = ["FigureWithCaption", "all_figures", "chapter_of", "figure", "figures_from", "save", "style"]
