"""The command ``verify``: generate sequences again and compare them."""

from __future__ import annotations

import math
from collections.abc import Sized
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from simbench.cli.arguments import Jobs
from simbench.cli.display import print_line, print_table, progress_bar
from simbench.core.errors import SimbenchError

if TYPE_CHECKING:
    from simbench.verification.difference import VerificationResult
    from simbench.verification.frame_agreement import FrameAgreement
    from simbench.verification.verify import RecordedSequence

__all__ = ["verify"]

_MOST_LINES = 20
_FRAMES = 3
_HEADINGS = (
    "frame",
    "ids %",
    "edges %",
    "masks %",
    "detail %",
    "depth mm",
    "at most",
    "within %",
    "hidden",
    "by rays",
)
_LEGEND = (
    "equal ids of samples away from edges (at least 99.9) and at edges, and of "
    "recorded masks (99.9); samples that differ by a level of detail (at most .05); "
    "difference of depth, median, largest, and samples within 1 mm and 0.1 % (99.9); "
    "hidden share of the target (within .005 of that by rays)"
)


def verify(
    place: Annotated[
        str,
        typer.Argument(metavar="DIR|RUN", help="Sequences, data set (or URL), or run."),
    ],
    jobs: Jobs = None,
    sample: Annotated[
        int | None,
        typer.Option(min=1, help="Only so many sequences, evenly spaced."),
    ] = None,
    oracle: Annotated[
        bool,
        typer.Option(
            "--oracle",
            help="Compare ids, depth and hidden shares with rays cast at the meshes.",
        ),
    ] = False,
    frames: Annotated[
        int | None,
        typer.Option(min=1, help="With --oracle: frames a sequence; default: 3."),
    ] = None,
) -> None:
    """Generate recorded sequences again and compare; exit 1 if anything differs.

    Trajectories, truth, ids (instance masks) and frames are compared separately, in
    new processes; a difference is reported with its first frame and its size. Images,
    depth and tables are compared decoded, value by value, other files byte by byte.
    The machine and versions that made a sequence are printed, but not compared. The
    index and the list of files of a data set are always compared whole.

    With --oracle, the truth is compared with that of an independent ray caster
    instead: of some frames, rays through every sample say which object is seen, how
    far it is, and how much of the target is hidden. Needs the extra "oracle".
    """
    from simbench.runtime.versions import core_count
    from simbench.verification.verify import find_recorded_sequences

    if frames is not None and not oracle:
        raise SimbenchError("--frames: expected --oracle with it, got none")
    console = Console()
    if oracle:
        from simbench.verification.ray_caster import require_embree

        require_embree()  # before anything is read
    sequences, total = find_recorded_sequences(place, sample)
    jobs = jobs or core_count()
    if oracle:
        agree = _compare_with_rays(console, sequences, total, jobs, frames or _FRAMES)
    else:
        agree = _generate_again(console, place, sequences, total, jobs)
    raise typer.Exit(0 if agree else 1)


def _generate_again(
    console: Console,
    place: str,
    sequences: list[RecordedSequence],
    total: int,
    jobs: int,
) -> bool:
    from simbench.verification.compare_dataset import compare_dataset
    from simbench.verification.verify import verify as verify_all

    with progress_bar(console, "nothing was changed", "verify") as progress:
        progress(0.0, len(sequences), "comparing the index")
        index = compare_dataset(place)
        results = verify_all(sequences, jobs=jobs, progress=progress)
    of_index = [] if index is None else [index]
    shown = [r for r in results if not r.is_same or len(results) <= _MOST_LINES]
    for result in [*shown, *of_index]:
        print_line(console, str(result), None if result.is_same else "red")
    _print_summary(console, results, total)
    for result in of_index:
        if not result.is_same:
            print_line(console, f"{result.name}: not as made", "red")
    return all(one.is_same for one in [*results, *of_index])


def _print_summary(
    console: Console, results: list[VerificationResult], total: int
) -> None:
    changes = {
        (name, *versions)
        for result in results
        for name, versions in result.environment_changes.items()
    }
    for name, then, now in sorted(changes):
        print_line(console, f"made with {name} {then or '?'}, here is {now or '?'}")
    same = sum(result.is_same for result in results)
    print_line(console, f"{_count(results, total)} verified: {same} identical")


def _compare_with_rays(
    console: Console,
    sequences: list[RecordedSequence],
    total: int,
    jobs: int,
    frames: int,
) -> bool:
    from simbench.verification.verify import verify_by_rays

    with progress_bar(console, "nothing was changed", "oracle") as progress:
        results = verify_by_rays(sequences, frames, jobs=jobs, progress=progress)
    shown = [r for r in results if not r.agrees or len(results) <= _MOST_LINES]
    for result in shown:
        print_line(console, str(result), None if result.agrees else "red")
        if result.frames:
            print_table(console, _HEADINGS, map(_row, result.frames))
    if any(result.frames for result in shown):
        print_line(console, _LEGEND)
    agreeing = sum(result.agrees for result in results)
    count = _count(results, total)
    print_line(console, f"{count} compared with rays: {agreeing} agree")
    return agreeing == len(results)


def _row(frame: FrameAgreement) -> list[str]:
    return [
        str(frame.frame),
        _number(100.0 * frame.equal_ids, "{:.3f}"),
        _number(100.0 * frame.equal_beside_edges, "{:.2f}"),
        _number(100.0 * frame.equal_masks, "{:.3f}"),
        _number(100.0 * frame.of_detail, "{:.3f}"),
        _number(1000.0 * frame.depth_median_m, "{:.2f}"),
        _number(1000.0 * frame.depth_max_m, "{:.0f}"),
        _number(100.0 * frame.depth_within, "{:.3f}"),
        _number(frame.hidden_by_camera, "{:.4f}"),
        _number(frame.hidden_by_rays, "{:.4f}"),
    ]


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else form.format(value)


def _count(results: Sized, total: int) -> str:
    return f"{len(results)} of {total}" if len(results) < total else f"{total}"
