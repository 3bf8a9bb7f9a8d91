"""What PROTOCOL.md needs of libsodium: X25519, AES-256-GCM, ChaCha20-Poly1305 and XChaCha20-Poly1305."""

import ctypes
import ctypes.util

TAG_BYTES = 16


class Missing(Exception):
    """This machine has no libsodium."""


class Refused(Exception):
    """What came is not authentic, or is not as the page says. The reader changes nothing."""


def _load():
    for name in ("libsodium.so.23", ctypes.util.find_library("sodium")):
        try:
            if name:
                library = ctypes.CDLL(name)
                break
        except OSError:
            continue
    else:
        raise Missing("libsodium.so.23 is not on this machine")
    if library.sodium_init() < 0:
        raise Missing("libsodium does not start")
    return library


_library = _load()
HAS_AES = _library.crypto_aead_aes256gcm_is_available() == 1
_LENGTH = ctypes.c_ulonglong


def public_key(secret):
    """The X25519 public key of 32 secret bytes."""
    out = ctypes.create_string_buffer(32)
    _library.crypto_scalarmult_curve25519_base(out, secret)
    return out.raw


def x25519(secret, public):
    """The shared secret; refuses a public key that gives zeros whatever the secret is."""
    out = ctypes.create_string_buffer(32)
    if _library.crypto_scalarmult_curve25519(out, secret, public) != 0:
        raise Refused("a public key of low order")
    return out.raw


def _seal(algorithm, key, nonce, associated, plain):
    out = ctypes.create_string_buffer(len(plain) + TAG_BYTES)
    getattr(_library, algorithm + "_encrypt")(out, None, plain, _LENGTH(len(plain)), associated,
                                              _LENGTH(len(associated)), None, nonce, key)
    return out.raw


def _open(algorithm, key, nonce, associated, sealed):
    if len(sealed) < TAG_BYTES:
        raise Refused("shorter than a tag")
    out = ctypes.create_string_buffer(max(1, len(sealed) - TAG_BYTES))
    if getattr(_library, algorithm + "_decrypt")(out, None, None, sealed, _LENGTH(len(sealed)), associated,
                                                 _LENGTH(len(associated)), nonce, key) != 0:
        raise Refused("a tag that is wrong")
    return out.raw[:len(sealed) - TAG_BYTES]


class Suite:
    """One of the page's two suites: its number on the wire, its name in Noise, and how it seals under a counter."""

    def __init__(self, number, noise_name, algorithm, byte_order):
        self.number, self.noise_name = number, noise_name
        self._algorithm, self._byte_order = algorithm, byte_order

    def _nonce(self, counter):
        return bytes(4) + counter.to_bytes(8, self._byte_order)

    def seal(self, key, counter, associated, plain):
        return _seal(self._algorithm, key, self._nonce(counter), associated, plain)

    def open(self, key, counter, associated, sealed):
        return _open(self._algorithm, key, self._nonce(counter), associated, sealed)


AES = Suite(1, b"Noise_IKpsk2_25519_AESGCM_BLAKE2b", "crypto_aead_aes256gcm", "big")
CHACHA = Suite(2, b"Noise_IKpsk2_25519_ChaChaPoly_BLAKE2b", "crypto_aead_chacha20poly1305_ietf", "little")
SUITES = ([AES] if HAS_AES else []) + [CHACHA]


def seal_x(key, nonce, associated, plain):
    """XChaCha20-Poly1305, with a nonce of 24 bytes."""
    return _seal("crypto_aead_xchacha20poly1305_ietf", key, nonce, associated, plain)


def open_x(key, nonce, associated, sealed):
    return _open("crypto_aead_xchacha20poly1305_ietf", key, nonce, associated, sealed)
