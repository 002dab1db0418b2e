"""Instance masks as the layouts want them: runs down the columns, tight boxes, labels.

Our masks run along the rows; those of COCO and of what came after it run down the
columns.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from simbench.core.errors import DatasetError
from simbench.core.mask import Mask
from simbench.core.sequence import Sequence, VehicleTruth
from simbench.core.trajectories import Vehicle, VehicleClass

__all__ = [
    "INFO",
    "TARGET_NAME",
    "categories",
    "label_image",
    "number_of_class",
    "segmentation",
    "tight_box",
    "vehicles_with_masks",
]

TARGET_NAME: Final = "target"
"""Name of the target among the vehicles."""

INFO: Final = {"description": "vehicles filmed by simbench"}
"""What stands first in COCO's files: older pycocotools fail without it."""

_CLASSES: Final[tuple[str, ...]] = get_args(VehicleClass)


def number_of_class(vehicle: Vehicle) -> int:
    """Return the number of a vehicle's class: the same, from 1, in every data set."""
    return _CLASSES.index(vehicle.vehicle_class) + 1


def categories(seen: Collection[int]) -> Iterator[dict[str, Any]]:
    """Yield COCO's description of the classes with those numbers.

    Parameters
    ----------
    seen : collection of int
        Looked at when the first is asked for, not before. A class that nothing belongs
        to must not be told: toolkits average their scores over all classes named.
    """
    for number in sorted(seen):
        name = _CLASSES[number - 1]
        group = "object" if name == "ball" else "vehicle"
        yield {"id": number, "name": name, "supercategory": group}


def vehicles_with_masks(sequence: Sequence, layout: str) -> VehicleTruth:
    """Return the truth about all vehicles.

    Raises
    ------
    DatasetError
        If the sequence has no instance masks.
    """
    vehicles = sequence.truth.vehicles
    if vehicles is None or len(vehicles.masks) != len(sequence):
        raise DatasetError(
            f"format {layout}: {sequence.name}: wanted an instance mask of every "
            "vehicle, this sequence has none"
        )
    return vehicles


def segmentation(mask: Mask) -> dict[str, Any]:
    """Return a mask as COCO's uncompressed run lengths.

    Returns
    -------
    dict
        ``size``: height and width; ``counts``: lengths of alternating runs down the
        columns, the first of zeros. The uncompressed form is the one that every reader
        takes, TrackEval's included.

    Examples
    --------
    >>> segmentation(Mask.from_array(np.array([[False, True], [True, True]])))
    {'size': [2, 2], 'counts': [1, 3]}
    """
    turned = Mask.from_array(mask.to_array().T)
    return {"size": [mask.height, mask.width], "counts": turned.counts.tolist()}


def tight_box(mask: Mask) -> list[int]:
    """Return the box around the pixels that are set: left, top, width, height, px.

    Examples
    --------
    >>> tight_box(Mask.from_array(np.array([[False, False], [False, True]])))
    [1, 1, 1, 1]
    """
    pixels = mask.to_array()
    columns, rows = (np.flatnonzero(pixels.any(axis=axis)) for axis in (0, 1))
    left, top = int(columns[0]), int(rows[0])
    return [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1]


def label_image(
    masks: Mapping[int, Mask], labels: Mapping[int, int], height: int, width: int
) -> NDArray[np.uint8]:
    """Return an image whose values say what each pixel shows.

    Parameters
    ----------
    masks : mapping from id to Mask
        They do not overlap.
    labels : mapping from id to int, in [1, 254]
        Value for the pixels of each.
    height, width : int, px

    Returns
    -------
    (H, W) uint8
        0 where there is none of them.
    """
    image = np.zeros((height, width), np.uint8)
    for identity, mask in masks.items():
        image[mask.to_array()] = labels[identity]
    return image
