"""Mistakes on the command line as one line each, with a hint at what may be meant."""

from __future__ import annotations

import typer

from simbench.cli.names import did_you_mean, scenario_names

__all__ = ["usage_mistake"]


def usage_mistake(error: typer.TyperException, app: typer.Typer) -> str:
    """Return a mistake that the parser of arguments found, as one line with a hint.

    Parameters
    ----------
    error : typer.TyperException
    app : typer.Typer
        The commands, among which a misplaced option is looked for.
    """
    # typer's subclasses are private: they are told apart by what they know
    context = getattr(error, "ctx", None)
    option = getattr(error, "option_name", "")
    text = error.message.strip() if option else error.format_message().strip()
    path = context.command_path if context is not None else "simbench"
    if option and text.startswith("No such option"):
        return text + _option_hint(option, context, app)
    if text.startswith("No such command") and "Did you mean" not in text:
        return text.rstrip(".") + _command_hint(text)
    if text.startswith("Missing") or "unexpected extra argument" in text:
        return f"{text.rstrip('.')}; see '{path} --help'"
    return text


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


def _command_hint(text: str) -> str:
    name = text.partition("'")[2].rpartition("'")[0]
    if name in scenario_names():
        return f"; did you mean 'simbench run {name}' or 'simbench show {name}'?"
    return _help("simbench")


def _help(command: str) -> str:
    return f"; see '{command} --help'"


def _commands(app: typer.Typer) -> dict[str, object]:
    return dict(getattr(typer.main.get_command(app), "commands", {}))


def _options(command: object) -> list[str]:
    parameters = getattr(command, "params", [])
    named = [name for p in parameters for name in (*p.opts, *p.secondary_opts)]
    return [name for name in named if name.startswith("-")]
