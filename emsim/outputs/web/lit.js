// Solids by the graphics card (WebGL2): soft light, a thin outline, and where something pulls down a ground with shadows.
// One context for the page; what is drawn is laid into the machine's own canvas. Without WebGL2, or
// where that is the processor's work too, solids.js draws: it is quicker then.
"use strict";

const SHADOWS = 1024, DARK = 0.3; // texels across of the shadow map; of a shadow, the share of the darkness
const PLACED = `#version 300 es
layout(location=0) in vec3 point; layout(location=1) in vec3 normal; layout(location=2) in vec3 mean;
uniform mat3 turn, upright, axes; uniform vec3 origin, middle, sun[3]; uniform vec4 frame; uniform float thick, size, far; uniform int pass;
out vec3 n, shade, place;
void main() {
  vec3 world = origin + turn * point;
  n = upright * normal;
  place = world;
  vec3 s = world - middle;
  shade = vec3(dot(sun[0], s), dot(sun[1], s), dot(sun[2], s)) / (1.5 * size);
  if (pass == 0) { gl_Position = vec4(shade.xy, -0.5 * shade.z, 1); shade = shade * vec3(0.5, 0.5, -0.25) + 0.5; return; }
  shade = shade * vec3(0.5, 0.5, -0.25) + 0.5;
  // rows of axes: right, up, towards; frame: where the middle is in clip space, and metres to that
  vec3 p = s * axes;
  float w = far > 0.0 ? max(0.05, 1.0 - p.z / far) : 1.0;
  gl_Position = vec4(p.xy * frame.zw + frame.xy * w, far > 0.0 ? w - 0.1 : -p.z / (4.0 * size), w);
  if (pass == 2) { vec2 out2 = ((upright * mean) * axes).xy; gl_Position.xy += thick * frame.zw * out2 / max(length(out2), 1e-6) * w; }
}`;
const LIT = `#version 300 es
precision highp float; precision highp int; precision highp sampler2DShadow;
in vec3 n, shade, place; out vec4 seen;
uniform vec3 colour, above, lamp, halfway, centre; uniform sampler2DShadow map; uniform float size; uniform int pass;
float sunny() {
  float sum = 0.0;
  for (int i = -1; i <= 1; i++) for (int j = -1; j <= 1; j++) sum += texture(map, vec3(shade.xy + 2.0 * vec2(i, j) / ${SHADOWS}.0, shade.z - 0.002));
  return sum / 9.0;
}
void main() {
  if (pass == 0) return;
  if (pass == 2) { seen = vec4(colour, 1); return; }
  if (pass == 3) {
    float fade = 1.0 - smoothstep(0.5, 1.25, length(place - centre) / size);
    seen = vec4(colour, 1) * 0.05 * fade;
    float dark = ${DARK} * (1.0 - sunny()) * fade;
    seen = vec4(seen.rgb * (1.0 - dark), seen.a * (1.0 - dark) + dark);
    return;
  }
  vec3 u = normalize(n);
  float lit = dot(u, lamp), light = lit > 0.0 ? sunny() : 1.0;
  seen = vec4(min(vec3(1), colour * (0.6 + 0.08 * dot(u, above) + 0.42 * max(0.0, lit) * mix(0.35, 1.0, light)) + 0.22 * pow(max(0.0, dot(u, halfway)), 30.0) * light), 1);
}`;

const Lit = {
  gl: undefined,
  // false where this browser cannot
  draw(solids, m, ctx) {
    if (this.gl === undefined) this.begin();
    const { gl } = this;
    if (!gl || gl.isContextLost()) return false;
    const ratio = Math.max(1, devicePixelRatio), width = Math.round(m.width * ratio), height = Math.round(m.height * ratio);
    if (gl.canvas.width !== width || gl.canvas.height !== height) Object.assign(gl.canvas, { width, height });
    if (this.owner !== solids) this.load(solids);
    this.light(m);
    const placed = solids.parts.map((part) => [part, solids.turn(m, part)]).filter(([, turn]) => turn), pass = (n) => gl.uniform1i(this.at.pass, n);
    const all = (paint) => placed.forEach(([part, { o, r }], k) => {
      gl.uniformMatrix3fv(this.at.turn, true, r);
      gl.uniformMatrix3fv(this.at.upright, true, cofactors(r));
      gl.uniform3fv(this.at.origin, o);
      gl.uniform3fv(this.at.colour, channels(m.colour(paint ?? part.colour)).map((v) => v / 255));
      gl.drawElements(gl.TRIANGLES, ...this.ranges.get(part));
    });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.viewport(0, 0, SHADOWS, SHADOWS);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, this.none);
    pass(0);
    all();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.bindTexture(gl.TEXTURE_2D, this.map);
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    pass(1);
    all();
    gl.enable(gl.CULL_FACE);
    gl.cullFace(gl.FRONT);
    pass(2);
    all("edge");
    gl.disable(gl.CULL_FACE);
    if (solids.ground) this.ground(solids, m, pass);
    ctx.drawImage(gl.canvas, 0, 0, m.width, m.height);
    return true;
  },
  // is the card played by the processor?
  slow(gl) {
    const told = gl.getParameter(gl.RENDERER), more = /^WebKit/.test(told) && gl.getExtension("WEBGL_debug_renderer_info");
    return /swiftshader|llvmpipe|software|basic render/i.test(more ? gl.getParameter(more.UNMASKED_RENDERER_WEBGL) : told);
  },
  begin() {
    const gl = document.createElement("canvas").getContext("webgl2", { antialias: true });
    this.gl = null;
    if (!gl || this.slow(gl)) return;
    const program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, PLACED], [gl.FRAGMENT_SHADER, LIT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
    this.gl = gl;
    gl.useProgram(program);
    this.at = Object.fromEntries(["turn", "upright", "origin", "axes", "middle", "sun", "frame", "thick", "size", "far", "pass", "colour", "above", "lamp", "halfway", "centre"].map((name) => [name, gl.getUniformLocation(program, name)]));
    gl.bindBuffer(gl.ARRAY_BUFFER, (this.buffer = gl.createBuffer()));
    this.order = gl.createBuffer();
    for (const k of [0, 1, 2]) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 36, 12 * k);
    }
    // none: what is read while the map is written
    [this.none, this.map] = [1, SHADOWS].map((across) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, across, across);
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
      return texture;
    });
    this.shadows = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadows);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, this.map, 0);
    gl.drawBuffers([gl.NONE]);
    gl.enable(gl.DEPTH_TEST);
  },
  // all parts as triangles in one buffer: point, normal, mean of the normals about a point; corners that are alike once
  load(solids) {
    const values = [], order = [];
    this.ranges = new Map();
    this.owner = solids;
    const add = (part) => {
      const first = order.length, mean = part.points.map(() => [0, 0, 0]), known = new Map();
      part.faces.forEach((face, f) => face.forEach((k, c) => part.normals[f][c].forEach((v, i) => (mean[k][i] += v))));
      part.faces.forEach((face, f) => {
        const own = face.map((k, c) => {
          const key = part.points.length * part.corners[f][c] + k;
          if (!known.has(key)) known.set(key, values.push(...part.points[k], ...part.normals[f][c], ...mean[k]) / 9 - 1);
          return known.get(key);
        });
        for (let k = 1; k + 1 < face.length; k++) order.push(own[0], own[part.outwards[f] < 0 ? k + 1 : k], own[part.outwards[f] < 0 ? k : k + 1]);
      });
      this.ranges.set(part, [order.length - first, this.gl.UNSIGNED_INT, 4 * first]);
    };
    solids.parts.forEach(add);
    const { gl } = this, { ground } = solids;
    if (ground) {
      const [u, v] = [ground.u, ground.v].map((a) => a.map((e) => 1.3 * ground.size * e)), corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([i, j]) => ground.at.map((e, k) => e + i * u[k] + j * v[k]));
      add((solids.floor = { points: corners, faces: [[0, 1, 2, 3]], normals: [corners.map(() => ground.above)], corners: [[0, 0, 0, 0]], outwards: [1] }));
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.order);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(order), gl.STATIC_DRAW);
  },
  light(m) {
    const { gl, at } = this, { right, up, towards } = m.view(), { above, lamp, halfway } = lampsOf(m), [w, h] = [m.width / 2, m.height / 2];
    const middle = [0, 1, 2].map((i) => right[i] * m.middle[0] + up[i] * m.middle[1] + towards[i] * m.deep), u = drawn.across(lamp), v = drawn.cross(lamp, u);
    gl.uniformMatrix3fv(at.axes, false, [...right, ...up, ...towards]);
    gl.uniform3fv(at.middle, middle);
    this.middle = middle;
    gl.uniform3fv(at.sun, [...u, ...v, ...lamp]);
    gl.uniform4f(at.frame, m.centre[0] / w - 1, 1 - m.centre[1] / h, m.scale / w, m.scale / h);
    gl.uniform1f(at.thick, 1.1 / m.scale);
    gl.uniform1f(at.size, m.reach);
    gl.uniform1f(at.far, m.perspective ? m.far : 0);
    for (const [name, value] of Object.entries({ above, lamp, halfway })) gl.uniform3fv(at[name], value);
  },
  // seen from above alone
  ground(solids, m, pass) {
    const { gl, at } = this, { ground, floor } = solids;
    if (dot(m.view().towards, ground.above) < 0.03) return;
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniform3fv(at.centre, m.follow ? this.middle : ground.at);
    gl.uniform3fv(at.colour, channels(m.colour("ground")).map((v) => v / 255));
    for (const place of [at.turn, at.upright]) gl.uniformMatrix3fv(place, false, [1, 0, 0, 0, 1, 0, 0, 0, 1]);
    gl.uniform3f(at.origin, 0, 0, 0);
    pass(3);
    gl.drawElements(gl.TRIANGLES, ...this.ranges.get(floor));
    gl.disable(gl.BLEND);
  },
};
