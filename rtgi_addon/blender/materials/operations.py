"""What value nodes do to values: conversions between socket types, Mix and Math."""

import math

import numpy as np

from .values import Unreadable, Value, apply


def converted(value: Value, before: str, after: str) -> Value:
    """Blender's implicit conversion between socket types."""
    scalar = ("VALUE", "INT", "BOOLEAN")
    if after in scalar and before == "RGBA":
        return value.luminance()
    if after in scalar and before == "VECTOR":
        return apply(lambda x: np.broadcast_to(x.mean(axis=-1, keepdims=True), x.shape), value)
    return value


def blended(node, blend: str, factor: Value, a: Value, b: Value) -> Value:
    """Mix by a factor; MIX, MULTIPLY, ADD and SUBTRACT."""
    if factor.equals(0.0):
        return a
    if blend == "MIX":
        if a.is_constant and b.is_constant:
            return a + (b - a) * factor
        return a * (1.0 - factor) + b * factor
    if blend == "MULTIPLY":
        return a * b if factor.equals(1.0) else a * (1.0 - factor + b * factor)
    if blend == "ADD":
        return a + b * factor
    if blend == "SUBTRACT":
        return a - b * factor
    raise Unreadable(node.label or node.name, f"blend mode {blend.lower()}")


def calculated(node, operands: list[Value]) -> Value:
    """A Math node."""
    operation = node.operation
    a, b = operands[0], operands[1] if len(operands) > 1 else Value.of(0.0)
    if operation == "ADD":
        return a + b
    if operation == "SUBTRACT":
        return a - b
    if operation == "MULTIPLY":
        return a * b
    if operation == "MULTIPLY_ADD":
        return a * b + operands[2]
    if operation == "DIVIDE" and b.is_constant:
        return a * (1.0 / float(b.constant[0]) if b.constant[0] else 0.0)
    if operation in ("GREATER_THAN", "LESS_THAN") and (a.is_constant or b.is_constant):
        above = (operation == "GREATER_THAN") == b.is_constant
        value, threshold = (a, b) if b.is_constant else (b, a)
        return value.greater_than(float(threshold.constant[0]), above)
    if operation == "ROUND" and a.texture is not None and a.texture.pixels.dtype == np.uint8 and a.clamped() is a:
        return a.greater_than(math.nextafter(0.5, 0.0))
    function = _MATH.get(operation)
    if function is None:
        raise Unreadable(node.label or node.name, f"{operation.lower().replace('_', ' ')} of values")
    return apply(function, *operands)


def quotient(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a / b, 0 where b is 0, as the Divide node."""
    a, b = np.broadcast_arrays(a, b)
    return np.divide(a, b, out=np.zeros(a.shape, np.float32), where=b != 0)


_MATH = {
    "DIVIDE": quotient,
    "GREATER_THAN": lambda a, b: (a > b).astype(np.float32),
    "LESS_THAN": lambda a, b: (a < b).astype(np.float32),
    "POWER": lambda a, b: np.where((a >= 0) | (b == np.rint(b)), np.power(np.maximum(a, 0), b), 0),
    "SQRT": lambda a: np.sqrt(np.maximum(a, 0)),
    "ABSOLUTE": np.abs,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "ROUND": lambda a: np.floor(a + 0.5),
    "FLOOR": np.floor,
    "CEIL": np.ceil,
}
