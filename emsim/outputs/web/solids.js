// Solids of a spatial scene (outputs/glyphs/solids.py) with a depth for each pixel: what is hidden is hidden, however parts cross.
// Drawn by the processor into FINE x FINE pixels for one: no library, no graphics card, and the same picture as a film's (solid.py).
"use strict";

const FINE = 2, BIAS = 0.006, DARKEST = 0.5;

class Solids {
  constructor(shapes, size) {
    this.size = size;
    this.parts = drawn.solids(shapes, size);
  }
  // into ctx, at the machine's instant and view
  draw(m, ctx) {
    const ratio = FINE * Math.min(devicePixelRatio, 1.5), width = Math.round(m.width * ratio), height = Math.round(m.height * ratio);
    if (this.width !== width || this.height !== height) {
      const sheet = Object.assign(document.createElement("canvas"), { width, height }), image = sheet.getContext("2d").createImageData(width, height);
      Object.assign(this, { width, height, sheet, image, pixels: new Uint32Array(image.data.buffer), depth: new Float32Array(width * height) });
    }
    this.pixels.fill(0);
    this.depth.fill(-Infinity);
    const { right, up, towards } = m.view(), light = unitary([0, 1, 2].map((i) => towards[i] + 0.7 * up[i] - 0.5 * right[i]));
    for (const part of this.parts) this.part(m, part, ratio, towards, light);
    this.sheet.getContext("2d").putImageData(this.image, 0, 0);
    ctx.imageSmoothingQuality = "high";
    ctx.drawImage(this.sheet, 0, 0, m.width, m.height);
  }
  // points of a part in the world
  placed(m, part) {
    const out = new Float64Array(3 * part.points.length);
    let o, r;
    if (part.at) {
      const pose = m.poses[part.at[0]];
      o = m.world(part.at, m.poses);
      r = pose.r;
    } else {
      o = m.world(part.from, m.poses);
      const to = m.world(part.to, m.poses), x = [0, 1, 2].map((i) => to[i] - o[i]);
      if (!(Math.hypot(...x) > 0)) return null;
      const y = drawn.across(x), z = unitary(drawn.cross(x, y));
      r = [x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]];
    }
    part.points.forEach(([x, y, z], k) => {
      for (let i = 0; i < 3; i++) out[3 * k + i] = o[i] + r[3 * i] * x + r[3 * i + 1] * y + r[3 * i + 2] * z;
    });
    return out;
  }
  part(m, part, ratio, towards, light) {
    const w = this.placed(m, part);
    if (!w) return;
    const count = part.points.length, p = new Float64Array(3 * count);
    for (let k = 0; k < count; k++) {
      const [x, y, near] = m.project([w[3 * k], w[3 * k + 1], w[3 * k + 2]]);
      p[3 * k] = x * ratio; p[3 * k + 1] = y * ratio; p[3 * k + 2] = near;
    }
    const base = channels(m.colour(part.colour)), ink = packed(channels(m.colour("edge"))), turned = new Int8Array(part.faces.length), from = m.eye();
    part.faces.forEach((face, f) => {
      // the normal by two diagonals, or two sides of a triangle
      const [a, b, c, d] = [face[0], face[1], face[2], face[3] ?? face[0]].map((k) => 3 * k), n = drawn.cross([w[c] - w[a], w[c + 1] - w[a + 1], w[c + 2] - w[a + 2]], [w[d] - w[b], w[d + 1] - w[b + 1], w[d + 2] - w[b + 2]]);
      const size = Math.hypot(...n) || 1, eye = from ? [0, 1, 2].map((i) => from[i] - w[a + i]) : towards, front = n[0] * eye[0] + n[1] * eye[1] + n[2] * eye[2] >= 0 ? 1 : -1;
      turned[f] = front;
      const lit = Math.max(0, front * (n[0] * light[0] + n[1] * light[1] + n[2] * light[2]) / size), share = DARKEST + (1.06 - DARKEST) * lit;
      const colour = packed(base.map((v) => Math.min(255, v * share)));
      for (let k = 1; k + 1 < face.length; k++) this.triangle(p, 3 * face[0], 3 * face[k], 3 * face[k + 1], colour);
    });
    for (const [i, j, f, g, sharp] of part.edges) if (sharp || turned[f] !== turned[g]) this.edge(p, 3 * i, 3 * j, ink, m.bias());
  }
  triangle(p, a, b, c, colour) {
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
        if (near > depth[at]) { depth[at] = near; pixels[at] = colour; }
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

function unitary(a) { const size = Math.hypot(...a) || 1; return a.map((v) => v / size); }
function channels(colour) { return [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)); }
function packed([r, g, b]) { return (255 << 24) | (b << 16) | (g << 8) | r; }
