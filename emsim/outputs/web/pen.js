// What glyphs draw with (outputs/glyphs/contract.py has its duties), on a canvas. A film's is in outputs/film.py.
"use strict";

const ANCHORS = { mm: ["center", "middle"], ls: ["left", "alphabetic"], ms: ["center", "alphabetic"] };

class Pen {
  constructor(ctx, colour, names) {
    // labels: written last, where there is room for them; taken: boxes [left, top, right, bottom] that they keep off
    Object.assign(this, { ctx, colour, names, unit: letters(), labels: [], taken: [] });
    ctx.lineJoin = ctx.lineCap = "round";
    ctx.font = `${12 * this.unit}px system-ui`;
  }
  stroke(colour, width, alpha = 1) {
    const { ctx } = this;
    ctx.strokeStyle = this.colour(colour);
    ctx.lineWidth = width * this.unit;
    ctx.globalAlpha = alpha;
    ctx.stroke();
    ctx.globalAlpha = 1;
  }
  fill(colour) { this.ctx.fillStyle = this.colour(colour); this.ctx.fill(); }
  trace(points) { this.ctx.beginPath(); for (const [x, y] of points) this.ctx.lineTo(x, y); }
  line(points, colour, width, dash = 0, alpha = 1) {
    this.trace(points);
    this.ctx.setLineDash(dash ? [dash * this.unit, dash * this.unit] : []);
    this.stroke(colour, width, alpha);
    this.ctx.setLineDash([]);
  }
  polygon(points, fill, edge, width) {
    this.trace(points);
    this.ctx.closePath();
    this.fill(fill);
    this.stroke(edge, width);
  }
  area(loops, fill, edge, width) {
    this.ctx.beginPath();
    for (const loop of loops) { loop.forEach(([x, y], k) => (k ? this.ctx.lineTo(x, y) : this.ctx.moveTo(x, y))); this.ctx.closePath(); }
    this.fill(fill);
    this.stroke(edge, width);
  }
  circle(at, r, fill, edge, width, alpha = 1) {
    this.ctx.beginPath();
    this.ctx.arc(at[0], at[1], r, 0, 7);
    if (fill) this.fill(fill);
    this.stroke(edge, width, alpha);
  }
  arc(at, r, start, end, colour, width) {
    this.ctx.beginPath();
    this.ctx.arc(at[0], at[1], r, start, end, end < start);
    this.stroke(colour, width);
  }
  head(tip, angle, colour, size) {
    size *= this.unit;
    this.trace([tip, ...[2.7, -2.7].map((side) => [tip[0] + size * Math.cos(angle + side), tip[1] + size * Math.sin(angle + side)])]);
    this.fill(colour);
  }
  label(at, dx, dy, text, colour) { if (this.names) this.labels.push([at[0] + dx * this.unit, at[1] + dy * this.unit, text, colour]); }
  keep_off(at, r) { this.taken.push([at[0] - r, at[1] - r, at[0] + r, at[1] + r]); }
  write(x, y, text, colour, anchor, edge = "panel") {
    const { ctx } = this;
    [ctx.textAlign, ctx.textBaseline] = ANCHORS[anchor];
    ctx.lineWidth = 3 * this.unit;
    ctx.strokeStyle = this.colour(edge);
    ctx.strokeText(text, x, y);
    ctx.fillStyle = this.colour(colour);
    ctx.fillText(text, x, y);
  }
  close(width, height) {
    for (const [x, y, text, colour] of drawn.named(this.labels, this.taken, [width, height], this.unit, (text) => this.ctx.measureText(text).width)) this.write(x, y, text, colour, "ls");
  }
}
