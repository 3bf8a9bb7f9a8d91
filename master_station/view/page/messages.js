// The messages of codecs/view/view_messages.h, as the page gets and sends them.
export const VERSION = 4;
export const KIND = { scene: 1, body: 2, tick: 3, status: 4, control: 5, token: 6, taken: 7, answer: 8, tiles: 9, presence: 10, history: 11 };
export const VERB = { resetFault: 1, pause: 2, resume: 3, recentre: 4 };
export const TONES = ["quiet", "notice", "trouble"];
export const SERIES = ["force", "torque", "depth", "tank", "coupling", "contacts", "work", "roundTrip", "network", "node", "age"];
export const STATES = ["free", "touching", "held", "fading", "fault", "paused"];
export const SOURCES = ["tiles", "outline", "remote, new", "remote"];

class Reader {
  constructor(buffer) {
    this.view = new DataView(buffer);
    this.at = 2;
  }
  step(n) {
    this.at += n;
    return this.at - n;
  }
  u8() { return this.view.getUint8(this.step(1)); }
  u16() { return this.view.getUint16(this.step(2), true); }
  u32() { return this.view.getUint32(this.step(4), true); }
  u64() { return Number(this.view.getBigUint64(this.step(8), true)); }
  f32() { return this.view.getFloat32(this.step(4), true); }
  f64() { return this.view.getFloat64(this.step(8), true); }
  vec3() { return [this.f64(), this.f64(), this.f64()]; }
  vec3f() { return [this.f32(), this.f32(), this.f32()]; }
  pose() {
    const p = this.vec3(), [w, x, y, z] = [this.f64(), this.f64(), this.f64(), this.f64()];
    return { p, q: [x, y, z, w] };
  }
  wrench() { return { torque: this.vec3(), force: this.vec3() }; }
  text() {
    const size = this.u16();
    return new TextDecoder().decode(new Uint8Array(this.view.buffer, this.step(size), size));
  }
}

export function kindOf(buffer) {
  const view = new DataView(buffer);
  return buffer.byteLength >= 2 && view.getUint8(0) === VERSION ? view.getUint8(1) : 0;
}

export function readScene(buffer) {
  const r = new Reader(buffer);
  return { name: r.text(), bodies: r.u16(), working: r.vec3(), outwards: r.vec3() };
}

// A vertex is low + step * (i, j, k), in the body's frame.
const readBox = (r) => ({ low: r.vec3(), step: r.vec3() });
function readPoints(r, box, count) {
  const points = new Float32Array(3 * count);
  for (let i = 0; i < 3 * count; ++i) points[i] = box.low[i % 3] + box.step[i % 3] * r.u16();
  return points;
}

export function readBody(buffer) {
  const r = new Reader(buffer);
  const body = { index: r.u16(), name: r.text(), pose: r.pose() }, box = readBox(r);
  const vertices = r.u32(), triangles = r.u32(), colours = r.u32();
  body.positions = readPoints(r, box, vertices);
  body.corners = new Uint32Array(3 * triangles);
  for (let i = 0; i < 3 * triangles; ++i) body.corners[i] = r.u32();
  body.colours = colours ? new Uint8Array(r.view.buffer, r.step(3 * colours), 3 * colours) : null;
  return body;
}

// The triangles of the felt surface, and of which of its tiles each is.
export function readTiles(buffer) {
  const r = new Reader(buffer);
  const body = r.u16(), box = readBox(r), count = r.u32(), pieces = r.u32();
  const tileOf = new Uint32Array(pieces), corners = new Float32Array(9 * pieces);
  for (let i = 0; i < pieces; ++i) {
    tileOf[i] = r.u32();
    corners.set(readPoints(r, box, 3), 9 * i);
  }
  return { body, count, tileOf, corners };
}

export function readPresence(buffer) {
  const r = new Reader(buffer);
  const here = new Uint8Array(r.u32());
  for (let i = 0, bits = 0; i < here.length; ++i) {
    if (i % 8 === 0) bits = r.u8();
    here[i] = bits >> (i % 8) & 1;
  }
  return here;
}

const readBins = (r) => SERIES.map(() => ({ low: r.f32(), high: r.f32(), mean: r.f32(), count: r.u32() }));

export function readHistory(buffer) {
  const r = new Reader(buffer);
  return Array.from({ length: r.u16() }, () => ({ time: 1e-9 * r.u64(), bins: readBins(r) }));
}

export function readTick(buffer) {
  const r = new Reader(buffer);
  const tick = { number: r.u64(), time: 1e-9 * r.u64(), told: r.u64(), state: r.u8(), fault: r.u8(), rung: r.u8(), flags: r.u8() };
  tick.tool = r.pose();
  tick.handle = r.pose();
  tick.hand = r.wrench();
  tick.contact = r.wrench();
  tick.depth = r.f64();
  tick.pressing = r.u32();
  tick.yaw = r.f64();
  tick.ticks = r.u32();
  tick.bins = readBins(r);
  tick.pushes = Array.from({ length: r.u16() }, () => ({
    object: r.u32(), doubts: r.u8(), source: r.u8(), leaving: r.u16() === 1,
    point: r.vec3f(), normal: r.vec3f(), force: r.vec3f(), depth: r.f32(),
  }));
  tick.moving = Array.from({ length: r.u16() }, () => ({ body: r.u16(), there: r.u16() === 1, pose: r.pose() }));
  return tick;
}

export function readStatus(buffer) {
  const r = new Reader(buffer);
  const status = { tone: TONES[r.u8()], paused: r.u8() === 1, happened: r.text(), toDo: r.text() };
  status.words = Array.from({ length: r.u8() }, () => [r.text(), r.text()]);
  return status;
}

export function readAnswer(buffer) {
  const r = new Reader(buffer);
  return { verb: r.u8(), done: r.u8() === 1, words: r.text() };
}

const head = (kind, size) => {
  const bytes = new Uint8Array(2 + size);
  bytes.set([VERSION, kind]);
  return bytes;
};
export function tokenMessage(token) {
  const bytes = head(KIND.token, token.length);
  bytes.set(new TextEncoder().encode(token), 2);
  return bytes;
}
export function takenMessage(number) {
  const bytes = head(KIND.taken, 8);
  new DataView(bytes.buffer).setBigUint64(2, BigInt(number), true);
  return bytes;
}
export function controlMessage(verb) {
  const bytes = head(KIND.control, 1);
  bytes[2] = verb;
  return bytes;
}
