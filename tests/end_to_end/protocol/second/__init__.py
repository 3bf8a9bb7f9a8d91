"""A second implementation of transport/PROTOCOL.md, made from that page alone.

It plays a master against the real slave and a slave against the real master. It shares no line with the programs, so that a
mistake in the page, or in what the programs make of it, shows as a session that does not come about.

Python's standard library, and libsodium by ctypes for what the library lacks: X25519 and the AEADs.
"""
