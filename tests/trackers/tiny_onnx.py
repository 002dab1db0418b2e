"""Small ONNX networks, written byte by byte: no package of the project writes ONNX.

Field numbers are those of https://github.com/onnx/onnx/blob/main/onnx/onnx.proto.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_nano", "write_vit"]

Shape = tuple[int, ...]
_FLOAT, _INT, _INTS = 1, 2, 7  # kinds of tensors and attributes


def write_vit(path: Path, *, bias: float = 0.0) -> None:
    """Write a network with the inputs and outputs that OpenCV's Vit asks for.

    It scores each cell of the search region by its colour times the mean colour of the
    template, and answers a box a quarter as wide as the region.
    """
    nodes = [
        _node("GlobalAveragePool", ["template"], "colour"),
        _node(
            "AveragePool", ["search"], "cells", kernel_shape=[16, 16], strides=[16, 16]
        ),
        _node("Mul", ["cells", "colour"], "match"),
        _node("Conv", ["match", "w1", "b1"], "raw", kernel_shape=[1, 1]),
        _node("Sigmoid", ["raw"], "output1"),
        _node("Conv", ["match", "w2", "b2"], "output2", kernel_shape=[1, 1]),
        _node("Conv", ["match", "w2", "b3"], "output3", kernel_shape=[1, 1]),
    ]
    values = {
        "w1": np.full((1, 3, 1, 1), 8.0),
        "b1": np.full(1, bias),
        "w2": np.zeros((2, 3, 1, 1)),
        "b2": np.full(2, 0.25),
        "b3": np.full(2, 0.5),
    }
    inputs = {"template": (1, 3, 128, 128), "search": (1, 3, 256, 256)}
    map_ = (16, 16)
    outputs = {
        "output1": (1, 1, *map_),
        "output2": (1, 2, *map_),
        "output3": (1, 2, *map_),
    }
    path.write_bytes(_model(nodes, values, inputs, outputs))


def write_nano(backbone: Path, neckhead: Path) -> None:
    """Write two networks with the inputs and outputs that OpenCV's Nano asks for."""
    nodes = [
        _node(
            "AveragePool", ["input"], "output", kernel_shape=[15, 15], strides=[16, 16]
        )
    ]
    backbone.write_bytes(
        _model(nodes, {}, {"input": (1, 3, 255, 255)}, {"output": (1, 3, 16, 16)})
    )
    nodes = [
        _node("GlobalAveragePool", ["input1"], "colour"),
        _node("Mul", ["input2", "colour"], "match"),
        _node("Conv", ["match", "w1", "b1"], "output1", kernel_shape=[1, 1]),
        _node("Conv", ["match", "w2", "b2"], "output2", kernel_shape=[1, 1]),
    ]
    values = {
        "w1": np.stack([np.zeros((3, 1, 1)), np.full((3, 1, 1), 1e-4)]),
        "b1": np.zeros(2),
        "w2": np.zeros((4, 3, 1, 1)),
        "b2": np.full(4, 32.0),
    }
    inputs = {"input1": (1, 3, 8, 8), "input2": (1, 3, 16, 16)}
    outputs = {"output1": (1, 2, 16, 16), "output2": (1, 4, 16, 16)}
    neckhead.write_bytes(_model(nodes, values, inputs, outputs))


def _model(
    nodes: Sequence[bytes],
    values: dict[str, NDArray[np.float64]],
    inputs: Mapping[str, Shape],
    outputs: Mapping[str, Shape],
) -> bytes:
    graph = b"".join(_bytes(1, node) for node in nodes) + _bytes(2, b"tiny")
    graph += b"".join(_bytes(5, _tensor(name, v)) for name, v in values.items())
    graph += b"".join(_bytes(11, _value(name, s)) for name, s in inputs.items())
    graph += b"".join(_bytes(12, _value(name, s)) for name, s in outputs.items())
    opset = _bytes(1, b"") + _number(2, 13)
    return _number(1, 8) + _bytes(8, opset) + _bytes(7, graph)


def _node(kind: str, inputs: list[str], output: str, **attributes: list[int]) -> bytes:
    encoded = b"".join(_bytes(1, name.encode()) for name in inputs)
    encoded += _bytes(2, output.encode()) + _bytes(3, f"make_{output}".encode())
    encoded += _bytes(4, kind.encode())
    for name, numbers in attributes.items():
        each = _bytes(1, name.encode()) + _number(20, _INTS)
        encoded += _bytes(5, each + b"".join(_number(8, one) for one in numbers))
    return encoded


def _tensor(name: str, values: NDArray[np.float64]) -> bytes:
    encoded = b"".join(_number(1, size) for size in values.shape)
    encoded += _number(2, _FLOAT) + _bytes(8, name.encode())
    return encoded + _bytes(9, values.astype("<f4").tobytes())


def _value(name: str, shape: Shape) -> bytes:
    sizes = b"".join(_bytes(1, _number(1, size)) for size in shape)
    tensor = _number(1, _FLOAT) + _bytes(2, sizes)
    return _bytes(1, name.encode()) + _bytes(2, _bytes(1, tensor))


def _number(field: int, value: int) -> bytes:
    return _varint(field << 3) + _varint(value)


def _bytes(field: int, content: bytes) -> bytes:
    return _varint(field << 3 | 2) + _varint(len(content)) + content


def _varint(value: int) -> bytes:
    encoded = bytearray()
    while value > 127:
        encoded.append(value & 127 | 128)
        value >>= 7
    encoded.append(value)
    return bytes(encoded)
