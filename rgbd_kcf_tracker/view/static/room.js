// Copyright 2026 The rgbd_kcf_tracker authors
// SPDX-License-Identifier: Apache-2.0

// The room in three dimensions: points and lines in WebGL, turned by hand, and picked from.
'use strict';

const VERTEX = `
attribute vec3 place; attribute vec3 tint;
uniform mat4 matrix; uniform float scale, size;
varying vec3 shade;
void main() { gl_Position = matrix * vec4(place * scale, 1.0); gl_PointSize = size; shade = tint; }`;
const FRAGMENT = 'precision mediump float; varying vec3 shade; void main() { gl_FragColor = vec4(shade, 1.0); }';
const HOME = {yaw: 0.35, pitch: 0.45, distance: 6.2, center: [0, 0.2, 2.8]};
const REACH = 14;  // pixels of the screen within which a click takes a point
const BODY = 0.4;  // metres that a target's box is deep

class Room {
  constructor(canvas, labels, onPick) {
    this.canvas = canvas;
    this.labels = labels;
    this.onPick = onPick;
    this.view = {...HOME, center: [...HOME.center]};
    this.points = null;
    this.gl = canvas.getContext('webgl', {antialias: true, preserveDrawingBuffer: true});
    if (this.gl) this.prepare();
    canvas.addEventListener('webglcontextlost', event => { event.preventDefault(); this.gl = null; });
    canvas.addEventListener('webglcontextrestored', () => { this.gl = canvas.getContext('webgl'); this.prepare(); });
    this.listen();
  }

  prepare() {
    const gl = this.gl;
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, 'place');
    gl.bindAttribLocation(program, 1, 'tint');
    gl.linkProgram(program);
    gl.useProgram(program);
    this.uniform = name => gl.getUniformLocation(program, name);
    this.buffers = {};
    for (const name of ['places', 'tints', 'lines', 'lineTints', 'dots', 'dotTints']) this.buffers[name] = gl.createBuffer();
    gl.enable(gl.DEPTH_TEST);
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
  }

  listen() {
    const pointers = new Map();
    let moved = 0, pinch = 0;
    this.canvas.addEventListener('contextmenu', event => event.preventDefault());
    this.canvas.addEventListener('pointerdown', event => {
      this.canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, event);
      moved = pointers.size > 1 ? 99 : 0;
      pinch = 0;
    });
    this.canvas.addEventListener('pointermove', event => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
      moved += Math.abs(dx) + Math.abs(dy);
      pointers.set(event.pointerId, event);
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        const span = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
        if (pinch) this.zoom(pinch / span);
        pinch = span;
        this.shift(dx / 2, dy / 2);
      } else if (event.buttons & 2 || event.shiftKey) {
        this.shift(dx, dy);
      } else {
        this.view.yaw += dx * 0.006;
        this.view.pitch = Math.max(-0.3, Math.min(1.55, this.view.pitch + dy * 0.006));
      }
      this.draw();
    });
    const up = event => {
      if (pointers.delete(event.pointerId) && event.type === 'pointerup' && moved < 5 && event.button === 0) this.pick(event);
      pinch = 0;
    };
    this.canvas.addEventListener('pointerup', up);
    this.canvas.addEventListener('pointercancel', up);
    this.canvas.addEventListener('wheel', event => {
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.001));
      this.draw();
    }, {passive: false});
  }

  home() {
    this.view = {...HOME, center: [...HOME.center]};
    this.draw();
  }

  zoom(factor) {
    this.view.distance = Math.max(0.5, Math.min(30, this.view.distance * factor));
  }

  shift(dx, dy) {
    const {right, up} = this.axes();
    const step = this.view.distance / Math.max(1, this.canvas.clientHeight);
    for (let i = 0; i < 3; i++) this.view.center[i] += (-dx * right[i] + dy * up[i]) * step;
  }

  /** Unit vectors of the viewer in the camera's frame, in which y points down. */
  axes() {
    const {yaw, pitch} = this.view;
    const back = [Math.sin(yaw) * Math.cos(pitch), -Math.sin(pitch), -Math.cos(yaw) * Math.cos(pitch)];
    const right = normalised(cross([0, -1, 0], back));
    return {right, up: cross(back, right), back};
  }

  matrix(width, height) {
    const {right, up, back} = this.axes();
    const eye = this.view.center.map((c, i) => c + back[i] * this.view.distance);
    const near = 0.05, far = 60, focal = 1.5, aspect = width / height;
    const rows = [right.map(v => v * focal / aspect), up.map(v => v * focal), back];
    const m = new Float32Array(16);
    const a = -(far + near) / (far - near), b = -2 * far * near / (far - near);
    for (let column = 0; column < 3; column++) {
      m[4 * column] = rows[0][column];
      m[4 * column + 1] = rows[1][column];
      m[4 * column + 2] = a * back[column];
      m[4 * column + 3] = -back[column];
    }
    m[12] = -dot(rows[0], eye);
    m[13] = -dot(rows[1], eye);
    m[14] = -a * dot(back, eye) + b;
    m[15] = dot(back, eye);
    return m;
  }

  /** Where a place in metres is on the screen, in CSS pixels; null behind the viewer. */
  project(m, [x, y, z], width, height) {
    const w = m[3] * x + m[7] * y + m[11] * z + m[15];
    if (w < 0.05) return null;
    const u = (m[0] * x + m[4] * y + m[8] * z + m[12]) / w, v = (m[1] * x + m[5] * y + m[9] * z + m[13]) / w;
    return [(u + 1) / 2 * width, (1 - v) / 2 * height, w];
  }

  show(shown, points, trails) {
    this.shown = shown;
    this.points = points;
    this.trails = trails;
    this.draw();
  }

  pick(event) {
    if (!this.points || !this.onPick) return;
    const box = this.canvas.getBoundingClientRect();
    const [px, py] = [event.clientX - box.left, event.clientY - box.top];
    const m = this.matrix(box.width, box.height);
    let best = null, least = Infinity;
    for (let i = 0; i < this.points.count; i++) {
      const place = [0, 1, 2].map(k => this.points.places[3 * i + k] / 1000);
      const at = this.project(m, place, box.width, box.height);
      if (!at) continue;
      const away = Math.hypot(at[0] - px, at[1] - py);
      // The nearer to the viewer the better: what is in front covers what is behind.
      if (away < REACH && at[2] + away * 0.02 < least) { least = at[2] + away * 0.02; best = place; }
    }
    if (best) {
      const [fx, fy, cx, cy] = this.shown.camera;
      this.onPick(fx * best[0] / best[2] + cx, fy * best[1] / best[2] + cy);
    }
  }

  draw() {
    if (!this.shown) return;
    const ratio = window.devicePixelRatio || 1;
    const width = Math.max(1, this.canvas.clientWidth), height = Math.max(1, this.canvas.clientHeight);
    const m = this.matrix(width, height);
    this.drawLabels(m);
    const gl = this.gl;
    if (!gl) return;
    if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
      this.canvas.width = Math.round(width * ratio);
      this.canvas.height = Math.round(height * ratio);
    }
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(...rgb(theme('soft')), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniformMatrix4fv(this.uniform('matrix'), false, m);
    if (this.points && this.points.count) {
      this.load('places', this.points.places, 0, gl.SHORT, false);
      this.load('tints', this.points.tints, 1, gl.UNSIGNED_BYTE, true);
      gl.uniform1f(this.uniform('scale'), 0.001);
      gl.uniform1f(this.uniform('size'), Math.max(1.5, Math.min(8, 16 / this.view.distance)) * ratio);
      gl.drawArrays(gl.POINTS, 0, this.points.count);
    }
    gl.uniform1f(this.uniform('scale'), 1);
    const lines = this.lines(), dots = this.dots();
    if (lines.places.length) {
      this.load('lines', new Float32Array(lines.places), 0, gl.FLOAT, false);
      this.load('lineTints', new Float32Array(lines.tints), 1, gl.FLOAT, false);
      gl.drawArrays(gl.LINES, 0, lines.places.length / 3);
    }
    if (dots.places.length) {
      this.load('dots', new Float32Array(dots.places), 0, gl.FLOAT, false);
      this.load('dotTints', new Float32Array(dots.tints), 1, gl.FLOAT, false);
      gl.uniform1f(this.uniform('size'), 4 * ratio);
      gl.drawArrays(gl.POINTS, 0, dots.places.length / 3);
    }
  }

  load(name, data, index, type, normalise) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[name]);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    gl.vertexAttribPointer(index, 3, type, normalise, 0, 0);
  }

  /** The floor, the camera's frustum, boxes, trails and ellipses as pairs of places. */
  lines() {
    const places = [], tints = [];
    const add = (a, b, color) => { places.push(...a, ...b); tints.push(...color, ...color); };
    const {camera, size, floor, targets} = this.shown;
    const [fx, fy, cx, cy] = camera;
    const grey = rgb(theme('quiet')), faint = rgb(theme('line'));
    if (floor) {
      const onFloor = (x, z) => [x, (1 - floor[0] * x - floor[2] * z) / floor[1], z];
      for (let x = -4; x <= 4; x++) add(onFloor(x, 0), onFloor(x, 8), faint);
      for (let z = 0; z <= 8; z++) add(onFloor(-4, z), onFloor(4, z), faint);
    }
    const corner = (u, v, z = 0.35) => [(u - cx) * z / fx, (v - cy) * z / fy, z];
    const frustum = [corner(0, 0), corner(size[0], 0), corner(size[0], size[1]), corner(0, size[1])];
    frustum.forEach((c, i) => { add([0, 0, 0], c, grey); add(c, frustum[(i + 1) % 4], grey); });
    for (const target of targets) {
      const color = rgb(colorOf(target.id));
      if (target.box && target.depth) {
        const [x, y, w, h] = target.box, z = target.depth;
        const near = Math.max(0.1, z - BODY / 2), far = z + BODY / 2;
        const flat = [corner(x, y, z), corner(x + w, y, z), corner(x + w, y + h, z), corner(x, y + h, z)];
        const front = flat.map(([a, b]) => [a, b, near]), back = flat.map(([a, b]) => [a, b, far]);
        for (let i = 0; i < 4; i++) {
          add(front[i], front[(i + 1) % 4], color);
          add(back[i], back[(i + 1) % 4], color);
          add(front[i], back[i], color);
        }
      }
      const trail = (this.trails && this.trails.get(target.id)) || [];
      for (let i = 1; i < trail.length; i++) add(trail[i - 1], trail[i], color);
      if (target.ellipse) {
        const border = rim(target.ellipse);
        for (let i = 1; i < border.length; i++) add(border[i - 1], border[i], color);
      }
    }
    return {places, tints};
  }

  dots() {
    const places = [], tints = [];
    for (const target of this.shown.targets) {
      const color = rgb(colorOf(target.id));
      for (const [x, y, z] of target.particles || []) { places.push(x, y, z); tints.push(...color); }
    }
    return {places, tints};
  }

  drawLabels(m) {
    const [g, width, height] = fitted(this.labels);
    g.clearRect(0, 0, width, height);
    g.textBaseline = 'middle';
    if (!this.gl) {
      g.fillStyle = theme('quiet');
      g.textAlign = 'center';
      g.font = '13px system-ui, sans-serif';
      g.fillText('This browser draws no WebGL: see the room from above.', width / 2, height / 2);
      return;
    }
    const placed = [];
    for (const target of this.shown.targets) {
      const place = target.position || target.predicted || (target.ellipse && [target.ellipse[0], target.ellipse[5], target.ellipse[1]]);
      const at = place && this.project(m, place, width, height);
      if (at) label(g, placed, target.name, at, colorOf(target.id));
    }
  }
}

function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function cross(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
function normalised(a) { const size = Math.hypot(...a) || 1; return a.map(v => v / size); }
function rgb(color) {
  const digits = color.replace('#', '');
  return [0, 2, 4].map(i => parseInt(digits.slice(i, i + 2), 16) / 255);
}
