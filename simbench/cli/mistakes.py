"""Mistakes on the command line as one line each, with a hint at what may be meant."""

from __future__ import annotations

from typing import Final

import typer

from simbench.cli.names import scenario_names
from simbench.core.text import did_you_mean

__all__ = ["usage_mistake"]

_LIMITS: Final = {
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
}
_EXPECTED: Final = {
    **_LIMITS,
    "int_parsing": "a whole number",
    "int_parsing_size": "a whole number of a sensible size",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
}
"""What a value had to be, by pydantic's type of error."""


def usage_mistake(error: typer.TyperException, app: typer.Typer) -> str:
    """Return a mistake that the parser of arguments found, as one line with a hint.

    Parameters
    ----------
    error : typer.TyperException
    app : typer.Typer
        The commands, among which a misplaced option is looked for.
    """
    # typer's subclasses are private: they are distinguished by their attributes
    context = getattr(error, "ctx", None)
    option = getattr(error, "option_name", "")
    text = error.message.strip() if option else error.format_message().strip()
    path = context.command_path if context is not None else "simbench"
    if option and text.startswith("No such option"):
        return text + _option_hint(option, context, app)
    if text.startswith("No such command"):
        return text.rstrip(".") + _command_hint(text, app)
    if text.startswith("Missing") or "unexpected extra argument" in text:
        listed = "'simbench list' prints them, " if "SCENARIO" in text else ""
        return f"{text.rstrip('.')}; {listed}see '{path} --help'"
    return _bad_value(error) or text


def _bad_value(error: typer.TyperException) -> str:
    """Return a value that cannot be converted as one line; empty for other mistakes."""
    errors = getattr(error.__cause__, "errors", None)  # of pydantic, which typer uses
    option = getattr(getattr(error, "param", None), "opts", None)
    if errors is None or not option:
        return ""
    first = errors()[0]
    expected = _EXPECTED.get(first["type"])
    if expected is None:
        return ""
    limits, value = first.get("ctx", {}), str(first["input"])
    shown = value if first["type"] in _LIMITS else repr(value)
    return f"{option[0]}: expected {expected.format(**limits)}, got {shown}"


def _option_hint(option: str, context: typer.Context | None, app: typer.Typer) -> str:
    """Return where an option belongs, or the most similar one that may be here."""
    if context is None:
        return _help("simbench")
    if context.parent is not None and option in _options(context.parent.command):
        name = context.info_name
        return f"; it goes before the command: simbench {option} {name} ..."
    commands = _commands(app)
    owners = [name for name, of in commands.items() if option in _options(of)]
    if owners and context.parent is None:
        return f"; it goes after its command: simbench {owners[0]} {option} ..."
    hint = did_you_mean(option, _options(context.command))
    if owners and not hint:
        return f"; it is an option of {', '.join(owners)}"
    return hint or _help(context.command_path)


def _command_hint(text: str, app: typer.Typer) -> str:
    name = text.partition("'")[2].partition("'")[0]
    if name in scenario_names():
        return f"; did you mean 'simbench run {name}' or 'simbench show {name}'?"
    if f"--{name}" in _options(typer.main.get_command(app)):
        return f"; did you mean 'simbench --{name}'?"
    return did_you_mean(name, _commands(app)) or _help("simbench")


def _help(command: str) -> str:
    return f"; see '{command} --help'"


def _commands(app: typer.Typer) -> dict[str, object]:
    return dict(getattr(typer.main.get_command(app), "commands", {}))


def _options(command: object) -> list[str]:
    parameters = getattr(command, "params", [])
    named = [name for p in parameters for name in (*p.opts, *p.secondary_opts)]
    return [*(name for name in named if name.startswith("-")), "--help"]
