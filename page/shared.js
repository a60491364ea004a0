// What the page of a run and the live page share: words, colours, charts, small tables, and the drawing. Texts come from
// messages, which anyone may have written: they reach the document through textContent only.
'use strict';
const ForeReach = (() => {

// ---- Words and colours. Okabe and Ito's colours can be told apart with any kind of colour vision.
const OUTCOMES = {
  certified: {label: 'certified', color: '#0072B2'},
  abstain_safety: {label: 'abstain S', color: '#E69F00'},
  abstain_domain: {label: 'abstain D', color: '#56B4E9'},
  abstain_falsified: {label: 'abstain F', color: '#CC79A7'},
  abstain_deadline: {label: 'abstain, late', color: '#F0E442'},
  abstain_obstacles: {label: 'abstain, no obstacles', color: '#D55E00'},
  rejected: {label: 'rejected', color: '#8A8F98'},
};
const EXECUTED = '#009E73', WRONG = '#D55E00', INK = '#1b1f24', SOFT = '#5b6470';
const outcomeLabel = (name) => OUTCOMES[name]?.label ?? name;
const outcomeColor = (name) => OUTCOMES[name]?.color ?? '#000000';

const byId = (id) => document.getElementById(id);
const make = (tag, text, className) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (className) element.className = className;
  return element;
};
// A field of a message may be any number, and JSON has null for those that are not finite: these take all of them.
const number = (x, digits = 6) =>
  typeof x !== 'number' || Number.isNaN(x) ? '\u2013' : x === Infinity ? '\u221e' : x === -Infinity ? '\u2212\u221e' : String(Number(x.toPrecision(digits)));
const counted = (n) => (Number.isSafeInteger(n) ? String(n).replace(/\B(?=(\d{3})+$)/g, '\u202f') : number(n));
const percent = (part, whole) => (whole > 0 ? `${(100 * part / whole).toFixed(1)} %` : '\u2013');
const duration = (us) => {
  if (!Number.isFinite(us)) return number(us);
  return us < 1000 ? `${number(us, 4)} \u00b5s` : us < 1e6 ? `${number(us / 1e3, 4)} ms` : `${number(us / 1e6, 4)} s`;
};
// Microseconds since the epoch. Times before the year 0 or after 9999 stay numbers.
const dateOf = (us) => (typeof us === 'number' && -62167219200e6 <= us && us < 253402300800e6 ? new Date(us / 1000) : null);
const timeText = (us) => dateOf(us)?.toISOString().replace('T', ' ').replace('Z', '') ?? duration(us);
const clockText = (us) => dateOf(us)?.toISOString().slice(11, 23) ?? duration(us);

const listed = (counts) => [...counts].sort((a, b) => b[1] - a[1]).map(([name, n]) => `${name} ${counted(n)}`).join(', ');

// ---- Parts of a page. One that cannot be drawn is marked, and the page says so until it can be: nothing old passes for new.
const problems = new Map();
const tell = (name, problem) => {
  if (problem) problems.set(name, problem); else problems.delete(name);
  const text = [...problems.values()].join(' ');
  if (byId('problem').textContent !== text) byId('problem').textContent = text;
  byId('problem').hidden = !text;
};
const failedAt = new Map();
// @return whether `draw` has drawn the part of this name, which the elements `ids` show.
const drawPart = (name, ids, draw) => {
  try {
    draw();
    failedAt.delete(name);
    tell(name, '');
  } catch (error) {
    console.error(error);
    if (!failedAt.has(name)) failedAt.set(name, new Date().toISOString().slice(11, 19));
    tell(name, `Not shown anew since ${failedAt.get(name)} UTC: ${name} (${error.message}).`);
  }
  for (const id of ids) byId(id).classList.toggle('old', failedAt.has(name));
  return !failedAt.has(name);
};

// ---- Charts.
const charts = {};
const drawChart = (id, label, config) => {
  const canvas = byId(id);
  canvas.setAttribute('aria-label', label);
  if (!charts[id]) {
    charts[id] = new Chart(canvas, {...config, options: {animation: false, responsive: true, maintainAspectRatio: false, ...config.options}});
    return;
  }
  charts[id].data = config.data;
  charts[id].options = {animation: false, responsive: true, maintainAspectRatio: false, ...config.options};
  charts[id].update('none');
};
const axis = (title, more = {}) => ({title: {display: true, text: title, color: SOFT}, grid: {color: '#eef1f4'}, ticks: {color: SOFT}, ...more});
const legend = (display) => ({display, position: 'bottom', labels: {boxWidth: 12, boxHeight: 12, color: INK}});

// ---- Small tables. A cell is a text or an element.
const fillTable = (table, caption, heads, rows, numeric = []) => {
  const cell = (tag, content, k) => {
    const td = make(tag, undefined, numeric.includes(k) ? 'n' : '');
    td.append(content);
    return td;
  };
  const line = (tag, contents) => {
    const tr = make('tr');
    tr.append(...contents.map((content, k) => cell(tag, content, k)));
    return tr;
  };
  const head = make('thead'), body = make('tbody');
  head.append(line('th', heads));
  body.append(...rows.map((row) => line('td', row)));
  table.replaceChildren(make('caption', caption), head, body);
};

// A list of names and values; what is empty is left out.
const fillList = (id, entries) => byId(id).replaceChildren(...entries.filter(([, value]) => value !== '' && value !== null)
  .flatMap(([name, value]) => [make('dt', name), make('dd', value)]));

// Figures: name, value and note each, and what `more` adds to the k-th.
const fillCards = (cards, more = () => []) => byId('figures').replaceChildren(...cards.map(([name, value, note], k) => {
  const card = make('div');
  card.append(make('dt', name), make('dd', value, 'value'), make('dd', note || '\u00a0'), ...more(k));
  return card;
}));

// ---- Drawings: SVG of records/svg.h, which holds numbers and names of classes alone, in metres.
const view = {x: 0, y: 0, width: 1, height: 1, whole: null, detail: null};

const showView = () => {
  const svg = byId('svg');
  svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.width} ${view.height}`);
  const box = svg.getBoundingClientRect();
  const perPixel = Math.max(view.width / Math.max(box.width, 1), view.height / Math.max(box.height, 1));
  for (const label of svg.querySelectorAll('text')) label.setAttribute('font-size', 12 * perPixel / label.closest('.scene').dataset.scale);
  const target = 110 * perPixel, base = Math.pow(10, Math.floor(Math.log10(target)));
  const length = [5, 2, 1].map((k) => k * base).find((l) => l <= target) ?? base;
  byId('scale').style.width = `${length / perPixel}px`;
  byId('scale').firstElementChild.textContent = `${number(length)} m`;
};
const zoom = (factor, x = .5, y = .5) => {
  const width = view.width * factor, height = view.height * factor;
  if (!(width > 1e-6 * view.whole.width && width < 100 * view.whole.width)) return;
  view.x += (view.width - width) * x;
  view.y += (view.height - height) * y;
  view.width = width;
  view.height = height;
  showView();
};
const pan = (dx, dy) => { view.x += dx * view.width; view.y += dy * view.height; showView(); };
const showWhole = () => { Object.assign(view, view.whole); showView(); };

const startView = () => {
  const svg = byId('svg'), fingers = new Map();
  const shareOf = (event) => {
    const box = svg.getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };
  svg.addEventListener('wheel', (event) => {
    if (document.activeElement !== svg && !event.ctrlKey) return;  // else the page scrolls
    event.preventDefault();
    zoom(Math.pow(1.0015, event.deltaY), ...shareOf(event));
  }, {passive: false});
  svg.addEventListener('pointerdown', (event) => { svg.setPointerCapture(event.pointerId); fingers.set(event.pointerId, event); });
  svg.addEventListener('pointermove', (event) => {
    const last = fingers.get(event.pointerId);
    if (!last || !view.whole) return;
    if (fingers.size === 1) {
      const box = svg.getBoundingClientRect(), perPixel = Math.max(view.width / box.width, view.height / box.height);
      pan(-(event.clientX - last.clientX) * perPixel / view.width, -(event.clientY - last.clientY) * perPixel / view.height);
    } else {
      const other = [...fingers.values()].find((finger) => finger.pointerId !== event.pointerId);
      const gap = (finger) => Math.max(20, Math.hypot(finger.clientX - other.clientX, finger.clientY - other.clientY));
      zoom(gap(last) / gap(event), ...shareOf(other));
    }
    fingers.set(event.pointerId, event);
  });
  for (const end of ['pointerup', 'pointercancel']) svg.addEventListener(end, (event) => fingers.delete(event.pointerId));
  svg.addEventListener('keydown', (event) => {
    const act = {ArrowLeft: () => pan(-.1, 0), ArrowRight: () => pan(.1, 0), ArrowUp: () => pan(0, -.1), ArrowDown: () => pan(0, .1),
      '+': () => zoom(.8), '=': () => zoom(.8), '-': () => zoom(1.25), 0: showWhole}[event.key];
    if (!act || !view.whole) return;
    act();
    event.preventDefault();
  });
  byId('closer').addEventListener('click', () => zoom(.7));
  byId('wider').addEventListener('click', () => zoom(1 / .7));
  byId('whole').addEventListener('click', showWhole);
  byId('step').addEventListener('input', () => drawPart('the step', ['stage'], showStep));
  new ResizeObserver(() => { if (view.whole) showView(); }).observe(svg);
};

const wholeOf = ({frame: [x, y, width, height]}) => ({x, y, width, height});
const drawTube = (detail, svgText, color) => {
  const svg = byId('svg'), slider = byId('step');
  svg.innerHTML = svgText;
  svg.pauseAnimations();
  svg.style.setProperty('--tube', color);
  view.whole = wholeOf(detail);
  view.detail = detail;
  slider.max = String(Math.max(0, detail.units - 1));
  slider.value = String(Math.max(0, Math.min(detail.binding, detail.units - 1)));
  Object.assign(view, view.whole);
  showStep();
};

const showStep = () => {
  const svg = byId('svg'), step = Number(byId('step').value), {detail} = view;
  if (!detail) return;
  byId('step-name').textContent = `Step ${step} of ${detail.steps}${step === detail.binding ? ', binding' : ''}`;
  byId('step').setAttribute('aria-valuetext', byId('step-name').textContent);
  svg.setCurrentTime(step + .5);  // obstacles that move
  for (const old of svg.querySelectorAll('.now')) old.classList.remove('now');
  for (const part of svg.querySelectorAll(`.s${step}`)) part.classList.add('now');
  showView();
};

const fillLegend = (entries) => byId('legend').replaceChildren(...entries.map(([color, text]) => {
  const item = make('li'), chip = make('i', undefined, 'chip');
  chip.style.background = color;
  item.append(chip, text);
  return item;
}));
const showLegend = (color, detail) => fillLegend([[color, 'tube'],
  ...(detail.executed ? [[EXECUTED, 'executed slices'], [INK, 'measured states']] : []),
  ...(detail.has_body ? [[INK, 'the body, at the center of its slice']] : []),
  ['#6b7280', 'obstacles, by their names or numbers'], [WRONG, 'binding step and obstacle']]);

return {OUTCOMES, EXECUTED, WRONG, INK, SOFT, outcomeLabel, outcomeColor, byId, make, counted, number, percent, duration, dateOf,
  timeText, clockText, listed, tell, drawPart, drawChart, axis, legend, fillTable, fillList, fillCards, view, wholeOf, showView, startView, drawTube,
  fillLegend, showLegend};
})();
