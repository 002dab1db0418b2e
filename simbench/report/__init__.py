"""The report of a run: one HTML file that opens without a network."""

from __future__ import annotations

from simbench.report.page import write_report

__all__ = ["write_report"]
