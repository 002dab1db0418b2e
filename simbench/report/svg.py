"""Drawings as SVG text: marks, lines and labels, without a library or a script."""

from __future__ import annotations

from html import escape
from typing import Final

from simbench.core.text import printable

__all__ = ["circle", "document", "label", "mark", "path", "rectangle", "segment"]

_FONT: Final = "system-ui, -apple-system, 'Segoe UI', Roboto, sans-serif"


def document(
    width: float,
    height: float,
    title: str,
    parts: list[str],
    *,
    is_file: bool = True,
) -> str:
    """Return an SVG of a size in px; its title is read to those who cannot see.

    A file of its own names its language; a part of an HTML page does not need to.
    """
    body = "\n".join(parts)
    language = 'xmlns="http://www.w3.org/2000/svg" ' if is_file else ""
    return (
        f'<svg {language}width="{width:g}" '
        f'height="{height:g}" viewBox="0 0 {width:g} {height:g}" role="img" '
        f'font-family="{_FONT}" font-size="13">\n'
        f"<title>{_text(title)}</title>\n"
        f'<rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n'
    )


def segment(
    x0: float, y0: float, x1: float, y1: float, color: str, width: float = 1.0
) -> str:
    """Return a straight line."""
    return (
        f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" '
        f'stroke="{color}" stroke-width="{width:g}"/>'
    )


def path(
    points: list[tuple[float, float]], color: str, dash: str = "", width: float = 1.0
) -> str:
    """Return a line through points."""
    listed = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    more = f' stroke-dasharray="{dash}"' if dash else ""
    more += f' stroke-width="{width:g}"' if width != 1.0 else ""
    return f'<polyline points="{listed}" fill="none" stroke="{color}"{more}/>'


def rectangle(x: float, y: float, width: float, height: float, fill: str) -> str:
    """Return a filled rectangle without a border."""
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" '
        f'fill="{fill}"/>'
    )


def mark(x: float, y: float, color: str, radius: float) -> str:
    """Return a filled dot, for many points."""
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" fill="{color}"/>'


def circle(x: float, y: float, color: str, *, is_filled: bool = True) -> str:
    """Return a mark."""
    fill = color if is_filled else "white"
    return (
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="{fill}" stroke="{color}" '
        'stroke-width="1.5"/>'
    )


def label(
    x: float, y: float, text: str, anchor: str = "start", color: str = "#1f2933"
) -> str:
    """Return a text; ``anchor`` is start, middle or end."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}">'
        f"{_text(text)}</text>"
    )


def _text(text: str) -> str:
    return escape(printable(text))
