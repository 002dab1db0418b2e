"""Choice of the appearance of affine filters, learnt in the first frame."""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import TrackerError
from simbench.trackers.parts.appearance import Appearance, TemplateAppearance
from simbench.trackers.parts.encoder import load_encoder
from simbench.trackers.parts.machine_appearance import MachineAppearance

__all__ = ["AppearanceSettings", "first_appearance", "require_appearance"]

APPEARANCES: Final = ("templates", "machine", "encoder")


class AppearanceSettings(Protocol):
    """Parameters of a filter, see `simbench.trackers.parts.affine_filter`."""

    appearance: str
    weights: str
    hidden: int
    structure: float
    balance: bool
    first_share: float
    template_gain: float
    colour_gain: float
    background_gain: float


def require_appearance(settings: AppearanceSettings) -> None:
    """Refuse an appearance that is not known, or weights that cannot be read.

    Raises
    ------
    TrackerError
    """
    if settings.appearance not in APPEARANCES:
        raise TrackerError(
            "appearance must be templates, machine or encoder, got "
            f"{settings.appearance}"
        )
    if settings.appearance == "encoder":
        load_encoder(settings.weights)


def first_appearance(
    settings: AppearanceSettings,
    image: NDArray[np.uint8],
    state: NDArray[np.float64],
    rng: np.random.Generator,
) -> Appearance:
    """Return the appearance of the target in the first frame.

    Parameters
    ----------
    settings : AppearanceSettings
    image : (H, W, 3) uint8, RGB
    state : (2, 3) float, px
        The target there.
    rng : numpy.random.Generator
        Of machines.
    """
    if settings.appearance != "templates":
        is_encoded = settings.appearance == "encoder"
        encoder = load_encoder(settings.weights) if is_encoded else None
        return MachineAppearance(
            image, state, encoder=encoder, hidden=settings.hidden, rng=rng
        )
    return TemplateAppearance(
        image,
        state,
        structure=settings.structure,
        balance=settings.balance,
        first_share=settings.first_share,
        template_gain=settings.template_gain,
        colour_gain=settings.colour_gain,
        background_gain=settings.background_gain,
    )
