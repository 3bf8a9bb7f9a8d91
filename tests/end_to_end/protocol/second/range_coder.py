"""PROTOCOL.md, "The range coder": reads the numbers of tiles and of the coarsest heights."""

from .sodium import Refused

_ONE, _LEAST, _MOST_SEEN = 65536, 128, 50
_MOST_SIZE, _MOST_AROUND = 24, 15


class Decoder:
    def __init__(self, data):
        self._data, self._at = data, 0
        self._range, self._code = 0xFFFFFFFF, 0
        for _ in range(4):
            self._shift()

    def _shift(self):
        self._code = (self._code << 8 | (self._data[self._at] if self._at < len(self._data) else 0)) & 0xFFFFFFFF
        self._at += 1

    def _narrow(self, yes):
        is_yes = self._code < yes
        if is_yes:
            self._range = yes
        else:
            self._code -= yes
            self._range -= yes
        while self._range < 1 << 24:
            self._range = self._range << 8 & 0xFFFFFFFF
            self._shift()
        return is_yes

    def bit(self, model):
        """model: [yes, seen], which it changes."""
        yes, seen = model
        is_yes = self._narrow((self._range >> 12) * (yes >> 4))
        yes += ((_ONE if is_yes else 0) - yes) * (2 * _ONE // (2 * seen + 3)) >> 16
        model[0], model[1] = min(max(yes, _LEAST), _ONE - _LEAST), min(seen + 1, _MOST_SEEN)
        return is_yes

    def even_bit(self):
        return self._narrow(self._range >> 1)

    def end(self):
        if self._at != len(self._data) or self._code:
            raise Refused("numbers that do not end as an encoder's do")


class Numbers:
    """A sequence of numbers with models of its own."""

    def __init__(self, decoder):
        self._decoder = decoder
        self._models = [[[_ONE // 2, 0] for _ in range(_MOST_SIZE)] for _ in range(_MOST_AROUND + 1)]

    def read(self, around):
        models, size = self._models[min(around.bit_length(), _MOST_AROUND)], 0
        while size < _MOST_SIZE and self._decoder.bit(models[size]):
            size += 1
        if not size:
            return 0
        magnitude = 1
        for _ in range(size - 1):
            magnitude = magnitude << 1 | self._decoder.even_bit()
        return -magnitude if self._decoder.even_bit() else magnitude
