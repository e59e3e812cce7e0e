// Copyright 2026 The rgbd_kcf_tracker authors
// SPDX-License-Identifier: Apache-2.0

// The page: what comes over the socket (or lies in the file) is shown, what is asked goes back.
'use strict';

const $ = id => document.getElementById(id);
const STATE_WORDS = {tracking: 'tracking', occluded: 'hidden', lost: 'lost', idle: 'no target'};
const MOST_ENTRIES = 6000;  // as the server keeps: a minute at 100 Hz
const stored = $('stored');
const page = {
  hello: null, shown: null, entries: [], trails: new Map(), points: null, bitmaps: {}, drag: null,
  socket: null, wait: 500, views: new Map(), names: new Map(), why: 0, settings: '', timeAxis: null, drawn: 0, word: 0, moment: 0, last: 0, waiting: false,
};
const room = new Room($('room'), $('labels'), stored ? null : (x, y) => send({do: 'point', x, y, frame: currentFrame()}));

// --- what comes -----------------------------------------------------------------------------------

function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const shown = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const blob = name => {
    const place = shown.blobs[name];
    return place ? new Uint8Array(buffer, 4 + length + place[0], place[1]) : null;
  };
  return [shown, blob];
}

async function bitmapOf(bytes) {
  return bytes ? createImageBitmap(new Blob([bytes], {type: 'image/jpeg'})) : null;
}

function pointsOf(bytes) {
  if (!bytes) return null;
  const count = bytes.length / 9;
  return {
    count,
    places: new Int16Array(bytes.buffer, bytes.byteOffset, 3 * count),
    tints: new Uint8Array(bytes.buffer, bytes.byteOffset + 6 * count, 3 * count),
  };
}

async function show(buffer) {
  const [shown, blob] = unpack(buffer);
  const [color, depth] = await Promise.all([bitmapOf(blob('color')), bitmapOf(blob('depth'))]);
  for (const old of Object.values(page.bitmaps)) if (old) old.close();
  page.bitmaps = {color, depth};
  page.points = pointsOf(blob('points'));
  if (shown.anew) page.entries = [];
  page.entries.push(...shown.entries);
  const last = page.entries.length ? page.entries[page.entries.length - 1].t : 0;
  page.entries = page.entries.filter(e => e.t >= last - 60).slice(-MOST_ENTRIES);
  page.shown = shown;
  page.last = performance.now();
  if (page.waiting) { page.waiting = false; $('banner').hidden = true; }
  showViews(shown, blob);
  redraw();
  page.drawn += 1;
}

function redraw() {
  const shown = page.shown;
  if (!shown) return;
  page.trails = trailsOf(page.entries, shown.time);
  drawPicture($('picture'), page.bitmaps.color, shown, page.trails, page.drag);
  drawDepth($('depth'), page.bitmaps.depth, shown);
  $('truth').hidden = !shown.truth;
  $('far').textContent = shown.far ? `dark 0 m, bright ${shown.far} m` : '';
  drawAbove($('above'), shown, page.points, page.trails);
  for (const target of shown.targets) page.names.set(target.id, target.name);
  page.timeAxis = drawTime($('time'), page.entries, shown.time, {
    names: page.names, chosen: new Set(shown.targets.filter(t => t.chosen).map(t => t.id)),
    stages: page.hello ? page.hello.stages : [],
  });
  room.show(shown, page.points, page.trails);
  showWords(shown);
  showTargets(shown);
  showWhy(shown);
  showSettings(shown);
}

/** Where each was in the last seconds, by id. */
function trailsOf(entries, now) {
  const trails = new Map();
  for (const entry of entries) {
    if (entry.t <= now - TRAIL_S || entry.t > now + 1e-3) continue;
    for (const [id, , , , , , place] of entry.targets) {
      if (!place) continue;
      if (!trails.has(id)) trails.set(id, []);
      trails.get(id).push(place);
    }
  }
  return trails;
}

function showWords(shown) {
  const chosen = shown.targets.filter(t => t.chosen), others = shown.targets.length - chosen.length;
  const states = chosen.map(t => t.state);
  const worst = ['lost', 'occluded', 'tracking'].find(s => states.includes(s)) || 'idle';
  $('state').dataset.state = worst;
  const some = chosen.length > 1 ? `${states.filter(s => s === worst).length} of ${states.length} ` : '';
  $('state').textContent = some + STATE_WORDS[worst] + (others ? `, ${others} ${others === 1 ? 'other' : 'others'}` : '');
  if (page.waiting || shown.silent) {
    $('state').dataset.state = 'idle';
    $('state').textContent = page.waiting ? 'no pictures' : 'tracker silent';
  }
  const recent = page.entries.slice(-30);
  const mean = name => recent.reduce((sum, e) => sum + (e[name] || 0), 0) / Math.max(1, recent.length);
  const facts = [];
  if (recent.length > 1) {
    const span = recent[recent.length - 1].t - recent[0].t;
    if (span > 0) facts.push(`${((recent.length - 1) / span).toFixed(1)} frames/s`);
  }
  if (mean('track')) facts.push(`tracking ${mean('track').toFixed(1)} ms`);
  showMoment(shown);
  if (shown.latency) facts.push(`latency ${shown.latency} ms`);
  if (shown.dropped !== undefined) facts.push(`${shown.dropped} pairs dropped`);
  if (shown.guessed && shown.blobs.points) facts.push('camera unknown: metres are guessed');
  $('numbers').textContent = facts.join(' · ');
  if (shown.word) say(shown.word, 8000);
  else if (shown.busy) say(shown.busy, 1500);
  if (page.hello && !page.hello.live) {
    $('seek').max = page.hello.frames - 1;
    // In a file the slider counts its moments, of which there may be fewer than frames.
    const place = stored ? page.moment : shown.frame;
    if (document.activeElement !== $('seek') || shown.playing) $('seek').value = place;
    $('frame').textContent = stored ? `frame ${shown.frame}` : `${shown.frame} / ${page.hello.frames - 1}`;
    $('play').textContent = shown.playing ? 'Pause' : 'Play';
    if (document.activeElement !== $('speed')) $('speed').value = String(shown.speed);
  }
}

/** In words, what the last minute says of the moment shown. */
function showMoment(shown) {
  const entry = page.entries.find(e => e.frame === shown.frame && Math.abs(e.t - shown.time) < 0.001);
  const words = [`${shown.time.toFixed(1)} s`];
  for (const [id, state, score, confused, who] of entry ? entry.targets.filter(t => shown.targets.some(s => s.id === t[0] && s.chosen)).slice(0, 2) : []) {
    const percent = v => `${Math.round(100 * v)} %`;
    words.push(`${page.names.get(id)} ${state === 'tracking' && score !== null ? percent(score) : STATE_WORDS[state]}`);
    if (confused >= 0.01) words.push(`confused with ${who === null ? 'another candidate' : page.names.get(who) || `person ${who}`} ${percent(confused)}`);
  }
  $('moment').textContent = words.join(' · ');
}

function showLegend(stages) {
  const key = (kind, style, words) => {
    const item = make('span'), mark = make('i', kind);
    Object.assign(mark.style, style);
    item.append(mark, words);
    return item;
  };
  $('legend').replaceChildren(
    make('span', '', 'bars: tall tracking, half hidden, low lost'),
    key('line', {}, 'score'), key('line', {borderTopStyle: 'dashed', color: 'var(--lost)'}, 'confused with another'),
    key('line', {borderTopStyle: 'dotted', color: 'var(--quiet)'}, 'response of the filter'),
    ...stages.map((stage, i) => key('', {background: STAGE_TINTS[i]}, `${stage} (ms)`)),
    ...(page.hello.live ? [make('span', '', '▲ pairs dropped')] : []));
}

function say(words, milliseconds) {
  $('banner').textContent = words;
  $('banner').hidden = false;
  clearTimeout(page.word);
  if (milliseconds) page.word = setTimeout(() => { $('banner').hidden = true; }, milliseconds);
}

function make(tag, className, words) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (words !== undefined) element.textContent = words;
  return element;
}

function showTargets(shown) {
  const chosen = shown.targets.filter(t => t.chosen);
  $('no-targets').hidden = chosen.length > 0;
  $('no-targets').textContent = page.waiting ? 'The pictures have stopped.' : shown.silent ? 'The tracker is silent.' : 'Nobody is followed yet.';
  showPeople($('targets'), chosen);
  showPeople($('others'), shown.targets.filter(t => !t.chosen));
  const variant = page.hello && page.hello.variants.find(v => v.name === shown.variant);
  $('everyone-row').hidden = shown.everyone === undefined || !variant;
  $('everyone').disabled = !variant || !variant.everyone;
  $('everyone-row').title = $('everyone').disabled ? 'only metric can' : '';
  $('everyone').checked = Boolean(shown.everyone);
}

function showPeople(list, people) {
  const known = new Map([...list.children].map(li => [Number(li.dataset.id), li]));
  for (const target of people) {
    let item = known.get(target.id);
    known.delete(target.id);
    if (!item) {
      item = make('li');
      item.dataset.id = target.id;
      const name = make('input');
      name.maxLength = 40;
      name.setAttribute('aria-label', 'name');
      name.readOnly = Boolean(stored) || !page.hello.several;
      name.addEventListener('change', () => send({do: 'rename', id: target.id, name: name.value}));
      const button = make('button', 'only-online', target.chosen ? 'Remove' : 'Follow');
      button.type = 'button';
      button.addEventListener('click', () => send(target.chosen ? {do: 'remove', id: target.id} : {do: 'follow', id: target.id, frame: currentFrame()}));
      item.append(make('span', 'dot'), name, button, make('span', 'facts'), make('div', 'views'));
      list.append(item);
    }
    const [dot, name, button, facts] = item.children;
    button.disabled = !target.chosen && !target.box;
    dot.dataset.state = target.state;
    dot.style.outline = `3px solid ${colorOf(target.id)}`;
    if (document.activeElement !== name) name.value = target.name;
    const words = [STATE_WORDS[target.state]];
    if (target.box && target.score !== null) words.push(`score ${target.score.toFixed(2)}`);
    if (target.depth !== null) words.push(`${target.depth.toFixed(2)} m`);
    if (target.speed !== undefined) words.push(`${target.speed.toFixed(1)}\u00a0m/s`);
    facts.textContent = words.join(' · ');
    const views = item.children[4];
    const urls = page.views.get(target.id) || [];
    const colors = target.colors || urls.map(() => []);
    if (views.dataset.shows !== urls.join() + colors.join()) {
      views.dataset.shows = urls.join() + colors.join();
      views.replaceChildren(...colors.map((slices, i) => {
        const view = make('span'), strip = make('b');
        view.title = slices.length ? 'a view that the tracker keeps, and the mean colours that it compares, from head to feet' : 'the first sight';
        strip.append(...slices.map(color => { const cell = make('i'); cell.style.background = color; return cell; }));
        if (urls[i]) { const image = make('img'); image.src = urls[i]; image.alt = `a view of ${target.name}`; view.append(image); }
        if (slices.length) view.append(strip);
        if (slices.length && !urls[i]) view.title += '; no picture of it came to this page';
        return view;
      }));
    }
  }
  for (const gone of known.values()) gone.remove();
}

function showViews(shown, blob) {
  const found = new Map();
  for (const name of Object.keys(shown.blobs)) {
    const match = /^view_(\d+)_(\d+)$/.exec(name);
    if (!match) continue;
    const id = Number(match[1]);
    if (!found.has(id)) found.set(id, []);
    found.get(id)[Number(match[2])] = name;
  }
  for (const [id, names] of found) {
    // Of two pictures of the same length one byte or another differs: the sum tells.
    const digest = names.map(name => blob(name).reduce((sum, byte) => (sum * 31 + byte) % 1000003, 7)).join();
    const before = page.views.get(id);
    if (before && before.digest === digest) continue;
    for (const url of before || []) if (url) URL.revokeObjectURL(url);
    const urls = names.map(name => URL.createObjectURL(new Blob([blob(name)], {type: 'image/jpeg'})));
    urls.digest = digest;
    page.views.set(id, urls);
  }
}

function showWhy(shown) {
  const weighed = shown.targets.filter(t => t.considered && t.considered.length);
  const target = weighed.find(t => t.id === page.why) || weighed[0];
  $('no-why').hidden = Boolean(target);
  $('no-why').textContent = shown.variant === 'metric' ? 'No candidates were weighed in this frame.'
    : `${shown.variant} weighs no candidates: its filter's response is in the last minute.`;
  $('why-of').hidden = !target;
  if (target && document.activeElement !== $('why-of')) {
    $('why-of').replaceChildren(...weighed.map(t => { const option = make('option', '', t.name); option.value = t.id; return option; }));
    $('why-of').value = target.id;
  }
  const cards = (target ? target.considered : []).map(candidate => {
    const card = make('div', 'candidate'), head = make('p');
    const odds = Object.values(candidate.cues).reduce((sum, v) => sum + v, 0);
    const taken = target.box && distance(candidate.box, target.box) < 1;
    const other = taken ? null : shown.targets.find(t => t !== target && t.box && overlap(t.box, candidate.box) > 0.5);
    head.append(make('b', '', `${Math.round(100 * candidate.probability)} %`), make('span', 'quiet',
      `  ${taken ? 'taken' : 'not taken'}${other ? ` (${other.name})` : ''}, log-odds ${odds >= 0 ? '+' : '−'}${Math.abs(odds).toFixed(1)}, at\u00a0${candidate.box.map(v => Math.round(v)).join(',\u00a0')}`));
    card.append(head);
    for (const [name, value] of Object.entries(candidate.cues)) {
      if (Math.abs(value) < 0.05) continue;
      const row = make('div', 'cue');
      const bar = make('div', 'bar'), fill = make('i', value < 0 ? 'against' : '');
      const share = Math.min(50, Math.abs(value) * 6);
      fill.style.width = `${share}%`;
      fill.style.left = value < 0 ? `${50 - share}%` : '50%';
      bar.append(fill);
      row.append(make('span', '', name), bar, make('span', '', `${value >= 0 ? '+' : '−'}${Math.abs(value).toFixed(1)}`));
      card.append(row);
    }
    return card;
  });
  $('why').replaceChildren(...cards);
}

function showSettings(shown) {
  const variant = page.hello && page.hello.variants.find(v => v.name === shown.variant);
  if (!variant) return;
  if (document.activeElement !== $('variant')) $('variant').value = variant.name;
  $('summary').textContent = variant.summary;
  if (page.settings !== variant.name) {
    page.settings = variant.name;
    $('parameters').replaceChildren(...variant.parameters.map(parameterRow));
  }
  for (const row of $('parameters').children) {
    const value = (shown.values || {})[row.dataset.name];
    const input = row.querySelector('input, select');
    if (value === undefined || document.activeElement === input) continue;
    if (input.type === 'checkbox') input.checked = value; else input.value = value;
    row.classList.toggle('changed', String(value) !== row.dataset.initial);
  }
}

function parameterRow(info) {
  const row = make('div', 'parameter');
  row.dataset.name = info.name;
  row.dataset.initial = String(info.default);
  const name = make('label', '', info.name + (info.unit ? ` (${info.unit})` : ''));
  let input = make(info.choices.length ? 'select' : 'input');
  input.id = `parameter-${info.name}`;
  name.htmlFor = input.id;
  if (info.choices.length) input.append(...info.choices.map(choice => make('option', '', choice)));
  else if (info.type === 'bool') input.type = 'checkbox';
  else if (info.type === 'str') input.type = 'text';
  else {
    input.type = 'number';
    input.step = info.type === 'int' ? 1 : 'any';
    if (info.minimum !== null) input.min = info.minimum;
    if (info.maximum !== null) input.max = info.maximum;
  }
  input.disabled = Boolean(stored) || info.file;  // a file is named where the page is started
  input.addEventListener('change', () => {
    if (input.type === 'number' && !input.reportValidity()) return;
    const value = input.type === 'checkbox' ? input.checked : input.type === 'number' ? Number(input.value) : input.value;
    send({do: 'parameter', name: info.name, value});
  });
  const range = info.minimum !== null && info.maximum !== null ? ` ${info.minimum} to ${info.maximum}.` : '';
  row.append(name, input, make('p', 'hint', info.description + range));
  return row;
}

function greet(hello) {
  page.hello = hello;
  document.title = `${hello.title} · rgbd_kcf_tracker`;
  $('title').textContent = hello.title;
  $('kind').textContent = stored ? 'a recorded run' : hello.live ? 'live' : 'recording';
  $('transport').hidden = hello.live;
  $('variant').replaceChildren(...hello.variants.map(v => make('option', '', v.name)));
  $('variant').value = '';
  page.last = performance.now();
  $('variant').disabled = Boolean(stored);
  showLegend(hello.stages);
  page.settings = '';
}

// --- what is asked --------------------------------------------------------------------------------

function send(message) {
  if (page.socket && page.socket.readyState === WebSocket.OPEN) page.socket.send(JSON.stringify(message));
}

function currentFrame() {
  return page.shown && page.shown.frame !== undefined ? page.shown.frame : 0;
}

function placeIn(event) {
  const box = $('picture').getBoundingClientRect();
  return [(event.clientX - box.left) * page.shown.size[0] / box.width, (event.clientY - box.top) * page.shown.size[1] / box.height];
}

function listenForPicking() {
  const picture = $('picture');
  let from = null, start = null;
  picture.addEventListener('pointerdown', event => {
    const touch = event.pointerType === 'touch';
    if (!page.shown || event.button !== 0 || (touch && !picture.classList.contains('picking'))) return;
    from = placeIn(event);
    start = [event.clientX, event.clientY];
    page.frameAtStart = currentFrame();
    if (page.shown.playing && !page.hello.live) send({do: 'pause'});
    picture.setPointerCapture(event.pointerId);
  });
  picture.addEventListener('pointermove', event => {
    if (!from) return;
    const [x, y] = placeIn(event);
    page.drag = [Math.min(x, from[0]), Math.min(y, from[1]), Math.abs(x - from[0]), Math.abs(y - from[1])];
    drawPicture(picture, page.bitmaps.color, page.shown, page.trails, page.drag);
  });
  picture.addEventListener('pointerup', event => {
    if (!from) return;
    const moved = Math.hypot(event.clientX - start[0], event.clientY - start[1]);
    const [x, y, width, height] = page.drag || [0, 0, 0, 0];
    const frame = page.frameAtStart;
    if (moved < 5) send({do: 'point', x: from[0], y: from[1], frame});
    else if (width >= 2 && height >= 2) send({do: 'box', x, y, width, height, frame});
    from = page.drag = null;
    setPicking(false);
    redraw();
  });
  picture.addEventListener('pointercancel', () => { from = page.drag = null; redraw(); });
  $('pick').addEventListener('click', () => setPicking(!picture.classList.contains('picking')));
}

function setPicking(on) {
  $('picture').classList.toggle('picking', on);
  $('pick').setAttribute('aria-pressed', on);
}

function listenForPlaying(act) {
  $('play').addEventListener('click', () => act({do: page.shown && page.shown.playing ? 'pause' : 'play'}));
  $('back').addEventListener('click', () => act({do: 'step', by: -1}));
  $('forward').addEventListener('click', () => act({do: 'step', by: 1}));
  $('seek').addEventListener('input', () => { $('frame').textContent = $('seek').value; });
  $('seek').addEventListener('change', () => { act({do: 'seek', frame: Number($('seek').value)}); $('seek').blur(); });
  $('speed').addEventListener('change', () => { act({do: 'speed', value: Number($('speed').value)}); $('speed').blur(); });
  $('time').addEventListener('click', event => {
    if (!page.timeAxis || !page.entries.length || page.hello.live) return;
    const t = page.timeAxis.time(event.clientX - $('time').getBoundingClientRect().left);
    const nearest = page.entries.reduce((a, b) => Math.abs(b.t - t) < Math.abs(a.t - t) ? b : a);
    act({do: 'seek', frame: nearest.frame});
  });
  document.addEventListener('keydown', event => {
    if (/^(INPUT|SELECT|BUTTON|TEXTAREA|A|SUMMARY)$/.test(event.target.tagName) || page.hello.live) return;
    const message = {' ': {do: page.shown && page.shown.playing ? 'pause' : 'play'}, ArrowLeft: {do: 'step', by: -1}, ArrowRight: {do: 'step', by: 1}}[event.key];
    if (message) { event.preventDefault(); act(message); }
  });
}

// --- over the socket ------------------------------------------------------------------------------

function connect() {
  const socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/socket`);
  socket.binaryType = 'arraybuffer';
  page.socket = socket;
  socket.addEventListener('message', async event => {
    if (typeof event.data === 'string') {
      const message = JSON.parse(event.data);
      if (message.hello) { page.wait = 500; $('banner').hidden = true; page.entries = []; greet(message.hello); }
      if (message.refused) say(message.refused, 8000);
      return;
    }
    try {
      await show(event.data);
    } finally {
      // Only now may the next one come: nothing queues. A page that is not seen draws nothing.
      requestAnimationFrame(() => send({do: 'ack'}));
      if (document.hidden) send({do: 'ack'});
    }
  });
  socket.addEventListener('close', async event => {
    say(event.reason === 'too slow' ? 'This browser was too slow; connecting again …' : 'Connection lost; trying again …');
    setTimeout(async () => {
      try {
        const answer = await fetch('/', {method: 'GET', cache: 'no-store'});
        if (answer.status === 401) { location.reload(); return; }
      } catch { /* nobody answers yet */ }
      connect();
    }, page.wait);
    page.wait = Math.min(5000, page.wait * 1.6);
  });
}

/** Say so where a live page gets no pictures: what it shows is old, or nothing. */
function watchForPictures() {
  setInterval(() => {
    const open = page.socket && page.socket.readyState === WebSocket.OPEN;
    if (!page.hello || !page.hello.live || !open || document.hidden) return;
    const seconds = (performance.now() - page.last) / 1000;
    if (seconds < 3 + 2 * page.hello.period) return;
    const before = page.waiting;
    page.waiting = true;
    if (!before && page.shown) {
      page.shown.targets = [];
      redraw();
    }
    say(`No picture for ${Math.round(seconds)} s: is the camera running, and the viewer's color/image remapped to it?`);
  }, 1000);
}

// --- out of a file --------------------------------------------------------------------------------

function replay() {
  const {hello, moments} = JSON.parse(stored.textContent);
  const unpacked = moments.map(text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer);
  const heads = unpacked.map(buffer => unpack(buffer)[0]);
  const run = {index: 0, playing: false, speed: 1, timer: 0};
  document.body.classList.add('export');
  greet({...hello, frames: unpacked.length, live: false});
  const put = async index => {
    run.index = page.moment = Math.max(0, Math.min(index, unpacked.length - 1));
    const past = heads.slice(0, run.index).flatMap(h => h.entries);
    page.entries = [...past];
    await show(unpacked[run.index]);
    page.entries = [...past, ...heads[run.index].entries].filter(e => e.t >= heads[run.index].time - 60);
    Object.assign(page.shown, {playing: run.playing, speed: run.speed});
    redraw();
  };
  const next = async () => {
    if (!run.playing) return;
    if (run.index >= unpacked.length - 1) { run.playing = false; await put(run.index); return; }
    const gap = heads[run.index + 1].time - heads[run.index].time;
    const begun = performance.now();
    await put(run.index + 1);
    run.timer = setTimeout(next, Math.max(0, gap * 1000 / run.speed - (performance.now() - begun)));
  };
  const frames = heads.map(h => h.frame);
  listenForPlaying(async message => {
    clearTimeout(run.timer);
    if (message.do === 'play') {
      run.playing = true;
      if (run.index >= unpacked.length - 1) run.index = -1;
      await next();
      return;
    }
    if (message.do === 'pause') run.playing = false;
    if (message.do === 'step') { run.playing = false; run.index += message.by; }
    if (message.do === 'seek') {
      // The slider counts moments, the time line names frames.
      const named = frames.indexOf(message.frame);
      run.index = document.activeElement === $('seek') || named < 0 ? message.frame : named;
    }
    if (message.do === 'speed') run.speed = message.value;
    await put(run.index);
    if (run.playing) next();
  });
  put(0);
}

$('home').addEventListener('click', () => room.home());
$('why-of').addEventListener('change', () => { page.why = Number($('why-of').value); $('why-of').blur(); redraw(); });
window.addEventListener('resize', redraw);
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redraw);
if (stored) {
  replay();
} else {
  listenForPicking();
  listenForPlaying(send);
  $('variant').addEventListener('change', () => { send({do: 'variant', name: $('variant').value}); $('variant').blur(); });
  $('defaults').addEventListener('click', () => send({do: 'defaults'}));
  $('everyone').addEventListener('change', () => send({do: 'everyone', value: $('everyone').checked}));
  connect();
  watchForPictures();
}
