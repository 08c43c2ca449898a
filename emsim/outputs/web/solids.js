// Solids of a scene (outputs/glyphs/solids.py) with a depth for each pixel: what is hidden is hidden, however parts cross.
// Where there is no WebGL2 (lit.js) they are drawn by the processor, into FINE x FINE pixels for one, as a film's are (solid.py).
"use strict";

const FINE = 2, BIAS = 0.006;

class Solids {
  constructor(shapes, size, planar) {
    this.size = size;
    this.parts = drawn.solids(shapes, size, planar);
    for (const part of this.parts) {
      part.normals = drawn.normals(part.points, part.faces);
      // normals that are alike are lit once
      const known = new Map();
      part.lit = [];
      part.corners = part.normals.map((face) => face.map((n) => {
        const key = n.map((v) => v.toFixed(3)).join();
        if (!known.has(key)) known.set(key, part.lit.push(n) - 1);
        return known.get(key);
      }));
      part.outwards = part.faces.map((face, f) => Math.sign(dot(faced(face.map((k) => part.points[k])), part.normals[f][0])));
    }
  }
  // into ctx, by the graphics card where there is one
  show(m, ctx) { if (!Lit.draw(this, m, ctx)) this.draw(m, ctx); }
  // into ctx, at the machine's instant and view
  draw(m, ctx) {
    const ratio = FINE * Math.min(devicePixelRatio, 1.5), width = Math.round(m.width * ratio), height = Math.round(m.height * ratio);
    if (this.width !== width || this.height !== height) {
      const sheet = Object.assign(document.createElement("canvas"), { width, height }), image = sheet.getContext("2d").createImageData(width, height);
      Object.assign(this, { width, height, sheet, image, pixels: new Uint32Array(image.data.buffer), depth: new Float32Array(width * height) });
    }
    this.pixels.fill(0);
    this.depth.fill(-Infinity);
    const lamps = lampsOf(m);
    for (const part of this.parts) this.part(m, part, ratio, lamps);
    this.sheet.getContext("2d").putImageData(this.image, 0, 0);
    ctx.imageSmoothingQuality = "high";
    ctx.drawImage(this.sheet, 0, 0, m.width, m.height);
  }
  // where a part's points are in the world: the origin, and the matrix of its axes by rows; null for a strut without a length
  turn(m, part) {
    if (part.at) return { o: m.world(part.at, m.poses), r: m.poses[part.at[0]].r };
    const o = m.world(part.from, m.poses), to = m.world(part.to, m.poses), x = [0, 1, 2].map((i) => to[i] - o[i]);
    if (!(Math.hypot(...x) > 0)) return null;
    const y = drawn.across(x), z = unitary(drawn.cross(x, y));
    return { o, r: [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]] };
  }
  part(m, part, ratio, { above, lamp, halfway }) {
    const turn = this.turn(m, part);
    if (!turn) return;
    const { o, r } = turn, upright = cofactors(r), from = m.eye(), { towards } = m.view();
    const w = part.points.map(([x, y, z]) => [0, 3, 6].map((i, k) => o[k] + r[i] * x + r[i + 1] * y + r[i + 2] * z)), p = w.flatMap((at) => { const [x, y, near] = m.project(at); return [x * ratio, y * ratio, near]; });
    const base = channels(m.colour(part.colour)), ink = packed(channels(m.colour("edge"))), turned = new Int8Array(part.faces.length);
    const lights = part.lit.map((own) => {
      const n = unitary([0, 3, 6].map((i) => upright[i] * own[0] + upright[i + 1] * own[1] + upright[i + 2] * own[2]));
      return [0.6 + 0.08 * dot(n, above) + 0.42 * Math.max(0, dot(n, lamp)), 0.22 * Math.max(0, dot(n, halfway)) ** 30];
    });
    part.faces.forEach((face, f) => {
      turned[f] = part.outwards[f] * dot(faced(face.map((k) => w[k])), from ? from.map((v, i) => v - w[face[0]][i]) : towards) >= 0 ? 1 : 0;
      if (!turned[f]) return;
      const lit = part.corners[f].map((k) => lights[k]);
      for (let k = 1; k + 1 < face.length; k++) this.triangle(p, [3 * face[0], 3 * face[k], 3 * face[k + 1]], base, [lit[0], lit[k], lit[k + 1]]);
    });
    for (const [i, j, f, g] of part.edges) if (turned[f] !== turned[g]) this.edge(p, 3 * i, 3 * j, ink, m.bias());
  }
  triangle(p, [a, b, c], base, [la, lb, lc]) {
    const { width, height, depth, pixels } = this, ax = p[a], ay = p[a + 1], bx = p[b], by = p[b + 1], cx = p[c], cy = p[c + 1];
    const area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
    if (!(Math.abs(area) > 1e-9)) return;
    const x0 = Math.max(0, Math.ceil(Math.min(ax, bx, cx))), x1 = Math.min(width - 1, Math.floor(Math.max(ax, bx, cx)));
    const y0 = Math.max(0, Math.ceil(Math.min(ay, by, cy))), y1 = Math.min(height - 1, Math.floor(Math.max(ay, by, cy)));
    // weights of b and c, and the depth, are linear over the picture
    const bdx = (cy - ay) / area, bdy = (ax - cx) / area, cdx = (ay - by) / area, cdy = (bx - ax) / area, da = p[a + 2], db = p[b + 2] - da, dc = p[c + 2] - da;
    for (let y = y0; y <= y1; y++) {
      let u = (x0 - ax) * bdx + (y - ay) * bdy, v = (x0 - ax) * cdx + (y - ay) * cdy, at = y * width + x0;
      for (let x = x0; x <= x1; x++, at++, u += bdx, v += cdx) {
        if (u < -1e-9 || v < -1e-9 || u + v > 1.000000001) continue;
        const near = da + u * db + v * dc;
        if (!(near > depth[at])) continue;
        const level = la[0] + u * (lb[0] - la[0]) + v * (lc[0] - la[0]), white = 255 * (la[1] + u * (lb[1] - la[1]) + v * (lc[1] - la[1]));
        depth[at] = near;
        pixels[at] = packed([Math.min(255, base[0] * level + white), Math.min(255, base[1] * level + white), Math.min(255, base[2] * level + white)]);
      }
    }
  }
  edge(p, i, j, colour, bias) {
    const { width, height, depth, pixels } = this, dx = p[j] - p[i], dy = p[j + 1] - p[i + 1], steps = Math.ceil(Math.max(Math.abs(dx), Math.abs(dy), 1));
    if (steps > 4 * (width + height)) return; // behind the eye
    for (let k = 0; k <= steps; k++) {
      const f = k / steps, x = Math.round(p[i] + f * dx), y = Math.round(p[i + 1] + f * dy), near = p[i + 2] + f * (p[j + 2] - p[i + 2]) + bias;
      for (let d = 0; d < 4; d++) {
        const px = x + (d & 1), py = y + (d >> 1), at = py * width + px;
        if (px >= 0 && px < width && py >= 0 && py < height && near > depth[at]) pixels[at] = colour;
      }
    }
  }
}

// what is above, where the lamp is (over the left shoulder), and half way between it and the eye
function lampsOf(m) {
  const { right, up, towards } = m.view(), above = Math.hypot(...m.gravity) > 0 ? unitary(m.gravity.map((g) => -g)) : up;
  const lamp = unitary([0, 1, 2].map((i) => 0.6 * towards[i] + above[i] - 0.45 * right[i]));
  return { above, lamp, halfway: unitary(lamp.map((v, i) => v + towards[i])) };
}
// the normal of a face by two diagonals, or two sides of a triangle
function faced([a, b, c, d = a]) { return drawn.cross([c[0] - a[0], c[1] - a[1], c[2] - a[2]], [d[0] - b[0], d[1] - b[1], d[2] - b[2]]); }
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
// what turns normals where a matrix, by rows, turns points
function cofactors([a, b, c, d, e, f, g, h, i]) { return [e * i - f * h, f * g - d * i, d * h - e * g, c * h - b * i, a * i - c * g, b * g - a * h, b * f - c * e, c * d - a * f, a * e - b * d]; }
function unitary(a) { const size = Math.hypot(...a) || 1; return a.map((v) => v / size); }
function channels(colour) { return [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)); }
function packed([r, g, b]) { return (255 << 24) | (b << 16) | (g << 8) | r; }
