/** Events of one camera in a time span, in order of time. */
export interface EventCloud {
  from_ns: number;
  to_ns: number;
  /** Their number before thinning. */
  total: number;
  /** Since from_ns. */
  dt_ns: Uint32Array;
  x: Uint16Array;
  y: Uint16Array;
  /** 1: ON, 0: OFF. */
  on: Uint8Array;
}

const header_bytes = 24;
const event_bytes = 8;

/**
 * Reads the server's events.bin, little-endian: u64 from, u64 to, u32 n, u32 total, then n times u32 dt, u16 x,
 * u16 y | polarity << 15. Throws if the length does not match n events.
 */
export function parseEvents(buffer: ArrayBuffer): EventCloud {
  if (buffer.byteLength < header_bytes)
    throw new Error(`events.bin: ${buffer.byteLength} bytes, less than its header of ${header_bytes}`);
  const view = new DataView(buffer);
  const n = view.getUint32(16, true);
  const expected = header_bytes + n * event_bytes;
  if (buffer.byteLength !== expected)
    throw new Error(`events.bin: ${buffer.byteLength} bytes, but ${n} events need ${expected}`);
  const cloud: EventCloud = {
    from_ns: Number(view.getBigUint64(0, true)),
    to_ns: Number(view.getBigUint64(8, true)),
    total: view.getUint32(20, true),
    dt_ns: new Uint32Array(n),
    x: new Uint16Array(n),
    y: new Uint16Array(n),
    on: new Uint8Array(n),
  };
  for (let i = 0, at = header_bytes; i < n; ++i, at += event_bytes) {
    cloud.dt_ns[i] = view.getUint32(at, true);
    cloud.x[i] = view.getUint16(at + 4, true);
    const row = view.getUint16(at + 6, true);
    cloud.y[i] = row & 0x7fff;
    cloud.on[i] = row >> 15;
  }
  return cloud;
}
