(() => {
'use strict';
document.documentElement.classList.add('js');
const SVG = 'http://www.w3.org/2000/svg';
const forward = (scale, v) => scale === 'log' ? Math.log10(v) : v;
const backward = (scale, c) => scale === 'log' ? 10 ** c : c;
const clamp = (v, low, high) => Math.min(high, Math.max(low, v));
const raised = n => String(n).replace(/./g, c => c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]);
const minus = text => text.replace('-', '−');
const element = (name, attributes, parent) => {
  const made = document.createElementNS(SVG, name);
  for (const key in attributes) made.setAttribute(key, attributes[key]);
  if (parent) parent.append(made);
  return made;
};

// Ticks: the same rules as in plot/ticks.rs.
const steps = (low, high, step) => {
  const values = [];
  for (let k = Math.ceil(low / step - 1e-9); k <= high / step + 1e-9 && values.length < 100; k++) values.push(k * step);
  return values;
};
const labelled = (values, low, high) => {
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const exponent = Math.floor(Math.log10(largest)), power = exponent >= -3 && exponent < 5 ? 0 : exponent;
  const scale = 10 ** power, fine = (values.length > 1 ? values[1] - values[0] : largest) / scale;
  let decimals = 0;
  while (decimals < 10 && Math.abs(fine * 10 ** decimals - Math.round(fine * 10 ** decimals)) > 1e-6 * fine * 10 ** decimals) decimals++;
  return values.map(v => [v, Math.abs(v) < 1e-9 * largest ? '0' : minus((v / scale).toFixed(decimals)) + (power ? '×10' + raised(power) : '')]);
};
const linearTicks = (low, high, target) => {
  const wanted = (high - low) / Math.max(target, 1), power = 10 ** Math.floor(Math.log10(wanted));
  const factor = [1, 2, 2.5, 5, 10].find(f => f * power >= wanted * 0.75) || 10;
  return labelled(steps(low, high, factor * power), low, high);
};
const logTicks = (low, high, target) => {
  const first = Math.floor(Math.log10(low)), last = Math.floor(Math.log10(high));
  const within = (mantissas, stride) => {
    const found = [];
    for (let d = first; d <= last; d++) if (((d % stride) + stride) % stride === 0)
      for (const m of mantissas) if (m * 10 ** d >= low * (1 - 1e-9) && m * 10 ** d <= high * (1 + 1e-9)) found.push([m, d]);
    return found;
  };
  const name = found => {
    const plain = found.every(([, d]) => d >= -2 && d < 4);
    return found.map(([m, d]) => [m * 10 ** d, plain ? (m * 10 ** d).toFixed(Math.max(-d, 0)) : (m === 1 ? '' : m + '×') + '10' + raised(d)]);
  };
  const most = Math.max(Math.ceil(target * 8 / 5), 3);
  const decades = within([1], 1).length;
  for (const mantissas of decades >= 3 && 3 * decades >= 2 * target ? [[1]] : [[1, 2, 5], [1, 3], [1]]) {
    const found = within(mantissas, 1);
    if (found.length >= 3 && found.length <= most) return name(found);
  }
  if (decades < 2) return linearTicks(low, high, target);
  let stride = 2;
  while (within([1], stride).length > most) stride++;
  return name(within([1], stride));
};
const ticks = (scale, low, high, target) => {
  if (!(low < high)) return [];
  if (scale === 'log') return logTicks(low, high, target);
  const wanted = (high - low) / Math.max(target, 1);
  const step = scale === 'degrees' && wanted > 5 && [15, 30, 45, 90, 180].find(s => s >= wanted * 0.7);
  return step ? labelled(steps(low, high, step), low, high) : linearTicks(low, high, target);
};
const sidewaysTicks = (scale, low, high, width) => {
  for (let target = Math.round(width / 70); ; target--) {
    const found = ticks(scale, low, high, target), longest = Math.max(0, ...found.map(([, label]) => [...label].length));
    if (target <= 2 || scale === 'log' || 6.2 * longest + 12 <= width / Math.max(found.length, 1)) return found;
  }
};
const number = (v, scale, range) => {
  if (v === 0) return '0';
  const exponent = Math.floor(Math.log10(Math.abs(v)));
  if (scale !== 'log') {
    const decimals = clamp(2 - Math.floor(Math.log10(range)), 0, 12);
    if (decimals < 6 && exponent < 5) return minus(v.toFixed(decimals));
  }
  if (exponent >= -3 && exponent < 5) return minus(v.toPrecision(3).includes('e') ? v.toFixed(0) : v.toPrecision(exponent >= 3 ? exponent + 1 : 3));
  return minus((v / 10 ** exponent).toFixed(2)) + '×10' + raised(exponent);
};

class Panel {
  constructor(svg, figure) {
    this.svg = svg; this.figure = figure;
    const meta = this.meta = JSON.parse(svg.dataset.panel);
    this.data = svg.querySelector('.data'); this.view = svg.querySelector('.view'); this.frame = svg.querySelector('.frame');
    this.xLabel = svg.querySelector('.x-label');
    const pair = (axis, low, high) => [forward(axis[0], low), forward(axis[0], high)];
    this.home = { x: pair(meta.x, meta.x[1], meta.x[2]), y: pair(meta.y, meta.y[1], meta.y[2]) };
    this.drawn = { x: pair(meta.x, meta.shown[0], meta.shown[1]), y: pair(meta.y, meta.shown[2], meta.shown[3]) };
    this.now = { x: this.home.x, y: this.home.y };
    this.paths = [...svg.querySelectorAll('.view [data-s]')];
    this.overlay = element('g', { 'aria-hidden': 'true' }, svg);
    this.at = null;
    this.free = meta.free; // places in a plane: read by distance, zoomed alone
  }
  get zoomed() { return this.now.x !== this.home.x || this.now.y !== this.home.y; }
  layout() {
    const { svg, meta } = this, width = svg.clientWidth;
    if (!width) return;
    const [left, top, right, bottom] = meta.margin, w = this.w = Math.max(width - left - right, 40);
    const h = this.h = meta.equal ? Math.min(w * meta.plot[1] / meta.plot[0], 420) : meta.plot[1];
    let { x, y } = this.now;
    if (meta.equal) {
      const unit = Math.max((x[1] - x[0]) / w, (y[1] - y[0]) / h);
      const around = (r, n) => [(r[0] + r[1] - n * unit) / 2, (r[0] + r[1] + n * unit) / 2];
      x = around(x, w); y = around(y, h);
    }
    this.shown = { x, y };
    const height = top + h + bottom;
    svg.setAttribute('viewBox', `0 0 ${width} ${height}`);
    svg.style.height = height + 'px';
    this.data.setAttribute('width', w); this.data.setAttribute('height', h);
    const d = this.drawn, kx = (d.x[1] - d.x[0]) / meta.plot[0] * w / (x[1] - x[0]), ox = (d.x[0] - x[0]) / (x[1] - x[0]) * w;
    const ky = (d.y[1] - d.y[0]) / meta.plot[1] * h / (y[1] - y[0]), oy = (y[1] - d.y[1]) / (y[1] - y[0]) * h;
    this.map = { kx, ox, ky, oy };
    this.view.setAttribute('transform', `matrix(${kx} 0 0 ${ky} ${ox} ${oy})`);
    for (const pin of svg.querySelectorAll('.pin')) {
      const kind = pin.dataset.kind, px = kind === 'rule' ? w : pin.dataset.x * kx + ox, py = pin.dataset.y * ky + oy;
      pin.setAttribute('x', px); pin.setAttribute('y', py);
      pin.style.display = px < -1 || px > w + 1 || py < -1 || py > h + 1 ? 'none' : '';
    }
    this.drawFrame(left, top, w, h);
    if (this.xLabel) { this.xLabel.setAttribute('x', left + w); this.xLabel.setAttribute('y', top + h + 31); }
    this.drawCursor();
  }
  drawFrame(left, top, w, h) {
    const { meta, frame } = this, { x, y } = this.shown;
    frame.replaceChildren();
    const text = (content, attributes) => { element('text', { class: 'tick', ...attributes }, frame).textContent = content; };
    const most = Math.max(1, Math.floor((left - 12) / 6.2)), short = name => [...name].length > most ? [...name].slice(0, most - 1).join('') + '…' : name;
    const rows = meta.names.map((name, k) => [meta.names.length - k - 0.5, short(name)]).filter(([at]) => at >= y[0] && at <= y[1]);
    for (const [v, label] of meta.names.length ? rows : ticks(meta.y[0], backward(meta.y[0], y[0]), backward(meta.y[0], y[1]), Math.round(h / 38))) {
      const at = top + (y[1] - forward(meta.y[0], v)) / (y[1] - y[0]) * h;
      element('path', { class: 'grid', d: `M${left} ${at}H${left + w}` }, frame);
      text(label, { x: left - 6, y: at + 4, 'text-anchor': 'end' });
    }
    for (const [v, label] of sidewaysTicks(meta.x[0], backward(meta.x[0], x[0]), backward(meta.x[0], x[1]), w)) {
      const at = left + (forward(meta.x[0], v) - x[0]) / (x[1] - x[0]) * w;
      element('path', { class: 'grid', d: `M${at} ${top}V${top + h}` }, frame);
      if (meta.labelled) text(label, { x: at, y: top + h + 15, 'text-anchor': 'middle' });
    }
    element('path', { class: 'base', d: `M${left} ${top + h}H${left + w}` }, frame);
  }
  // Points of a series in the coordinates in which it was drawn: [x, y] or, for bands, [x, high, low].
  points(path) {
    if (path.points) return path.points;
    const points = path.points = [];
    for (const run of path.getAttribute('d').replaceAll('h0', '').split('M').slice(1)) {
      const n = (run.match(/-?[\d.]+/g) || []).map(Number);
      if (run.endsWith('Z')) for (let k = 0, m = n.length; k < m / 2; k += 2) points.push([n[k], n[k + 1], n[m - 1 - k]]);
      else for (let k = 0; k + 1 < n.length; k += 2) points.push([n[k], n[k + 1]]);
    }
    return points;
  }
  valueX(px) { const { meta, drawn } = this; return backward(meta.x[0], drawn.x[0] + px / meta.plot[0] * (drawn.x[1] - drawn.x[0])); }
  valueY(py) {
    const { meta, drawn } = this;
    return backward(meta.y[0], drawn.y[1] - py / meta.plot[1] * (drawn.y[1] - drawn.y[0]));
  }
  // What lies nearest to a place (in drawn coordinates): one entry a label.
  read(px, py) {
    const entries = new Map(), { meta } = this, reach = this.free ? Infinity : 0.04 * (this.w / this.map.kx) + 1;
    for (const path of this.paths) {
      if (path.style.display === 'none') continue;
      const [label, kind, color] = meta.series[path.dataset.s];
      if (kind === 'area') { // a part of a bar: the one under the pointer, by its length
        for (const run of meta.names.length ? path.getAttribute('d').split('M').slice(1) : []) {
          const n = run.match(/-?[\d.]+/g).map(Number), xs = n.filter((_, k) => k % 2 === 0), ys = n.filter((_, k) => k % 2);
          const part = [Math.min(...xs), Math.max(...xs)], middle = (Math.min(...ys) + Math.max(...ys)) / 2;
          if (px >= part[0] && px <= part[1] && (meta.names.length === 1 || py >= Math.min(...ys) && py <= Math.max(...ys))) entries.set(label, { label, color, part, point: [px, middle], distance: 0 });
        }
        continue;
      }
      const points = this.points(path);
      let best = null, distance = points.length < 40 ? Infinity : reach; // few points: the nearest, however far
      for (const p of points) {
        const away = this.free ? Math.hypot((p[0] - px) * this.map.kx, (p[1] - py) * this.map.ky) : Math.abs(p[0] - px);
        if (away < distance) { distance = away; best = p; }
      }
      if (!best) continue;
      const entry = entries.get(label) || { label, color };
      if (kind === 'band') entry.band = best; else { entry.point = best; entry.distance = distance; }
      entries.set(label, entry);
    }
    return [...entries.values()];
  }
  words(entry) {
    const { meta } = this, size = Math.abs(backward(meta.y[0], this.home.y[1]) - backward(meta.y[0], this.home.y[0]));
    if (entry.part) return meta.x[4] ? number(this.valueX(entry.part[1]) - this.valueX(entry.part[0]), 'linear', 100) + ' ' + meta.x[4] : '';
    if (meta.names.length) return this.title(entry.point[0]);
    const y = py => number(this.valueY(py), meta.y[0], size);
    const value = entry.point ? y(entry.point[1]) : '';
    const unit = meta.y[4] === '°' ? '°' : '';
    return value + (value ? unit : '') + (entry.band ? ` [${y(entry.band[2])}, ${y(entry.band[1])}]` : '');
  }
  heading(px, shown) {
    const { meta } = this;
    if (!meta.names.length) return `${meta.x[3] ? meta.x[3] + ' ' : ''}${this.title(px)}`;
    return shown.length && shown[0].part && meta.names.length === 1 ? meta.x[3] : shown.length ? meta.names[clamp(Math.floor(meta.names.length - this.valueY(shown[0].point[1])), 0, meta.names.length - 1)] : '';
  }
  title(px) {
    const { meta } = this, size = Math.abs(backward(meta.x[0], this.home.x[1]) - backward(meta.x[0], this.home.x[0]));
    return number(this.valueX(px), meta.x[0], size) + (meta.x[4] ? ' ' + meta.x[4] : '');
  }
  drawCursor() {
    this.overlay.replaceChildren();
    if (!this.at || !this.map) return [];
    const { kx, ox, ky, oy } = this.map, [left, top] = this.meta.margin, entries = this.read(this.at.x, this.at.y);
    const x = this.at.x * kx + ox;
    if (x < -1 || x > this.w + 1) return [];
    if (!this.free) element('path', { class: 'cursor', d: `M${left + x} ${top}V${top + this.h}` }, this.overlay);
    const nearest = this.free ? entries.filter(e => e.point).sort((a, b) => a.distance - b.distance).slice(0, 1) : entries;
    for (const entry of nearest) if (entry.point && !entry.part) {
      const cy = entry.point[1] * ky + oy;
      if (cy >= -1 && cy <= this.h + 1) element('circle', { class: 'dot c-' + entry.color, cx: left + entry.point[0] * kx + ox, cy: top + cy, r: 3.5 }, this.overlay);
    }
    return nearest;
  }
}

const tip = document.createElement('div');
tip.className = 'tip'; tip.hidden = true; tip.setAttribute('aria-hidden', 'true');
document.body.append(tip);
const span = (parent, text) => { const s = document.createElement('span'); s.textContent = text; parent.append(s); };

class Figure {
  constructor(root) {
    this.root = root; this.live = root.querySelector('.live');
    this.panels = [...root.querySelectorAll('svg.panel')].map(svg => new Panel(svg, this));
    this.last = this.panels[0];
    for (const panel of this.panels) this.listen(panel);
    for (const button of root.querySelectorAll('.legend button')) button.addEventListener('click', () => this.toggle(button));
    for (const button of root.querySelectorAll('[data-zoom]')) button.addEventListener('click', () => this.zoom(button.dataset.zoom));
  }
  linked(panel) {
    if (panel.free) return [panel];
    return this.panels.filter(p => !p.free && p.meta.link === panel.meta.link && p.meta.x[0] === panel.meta.x[0]);
  }
  toggle(button) {
    const on = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', on);
    for (const panel of this.panels) for (const path of panel.paths)
      if (panel.meta.series[path.dataset.s][0] === button.dataset.label) path.style.display = on ? '' : 'none';
  }
  refresh(panels) {
    for (const panel of panels) panel.layout();
    const reset = this.root.querySelector('[data-zoom=reset]');
    if (reset) reset.disabled = !this.panels.some(p => p.zoomed);
  }
  setRange(panel, x, y) {
    const fit = (range, home) => {
      const [low, high] = [clamp(range[0], home[0], home[1]), clamp(range[1], home[0], home[1])];
      if (high - low >= 0.999 * (home[1] - home[0])) return home;
      return high - low > 1e-4 * (home[1] - home[0]) ? [low, high] : null;
    };
    const linked = this.linked(panel);
    for (const p of linked) p.now.x = (x && fit(x, p.home.x)) || p.now.x;
    if (y) panel.now.y = fit(y, panel.home.y) || panel.now.y;
    this.refresh(linked);
  }
  zoom(how, panel = this.last) {
    if (how === 'reset') {
      for (const p of this.panels) p.now = { x: p.home.x, y: p.home.y };
      return this.refresh(this.panels);
    }
    const factor = how === 'in' ? 0.5 : 2, around = (range, at) => range.map(v => at + (v - at) * factor);
    const { x, y } = panel.shown, { drawn, meta, at } = panel;
    const centre = (range, place) => place >= range[0] && place <= range[1] ? place : (range[0] + range[1]) / 2;
    const atX = at ? drawn.x[0] + at.x / meta.plot[0] * (drawn.x[1] - drawn.x[0]) : NaN;
    const atY = at ? drawn.y[1] - at.y / meta.plot[1] * (drawn.y[1] - drawn.y[0]) : NaN;
    if (meta.equal) return this.setRange(panel, around(x, centre(x, atX)), around(y, centre(y, atY)));
    this.setRange(panel, around(x, centre(x, atX)), how === 'out' && around(panel.now.y, centre(panel.now.y, NaN)));
  }
  place(panel, at, pointer) {
    this.last = panel;
    let shown = [];
    for (const p of this.linked(panel)) {
      p.at = p === panel ? at : { x: at.x / panel.meta.plot[0] * p.meta.plot[0], y: 0 };
      const entries = p.drawCursor();
      if (p === panel) shown = entries;
    }
    const x = panel.free && shown[0] ? shown[0].point[0] : at.x;
    const heading = panel.heading(x, shown);
    if (!pointer) this.live.textContent = [heading, ...shown.map(e => `${e.label}: ${panel.words(e)} ${panel.meta.y[4]}`)].join('; ');
    if (!shown.length) { tip.hidden = true; return; }
    tip.replaceChildren();
    const head = document.createElement('b');
    head.textContent = heading;
    tip.append(head);
    for (const entry of shown) {
      const row = document.createElement('div'), mark = document.createElement('i');
      mark.className = 'c-' + entry.color;
      row.append(mark);
      span(row, entry.label); span(row, panel.words(entry));
      tip.append(row);
    }
    tip.hidden = false;
    const box = panel.svg.getBoundingClientRect(), scale = box.width / (panel.w + panel.meta.margin[0] + panel.meta.margin[2]);
    const px = pointer ? pointer.clientX : box.left + (panel.meta.margin[0] + x * panel.map.kx + panel.map.ox) * scale;
    const py = pointer && pointer.pointerType !== 'touch' ? pointer.clientY : box.top + 14; // a finger hides what is below it
    const left = px + 16 + tip.offsetWidth > document.documentElement.clientWidth ? px - 16 - tip.offsetWidth : px + 16;
    tip.style.left = Math.max(4, left) + scrollX + 'px';
    tip.style.top = Math.max(4, py - tip.offsetHeight - 12) + scrollY + 'px';
  }
  leave(panel) {
    for (const p of this.linked(panel)) { p.at = null; p.drawCursor(); }
    tip.hidden = true;
  }
  listen(panel) {
    const { svg } = panel;
    let start = null, box = null;
    const where = event => {
      const r = svg.getBoundingClientRect(), [left, top] = panel.meta.margin;
      return { px: clamp(event.clientX - r.left - left, 0, panel.w), py: clamp(event.clientY - r.top - top, 0, panel.h) };
    };
    const drawn = ({ px, py }) => ({ x: (px - panel.map.ox) / panel.map.kx, y: (py - panel.map.oy) / panel.map.ky });
    const tall = (a, b) => panel.free || Math.abs(a.py - b.py) > 28;
    svg.addEventListener('pointerdown', event => {
      if (event.pointerType === 'touch') return this.place(panel, drawn(where(event)), event);
      if (event.button) return;
      start = where(event);
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener('pointermove', event => {
      const here = where(event);
      if (start) {
        const [left, top] = panel.meta.margin, high = tall(start, here);
        box = box || element('rect', { class: 'select' }, svg);
        const set = { x: left + Math.min(start.px, here.px), width: Math.abs(start.px - here.px), y: top + (high ? Math.min(start.py, here.py) : 0), height: high ? Math.abs(start.py - here.py) : panel.h };
        for (const key in set) box.setAttribute(key, set[key]);
      }
      this.place(panel, drawn(here), event);
    });
    const finish = event => {
      if (box) box.remove();
      box = null;
      const from = start;
      start = null;
      if (!from || event.type === 'pointercancel') return;
      const to = where(event);
      if (Math.abs(from.px - to.px) < 6) return;
      const { x, y } = panel.shown, { w, h } = panel;
      const xs = [from.px, to.px].sort((a, b) => a - b).map(p => x[0] + p / w * (x[1] - x[0]));
      const ys = tall(from, to) ? [from.py, to.py].sort((a, b) => b - a).map(p => y[1] - p / h * (y[1] - y[0])) : null;
      this.setRange(panel, xs, ys);
    };
    svg.addEventListener('pointerup', finish);
    svg.addEventListener('pointercancel', finish);
    // A finger leaves as soon as it lifts; what it touched stays to be read until it touches elsewhere.
    svg.addEventListener('pointerleave', event => { if (!start && event.pointerType !== 'touch') this.leave(panel); });
    document.addEventListener('pointerdown', event => { if (event.pointerType === 'touch' && panel.at && !this.root.contains(event.target)) this.leave(panel); });
    svg.addEventListener('dblclick', () => this.zoom('reset', panel));
    svg.addEventListener('blur', () => this.leave(panel));
    svg.addEventListener('keydown', event => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const key = event.key;
      if (key === '+' || key === '=') this.zoom('in', panel);
      else if (key === '-') this.zoom('out', panel);
      else if (key === '0') this.zoom('reset', panel);
      else if (key === 'Escape') this.leave(panel);
      else if (key === 'ArrowLeft' || key === 'ArrowRight') this.step(panel, (key === 'ArrowRight' ? 1 : -1) * (event.shiftKey ? 10 : 1));
      else return;
      event.preventDefault();
    });
  }
  step(panel, by) {
    const path = panel.paths.find(p => p.style.display !== 'none' && !p.classList.contains('band')) || panel.paths[0];
    if (!path || !panel.map) return;
    const { kx, ox } = panel.map;
    const points = panel.points(path).filter(p => p[0] * kx + ox >= -0.5 && p[0] * kx + ox <= panel.w + 0.5);
    if (!points.length) return;
    let k = 0;
    if (panel.at) {
      const away = p => panel.free ? Math.hypot(p[0] - panel.at.x, p[1] - panel.at.y) : Math.abs(p[0] - panel.at.x);
      for (let j = 1; j < points.length; j++) if (away(points[j]) < away(points[k])) k = j;
      k = clamp(k + by, 0, points.length - 1);
    } else if (by < 0) k = points.length - 1;
    this.place(panel, { x: points[k][0], y: points[k][1] });
  }
}

for (const root of document.querySelectorAll('figure')) {
  const figure = new Figure(root);
  figure.refresh(figure.panels);
  const observer = new ResizeObserver(() => figure.refresh(figure.panels));
  observer.observe(root);
}
if ('IntersectionObserver' in window) {
  const links = new Map([...document.querySelectorAll('nav a')].map(a => [a.getAttribute('href').slice(1), a]));
  const watch = new IntersectionObserver(seen => {
    for (const entry of seen) if (entry.isIntersecting) {
      for (const link of links.values()) link.classList.toggle('here', link === links.get(entry.target.id));
    }
  }, { rootMargin: '-10% 0px -75% 0px' });
  for (const section of document.querySelectorAll('main section')) watch.observe(section);
}
})();
