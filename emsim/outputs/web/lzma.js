// LZMA (the "alone" format of 7-Zip's specification, Pavlov 2015): a quarter smaller than deflate, which browsers have themselves.
// It stands apart from all else, for a worker is given its text.
"use strict";

function unlzma(data) {
  const props = data[0], lc = props % 9, lp = (props / 9 | 0) % 5, pb = props / 45 | 0, view = new DataView(data.buffer, data.byteOffset);
  const length = view.getUint32(5, true), out = new Uint8Array(length), odds = (n) => new Uint16Array(n).fill(1024);
  // the range coder
  let at = 18, range = 0xffffffff, code = view.getUint32(14, false);
  const bit = (p, k) => {
    const bound = (range >>> 11) * p[k];
    let b = 0;
    if (code < bound) { range = bound; p[k] += (2048 - p[k]) >> 5; } else { range -= bound; code -= bound; p[k] -= p[k] >> 5; b = 1; }
    if (range < 0x1000000) { range = (range << 8) >>> 0; code = ((code << 8) | data[at++]) >>> 0; }
    return b;
  };
  const direct = (n) => {
    let v = 0;
    while (n--) {
      range >>>= 1;
      const b = code >= range ? 1 : 0;
      if (b) code -= range;
      if (range < 0x1000000) { range = (range << 8) >>> 0; code = ((code << 8) | data[at++]) >>> 0; }
      v = v * 2 + b;
    }
    return v;
  };
  const tree = (p, bits, from = 0) => { let m = 1; for (let k = 0; k < bits; k++) m = (m << 1) | bit(p, from + m); return m - (1 << bits); };
  const backwards = (p, bits, from) => { let m = 1, v = 0; for (let k = 0; k < bits; k++) { const b = bit(p, from + m); m = (m << 1) | b; v |= b << k; } return v; };
  // lengths
  const lengths = () => ({ choice: odds(2), low: odds(16 << 3), mid: odds(16 << 3), high: odds(256) });
  const measure = (c, side) => (!bit(c.choice, 0) ? tree(c.low, 3, side << 3) : !bit(c.choice, 1) ? 8 + tree(c.mid, 3, side << 3) : 16 + tree(c.high, 8)) + 2;
  const literals = odds(0x300 << (lc + lp)), match = odds(192), rep = odds(12), rep0 = odds(12), rep1 = odds(12), rep2 = odds(12), long = odds(192), slots = odds(256), special = odds(128), align = odds(16), plain = lengths(), again = lengths();
  let state = 0, r0 = 0, r1 = 0, r2 = 0, r3 = 0, n = 0;
  while (n < length) {
    const side = n & ((1 << pb) - 1);
    if (!bit(match, (state << 4) + side)) {
      const from = 0x300 * (((n & ((1 << lp) - 1)) << lc) + ((n ? out[n - 1] : 0) >> (8 - lc)));
      let m = 1;
      if (state >= 7) {
        let like = out[n - r0 - 1], off = 0x100;
        do {
          like <<= 1;
          const b = bit(literals, from + off + (like & off) + m);
          m = (m << 1) | b;
          off &= b ? like : ~like;
        } while (m < 0x100);
      } else while (m < 0x100) m = (m << 1) | bit(literals, from + m);
      out[n++] = m;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let size;
    if (bit(rep, state)) {
      if (!bit(rep0, state)) {
        if (!bit(long, (state << 4) + side)) { state = state < 7 ? 9 : 11; out[n] = out[n - r0 - 1]; n++; continue; }
      } else {
        let far;
        if (!bit(rep1, state)) far = r1; else { if (!bit(rep2, state)) far = r2; else { far = r3; r3 = r2; } r2 = r1; }
        r1 = r0;
        r0 = far;
      }
      size = measure(again, side);
      state = state < 7 ? 8 : 11;
    } else {
      r3 = r2; r2 = r1; r1 = r0;
      size = measure(plain, side);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots, 6, Math.min(size - 2, 3) << 6);
      r0 = slot;
      if (slot > 3) {
        const bits = (slot >> 1) - 1;
        r0 = (2 | (slot & 1)) * 2 ** bits;
        if (slot < 14) r0 += backwards(special, bits, r0 - slot); else r0 += direct(bits - 4) * 16 + backwards(align, 4, 0);
      }
    }
    for (const end = Math.min(length, n + size); n < end; n++) out[n] = out[n - r0 - 1];
  }
  return out;
}
