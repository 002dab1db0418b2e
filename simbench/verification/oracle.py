"""Compare recorded sequences with rays: the jobs of ``verify --oracle``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from simbench.core.errors import SimbenchError, one_line
from simbench.runtime.pool import ReportProgress
from simbench.verification.difference import DAMAGE
from simbench.verification.frame_agreement import FrameAgreement
from simbench.verification.ray_caster import require_embree
from simbench.verification.regenerate import Recorded

__all__ = ["OracleResult", "cast_recorded"]


@dataclass(frozen=True, slots=True)
class OracleResult:
    """Agreement of one sequence with the rays cast for it.

    Attributes
    ----------
    name : str
    frames : tuple of FrameAgreement
    fault : str
        One line that says why it could not be compared; empty where it could.
    """

    name: str
    frames: tuple[FrameAgreement, ...] = ()
    fault: str = ""

    @property
    def agrees(self) -> bool:
        """Whether it could be compared, and every frame is within its bounds."""
        return not self.fault and not any(frame.faults for frame in self.frames)

    def __str__(self) -> str:
        """Return it as one line."""
        if self.fault:
            return f"{self.name}: cannot be verified: {self.fault}"
        broken = [frame for frame in self.frames if frame.faults]
        if not broken:
            return f"{self.name}: agrees with its rays"
        first = f"frame {broken[0].frame}: {'; '.join(broken[0].faults)}"
        more = f" and {len(broken) - 1} more" if len(broken) > 1 else ""
        return f"{self.name}: {first}{more}"


def cast_recorded(
    name: str, read: Callable[[], Recorded], count: int, report: ReportProgress
) -> OracleResult:
    """Render a recorded sequence again, and cast rays for some of its frames.

    Parameters
    ----------
    name : str
    read : callable
        `simbench.verification.regenerate.in_folder` or ``in_dataset`` of a sequence.
    count : int
        How many frames, evenly spaced.
    report : callable of (done, total)
    """
    # here, so that the parent process loads neither simulator nor renderer
    from simbench.verification.cast_frames import cast_sequence

    try:
        require_embree()
        return OracleResult(name, cast_sequence(read(), count, report))
    except SimbenchError as error:
        return OracleResult(name, fault=str(error))
    except DAMAGE as error:
        return OracleResult(name, fault=f"damaged record: {one_line(error)}")
