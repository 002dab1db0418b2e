"""Report of a run: one HTML file that needs no network."""

from __future__ import annotations

from simbench.report.page import write_report

__all__ = ["write_report"]
