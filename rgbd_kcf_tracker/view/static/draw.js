// Copyright 2026 The rgbd_kcf_tracker authors
// SPDX-License-Identifier: Apache-2.0

// Drawing on flat canvases: the pictures with their boxes, the room from above, the last minute.
'use strict';

const PALETTE = ['#56b4e9', '#e69f00', '#cc79a7', '#009e73', '#d55e00', '#0072b2', '#f0e442', '#999999'];
const STATES = ['tracking', 'occluded', 'lost', 'idle'];
const TRAIL_S = 10;
const MOST_BANDS = 6;
const STAGE_TINTS = ['#9aa5b1', '#3d7fb8', '#cc79a7', '#e69f00', '#5a6570'];

function theme(name) {
  return getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
}

function colorOf(id) {
  return PALETTE[(id - 1 + PALETTE.length) % PALETTE.length];
}

/** A canvas whose pixels are the screen's; returns its context and its size in CSS pixels. */
function fitted(canvas) {
  const ratio = window.devicePixelRatio || 1;
  const width = Math.max(1, canvas.clientWidth), height = Math.max(1, canvas.clientHeight);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const g = canvas.getContext('2d');
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [g, width, height];
}

/** The picture and, in its own pixels, what is drawn on it. */
function drawPicture(canvas, bitmap, shown, trails, drag) {
  const [width, height] = shown.size;
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const g = canvas.getContext('2d');
  if (bitmap) g.drawImage(bitmap, 0, 0, width, height);
  const unit = width / Math.max(1, canvas.clientWidth);  // image pixels to one of the screen
  const [fx, fy, cx, cy] = shown.camera;
  const seenAt = ([x, y, z]) => z > 0.1 ? [fx * x / z + cx, fy * y / z + cy] : null;
  if (shown.truth) outline(g, shown.truth, '#ffffff', 1 * unit, [5 * unit, 4 * unit]);
  const placed = [];
  for (const target of shown.targets) {
    if (target.chosen) path(g, (trails.get(target.id) || []).map(seenAt), colorOf(target.id), 1.5 * unit);
    if (target.ellipse) path(g, rim(target.ellipse).map(seenAt), colorOf(target.id), 1.5 * unit);
    for (const [x, y, weight] of target.pixels || []) {
      g.fillStyle = colorOf(target.id);
      g.globalAlpha = 0.25 + 0.65 * weight;
      g.fillRect(x - 1.5 * unit, y - 1.5 * unit, 3 * unit, 3 * unit);
    }
    for (const [x, y, z, weight] of target.particles || []) {
      const at = seenAt([x, y, z]);
      if (!at) continue;
      g.fillStyle = colorOf(target.id);
      g.globalAlpha = 0.25 + 0.65 * weight;
      g.fillRect(at[0] - 1.5 * unit, at[1] - 1.5 * unit, 3 * unit, 3 * unit);
    }
    g.globalAlpha = 1;
    if (!target.box && target.predicted) {
      const at = seenAt(target.predicted);
      if (at) label(g, placed, `${target.name}, hidden`, [at[0], at[1] + 17 * unit], colorOf(target.id), unit);
    }
    for (const other of (target.considered || []).slice(0, 6)) {
      if (!target.box || distance(other.box, target.box) > 4)
        outline(g, other.box, '#dddddd', 1 * unit, [3 * unit, 3 * unit]);
    }
    if (target.box) {
      outline(g, target.box, colorOf(target.id), (target.chosen ? 2.5 : 1.2) * unit, []);
    }
  }
  // Last, so that no box crosses out a name; those who were asked for come first.
  for (const target of shown.targets) if (target.box) caption(g, placed, target, unit, width);
  if (drag) outline(g, drag, '#ffffff', 2 * unit, [6 * unit, 4 * unit]);
}

/** The border of the ellipse on the floor plan that holds 95 % of where somebody may be. */
function rim([x, z, major, minor, angle, level]) {
  return Array.from({length: 37}, (_, i) => {
    const a = i / 18 * Math.PI, p = major * Math.cos(a), q = minor * Math.sin(a);
    return [x + p * Math.cos(angle) - q * Math.sin(angle), level, z + p * Math.sin(angle) + q * Math.cos(angle)];
  });
}

function path(g, places, color, thickness) {
  g.strokeStyle = color;
  g.lineWidth = thickness;
  g.beginPath();
  places.forEach((at, i) => { if (at) g[i && places[i - 1] ? 'lineTo' : 'moveTo'](...at); });
  g.stroke();
}

function distance(a, b) {
  return Math.max(...a.map((value, i) => Math.abs(value - b[i])));
}

/** Common area of two boxes against that of either. */
function overlap([ax, ay, aw, ah], [bx, by, bw, bh]) {
  const wide = Math.min(ax + aw, bx + bw) - Math.max(ax, bx), high = Math.min(ay + ah, by + bh) - Math.max(ay, by);
  return wide > 0 && high > 0 ? wide * high / (aw * ah + bw * bh - wide * high) : 0;
}

function outline(g, [x, y, width, height], color, thickness, dash) {
  g.setLineDash([]);
  g.lineWidth = thickness * 2;
  g.strokeStyle = 'rgba(0,0,0,0.65)';
  g.strokeRect(x, y, width, height);
  g.setLineDash(dash);
  g.lineWidth = thickness;
  g.strokeStyle = color;
  g.strokeRect(x, y, width, height);
  g.setLineDash([]);
}

/** Where words that are so large find room: above what is there already, as often as it takes. */
function roomFor(placed, left, top, width, height) {
  const over = () => placed.some(([x, y, w, h]) => left < x + w && x < left + width && top < y + h && y < top + height);
  const first = top;
  while (over() && top > height) top -= height + 1;
  if (over()) for (top = first; over() && top < first + 20 * height;) top += height + 1;
  placed.push([left, top, width, height]);
  return top;
}

function caption(g, placed, target, unit, imageWidth) {
  const [x, y] = target.box;
  let words = target.name;
  if (target.score !== null) words += `  ${Math.round(100 * target.score)} %`;
  if (target.depth !== null) words += `  ${target.depth.toFixed(2)} m`;
  const size = (target.chosen ? 12 : 10.5) * unit;
  g.font = `600 ${size}px system-ui, sans-serif`;
  const width = g.measureText(words).width + 10 * unit;
  const left = Math.max(0, Math.min(x, imageWidth - width));
  const top = roomFor(placed, left, y > 19 * unit ? y - 19 * unit : y + 2 * unit, width, 17 * unit);
  g.fillStyle = colorOf(target.id);
  g.fillRect(left, top, width, 17 * unit);
  g.fillStyle = '#10151a';
  g.textBaseline = 'middle';
  g.fillText(words, left + 5 * unit, top + 9 * unit);
}

function drawDepth(canvas, bitmap, shown) {
  const [width, height] = shown.size;
  canvas.width = bitmap ? bitmap.width : width;
  canvas.height = bitmap ? bitmap.height : height;
  const g = canvas.getContext('2d');
  if (!bitmap) {
    g.fillStyle = theme('soft');
    g.fillRect(0, 0, canvas.width, canvas.height);
    g.fillStyle = theme('quiet');
    g.font = `${canvas.width / 28}px system-ui, sans-serif`;
    g.textAlign = 'center';
    g.fillText('no depth', canvas.width / 2, canvas.height / 2);
    return;
  }
  g.drawImage(bitmap, 0, 0);
  const scale = canvas.width / width;
  for (const target of shown.targets) {
    if (target.box) outline(g, target.box.map(v => v * scale), colorOf(target.id), 2, []);
  }
}

/** The room as a plan: what the camera sees, targets, trails, where hidden ones may be. */
function drawAbove(canvas, shown, points, trails) {
  const [g, width, height] = fitted(canvas);
  g.fillStyle = theme('card');
  g.fillRect(0, 0, width, height);
  const far = Math.min(12, Math.max(3, (shown.far || 5) * 1.15));
  const scale = (height - 34) / (far + 0.4);
  const at = (x, z) => [width / 2 + x * scale, height - 22 - (z + 0.2) * scale];
  g.font = '11px system-ui, sans-serif';
  g.textBaseline = 'middle';
  for (let metre = 1; metre <= far; metre++) {
    const [, y] = at(0, metre);
    g.strokeStyle = theme('soft');
    g.lineWidth = 1;
    g.beginPath(); g.moveTo(0, y); g.lineTo(width, y); g.stroke();
    g.fillStyle = theme('quiet');
    g.textAlign = 'left';
    g.fillText(`${metre} m`, 4, y - 7);
  }
  if (points) {
    g.fillStyle = theme('quiet');
    g.globalAlpha = 0.5;
    const step = Math.max(1, Math.floor(points.count / 5000));
    for (let i = 0; i < points.count; i += step) {
      const [u, v] = at(points.places[3 * i] / 1000, points.places[3 * i + 2] / 1000);
      g.fillRect(u, v, 1.2, 1.2);
    }
    g.globalAlpha = 1;
  }
  const edge = (shown.size[0] / 2) / shown.camera[0];
  g.strokeStyle = theme('quiet');
  g.setLineDash([4, 4]);
  g.beginPath();
  g.moveTo(...at(-edge * far, far)); g.lineTo(...at(0, 0)); g.lineTo(...at(edge * far, far));
  g.stroke();
  g.setLineDash([]);
  const [cx, cy] = at(0, 0);
  g.fillStyle = theme('text');
  g.beginPath(); g.moveTo(cx, cy - 7); g.lineTo(cx - 6, cy + 5); g.lineTo(cx + 6, cy + 5); g.fill();
  g.textAlign = 'center';
  g.fillText('camera', cx, cy + 14);
  const placed = [];
  for (const target of shown.targets) {
    const color = colorOf(target.id);
    const trail = trails.get(target.id) || [];
    g.strokeStyle = color;
    g.lineWidth = 2;
    g.beginPath();
    trail.forEach((place, i) => g[i ? 'lineTo' : 'moveTo'](...at(place[0], place[2])));
    g.lineWidth = target.chosen ? 2 : 1;
    g.stroke();
    g.lineWidth = 2;
    g.fillStyle = color;
    for (const [x, , z, weight] of target.particles || []) {
      const [u, v] = at(x, z);
      g.globalAlpha = 0.2 + 0.7 * weight;
      g.fillRect(u - 1.2, v - 1.2, 2.4, 2.4);
    }
    g.globalAlpha = 1;
    if (target.ellipse) {
      const [x, z, major, minor, angle] = target.ellipse;
      g.beginPath();
      g.ellipse(...at(x, z), Math.max(1, major * scale), Math.max(1, minor * scale), -angle, 0, 2 * Math.PI);
      g.strokeStyle = color;
      g.stroke();
      label(g, placed, `${target.name}, 95 %`, at(x, z), color);
    }
    if (target.position) {
      const [u, v] = at(target.position[0], target.position[2]);
      g.beginPath(); g.arc(u, v, target.chosen ? 6 : 4, 0, 2 * Math.PI); g.fill();
      g.strokeStyle = theme('card'); g.lineWidth = 1.5; g.stroke();
      label(g, placed, target.name, [u, v - 4], color);
    }
  }
}

function label(g, placed, words, [u, v], color, unit = 1) {
  g.font = `600 ${11 * unit}px system-ui, sans-serif`;
  g.textAlign = 'center';
  g.textBaseline = 'middle';
  const width = g.measureText(words).width + 8 * unit;
  const top = roomFor(placed, u - width / 2, v - 24 * unit, width, 15 * unit);
  g.fillStyle = color;
  g.fillRect(u - width / 2, top, width, 15 * unit);
  g.fillStyle = '#10151a';
  g.fillText(words, u, top + 8 * unit);
  g.textAlign = 'left';
}

/** State, score, confusion and latency of the last minute. Returns where each entry lies. */
function drawTime(canvas, entries, now, {names, chosen, stages}) {
  const [g, width, height] = fitted(canvas);
  g.fillStyle = theme('card');
  g.fillRect(0, 0, width, height);
  const left = 76, right = width - 8, top = 6;
  const everyone = [...new Set(entries.flatMap(e => e.targets.map(t => t[0])))];
  const ids = everyone.sort((a, b) => chosen.has(b) - chosen.has(a) || a - b).slice(0, MOST_BANDS);
  const bandHeight = 12;
  const scoreTop = top + Math.max(1, ids.length) * (bandHeight + 3) + 6;
  const scoreBottom = scoreTop + (height - scoreTop - 22) * 0.6;
  const costTop = scoreBottom + 10, costBottom = height - 18;
  const end = entries.length ? entries[entries.length - 1].t : 0;
  const start = Math.max(end - 60, entries.length ? entries[0].t : 0);
  const stop = Math.max(end, start + 5);
  const x = t => left + (t - start) / (stop - start) * (right - left);
  g.font = '11px system-ui, sans-serif';
  g.textBaseline = 'middle';
  const words = (text, u, v, align) => {
    g.fillStyle = theme('quiet');
    g.textAlign = align || 'right';
    g.fillText(text, u, v);
  };
  ids.forEach((id, row) => {
    const y = top + row * (bandHeight + 3);
    words(shortened(g, names.get(id) || `person ${id}`, left - 12), left - 7, y + bandHeight / 2);
    g.fillStyle = colorOf(id);
    g.fillRect(left - 4, y, 3, bandHeight);
    for (let i = 0; i < entries.length; i++) {
      const found = entries[i].targets.find(t => t[0] === id);
      if (!found) continue;
      const from = x(entries[i].t);
      const to = i + 1 < entries.length ? x(Math.min(entries[i + 1].t, entries[i].t + 0.5)) : from + 2;
      // Height tells states apart where colours do not.
      const share = {tracking: 1, occluded: 0.6, lost: 0.3, idle: 0.15}[found[1]];
      g.fillStyle = theme(found[1]);
      g.fillRect(from, y + bandHeight * (1 - share), Math.max(1, to - from + 0.3), bandHeight * share);
    }
  });
  for (const value of [0, 0.5, 1]) {
    const y = scoreBottom - value * (scoreBottom - scoreTop);
    g.strokeStyle = theme('soft');
    g.beginPath(); g.moveTo(left, y); g.lineTo(right, y); g.stroke();
    words(value ? `${100 * value} %` : 'score', left - 6, y);
  }
  for (const id of ids) {
    const curve = (index, color, thickness, dash) => line(g, entries, e => (e.targets.find(t => t[0] === id) || [])[index],
      color, thickness, dash, x, scoreTop, scoreBottom, 1);
    curve(2, colorOf(id), chosen.has(id) ? 1.8 : 1, []);
    curve(3, theme('lost'), 1.4, [4, 3]);
    curve(5, theme('quiet'), 1.6, [1, 3]);
  }
  const sums = entries.map(e => stages.reduce((sum, s) => sum + (e[s] || 0), 0)).sort((a, b) => a - b);
  // A single hiccup must not flatten all the rest.
  const most = Math.max(5, 1.2 * (sums[Math.floor(0.97 * (sums.length - 1))] || 0));
  words(`${Math.ceil(most)} ms`, left - 6, costTop + 4);
  words('0', left - 6, costBottom);
  const gap = entries.length > 1 ? (x(end) - x(entries[0].t)) / (entries.length - 1) : 2;
  for (const entry of entries) {
    let base = costBottom;
    stages.forEach((stage, i) => {
      const size = Math.min((entry[stage] || 0) / most * (costBottom - costTop), base - costTop);
      g.fillStyle = STAGE_TINTS[i % STAGE_TINTS.length];
      g.fillRect(x(entry.t), base - size, Math.max(1, Math.min(6, gap - (gap > 3))), size);
      base -= size;
    });
    if (entry.dropped) {
      g.fillStyle = theme('lost');
      g.beginPath(); g.moveTo(x(entry.t), costBottom - 7); g.lineTo(x(entry.t) - 4, costBottom); g.lineTo(x(entry.t) + 4, costBottom); g.fill();
    }
  }
  words(`${start.toFixed(0)} s`, left, height - 8, 'left');
  words(`${stop.toFixed(1)} s`, right, height - 8, 'right');
  if (now !== undefined && now >= start && now <= end) {
    g.strokeStyle = theme('text');
    g.lineWidth = 1;
    g.beginPath(); g.moveTo(x(now), top); g.lineTo(x(now), costBottom); g.stroke();
  }
  return {time: u => start + (u - left) / (right - left) * (stop - start)};
}

function shortened(g, words, width) {
  if (g.measureText(words).width <= width) return words;
  let kept = words;
  while (kept.length > 1 && g.measureText(kept + '…').width > width) kept = kept.slice(0, -1);
  return kept + '…';
}

function line(g, entries, value, color, thickness, dash, x, top, bottom, most) {
  g.strokeStyle = color;
  g.lineWidth = thickness;
  g.setLineDash(dash);
  g.beginPath();
  let drawing = false;
  for (const entry of entries) {
    const v = value(entry);
    if (v === undefined || v === null) { drawing = false; continue; }
    if (v === 0 && dash.length) { drawing = false; continue; }
    g[drawing ? 'lineTo' : 'moveTo'](x(entry.t), bottom - Math.min(v / most, 1) * (bottom - top));
    drawing = true;
  }
  g.stroke();
  g.setLineDash([]);
}
