"""Noise_IKpsk2_25519_*_BLAKE2b, revision 34 (PROTOCOL.md, "The handshake"; noiseprotocol.org for the rest).

    <- s
    ...
    -> e, es, s, ss          the initiation
    <- e, ee, se, psk        the response
"""

import hashlib
import hmac
import os

from .sodium import Refused, TAG_BYTES, public_key, x25519

KEY_BYTES = 32
NO_PSK = bytes(KEY_BYTES)


def _hash(*parts):
    return hashlib.blake2b(b"".join(parts)).digest()


def _hkdf(chaining, material, outputs):
    first = hmac.digest(chaining, material, "blake2b")
    out, last = [], b""
    for i in range(outputs):
        last = hmac.digest(first, last + bytes([i + 1]), "blake2b")
        out.append(last)
    return out


class _State:
    """Noise's SymmetricState, with its CipherState."""

    def __init__(self, suite, prologue, responder_public):
        self.suite = suite
        name = suite.noise_name
        self.hash = name.ljust(64, b"\0") if len(name) <= 64 else _hash(name)
        self.chaining = self.hash
        self.key, self.count = None, 0
        self.mix_hash(prologue)
        self.mix_hash(responder_public)

    def mix_hash(self, data):
        self.hash = _hash(self.hash, data)

    def mix_key(self, material):
        self.chaining, key = _hkdf(self.chaining, material, 2)
        self.key, self.count = key[:KEY_BYTES], 0

    def mix_psk(self, psk):
        self.chaining, extra, key = _hkdf(self.chaining, psk, 3)
        self.mix_hash(extra)
        self.key, self.count = key[:KEY_BYTES], 0

    def mix_ephemeral(self, public):
        """With a psk in the pattern an ephemeral key is mixed into the key, too."""
        self.mix_hash(public)
        self.mix_key(public)

    def seal(self, plain):
        sealed = self.suite.seal(self.key, self.count, self.hash, plain)
        self.count += 1
        self.mix_hash(sealed)
        return sealed

    def open(self, sealed):
        plain = self.suite.open(self.key, self.count, self.hash, sealed)
        self.count += 1
        self.mix_hash(sealed)
        return plain

    def split(self):
        """The initiator's sending key, and the responder's."""
        first, second = _hkdf(self.chaining, b"", 2)
        return first[:KEY_BYTES], second[:KEY_BYTES]


class Initiator:
    """Writes the initiation, reads the response; after that keys() are the transport keys."""

    def __init__(self, suite, prologue, secret, responder_public, psk=NO_PSK):
        self._state = _State(suite, prologue, responder_public)
        self._secret, self._responder, self._psk = secret, responder_public, psk
        self._ephemeral = os.urandom(KEY_BYTES)

    def write(self, payload):
        state, e = self._state, public_key(self._ephemeral)
        state.mix_ephemeral(e)
        state.mix_key(x25519(self._ephemeral, self._responder))  # es
        s = state.seal(public_key(self._secret))
        state.mix_key(x25519(self._secret, self._responder))  # ss
        return e + s + state.seal(payload)

    def read(self, message):
        state, e = self._state, message[:KEY_BYTES]
        state.mix_ephemeral(e)
        state.mix_key(x25519(self._ephemeral, e))  # ee
        state.mix_key(x25519(self._secret, e))  # se
        state.mix_psk(self._psk)
        return state.open(message[KEY_BYTES:])

    def keys(self):
        return self._state.split()


class Responder:
    """Reads an initiation, then writes the response to it."""

    def __init__(self, suite, prologue, secret):
        self._state = _State(suite, prologue, public_key(secret))
        self._secret = secret
        self.initiator = None

    def read(self, message):
        state, self._e = self._state, message[:KEY_BYTES]
        state.mix_ephemeral(self._e)
        state.mix_key(x25519(self._secret, self._e))  # es
        end_of_s = KEY_BYTES + KEY_BYTES + TAG_BYTES
        self.initiator = state.open(message[KEY_BYTES:end_of_s])
        state.mix_key(x25519(self._secret, self.initiator))  # ss
        return state.open(message[end_of_s:])

    def write(self, payload, psk=NO_PSK):
        state, ephemeral = self._state, os.urandom(KEY_BYTES)
        state.mix_ephemeral(public_key(ephemeral))
        state.mix_key(x25519(ephemeral, self._e))  # ee
        state.mix_key(x25519(ephemeral, self.initiator))  # se
        state.mix_psk(psk)
        return public_key(ephemeral) + state.seal(payload)

    def keys(self):
        return self._state.split()


__all__ = ["Initiator", "NO_PSK", "Refused", "Responder"]
