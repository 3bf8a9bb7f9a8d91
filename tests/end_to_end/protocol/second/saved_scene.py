"""PROTOCOL.md, "A scene as files": the object in a side session's slot 1."""

from .numbers import Reader
from .sodium import Refused

SLOT = 1
_MAGIC, _VERSION = b"FFSV", 1
_LETTERS = set(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.")


def _is_asset_name(name):
    return 5 <= len(name) <= 64 and name.endswith(b".glb") and not name.startswith(b".") and set(name) <= _LETTERS


def read(data):
    """Names and bytes of the files, in their order."""
    reader = Reader(data)
    if reader.bytes(4) != _MAGIC or reader.one("H") != _VERSION:
        raise Refused("no saved scene")
    files = {}
    for i in range(reader.one("H")):
        name = reader.bytes(reader.one("B"))
        content = reader.bytes(reader.one("I"))
        if not (_is_asset_name(name) if i else name == b"scene.toml") or name.decode() in files or not content:
            raise Refused("a file's name, or nothing in it")
        files[name.decode()] = content
    reader.end()
    if not 2 <= len(files) <= 258:
        raise Refused("too few files, or too many")
    return files
