"""PROTOCOL.md, "tile" and "Coarsest heights": parts of tiles to coefficients, and what is known of them before."""

import math
import struct
from dataclasses import dataclass

from .numbers import Reader
from .range_coder import Decoder, Numbers
from .sodium import Refused

SIDE, HALF, INNER, BLOCK = 32, 16, 30, 10
RAW, STEPPED, SMOOTH, SAME = 2, 3, 4, 5
_MOST = 65535


def _clamp(x):
    return min(max(x, 0), _MOST)


def _predict(a, b, c):
    """From left, above, and above left."""
    return min(a, b) if c >= max(a, b) else max(a, b) if c <= min(a, b) else a + b - c


@dataclass
class Part:
    surface: int
    tile: int
    version: int
    first_row: int
    rows: list  # of 32 coefficients
    is_half: bool
    form: int


def _raw(reader, rows):
    values = reader.unpack(f"{rows * SIDE}H")
    reader.end()
    return [list(values[j * SIDE:(j + 1) * SIDE]) for j in range(rows)]


def _same(reader, _):
    reader.end()
    return []


def hash_of(rows):
    """Of a tile's coefficients: FNV-1a, folded."""
    fnv = 0xCBF29CE484222325
    for row in rows:
        for byte in struct.pack(f"<{SIDE}H", *row):
            fnv = (fnv ^ byte) * 0x100000001B3 % 2**64
    return max(1, (fnv ^ fnv >> 32) & 0xFFFFFFFF)


def _stepped(reader, rows):
    step = 2 * reader.one("H") + 1
    decoder = Decoder(reader.bytes(reader.left()))
    numbers, size, out = Numbers(decoder), [], []
    for j in range(rows):
        size.append([0] * SIDE)
        out.append([0] * SIDE)
        for i in range(SIDE):
            at = lambda dj, di: size[j + dj][i + di] if j + dj >= 0 and 0 <= i + di < SIDE else 0  # noqa: E731
            n = numbers.read(2 * at(0, -1) + 2 * at(-1, 0) + at(-1, -1) + at(-1, 1) + at(0, -2) + at(-2, 0))
            size[j][i] = abs(n)
            if i and j:
                p = _predict(out[j][i - 1], out[j - 1][i], out[j - 1][i - 1])
            else:
                p = out[j][i - 1] if i else out[j - 1][i] if j else 32768
            out[j][i] = _clamp(p + step * n)
    decoder.end()
    return out


def _orthonormal():
    """Polynomials of degree 0 ... 31, orthonormal on 0 ... 31 and positive at 31 (Gram-Schmidt, twice)."""
    basis = []
    for k in range(SIDE):
        # The one before times x has the degree wanted, and is orthogonal to most already.
        v = [basis[-1][x] * (2 * x - 31) / 31 for x in range(SIDE)] if k else [1.0] * SIDE
        for _ in range(2):
            for b in basis:
                along = math.fsum(x * y for x, y in zip(v, b))
                v = [x - along * y for x, y in zip(v, b)]
        length = math.sqrt(math.fsum(x * x for x in v))
        basis.append([x / length if v[-1] > 0 else -x / length for x in v])
    return basis


_BASIS = _orthonormal()


def _smooth(reader, _):
    step, degree = reader.unpack("BB")
    if degree > 62:
        raise Refused("degree of a smooth tile")
    decoder = Decoder(reader.bytes(reader.left()))
    numbers, told = Numbers(decoder), [[0] * SIDE for _ in range(SIDE)]
    for total in range(degree + 1):
        for l in range(max(0, total - 31), min(31, total) + 1):
            k = total - l
            at = lambda dl, dk: abs(told[l + dl][k + dk]) if l + dl >= 0 and k + dk >= 0 else 0  # noqa: E731
            told[l][k] = numbers.read(2 * at(0, -1) + 2 * at(-1, 0) + at(-1, -1) + at(0, -2) + at(-2, 0))
    decoder.end()
    scale = 2.0**(step / 8 - 2)
    rows = [[sum(told[l][k] * _BASIS[k][i] for k in range(SIDE)) for i in range(SIDE)] for l in range(SIDE)]
    return [[_clamp(round(32768 + scale * sum(_BASIS[l][j] * rows[l][i] for l in range(SIDE)))) for i in range(SIDE)]
            for j in range(SIDE)]


def read_part(body):
    """A tile message behind its bulk head."""
    reader = Reader(body)
    surface, form, band, tile, version = reader.unpack("IBBII")
    if (not 10 <= len(body) - 4 <= 1150 or form not in (RAW, STEPPED, SMOOTH, SAME) or band > 2
            or (form in (SMOOTH, SAME) and band)):
        raise Refused("head of a tile's part")
    rows = HALF if band else SIDE
    coefficients = {SAME: _same, RAW: _raw, STEPPED: _stepped, SMOOTH: _smooth}[form](reader, rows)
    return Part(surface, tile, version, HALF if band == 2 else 0, coefficients, band != 0, form)


class Coarsest:
    """The coarsest heights of a body: values of blocks, and bounds of tiles."""

    def __init__(self, body):
        self.charts, self.step = body.charts, min(10000, max(1, round(4e-6 / body.scale_m)))
        decoder = Decoder(body.coarsest)
        self.values = self._read_values(Numbers(decoder))
        self.bounds = self._read_bounds(Numbers(decoder))
        decoder.end()

    def _read_values(self, numbers):
        out, first = [], 0
        for chart in self.charts:
            columns, rows = -(-chart.columns // BLOCK), -(-chart.rows // BLOCK)
            v, size = [[0] * columns for _ in range(rows)], [[0] * columns for _ in range(rows)]
            for j in range(rows):
                for i in range(columns):
                    west, north = size[j][i - 1] if i else 0, size[j - 1][i] if j else 0
                    n = numbers.read(2 * west + 2 * north)
                    if i and j:
                        p = _predict(v[j][i - 1], v[j - 1][i], v[j - 1][i - 1])
                    else:
                        p = v[j][i - 1] if i else v[j - 1][i] if j else first
                    size[j][i], v[j][i] = abs(n), p + n
                    if not 0 <= v[j][i] <= _MOST:
                        raise Refused("a value of the coarsest heights")
            first = v[0][0]
            out.append(v)
        return out

    def _read_bounds(self, numbers):
        out, last, size = [], 0, 0
        for _ in range(sum(chart.tiles() for chart in self.charts)):
            n = numbers.read(size)
            last, size = last + n, abs(n)
            if not 0 <= last <= _MOST:
                raise Refused("a bound of a tile")
            out.append(last)
        return out

    def coefficient(self, chart, i, j):
        """Of texel (i, j): column, row."""
        v, total = self.values[chart], 0.0
        block_i, block_j = i // BLOCK, j // BLOCK
        for dj, wj in zip((-1, 0, 1), _weights(j - BLOCK * block_j)):
            for di, wi in zip((-1, 0, 1), _weights(i - BLOCK * block_i)):
                total += wi * wj * _value(v, block_i + di, block_j + dj)
        return _clamp(math.floor(total * self.step + 0.5))

    def tile(self, index):
        """The chart, its first column and its first row of a tile's inner texels."""
        for c, chart in enumerate(self.charts):
            if index < chart.tiles():
                across = -(-chart.columns // INNER)
                return c, index % across * INNER, index // across * INNER
            index -= chart.tiles()
        raise Refused("a tile that the surface does not have")


def _weights(k):
    m = 2 * k + 1
    before, behind = (20 - m)**2 / 800, m**2 / 800
    return before, 1 - before - behind, behind


def _value(v, i, j):
    """Beyond the ends values go on as the last two do."""
    def along(row, at, n):
        if n == 1:
            return row(0)
        if at < 0:
            return row(0) + (row(0) - row(1)) * -at
        if at >= n:
            return row(n - 1) + (row(n - 1) - row(n - 2)) * (at - n + 1)
        return row(at)

    return along(lambda y: along(lambda x: v[y][x], i, len(v[0])), j, len(v))
