// The page of a run. Its data are columns of numbers and dictionaries of texts. Texts come from logs, which anyone may have
// written: they reach the document through textContent only.
'use strict';
(() => {

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
const EXECUTED = '#009E73', WRONG = '#D55E00', INK = '#1b1f24', SOFT = '#5b6470', LINE = '#d9dee4';
const outcomeLabel = (name) => OUTCOMES[name]?.label ?? name;
const outcomeColor = (name) => OUTCOMES[name]?.color ?? '#000000';

const byId = (id) => document.getElementById(id);
const make = (tag, text, className) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (className) element.className = className;
  return element;
};
const counted = (n) => String(n).replace(/\B(?=(\d{3})+$)/g, '\u202f');
const number = (x, digits = 6) =>
  Number.isNaN(x) ? '–' : x === Infinity ? '∞' : x === -Infinity ? '−∞' : String(Number(x.toPrecision(digits)));
const percent = (part, whole) => (whole > 0 ? `${(100 * part / whole).toFixed(1)} %` : '–');
const duration = (us) => {
  if (!Number.isFinite(us)) return number(us);
  return us < 1000 ? `${number(us, 4)} µs` : us < 1e6 ? `${number(us / 1e3, 4)} ms` : `${number(us / 1e6, 4)} s`;
};
// Microseconds since the epoch. Times beyond a calendar stay numbers.
const dateOf = (us) => (Math.abs(us) <= 8.64e18 / 1e3 ? new Date(us / 1000) : null);
const timeText = (us) => dateOf(us)?.toISOString().replace('T', ' ').replace('Z', '') ?? `${us} µs`;
const clockText = (us) => dateOf(us)?.toISOString().slice(11, 23) ?? `${us} µs`;

// ---- Columns: base64 of zlib's format.
const ARRAYS = {i8: Int8Array, u8: Uint8Array, i16: Int16Array, u16: Uint16Array, i32: Int32Array, u32: Uint32Array,
  i64: BigInt64Array, u64: BigUint64Array, f32: Float32Array, f64: Float64Array};

const bytesOf = (base64) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
};
const unpack = (base64) =>
  new Response(new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();

// An object of columns with the same keys: {values, names?} or, of texts, {bytes, ends}.
const unpackTable = async (columns) => {
  const table = {};
  await Promise.all(Object.entries(columns).map(async ([name, column]) => {
    const buffer = await unpack(column.data);
    if (column.type === 'text')
      table[name] = {bytes: new Uint8Array(buffer), ends: new Uint32Array(await unpack(column.ends.data))};
    else
      table[name] = {values: new ARRAYS[column.type](buffer), names: column.names};
  }));
  return table;
};
const toNumbers = (bigs) => {
  const numbers = new Float64Array(bigs.length);
  for (let i = 0; i < numbers.length; ++i) numbers[i] = Number(bigs[i]);
  return numbers;
};
const decoder = new TextDecoder();
const textAt = (column, i) => decoder.decode(column.bytes.subarray(i > 0 ? column.ends[i - 1] : 0, column.ends[i] - 1));
const nameAt = (column, i) => column.names[column.values[i]];
const hexAt = (bytes, i) => {
  let text = '';
  for (let k = 32 * i; k < 32 * i + 32; ++k) text += bytes[k].toString(16).padStart(2, '0');
  return text;
};

// ---- One side of the page: decisions and the other records of a run, and which of them are shown.
const OTHERS = ['events', 'gaps', 'faults', 'withdrawals'];

const loadRun = async (raw) => {
  const run = {raw, count: raw.count, decisions: await unpackTable(raw.decisions)};
  for (const name of OTHERS) run[name] = await unpackTable(raw[name]);
  const d = run.decisions;
  run.time = toNumbers(d.utime.values);
  const plans = toNumbers(d.plan.values), rowsOfRun = raw.runs.map(() => new Map());
  const rowOfPlan = (part) => (rowsOfRun[part] ??= new Map());
  for (let i = 0; i < run.count; ++i) {
    const rows = rowOfPlan(d.run.values[i]);
    if (!rows.has(plans[i]) || nameAt(d.outcome, i) === 'certified') rows.set(plans[i], i);
  }
  for (const name of OTHERS) {
    const table = run[name];
    table.time = toNumbers(table.utime.values);
    table.shown = new Uint8Array(table.time.length);
    if (!table.plan) continue;
    table.row = new Int32Array(table.time.length);
    for (let i = 0; i < table.row.length; ++i) table.row[i] = rowOfPlan(table.run.values[i]).get(Number(table.plan.values[i])) ?? -1;
  }
  run.shown = new Uint8Array(run.count);
  run.rows = new Uint32Array(run.count);  // those that are shown, in the order of the log
  run.size = 0;
  return run;
};

// The bytes of all sentences as text of one character a byte, so that a search is one pass over them.
const sentencesOf = (run) => {
  run.sentences ??= new TextDecoder('latin1').decode(run.decisions.message.bytes).toLowerCase();
  return run.sentences;
};
const search = (run, query, found) => {
  const d = run.decisions, bytes = new TextEncoder().encode(query.toLowerCase());
  const needle = new TextDecoder('latin1').decode(bytes).toLowerCase();
  const matches = (column) => column.names.map((name) => name.toLowerCase().includes(query.toLowerCase()));
  const sources = matches(d.source), causes = matches(d.cause), outcomes = matches(d.outcome);
  const plan = /^-?\d+$/.test(query) ? BigInt.asIntN(64, BigInt(query)) : null;
  const digest = /^[0-9a-f]{6,64}$/i.test(query) ? query.toLowerCase() : null;
  for (let i = 0; i < run.count; ++i)
    found[i] = sources[d.source.values[i]] || causes[d.cause.values[i]] || outcomes[d.outcome.values[i]] ||
      (plan !== null && d.plan.values[i] === plan) ? 1 : 0;
  if (d.message) {
    const hay = sentencesOf(run), ends = d.message.ends;
    for (let at = hay.indexOf(needle), row = 0; at >= 0; at = hay.indexOf(needle, ends[row])) {
      for (let high = run.count - 1; row < high;) {
        const middle = (row + high) >> 1;
        if (ends[middle] > at) high = middle; else row = middle + 1;
      }
      found[row] = 1;
    }
  }
  if (digest && d.digest)
    for (let i = 0; i < run.count; ++i) if (!found[i] && hexAt(d.digest.values, i).startsWith(digest)) found[i] = 1;
};

const CHOICES = ['outcome', 'cause', 'robot', 'source', 'config', 'obstacle'];

// Decides what of a run passes the filters. Choices are texts, so that they mean the same in two runs.
const select = (run, filters, {withTime = true} = {}) => {
  const d = run.decisions, shown = run.shown;
  const from = withTime ? filters.from : -Infinity, to = withTime ? filters.to : Infinity;
  if (filters.search) search(run, filters.search, shown); else shown.fill(1);
  for (const name of CHOICES) {
    if (filters[name] === null) continue;
    const values = d[name].values;
    const wanted = d[name].names ? d[name].names.indexOf(filters[name]) : Number(filters[name]);
    for (let i = 0; i < run.count; ++i) if (values[i] !== wanted) shown[i] = 0;
  }
  run.size = 0;
  for (let i = 0; i < run.count; ++i) {
    if (!(from <= run.time[i] && run.time[i] <= to)) shown[i] = 0;
    if (shown[i]) run.rows[run.size++] = i;
  }
  const chosen = CHOICES.filter((name) => filters[name] !== null);
  const isOpen = chosen.length === 0 && !filters.search;
  const isOfRobot = chosen.length === 1 && filters.robot !== null && !filters.search;
  const isOfSource = chosen.length === 1 && filters.source !== null && !filters.search;
  for (const name of OTHERS) {
    const table = run[name];
    for (let i = 0; i < table.shown.length; ++i) {
      const isNow = from <= table.time[i] && table.time[i] <= to;
      if (table.row && table.row[i] >= 0) table.shown[i] = isNow && shown[table.row[i]] ? 1 : 0;
      else if (isOfRobot) table.shown[i] = isNow && run.raw.runs[table.run.values[i]]?.robot === filters.robot ? 1 : 0;
      else if (isOfSource && name === 'gaps') table.shown[i] = isNow && nameAt(table.source, i) === filters.source ? 1 : 0;
      else table.shown[i] = isNow && isOpen ? 1 : 0;
    }
  }
};

// ---- Figures.
const sortedOf = (run, values) => {
  const sorted = new Float64Array(run.size);
  let count = 0;
  for (let k = 0; k < run.size; ++k) {
    const value = values[run.rows[k]];
    if (value > 0 && value < Infinity) sorted[count++] = value;  // zero: the simulated clock stops during computations
  }
  return sorted.subarray(0, count).sort();
};
// Nearest rank.
const quantile = (sorted, q) => (sorted.length ? sorted[Math.max(0, Math.ceil(q * sorted.length) - 1)] : NaN);

const countBy = (run, column) => {
  const counts = new Map();
  for (let k = 0; k < run.size; ++k) {
    const value = column.values[run.rows[k]];
    counts.set(value, (counts.get(value) ?? 0) + 1);
  }
  return column.names ? new Map([...counts].map(([value, count]) => [column.names[value], count])) : counts;
};
const countKinds = (table, column) => {
  const counts = new Map();
  for (let i = 0; i < table.shown.length; ++i)
    if (table.shown[i]) counts.set(nameAt(table[column], i), (counts.get(nameAt(table[column], i)) ?? 0) + 1);
  return counts;
};
const listed = (counts) => [...counts].sort((a, b) => b[1] - a[1]).map(([name, n]) => `${name} ${counted(n)}`).join(', ');
const total = (shown) => shown.reduce((sum, x) => sum + x, 0);

const figuresOf = (run) => {
  const outcomes = countBy(run, run.decisions.outcome);
  const of = (name) => outcomes.get(name) ?? 0;
  const abstained = [...outcomes].filter(([name]) => name.startsWith('abstain')).reduce((sum, [, n]) => sum + n, 0);
  const latency = sortedOf(run, run.decisions.latency.values), gate = sortedOf(run, run.decisions.elapsed.values);
  const kinds = countKinds(run.events, 'kind'), reasons = new Map();
  const first = [];
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k];
    if (run.decisions.step.values[i] >= 0 && nameAt(run.decisions.outcome, i).startsWith('abstain'))
      first.push(run.decisions.step.values[i]);
  }
  first.sort((a, b) => a - b);
  let lost = 0;
  for (let i = 0; i < run.gaps.shown.length; ++i) {
    if (!run.gaps.shown[i]) continue;
    lost += Number(run.gaps.lost.values[i]);
    const reason = nameAt(run.gaps.reason, i);
    reasons.set(reason, (reasons.get(reason) ?? 0) + 1);
  }
  const inside = kinds.get('step_inside') ?? 0, outside = kinds.get('step_outside') ?? 0;
  const times = (sorted) => (sorted.length ? `p99 ${duration(quantile(sorted, .99))}, most ${duration(sorted.at(-1))}` : 'not measured');
  return [
    ['Decisions', counted(run.size), run.size === run.count ? 'all' : `of ${counted(run.count)}`],
    ['Certified', percent(of('certified'), run.size), counted(of('certified'))],
    ['Abstained', percent(abstained, run.size),
      [...outcomes].filter(([name]) => name.startsWith('abstain')).map(([name, n]) => `${outcomeLabel(name).replace(/^abstain,? /, '')} ${counted(n)}`).join(', ')],
    ['Rejected', percent(of('rejected'), run.size), counted(of('rejected'))],
    ['First step that fails', first.length ? `${quantile(first, .5)}` : '–',
      first.length ? `median; from ${first[0]} to ${first.at(-1)}` : 'no abstention names a step'],
    ['Latency', duration(quantile(latency, .5)), `median; ${times(latency)}`],
    ['Gate', duration(quantile(gate, .5)), `median; ${times(gate)}`],
    ['Steps in their slice', inside + outside > 0 ? percent(inside, inside + outside) : '–',
      `${counted(inside)} of ${counted(inside + outside)}`],
    ['Withdrawals', counted(total(run.withdrawals.shown)), listed(countKinds(run.withdrawals, 'kind'))],
    ['Faults', counted(total(run.faults.shown)), listed(countKinds(run.faults, 'kind'))],
    ['Messages lost', counted(lost), `${counted(total(run.gaps.shown))} gaps${reasons.size ? `: ${listed(reasons)}` : ''}`],
  ];
};

const showFigures = (run, before) => {
  const old = before ? figuresOf(before) : null;
  byId('figures').replaceChildren(...figuresOf(run).map(([name, value, note], k) => {
    const card = make('div');
    card.append(make('dt', name), make('dd', value, 'value'), make('dd', note || '\u00a0'));
    if (old) {
      const dd = make('dd', 'before: ', 'before');
      dd.append(make('b', old[k][1]), old[k][2] ? ` (${old[k][2]})` : '');
      card.append(dd);
    }
    return card;
  }));
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

const BINS = 48;
const trendOf = (run) => {
  const times = new Float64Array(run.size);
  for (let k = 0; k < run.size; ++k) times[k] = run.time[run.rows[k]];
  times.sort();
  // A few decisions with a stamp of another year do not press the others into one bar.
  const cut = run.size >= 1000 ? .001 : 0;
  const from = run.size ? times[Math.floor(cut * (run.size - 1))] : 0, to = run.size ? times[Math.ceil((1 - cut) * (run.size - 1))] : 0;
  const width = Math.max((to - from) / BINS, 1);
  const counts = new Map(), all = new Float64Array(BINS);
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], bin = Math.min(BINS - 1, Math.max(0, Math.floor((run.time[i] - from) / width)));
    const outcome = nameAt(run.decisions.outcome, i);
    if (!counts.has(outcome)) counts.set(outcome, new Float64Array(BINS));
    ++counts.get(outcome)[bin];
    ++all[bin];
  }
  return {from, width, counts, all};
};

const showTrend = (run) => {
  const {from, width, counts, all} = trendOf(run);
  const isShort = width * BINS < 120e6;
  const labels = Array.from(all, (_, k) => (isShort ? `${((k + .5) * width / 1e6).toFixed(1)} s` : timeText(from + (k + .5) * width).slice(0, 19)));
  const certified = counts.get('certified') ?? new Float64Array(BINS);
  const sets = Object.keys(OUTCOMES).concat([...counts.keys()].filter((name) => !OUTCOMES[name])).filter((name) => counts.has(name));
  drawChart('trend', `Decisions over time by outcome: ${listed(countBy(run, run.decisions.outcome))}`, {
    type: 'bar',
    data: {labels, datasets: [
      {type: 'line', label: 'certified share', data: Array.from(all, (n, k) => (n ? 100 * certified[k] / n : null)), yAxisID: 'share',
        borderColor: INK, backgroundColor: INK, borderWidth: 1.5, pointRadius: 2, spanGaps: true},
      ...sets.map((name) => ({label: outcomeLabel(name), data: Array.from(counts.get(name)), backgroundColor: outcomeColor(name),
        stack: 'all', barPercentage: 1, categoryPercentage: .94})),
    ]},
    options: {
      plugins: {legend: legend(true)},
      interaction: {mode: 'index', intersect: false},
      scales: {
        x: axis(run.size ? `from ${timeText(from).slice(0, 19)} UTC on` : '', {stacked: true, ticks: {color: SOFT, maxRotation: 0, autoSkipPadding: 18}}),
        y: axis('decisions', {stacked: true, beginAtZero: true}),
        share: axis('certified, %', {position: 'right', min: 0, max: 100, grid: {display: false}}),
      },
      onClick: (event, items) => { if (items.length) setTime(from + items[0].index * width, from + (items[0].index + 1) * width); },
    },
  });
};

const showCauses = (run) => {
  const d = run.decisions, counts = new Map();
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], outcome = nameAt(d.outcome, i), cause = nameAt(d.cause, i);
    if (outcome === 'certified') continue;
    const entry = counts.get(cause) ?? {cause, outcome, count: 0};
    ++entry.count;
    counts.set(cause, entry);
  }
  const entries = [...counts.values()].sort((a, b) => b.count - a.count).slice(0, 12);
  drawChart('causes', `Causes: ${entries.map((e) => `${e.cause} ${e.count}`).join(', ') || 'none'}`, {
    type: 'bar',
    data: {labels: entries.map((e) => e.cause.replaceAll('_', ' ')),
      datasets: [{data: entries.map((e) => e.count), backgroundColor: entries.map((e) => outcomeColor(e.outcome)), maxBarThickness: 22}]},
    options: {indexAxis: 'y', plugins: {legend: legend(false)},
      scales: {x: axis('decisions', {beginAtZero: true}), y: axis('', {title: {display: false}, grid: {display: false}})},
      onClick: (event, items) => { if (items.length) setChoice('cause', entries[items[0].index].cause); }},
  });
};

const STEPS = 129;
const showSteps = (run) => {
  const d = run.decisions, counts = new Map();
  let last = 0, asked = 0;
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], outcome = nameAt(d.outcome, i), step = d.step.values[i];
    if (step < 0 || !outcome.startsWith('abstain')) continue;
    if (!counts.has(outcome)) counts.set(outcome, new Array(STEPS).fill(0));
    const bin = Math.min(step, STEPS - 1);
    ++counts.get(outcome)[bin];
    ++asked;
    last = Math.max(last, bin);
  }
  drawChart('steps', `First failing steps of ${asked} abstentions`, {
    type: 'bar',
    data: {labels: Array.from({length: last + 1}, (_, k) => (k === STEPS - 1 ? `${k} or more` : k)),
      datasets: [...counts].map(([name, all]) => ({label: outcomeLabel(name), data: all.slice(0, last + 1), backgroundColor: outcomeColor(name), stack: 'all', barPercentage: 1}))},
    options: {plugins: {legend: legend(true)},
      scales: {x: axis('step', {stacked: true, grid: {display: false}, ticks: {color: SOFT, maxRotation: 0, autoSkipPadding: 8}}),
        y: axis('abstentions', {stacked: true, beginAtZero: true, ticks: {color: SOFT, precision: 0}})}},
  });
};

const QUANTILES = [['p50', .5], ['p90', .9], ['p99', .99], ['p99.9', .999], ['most', 1]];
// Of a logarithmic axis, labels at powers of ten alone.
const powers = {color: SOFT, maxRotation: 0, callback: (value) => (Math.abs(Math.log10(value) % 1) < 1e-9 ? String(value) : '')};
const showTimes = (run) => {
  const sides = [['Latency', sortedOf(run, run.decisions.latency.values), '#0072B2'],
    ['Gate', sortedOf(run, run.decisions.elapsed.values), '#D55E00']];
  const points = (sorted) => {
    const all = [];
    for (let k = 0; k <= 160; ++k) {
      const at = Math.min(sorted.length - 1, Math.floor(sorted.length * (1 - Math.pow(sorted.length, -k / 160))));
      if (at >= 0) all.push({x: sorted[at] / 1e3, y: (sorted.length - at) / sorted.length * 100});
    }
    return all;
  };
  drawChart('tail', `Share of decisions that took longer than a time; ${sides.map(([name, sorted]) => `${name}: p99 ${duration(quantile(sorted, .99))}`).join('; ')}`, {
    type: 'scatter',
    data: {datasets: sides.filter(([, sorted]) => sorted.length).map(([label, sorted, color]) => ({label, data: points(sorted), showLine: true, borderColor: color, backgroundColor: color, pointRadius: 0, borderWidth: 2}))},
    options: {plugins: {legend: legend(true)},
      scales: {x: axis('milliseconds', {type: 'logarithmic', ticks: powers}),
        y: axis('% took longer', {type: 'logarithmic', max: 100, ticks: powers})}},
  });
  fillTable(byId('times'), 'Percentiles', ['', ...sides.map(([name]) => name)],
    [...QUANTILES.map(([name, q]) => [name, ...sides.map(([, sorted]) => duration(quantile(sorted, q)))]),
      ['measured', ...sides.map(([, sorted]) => counted(sorted.length))]], [1, 2]);
};

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

const MOST_GROUPS = 8;
const showGroups = (run, id, caption, name, label) => {
  const d = run.decisions, groups = new Map();
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], value = d[name].values[i];
    const group = groups.get(value) ?? {count: 0, certified: 0};
    ++group.count;
    if (nameAt(d.outcome, i) === 'certified') ++group.certified;
    groups.set(value, group);
  }
  const key = (value) => (d[name].names ? d[name].names[value] : String(value));
  const all = [...groups].sort((a, b) => b[1].count - a[1].count);
  const rows = all.slice(0, MOST_GROUPS).map(([value, {count, certified}]) => {
    const button = make('button', label(key(value)));
    button.type = 'button';
    button.addEventListener('click', () => setChoice(name, key(value)));
    const bar = make('span', undefined, 'bar'), filled = make('i');
    filled.style.width = `${100 * certified / count}%`;
    bar.append(filled);
    return [button, counted(count), percent(certified, count), bar];
  });
  if (all.length > MOST_GROUPS) rows.push([`and ${counted(all.length - MOST_GROUPS)} others`, '', '', '']);
  fillTable(byId(id), caption, ['', 'decisions', 'certified', ''], rows, [1, 2]);
};

const MOST_OTHERS = 100;
const showRecords = (id, caption, table, heads, line) => {
  const rows = [];
  let count = 0;
  for (let i = 0; i < table.shown.length; ++i)
    if (table.shown[i] && ++count <= MOST_OTHERS) rows.push(line(i));
  if (count > MOST_OTHERS) rows.push([`and ${counted(count - MOST_OTHERS)} more`, ...heads.slice(1).map(() => '')]);
  fillTable(byId(id), `${caption}: ${counted(count)}`, heads, rows);
};
const showOthers = (run) => {
  const {faults, withdrawals, gaps, events} = run;
  showRecords('faults', 'Faults', faults, ['Time', 'Fault', 'Sentence'],
    (i) => [clockText(faults.time[i]), nameAt(faults.kind, i), textAt(faults.message, i)]);
  showRecords('withdrawals', 'Withdrawals', withdrawals, ['Time', 'Plan', 'Cause', 'Sentence'],
    (i) => [clockText(withdrawals.time[i]), String(withdrawals.plan.values[i]), nameAt(withdrawals.kind, i), textAt(withdrawals.message, i)]);
  showRecords('gaps', 'Gaps', gaps, ['Time', 'Channel', 'Reason', 'Lost'],
    (i) => [clockText(gaps.time[i]), [nameAt(gaps.channel, i), nameAt(gaps.source, i)].filter(Boolean).join(' '), nameAt(gaps.reason, i), String(gaps.lost.values[i])]);
  fillTable(byId('events'), 'What the robot did', ['Event', 'Times'],
    [...countKinds(events, 'kind')].sort((a, b) => b[1] - a[1]).map(([name, n]) => [name.replaceAll('_', ' '), counted(n)]), [1]);
};

// ---- The table of decisions. Only rows in view are elements, and these are used again.
const grid = {order: new Uint32Array(0), sort: 'time', falls: false, chosen: -1, pool: []};
const clearanceAt = (d, i) => d.margin.values[i] - d.threshold.values[i];
const COLUMNS = [
  {id: 'time', title: 'Time (UTC)', key: (run) => run.time, text: (run, i) => (narrow.matches ? clockText(run.time[i]).slice(0, 10) : timeText(run.time[i]))},
  {id: 'plan', title: 'Plan', rare: true, number: true, key: (run) => toNumbers(run.decisions.plan.values), text: (run, i) => lastDigits(String(run.decisions.plan.values[i]))},
  {id: 'source', title: 'Source', rare: true, text: (run, i) => nameAt(run.decisions.source, i), names: 'source'},
  {id: 'outcome', title: 'Outcome', text: (run, i) => outcomeLabel(nameAt(run.decisions.outcome, i)), names: 'outcome', chip: true},
  {id: 'cause', title: 'Cause', text: (run, i) => { const cause = nameAt(run.decisions.cause, i); return cause === 'none' ? '' : cause.replaceAll('_', ' '); }, names: 'cause'},
  {id: 'step', title: 'Step', number: true, key: (run) => run.decisions.step.values, text: (run, i) => indexText(run.decisions.step.values[i])},
  {id: 'obstacle', title: 'Obstacle', rare: true, number: true, key: (run) => run.decisions.obstacle.values, text: (run, i) => indexText(run.decisions.obstacle.values[i])},
  {id: 'clearance', title: 'Margin', rare: true, number: true, text: (run, i) => number(clearanceAt(run.decisions, i), 4),
    key: (run) => Float64Array.from({length: run.count}, (_, i) => clearanceAt(run.decisions, i))},
  {id: 'latency', title: 'Latency', rare: true, number: true, key: (run) => run.decisions.latency.values, text: (run, i) => duration(run.decisions.latency.values[i])},
  {id: 'message', title: 'Sentence', rare: true, text: (run, i) => textAt(run.decisions.message, i)},
];
const narrow = matchMedia('(max-width: 46rem)');
// Of a long number, as a planner makes of the time, the digits that differ.
const lastDigits = (text) => (text.length > 8 ? `…${text.slice(-7)}` : text);
const indexText = (index) => (index < 0 ? '' : String(index));
const rowHeight = () => (narrow.matches ? 40 : 30);
const MOST_PIXELS = 12e6;  // browsers lay out no more than about 16 million

const sortKey = (run, column) => {
  run.keys ??= {};
  if (run.keys[column.id]) return run.keys[column.id];
  if (!column.names) return run.keys[column.id] = column.key(run);
  const {values, names} = run.decisions[column.names];
  const ranks = new Uint32Array(names.length);
  names.map((_, k) => k).sort((a, b) => (names[a] < names[b] ? -1 : 1)).forEach((k, rank) => { ranks[k] = rank; });
  return run.keys[column.id] = values.map((value) => ranks[value]);
};
// Rows without a value come last, whatever the direction; equal ones in the order of the log.
const sortRows = (run) => {
  const key = sortKey(run, COLUMNS.find((column) => column.id === grid.sort)), sign = grid.falls ? -1 : 1;
  grid.order = run.rows.slice(0, run.size).sort((a, b) => {
    const x = key[a], y = key[b];
    return x < y ? -sign : x > y ? sign : x === y ? a - b : Number.isNaN(x) - Number.isNaN(y) || a - b;
  });
};

const showHead = (run) => {
  byId('head').replaceChildren(...COLUMNS.map((column) => {
    const isSorted = grid.sort === column.id, isSortable = column.key || column.names;
    const cell = make(isSortable ? 'button' : 'span', column.title + (isSorted ? (grid.falls ? ' ▾' : ' ▴') : ''),
      (column.rare ? 'rare ' : '') + (column.number ? 'n' : ''));
    cell.setAttribute('role', 'columnheader');
    if (isSortable) {
      cell.type = 'button';
      cell.dataset.sort = column.id;
      cell.setAttribute('aria-sort', isSorted ? (grid.falls ? 'descending' : 'ascending') : 'none');
      cell.addEventListener('click', () => {
        grid.falls = isSorted ? !grid.falls : false;
        grid.sort = column.id;
        sortRows(run);
        showHead(run);
        showRows(run);
        byId('head').querySelector(`[data-sort=${column.id}]`).focus();
      });
    }
    return cell;
  }));
};

const newRow = () => {
  const row = make('div', undefined, 'row');
  row.setAttribute('role', 'row');
  row.cells = COLUMNS.map((column) => {
    const cell = make('span', undefined, (column.rare ? 'rare ' : '') + (column.number ? 'n' : ''));
    cell.setAttribute('role', 'gridcell');
    if (column.chip) {
      row.chip = make('i', undefined, 'chip');
      cell.append(row.chip, '');
    } else {
      cell.append('');
    }
    row.append(cell);
    return cell.lastChild;  // a text
  });
  return row;
};
// The height of the scrolled area is bounded; beyond it, a pixel of scrolling is more than a pixel of rows.
const scrollFactor = () => Math.max(1, grid.order.length * rowHeight() / MOST_PIXELS);

const showRows = (run) => {
  const box = byId('grid'), height = rowHeight(), count = grid.order.length, factor = scrollFactor();
  byId('space').style.height = `${Math.min(count * height, MOST_PIXELS)}px`;
  box.setAttribute('aria-rowcount', String(count));
  const inView = Math.ceil(box.clientHeight / height) + 2;
  const first = Math.max(0, Math.min(Math.floor(box.scrollTop * factor / height), count - inView + 1));
  while (grid.pool.length < inView) {
    grid.pool.push(newRow());
    byId('rows').append(grid.pool.at(-1));
  }
  const top = factor > 1 ? box.scrollTop - box.scrollTop * factor % height : first * height;
  byId('rows').style.transform = `translateY(${top}px)`;
  grid.pool.forEach((row, k) => {
    const place = first + k, isThere = k < inView && place < count;
    row.hidden = !isThere;
    if (!isThere) return;
    const i = grid.order[place];
    row.place = place;
    row.id = `row-${i}`;
    row.setAttribute('aria-rowindex', String(place + 1));
    row.setAttribute('aria-selected', String(i === grid.chosen));
    row.classList.toggle('chosen', i === grid.chosen);
    row.chip.style.background = outcomeColor(nameAt(run.decisions.outcome, i));
    COLUMNS.forEach((column, c) => { row.cells[c].data = column.text(run, i); });
    row.title = narrow.matches ? '' : textAt(run.decisions.message, i);
  });
  box.setAttribute('aria-activedescendant', grid.chosen >= 0 ? `row-${grid.chosen}` : '');
};

const choose = (run, place, {scroll = true} = {}) => {
  if (grid.order.length === 0) return;
  place = Math.max(0, Math.min(place, grid.order.length - 1));
  grid.chosen = grid.order[place];
  const box = byId('grid'), height = rowHeight(), factor = scrollFactor(), room = box.clientHeight - byId('head').offsetHeight;
  const top = box.scrollTop * factor;
  if (scroll && place * height < top) box.scrollTop = place * height / factor;
  if (scroll && (place + 1) * height > top + room) box.scrollTop = ((place + 1) * height - room) / factor;
  showRows(run);
  showDetail(run, grid.chosen);
};
const placeOfChosen = () => grid.order.indexOf(grid.chosen);

const startGrid = (run) => {
  const box = byId('grid');
  let isDue = false;
  box.addEventListener('scroll', () => {
    if (isDue) return;
    isDue = true;
    requestAnimationFrame(() => { isDue = false; showRows(run); });
  });
  byId('rows').addEventListener('click', (event) => {
    const row = event.target.closest('.row');
    if (row) choose(run, row.place, {scroll: false});
  });
  box.addEventListener('keydown', (event) => {
    if (event.target !== box) return;
    const page = Math.floor(box.clientHeight / rowHeight()) - 2;
    const at = placeOfChosen();
    const to = {ArrowDown: at + 1, ArrowUp: at - 1, PageDown: at + page, PageUp: at - page, Home: 0, End: grid.order.length - 1}[event.key];
    if (to !== undefined) choose(run, to);
    else if (event.key === 'Enter') { byId('detail').scrollIntoView(); byId('step').focus({preventScroll: true}); }
    else return;
    event.preventDefault();
  });
  byId('previous').addEventListener('click', () => choose(run, placeOfChosen() - 1));
  byId('next').addEventListener('click', () => choose(run, placeOfChosen() + 1));
  byId('back').addEventListener('click', () => { box.scrollIntoView({block: 'center'}); box.focus({preventScroll: true}); });
  narrow.addEventListener('change', () => showRows(run));
  new ResizeObserver(() => showRows(run)).observe(box);
};

// ---- Drawings.
const loadDrawings = async (raw) => {
  const texts = JSON.parse(decoder.decode(await unpack(raw.texts)));
  const {parts, corners, points} = await unpackTable({parts: raw.parts, corners: raw.corners, points: raw.points});
  const ofRow = new Map();
  let part = 0, polygon = 0, point = 0;
  for (const detail of texts.details) {  // where its numbers begin
    detail.at = {part, polygon, point};
    detail.executed = detail.executed.filter(([, x, y]) => canBeDrawn(x, y));
    for (let u = 0; u < detail.units; ++u)
      for (let k = parts.values[part++]; k > 0; --k) point += 2 * corners.values[polygon++];
    ofRow.set(detail.row, detail);
  }
  return {ofRow, sets: texts.obstacle_sets, parts: parts.values, corners: corners.values, points: points.values};
};

// The polygons of each unit, as arrays of x and y in metres.
const unitsOf = (drawings, detail) => {
  const [x0, y0, quantum] = detail.grid;
  let {part, polygon, point} = detail.at;
  return Array.from({length: detail.units}, () => Array.from({length: drawings.parts[part++]}, () => {
    let x = 0, y = 0;
    return Array.from({length: drawings.corners[polygon++]}, () => {
      x += drawings.points[point++];
      y += drawings.points[point++];
      return [x0 + quantum * x, y0 + quantum * y];
    });
  }));
};

const SVG = 'http://www.w3.org/2000/svg';
const shape = (tag, attributes) => {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
};
// y points up.
const pointsText = (points) => points.map(([x, y]) => `${x},${-y}`).join(' ');
const outline = (points, attributes) =>
  shape('polygon', {points: pointsText(points), 'vector-effect': 'non-scaling-stroke', 'stroke-linejoin': 'round', ...attributes});

const view = {x: 0, y: 0, width: 1, height: 1, whole: null, scene: null};

// Beyond this, numbers of a log are no places in a drawing.
const canBeDrawn = (...numbers) => numbers.every((x) => Math.abs(x) < 1e9);

// Where an obstacle is at a time: its points and its radius, or null.
const placeOf = (obstacle, time) => {
  if (!obstacle?.points) return null;
  const {points, radius, motion} = obstacle;
  if (!motion) return {points, radius};
  if (time < motion.from || motion.until < time) return null;
  const tau = (time - motion.stamp) / 1e6;
  return {points: points.map(([x, y]) => [x + motion.velocity[0] * tau, y + motion.velocity[1] * tau]),
    radius: radius + motion.uncertainty + motion.growth * Math.abs(tau) + motion.growth_rate * tau * tau / 2};
};
const centerOf = (points) => [0, 1].map((k) => points.reduce((sum, point) => sum + point[k], 0) / points.length);

// A hull of points, each with a disc of this radius, is their polygon with a round border as wide.
const drawObstacle = (obstacle, place, isBinding) => {
  const color = isBinding ? WRONG : '#6b7280';
  if (obstacle.normal) {
    const [nx, ny] = obstacle.normal, norm = Math.hypot(nx, ny), far = 50 * Math.max(view.whole.width, view.whole.height);
    const [ux, uy] = [nx / norm, ny / norm], [cx, cy] = [ux * obstacle.offset / norm, uy * obstacle.offset / norm];
    if (!canBeDrawn(cx, cy)) return shape('g', {});
    return outline([[cx - far * uy, cy + far * ux], [cx + far * uy, cy - far * ux], [cx + far * (uy + ux), cy + far * (uy - ux)],
      [cx + far * (ux - uy), cy + far * (uy + ux)]], {fill: color, 'fill-opacity': .28, stroke: color, 'stroke-width': isBinding ? 2 : 1});
  }
  const group = shape('g', {opacity: isBinding ? .5 : .38});
  if (place.points.length === 1)
    group.append(shape('circle', {cx: place.points[0][0], cy: -place.points[0][1], r: Math.max(place.radius, 0), fill: color}));
  else
    group.append(shape('polygon', {points: pointsText(place.points), fill: color, stroke: color, 'stroke-width': 2 * place.radius, 'stroke-linejoin': 'round'}));
  return group;
};

const showView = () => {
  const svg = byId('svg');
  svg.setAttribute('viewBox', `${view.x} ${view.y} ${view.width} ${view.height}`);
  const box = svg.getBoundingClientRect();
  const perPixel = Math.max(view.width / Math.max(box.width, 1), view.height / Math.max(box.height, 1));
  for (const label of svg.querySelectorAll('text')) label.setAttribute('font-size', 12 * perPixel);
  for (const dot of svg.querySelectorAll('.dot')) dot.setAttribute('r', (dot.isNow ? 5 : 2.2) * perPixel);
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
  byId('step').addEventListener('input', showStep);
  new ResizeObserver(() => { if (view.whole) showView(); }).observe(svg);
};

// The tube, and the obstacle that decides if it is not much larger.
const extentOf = (units, executed, place) => {
  let [left, bottom, right, top] = [Infinity, Infinity, -Infinity, -Infinity];
  const add = ([x, y]) => { left = Math.min(left, x); right = Math.max(right, x); bottom = Math.min(bottom, y); top = Math.max(top, y); };
  units.flat(2).forEach(add);
  executed.forEach(([, x, y]) => add([x, y]));
  const size = Math.max(right - left, top - bottom, 1e-3);
  for (const [x, y] of place && place.radius < size && canBeDrawn(...place.points.flat()) ? place.points : [])
    if (Math.abs(x - (left + right) / 2) < 1.5 * size && Math.abs(y - (top + bottom) / 2) < 1.5 * size)
      for (const way of [-1, 1]) add([x + way * place.radius, y + way * place.radius]);
  const border = Math.max(.12 * Math.max(right - left, top - bottom), 1e-3);
  const width = right - left + 2 * border, height = Math.max(top - bottom + 2 * border, .45 * width);
  return {x: left - border, y: -(top + bottom) / 2 - height / 2, width, height};
};

// What the step slider changes is in groups of its own.
const drawTube = (run, i, detail) => {
  const units = unitsOf(run.drawings, detail), outcome = nameAt(run.decisions.outcome, i), color = outcomeColor(outcome);
  const binding = outcome === 'rejected' ? -1 : run.decisions.obstacle.values[i];
  const executed = new Set(detail.executed.map(([step]) => step));
  const set = run.drawings.sets[detail.obstacles] ?? [];
  view.whole = extentOf(units, detail.executed, placeOf(set[binding], detail.start + Math.max(detail.binding, 0) * detail.step_us));
  const tube = shape('g', {}), path = shape('g', {}), now = shape('g', {}), obstacles = shape('g', {}), labels = shape('g', {});
  units.forEach((polygons, u) => polygons.forEach((polygon) => tube.append(outline(polygon, {
    fill: executed.has(u) ? EXECUTED : color, 'fill-opacity': executed.has(u) ? .2 : .13,
    stroke: executed.has(u) ? EXECUTED : color, 'stroke-opacity': .45, 'stroke-width': .8}))));
  for (const polygon of units[detail.binding] ?? []) path.append(outline(polygon, {fill: 'none', stroke: WRONG, 'stroke-width': 2}));
  if (detail.executed.length > 1)
    path.append(shape('polyline', {points: pointsText(detail.executed.map(([, x, y]) => [x, y])), fill: 'none', stroke: INK, 'stroke-width': 1, 'vector-effect': 'non-scaling-stroke'}));
  for (const [step, x, y] of detail.executed) {
    const dot = shape('circle', {class: 'dot', cx: x, cy: -y, fill: INK});
    dot.step = step;
    path.append(dot);
  }
  byId('svg').replaceChildren(obstacles, tube, path, now, labels);
  view.scene = {units, detail, color, binding, obstacles, now, path, labels, set};
  const slider = byId('step');
  slider.max = String(Math.max(0, units.length - 1));
  slider.value = String(Math.max(0, Math.min(detail.binding, units.length - 1)));
  Object.assign(view, view.whole);
  showStep();
};

const showStep = () => {
  const {scene} = view, step = Number(byId('step').value);
  if (!scene) return;
  const {detail, units} = scene, time = detail.start + step * detail.step_us;
  byId('step-name').textContent = `Step ${step} of ${detail.steps}${step === detail.binding ? ', binding' : ''}`;
  byId('step').setAttribute('aria-valuetext', byId('step-name').textContent);
  scene.now.replaceChildren(...(units[step] ?? []).map((polygon) => outline(polygon, {fill: scene.color, 'fill-opacity': .35, stroke: INK, 'stroke-width': 1.6})));
  for (const dot of scene.path.querySelectorAll('.dot')) dot.isNow = dot.step === step;
  scene.obstacles.replaceChildren();
  scene.labels.replaceChildren();
  scene.set.forEach((obstacle, k) => {
    const place = placeOf(obstacle, time), isBinding = k === scene.binding;
    if (!obstacle || !(obstacle.normal ? canBeDrawn(...obstacle.normal, obstacle.offset) : place && canBeDrawn(place.radius, ...place.points.flat()))) return;
    scene.obstacles.append(drawObstacle(obstacle, place, isBinding));
    if (!place) return;
    const [x, y] = centerOf(place.points);
    const label = shape('text', {x, y: -y, 'text-anchor': 'middle', 'dominant-baseline': 'middle', fill: INK, 'pointer-events': 'none'});
    label.textContent = String(k);
    scene.labels.append(label);
  });
  showView();
};

// ---- The detail of a decision.
const fillList = (id, entries) => byId(id).replaceChildren(...entries.filter(([, value]) => value !== '' && value !== null)
  .flatMap(([name, value]) => [make('dt', name), make('dd', value)]));

// The name of the coordinate that an abstention is about.
const coordinateText = (d, i, task) => {
  const k = d.coordinate.values[i], cause = nameAt(d.cause, i);
  if (k < 0) return '';
  if (cause === 'limit') return `limit ${k}`;
  return task ? [...task.states, ...task.inputs][k] ?? `row ${k - task.states.length - task.inputs.length}` : String(k);
};

const showLegend = (color, detail) => {
  const entries = [[color, 'tube'], ['#6b7280', 'obstacles, by their numbers'], [WRONG, 'binding step and obstacle']];
  if (detail.executed.length) entries.splice(1, 0, [EXECUTED, 'executed slices'], [INK, 'measured states']);
  byId('legend').replaceChildren(...entries.map(([background, text]) => {
    const item = make('li'), chip = make('i', undefined, 'chip');
    chip.style.background = background;
    item.append(chip, text);
    return item;
  }));
};

const showEnvelope = (detail, task) => {
  const [lower, upper] = detail?.hull ?? [[], []], [low, up] = detail?.envelope ?? [[], []];
  byId('envelope').hidden = lower.length === 0;
  if (lower.length === 0) return;
  const range = (a, b) => (a === undefined ? '' : `${number(a ?? NaN, 4)} … ${number(b ?? NaN, 4)}`);
  fillTable(byId('envelope'), `At step ${detail.binding}`, ['state', 'slice', 'envelope of the residual'],
    lower.map((_, k) => [task?.states[k] ?? String(k), range(lower[k], upper[k]), range(low[k], up[k])]));
};

const showDetail = (run, i) => {
  const d = run.decisions, detail = run.drawings.ofRow.get(i);
  const config = nameAt(d.config, i), task = run.raw.tasks.find((each) => each.digest === config);
  const outcome = nameAt(d.outcome, i), cause = nameAt(d.cause, i), digest = hexAt(d.digest.values, i);
  const hasDrawing = Boolean(detail && detail.units > 0 && !detail.missing);
  const index = (column) => (column.values[i] >= 0 ? String(column.values[i]) : '');
  const margin = d.margin.values[i], threshold = d.threshold.values[i];
  byId('sentence').textContent = textAt(d.message, i) || '(no sentence)';
  fillList('facts', [
    ['Outcome', outcomeLabel(outcome) + (cause === 'none' ? '' : `: ${cause.replaceAll('_', ' ')}`)],
    ['Robot', run.raw.runs.length > 1 ? nameAt(d.robot, i) : ''],
    ['Plan', `${d.plan.values[i]} of ${nameAt(d.source, i)}`],
    ['Received', `${timeText(run.time[i])} UTC`],
    ['Sequence', String(d.sequence.values[i])],
    ['Took', `${duration(d.elapsed.values[i])} in the gate, latency ${duration(d.latency.values[i])}`],
    ['Binding step', d.step.values[i] >= 0 ? `${d.step.values[i]}, the first that fails` : detail?.binding >= 0 ? `${detail.binding}, the closest` : ''],
    ['Obstacle', index(d.obstacle)],
    ['Part of the body', detail?.part >= 0 && run.raw.tasks[detail.task]?.parts > 1 ? String(detail.part) : ''],
    ['Coordinate', coordinateText(d, i, task)],
    ['Observations', d.first.values[i] >= 0 ? `${d.first.values[i]} and ${d.second.values[i]} contradict each other` : ''],
    ['Value, bound', `${number(margin)}, ${number(threshold)}; margin ${number(margin - threshold)}`],
    ['Task', task ? `${task.name}; certificates hold ${task.holds === 'all_times' ? 'at all times' : 'at the samples'}` : 'not known'],
    ['Log', `${nameAt(d.log, i)} event ${d.event.values[i]}`],
  ]);
  showEnvelope(detail, task);
  const replay = run.raw.runs[d.run.values[i]]?.replays?.[nameAt(d.log, i)];
  byId('command').textContent = replay ? `${replay} --plan-digest ${digest}` : 'Its log was not read.';
  fillList('digests', [['candidate', digest], ['task', config], ...['model', 'declaration', 'observations', 'obstacles'].map((name) => [name, nameAt(d[name], i)])]);
  byId('stage').hidden = byId('step').closest('.steer').hidden = byId('legend').hidden = !hasDrawing;
  byId('missing').textContent = hasDrawing ? '' : `No drawing: ${detail ? detail.missing || 'it has no tube' :
    outcome === 'certified' || /safety|domain|falsified/.test(outcome) ? 'the page has the tubes of the last decisions only' : 'it was answered without a tube'}.`;
  view.scene = view.whole = null;
  if (!hasDrawing) return;
  showLegend(outcomeColor(outcome), detail);
  drawTube(run, i, detail);
};

// ---- Filters.
const timeFrom = (id, otherwise) => {
  const value = Date.parse(`${byId(id).value}Z`);
  return Number.isNaN(value) ? otherwise : value * 1000;
};
const readFilters = () => {
  const filters = {from: timeFrom('f-from', -Infinity), to: timeFrom('f-to', Infinity), search: byId('f-search').value.trim()};
  if (Number.isFinite(filters.to)) filters.to += 999;  // the whole of its millisecond
  for (const name of CHOICES) filters[name] = byId(`f-${name}`).selectedIndex > 0 ? byId(`f-${name}`).selectedOptions[0].value : null;
  return filters;
};
const fillChoices = (run) => {
  const labels = {outcome: outcomeLabel, cause: (name) => name.replaceAll('_', ' '), robot: (name) => name || '(no name)', source: (name) => name || '(no name)',
    config: (digest) => taskLabel(run, digest), obstacle: (index) => (index < 0 ? 'none' : String(index))};
  const fill = (name, values) => byId(`f-${name}`).replaceChildren(make('option', 'all'), ...values.map((value) => {
    const option = make('option', labels[name](value));
    option.value = String(value);
    return option;
  }));
  for (const name of CHOICES)
    fill(name, run.decisions[name].names ? [...run.decisions[name].names].sort() : [...new Set(run.decisions[name].values)].sort((a, b) => a - b));
};
const taskLabel = (run, digest) => {
  const task = run.raw.tasks.find((each) => each.digest === digest);
  return `${task ? `${task.name}, ` : ''}${digest.slice(0, 10)}`;
};

let show;  // everything that passes the filters
const setChoice = (name, value) => {
  const select = byId(`f-${name}`), option = [...select.options].findIndex((each, k) => k > 0 && each.value === value);
  select.selectedIndex = Math.max(option, 0);
  show();
};
const setTime = (from, to) => {
  const text = (us) => dateOf(us)?.toISOString().slice(0, 23) ?? '';
  byId('f-from').value = text(Math.floor(from));
  byId('f-to').value = text(Math.ceil(to));
  show();
};

// ---- Begin.
const start = async () => {
  const data = JSON.parse(byId('data').textContent);
  const run = await loadRun(data.run), before = data.before ? await loadRun(data.before) : null;
  run.drawings = await loadDrawings(data.run.drawings);
  byId('main').hidden = false;
  const sorted = run.time.slice().sort();
  byId('what').textContent = `${data.run.name}: ${counted(run.count)} decisions` +
    (run.count ? `, ${timeText(sorted[0])} to ${timeText(sorted.at(-1))} UTC` : '') + (before ? `. Before: ${data.before.name}` : '');
  document.title = `ForeReach report: ${data.run.name}`;
  fillChoices(run);
  show = () => {
    const filters = readFilters();
    select(run, filters);
    if (before) select(before, filters, {withTime: false});
    byId('shown').textContent = `${counted(run.size)} of ${counted(run.count)} decisions`;
    showFigures(run, before);
    showTrend(run);
    showCauses(run);
    showSteps(run);
    showTimes(run);
    showGroups(run, 'by-robot', 'By robot', 'robot', (name) => name || '(no name)');
    showGroups(run, 'by-source', 'By source', 'source', (name) => name || '(no name)');
    showGroups(run, 'by-config', 'By task, with its config digest', 'config', (digest) => taskLabel(run, digest));
    showGroups(run, 'by-obstacle', 'By the obstacle that decided', 'obstacle', (index) => (Number(index) < 0 ? 'none' : `obstacle ${index}`));
    showOthers(run);
    sortRows(run);
    byId('grid').scrollTop = 0;
    if (run.size === 0) grid.chosen = -1;
    showRows(run);
    byId('detail').hidden = run.size === 0;
    if (run.size > 0) choose(run, Math.max(0, placeOfChosen()), {scroll: placeOfChosen() >= 0});
  };
  showHead(run);
  startGrid(run);
  startView();
  for (const element of byId('filters').querySelectorAll('select')) element.addEventListener('change', show);
  let pause = 0;
  for (const element of byId('filters').querySelectorAll('input'))
    element.addEventListener('input', () => { clearTimeout(pause); pause = setTimeout(show, 120); });
  byId('filters').addEventListener('submit', (event) => event.preventDefault());
  byId('filters').addEventListener('reset', () => setTimeout(show, 0));
  byId('notes').replaceChildren(...[
    `${counted(run.drawings.ofRow.size)} decisions have their tube on this page, or the reason why they have none: the last certified ones and the last abstentions.`,
    'Outlines are drawn to within half a percent of their size; the certificate is about the exact sets.',
    ...(before ? ['The figures before pass the same filters, except the time.'] : []),
    ...[data.run, data.before].filter((side) => side?.damaged_places).map((side) => `${side.name}: the logs are damaged in ${counted(side.damaged_places)} places.`),
    ...data.run.notes, ...(data.before?.notes ?? [])].map((note) => make('li', note)));
  show();
  document.body.dataset.ready = 'yes';
};

start().catch((error) => {
  byId('problem').textContent = `This page cannot be shown: ${error.message}`;
  byId('problem').hidden = false;
  throw error;
});

})();
