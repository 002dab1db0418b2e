"""Tests of simbench.report."""
