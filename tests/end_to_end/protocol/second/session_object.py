"""PROTOCOL.md, "The session object": the grid, the scene and the outline of what is felt.

Meshes (Draco), with their colours in version 5, are stepped over by their length; tiles.py reads the coarsest heights.
"""

from dataclasses import dataclass, field

from . import numbers as n
from .sodium import Refused

_NONE = 0xFFFFFFFF
_MOST_MESH_BYTES = 32 << 20
_MOST_COUNT = 65536


@dataclass
class SceneObject:
    name: str
    p_WO: tuple
    R_WO: tuple
    life: int
    keys: list
    mesh: bytes


@dataclass
class Scene:
    version: int  # 5 where a mesh has colours
    name: str
    tolerance_m: float
    workspace_scale: float
    force_scale: float
    clutch: bool
    tool_name: str
    mass_kg: float
    inertia: tuple
    tool_material: tuple
    tool_mesh: bytes
    working_point: tuple
    working_normal: tuple
    region: tuple  # low corner, high corner, in W
    approach: tuple
    press_N: float
    stroke_m_per_s: float
    objects: list = field(default_factory=list)


@dataclass
class Chart:
    pose: tuple
    texel_m: float
    columns: int
    rows: int
    most_bend: float

    def tiles(self):
        return -(-self.columns // 30) * -(-self.rows // 30)


@dataclass
class Body:
    p_WO: tuple
    R_WO: tuple
    material: tuple
    offset_m: float
    scale_m: float
    vertices: list
    triangles: list  # (three vertices, piece, chart or None, least and greatest height [m])
    thicknesses_m: list
    charts: list
    coarsest: bytes

    def corners_W(self):
        return [n.add(self.p_WO, n.rotate(self.R_WO, v)) for v in self.vertices]


@dataclass
class Outline:
    tolerance_m: float
    soft_width_m: float
    bodies: list


@dataclass
class SessionObject:
    grid: n.Grid
    scene: Scene
    outline: Outline


def _name(reader):
    length = reader.one("H")
    if length > 128:
        raise Refused("length of a name")
    try:
        text = reader.bytes(length).decode("utf-8")
    except UnicodeDecodeError as error:
        raise Refused("a name that is not UTF-8") from error
    if any(ord(c) < 32 or 127 <= ord(c) < 160 for c in text):
        raise Refused("a control character in a name")
    return text


def _pose(reader):
    p, q = reader.floats("3d"), reader.floats("4d")
    if abs(n.norm(q) - 1) > 1e-6:
        raise Refused("a quaternion that is not of length 1")
    return p, q


def _mesh(reader):
    triangles, size = reader.unpack("II")
    if triangles > 2_000_000 or size > _MOST_MESH_BYTES:
        raise Refused("size of a mesh")
    return reader.bytes(size)


def _unit(reader):
    v = reader.floats("3d")
    if abs(n.norm(v) - 1) > 1e-6:
        raise Refused("a direction that is not of length 1")
    return v


def _material(reader):
    return reader.floats("d", 1e8, 0) + reader.floats("d", 1e6, 0) + reader.floats("2d", 100, 0)


def read_scene(data):
    reader = n.Reader(data)
    magic, version, zero = reader.unpack("IHH")
    if magic != 0x43534646 or version not in (4, 5) or zero:
        raise Refused("head of a scene")
    name, (tolerance,), scales = _name(reader), reader.floats("d"), reader.floats("2d", 1e4, 1e-4)
    clutch = reader.one("H")
    if clutch > 1:
        raise Refused("clutch of a scene")
    tool = _name(reader), reader.floats("d")[0], reader.floats("6d"), _material(reader), _mesh(reader)
    exploration = reader.floats("3d"), _unit(reader), (reader.floats("3d"), reader.floats("3d")), _unit(reader)
    scene = Scene(version, name, tolerance, *scales, bool(clutch), *tool, *exploration, *reader.floats("2d"))
    count = reader.one("H")
    if count > 256:
        raise Refused("objects of a scene")
    for _ in range(count):
        object_name, (p, q) = _name(reader), _pose(reader)
        life, keys, again = reader.unpack("HHH")
        if keys > 256 or again > 1:
            raise Refused("keys of a motion")
        if life > 2 or (life and keys):
            raise Refused("the life of an object")
        motion = [(reader.floats("d", 1e5, 0)[0], _pose(reader)) for _ in range(keys)]
        if any(b[0] - a[0] < 1e-3 - 1e-12 for a, b in zip(motion, motion[1:])):
            raise Refused("times of a motion")
        scene.objects.append(SceneObject(object_name, p, q, life, motion, _mesh(reader)))
    reader.end()
    return scene


def _body(reader):
    (p, q), material, (offset, scale) = _pose(reader), _material(reader), reader.floats("2d")
    vertices, triangles, pieces, charts = reader.unpack("4I")
    if max(vertices, triangles, pieces, charts) > _MOST_COUNT:
        raise Refused("counts of a body")
    body = Body(p, q, material, offset, scale, [reader.floats("3f") for _ in range(vertices)], [], [], [], b"")
    for _ in range(triangles):
        *corners, piece, chart = reader.unpack("5I")
        heights = reader.floats("2d")
        if max(corners) >= vertices or piece >= pieces or (chart != _NONE and chart >= charts) or heights[0] > heights[1]:
            raise Refused("a triangle of a body")
        body.triangles.append((tuple(corners), piece, None if chart == _NONE else chart, heights))
    body.thicknesses_m = list(reader.floats(f"{pieces}f", least=0))
    for _ in range(charts):
        pose = _pose(reader)
        body.charts.append(Chart(pose, reader.floats("d", least=0)[0], *reader.unpack("II"), reader.floats("d")[0]))
    body.coarsest = reader.bytes(reader.one("I"))
    if body.coarsest and not body.charts:
        raise Refused("coarsest heights without charts")
    return body


def read_outline(data):
    reader = n.Reader(data)
    if reader.unpack("IH") != (0x4F464646, 3):
        raise Refused("head of an outline")
    count = reader.one("H")
    if not 2 <= count <= 257:
        raise Refused("bodies of an outline")
    lengths = reader.floats("2d", least=0)
    if reader.unpack("II")[1]:
        raise Refused("zero of an outline")
    bodies = [_body(reader) for _ in range(count)]
    if sum(chart.tiles() for body in bodies for chart in body.charts) > _MOST_COUNT:
        raise Refused("tiles of an outline")
    reader.end()
    return Outline(*lengths, bodies)


def read(blob):
    reader = n.Reader(blob)
    grid = n.Grid.read(reader)
    scene = read_scene(reader.bytes(reader.one("I")))
    outline = read_outline(reader.bytes(reader.left())) if reader.left() else None
    if outline and len(outline.bodies) != len(scene.objects) + 1:
        raise Refused("bodies of the outline are not the scene's")
    return SessionObject(grid, scene, outline)


def without_outline(blob):
    """The same session, of which contacts are felt as they come."""
    reader = n.Reader(blob)
    n.Grid.read(reader)
    reader.bytes(reader.one("I"))
    return blob[:len(blob) - reader.left()]
