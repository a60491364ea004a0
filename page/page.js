// The page of a run. Its data are columns of numbers and dictionaries of texts.
'use strict';
(() => {
const {OUTCOMES, INK, SOFT, outcomeLabel, outcomeColor, byId, make, counted, number, percent, duration, dateOf, timeText, clockText,
  listed, drawPart, drawChart, axis, legend, fillTable, fillList, fillCards, view, startView, drawTube, showLegend} = ForeReach;

// ---- Columns: base64 of zlib's format, each in an element of its own.
const ARRAYS = {u8: Uint8Array, i32: Int32Array, u32: Uint32Array, i64: BigInt64Array, f32: Float32Array, f64: Float64Array};
const packed = document.getElementsByClassName('column');

const bytesOf = (base64) => {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(base64);
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < bytes.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
};
const unpack = (column) => {
  const stream = new DecompressionStream('deflate'), writer = stream.writable.getWriter();
  for (const done of [writer.write(bytesOf(packed[column.data].textContent)), writer.close()]) done.catch(() => {});  // the reader is told
  return new Response(stream.readable).arrayBuffer();
};
const numbersIn = async (column) => new ARRAYS[column.type](await unpack(column));

// An object of columns with the same keys: {values, names?} or, of texts, {bytes, ends}.
const unpackTable = async (columns) => {
  const table = {};
  await Promise.all(Object.entries(columns).map(async ([name, column]) => {
    if (column.type === 'text')
      table[name] = {bytes: new Uint8Array(await unpack(column)), ends: await numbersIn(column.ends)};
    else
      table[name] = {values: await numbersIn(column), names: column.names};
  }));
  return table;
};
// Of 64-bit integers, by their halves, since big integers are slow.
const toNumbers = (bigs) => {
  const numbers = new Float64Array(bigs.length), low = new Uint32Array(bigs.buffer), high = new Int32Array(bigs.buffer);
  for (let i = 0; i < numbers.length; ++i) numbers[i] = 2 ** 32 * high[2 * i + 1] + low[2 * i];
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
// Columns of decisions that choices and figures need. The others follow when these are on the screen.
const FIRST = ['run', 'robot', 'utime', 'plan', 'source', 'outcome', 'cause', 'step', 'obstacle', 'elapsed', 'latency', 'config'];
const columnsOf = (raw, isFirst) =>
  Object.fromEntries(Object.entries(raw.decisions).filter(([name]) => FIRST.includes(name) === isFirst));

const loadRun = async (raw) => {
  const run = {raw, count: raw.count, decisions: await unpackTable(columnsOf(raw, true))};
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
  run.sorted = {};  // their times
  return run;
};

const loadRest = async (run) => {
  Object.assign(run.decisions, await unpackTable(columnsOf(run.raw, false)));
  run.drawings = await loadDrawings(run.raw.drawings);
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
      (plan !== null && d.plan.values[i] == plan) ? 1 : 0;
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
    const wanted = d[name].names.indexOf(filters[name]);
    for (let i = 0; i < run.count; ++i) if (values[i] !== wanted) shown[i] = 0;
  }
  run.size = 0;
  run.sorted = {};
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
const sortedOf = (run, name) => {
  if (run.sorted[name]) return run.sorted[name];
  const {values} = run.decisions[name], sorted = new Float64Array(run.size);
  let count = 0;
  for (let k = 0; k < run.size; ++k) {
    const value = values[run.rows[k]];
    // Zero: the simulated clock stops during computations. An hour or more: the log's clock stepped.
    if (value > 0 && value < 3.6e9) sorted[count++] = value;
  }
  return run.sorted[name] = sorted.subarray(0, count).sort();
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
const total = (shown) => shown.reduce((sum, x) => sum + x, 0);

const figuresOf = (run) => {
  const outcomes = countBy(run, run.decisions.outcome);
  const of = (name) => outcomes.get(name) ?? 0;
  const abstained = [...outcomes].filter(([name]) => name.startsWith('abstain')).reduce((sum, [, n]) => sum + n, 0);
  const latency = sortedOf(run, 'latency'), gate = sortedOf(run, 'elapsed');
  const kinds = countKinds(run.events, 'kind'), reasons = new Map();
  const first = [], stepped = [];
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], latency = run.decisions.latency.values[i];
    if (latency < 0 || latency >= 3.6e9) stepped.push(run.time[i]);
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
  const inside = kinds.get('step_inside') ?? 0, consistent = kinds.get('step_consistent') ?? 0;
  const steps = inside + consistent + (kinds.get('step_outside') ?? 0);
  const times = (sorted) => (sorted.length ? `p99 ${duration(quantile(sorted, .99))}, most ${duration(sorted.at(-1))}` : 'not measured');
  return [
    ['Decisions', counted(run.size), run.size === run.count ? 'all' : `of ${counted(run.count)}`],
    ['Certified', percent(of('certified'), run.size), `${counted(of('certified'))}, if the declaration is true`],
    ['Abstained', percent(abstained, run.size),
      [...outcomes].filter(([name]) => name.startsWith('abstain')).map(([name, n]) => `${outcomeLabel(name).replace(/^abstain,? /, '')} ${counted(n)}`).join(', ')],
    ['Rejected', percent(of('rejected'), run.size), counted(of('rejected'))],
    ['First step that fails', first.length ? `${quantile(first, .5)}` : '\u2013',
      first.length ? `median; from ${first[0]} to ${first.at(-1)}` : 'no abstention names a step'],
    ['Latency', duration(quantile(latency, .5)), `median; ${times(latency)}${
      stepped.length ? `; ${counted(stepped.length)} left out, since the log's clock stepped at ${timeText(stepped[0])}` : ''}`],
    ['Gate', duration(quantile(gate, .5)), `median; ${times(gate)}`],
    ['Steps in their slice', steps > 0 ? percent(inside, steps) : '\u2013',
      `${counted(inside)} of ${counted(steps)}${consistent ? `; ${counted(consistent)} consistent (within the state error)` : ''}`],
    ['Withdrawals', counted(total(run.withdrawals.shown)), listed(countKinds(run.withdrawals, 'kind'))],
    ['Faults', counted(total(run.faults.shown)), listed(countKinds(run.faults, 'kind'))],
    ['Messages lost', counted(lost), `${counted(total(run.gaps.shown))} gaps${reasons.size ? `: ${listed(reasons)}` : ''}`],
  ];
};

const showFigures = (run, before) => {
  const old = before ? figuresOf(before) : null;
  fillCards(figuresOf(run), (k) => {
    if (!old) return [];
    const dd = make('dd', 'before: ', 'before');
    dd.append(make('b', old[k][1]), old[k][2] ? ` (${old[k][2]})` : '');
    return [dd];
  });
};

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

const causesOf = (run) => {
  const d = run.decisions, counts = new Map();
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], outcome = nameAt(d.outcome, i), cause = nameAt(d.cause, i);
    if (outcome === 'certified') continue;
    const entry = counts.get(cause) ?? {cause, outcome, count: 0};
    ++entry.count;
    counts.set(cause, entry);
  }
  return counts;
};
// Beside a run before, shares: the runs differ in length.
const showCauses = (run, before) => {
  const counts = causesOf(run), old = before ? causesOf(before) : new Map();
  for (const entry of old.values()) if (!counts.has(entry.cause)) counts.set(entry.cause, {...entry, count: 0});
  const entries = [...counts.values()].sort((a, b) => b.count - a.count).slice(0, 12);
  const value = (count, whole) => (before ? 100 * count / Math.max(whole, 1) : count);
  const sets = [{label: 'this run', data: entries.map((e) => value(e.count, run.size)), backgroundColor: entries.map((e) => outcomeColor(e.outcome)), maxBarThickness: 22}];
  if (before) sets.push({label: 'before', data: entries.map((e) => value(old.get(e.cause)?.count ?? 0, before.size)), backgroundColor: '#c3c8cf', maxBarThickness: 22});
  drawChart('causes', `Causes: ${entries.map((e) => `${e.cause} ${e.count}`).join(', ') || 'none'}`, {
    type: 'bar',
    data: {labels: entries.map((e) => e.cause.replaceAll('_', ' ')),
      datasets: sets},
    options: {indexAxis: 'y', plugins: {legend: legend(Boolean(before))},
      scales: {x: axis(before ? '% of the decisions' : 'decisions', {beginAtZero: true}), y: axis('', {title: {display: false}, grid: {display: false}})},
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
  const sides = [['Latency', sortedOf(run, 'latency'), '#0072B2'],
    ['Gate', sortedOf(run, 'elapsed'), '#D55E00']];
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

const MOST_GROUPS = 8;
// By text, so that groups of two runs are the same.
const groupsOf = (run, name) => {
  const d = run.decisions, groups = new Map();
  for (let k = 0; k < run.size; ++k) {
    const i = run.rows[k], value = d[name].values[i];
    const group = groups.get(value) ?? {count: 0, certified: 0};
    ++group.count;
    if (nameAt(d.outcome, i) === 'certified') ++group.certified;
    groups.set(value, group);
  }
  return new Map([...groups].map(([value, group]) => [d[name].names[value], group]));
};
const showGroups = (run, before, id, caption, name, label) => {
  const old = before ? groupsOf(before, name) : null, groups = groupsOf(run, name);
  for (const key of old?.keys() ?? []) if (!groups.has(key)) groups.set(key, {count: 0, certified: 0});
  const all = [...groups].sort((a, b) => b[1].count - a[1].count);
  const rows = all.slice(0, MOST_GROUPS).map(([key, {count, certified}]) => {
    const button = make('button', label(key));
    button.type = 'button';
    button.addEventListener('click', () => setChoice(name, key));
    const bar = make('span', undefined, 'bar'), filled = make('i');
    filled.style.width = `${count > 0 ? 100 * certified / count : 0}%`;
    bar.append(filled);
    const then = old?.get(key);
    return [button, counted(count), percent(certified, count), bar, ...(old ? [then ? `${percent(then.certified, then.count)} of ${counted(then.count)}` : '\u2013'] : [])];
  });
  if (all.length > MOST_GROUPS) rows.push([`and ${counted(all.length - MOST_GROUPS)} others`, '', '', '', ...(old ? [''] : [])]);
  fillTable(byId(id), caption, ['', 'decisions', 'certified', '', ...(old ? ['certified before'] : [])], rows, [1, 2, 4]);
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
  {id: 'obstacle', title: 'Obstacle', rare: true, text: (run, i) => nameAt(run.decisions.obstacle, i), names: 'obstacle'},
  {id: 'clearance', title: 'Margin', rare: true, number: true, text: (run, i) => number(clearanceAt(run.decisions, i), 4),
    key: (run) => Float64Array.from({length: run.count}, (_, i) => clearanceAt(run.decisions, i))},
  {id: 'latency', title: 'Latency', rare: true, number: true, key: (run) => run.decisions.latency.values, text: (run, i) => duration(run.decisions.latency.values[i])},
  {id: 'message', title: 'Sentence', rare: true, text: (run, i) => textAt(run.decisions.message, i)},
];
const narrow = matchMedia('(max-width: 46rem)');
// Of a long number, as a planner makes of the time, the digits that differ.
const lastDigits = (text) => (text.length > 8 ? `\u2026${text.slice(-7)}` : text);
const indexText = (index) => (index < 0 ? '' : String(index));
const rowHeight = () => (narrow.matches ? 40 : 30);
const MOST_PIXELS = 12e6;  // browsers lay out no more than about 16 million

const byName = (a, b) => a.localeCompare(b, 'en', {numeric: true}) || (a < b ? -1 : 1);
const sortKey = (run, column) => {
  run.keys ??= {};
  if (run.keys[column.id]) return run.keys[column.id];
  if (!column.names) return run.keys[column.id] = column.key(run);
  const {values, names} = run.decisions[column.names];
  const ranks = new Uint32Array(names.length);
  names.map((_, k) => k).sort((a, b) => byName(names[a], names[b])).forEach((k, rank) => { ranks[k] = rank; });
  return run.keys[column.id] = values.map((value) => ranks[value]);
};
// Rows without a value come last, whatever the direction; equal ones in the order of the log.
const sortRows = (run) => {
  const key = sortKey(run, COLUMNS.find((column) => column.id === grid.sort)), sign = grid.falls ? -1 : 1;
  grid.order = run.rows.slice(0, run.size);
  if (grid.order.every((row, k) => k === 0 || sign * key[grid.order[k - 1]] <= sign * key[row])) return;
  grid.order.sort((a, b) => {
    const x = key[a], y = key[b];
    return x < y ? -sign : x > y ? sign : x === y ? a - b : Number.isNaN(x) - Number.isNaN(y) || a - b;
  });
};

const showHead = (run) => {
  byId('head').replaceChildren(...COLUMNS.map((column) => {
    const isSorted = grid.sort === column.id, isSortable = column.key || column.names;
    const cell = make(isSortable ? 'button' : 'span', column.title + (isSorted ? (grid.falls ? ' \u25be' : ' \u25b4') : ''),
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

const showRows = (run) => drawPart('the decisions', ['grid'], () => {
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
});

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
  const texts = JSON.parse(decoder.decode(await unpack(raw.texts))), {svg} = await unpackTable({svg: raw.svg});
  texts.details.forEach((detail, i) => { detail.place = i; });
  const byRow = (all) => new Map(all.map((each) => [each.row, each]));
  return {ofRow: byRow(texts.details), adviceOf: byRow(texts.advice), svgOf: (detail) => textAt(svg, detail.place)};
};

// ---- The detail of a decision.
// The name of the coordinate that an abstention is about.
const coordinateText = (d, i, task) => {
  const k = d.coordinate.values[i], cause = nameAt(d.cause, i);
  if (k < 0) return '';
  if (cause === 'limit') return `limit ${k}`;
  return task ? [...task.states, ...task.inputs][k] ?? `row ${k - task.states.length - task.inputs.length}` : String(k);
};

const showEnvelope = (detail, task) => {
  const [lower, upper] = detail?.hull ?? [[], []], [low, up] = detail?.envelope ?? [[], []];
  byId('envelope').hidden = lower.length === 0;
  if (lower.length === 0) return;
  const range = (a, b) => (a === undefined ? '' : `${number(a, 4)} \u2026 ${number(b, 4)}`);
  const nearest = (k) => (detail.nearest[k] >= 0 ? `${detail.nearest[k]}, \u00b1${number(detail.nearest_distance[k], 3)} by its distance` : '');
  fillTable(byId('envelope'), `At step ${detail.binding}`, ['state', 'slice', 'envelope of the residual', 'nearest observation'],
    lower.map((_, k) => [task?.states[k] ?? String(k), range(lower[k], upper[k]), range(low[k], up[k]), nearest(k)]));
};

const showAdvice = (run, i, advise) => {
  const advice = run.drawings.adviceOf.get(i), box = byId('advice');
  box.hidden = nameAt(run.decisions.outcome, i) === 'certified';
  const sentence = (text) => `${text[0].toUpperCase()}${text.slice(1)}`;
  const parts = (advice?.groups ?? []).map(([heading, isFolded, clauses]) => {
    const group = make(isFolded ? 'details' : 'div'), list = make('ul');
    list.append(...clauses.map((clause) => make('li', clause)));
    group.append(make(isFolded ? 'summary' : 'p', sentence(heading)), list);
    return group;
  });
  if (advice?.missing) parts.unshift(make('p', sentence(advice.missing)));
  if (!advice) parts.push(make('p', advise ? `This page has advice on the last decisions only. This command prints the advice on all: ${advise}` : 'Its log was not read.'));
  else if (parts.length === 0) parts.push(make('p', 'No change of one kind would have turned it.'));
  byId('advice-lines').replaceChildren(...parts);
};

const showDetail = (run, i) => drawPart('the chosen decision', ['detail'], () => {
  const d = run.decisions, detail = run.drawings.ofRow.get(i);
  const config = nameAt(d.config, i), task = run.raw.tasks.find((each) => each.digest === config);
  const outcome = nameAt(d.outcome, i), cause = nameAt(d.cause, i), digest = hexAt(d.digest.values, i);
  const hasDrawing = Boolean(detail?.frame && !detail.missing);
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
    ['Obstacle', nameAt(d.obstacle, i)],
    ['Part of the body', detail?.part >= 0 && run.raw.tasks[detail.task]?.parts > 1 ? String(detail.part) : ''],
    ['Coordinate', coordinateText(d, i, task)],
    ['Observations', d.first.values[i] < 0 ? '' : d.second.values[i] < 0 ? `${d.first.values[i]} contradicts a bound` :
      `${d.first.values[i]} and ${d.second.values[i]} contradict each other`],
    ['Value, bound', `${number(margin)}, ${number(threshold)}; margin ${number(margin - threshold)}`],
    ['Task', task ? `${task.name}; certificates hold ${task.holds === 'all_times' ? 'at all times' : 'at the samples'}` : 'not known'],
    ['Log', `${nameAt(d.log, i)} event ${d.event.values[i]}`],
  ]);
  showEnvelope(detail, task);
  const replay = run.raw.runs[d.run.values[i]]?.replays?.[nameAt(d.log, i)];
  byId('command').textContent = replay ? `${replay} --plan-digest ${digest}` : 'Its log was not read.';
  showAdvice(run, i, replay?.replace(/^forereach replay/, 'forereach advise'));
  fillList('digests', [['candidate', digest], ['task', config], ...['model', 'declaration', 'observations', 'obstacles'].map((name) => [name, nameAt(d[name], i)])]);
  byId('stage').hidden = byId('step').closest('.steer').hidden = byId('legend').hidden = !hasDrawing;
  byId('missing').textContent = hasDrawing ? '' : `No drawing: ${detail ? detail.missing || 'it has no tube' :
    outcome === 'certified' || /safety|domain|falsified/.test(outcome) ? 'the page has the tubes of the last decisions only' : 'it was answered without a tube'}.`;
  view.detail = view.whole = null;
  if (!hasDrawing) return;
  showLegend(outcomeColor(outcome), detail);
  drawTube(detail, run.drawings.svgOf(detail), outcomeColor(outcome));
});

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
    config: (digest) => taskLabel(run, digest), obstacle: (name) => name || 'none'};
  const fill = (name, values) => byId(`f-${name}`).replaceChildren(make('option', 'all'), ...values.map((value) => {
    const option = make('option', labels[name](value));
    option.value = String(value);
    return option;
  }));
  for (const name of CHOICES)
    fill(name, [...run.decisions[name].names].sort(byName));
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
  byId('main').hidden = false;
  const from = run.time.reduce((a, b) => Math.min(a, b), Infinity), to = run.time.reduce((a, b) => Math.max(a, b), -Infinity);
  byId('what').textContent = `${data.run.name}: ${counted(run.count)} decisions` +
    (run.count ? `, ${timeText(from)} to ${timeText(to)} UTC` : '') + (before ? `. Before: ${data.before.name}` : '');
  document.title = `ForeReach report: ${data.run.name}`;
  byId('shadow').textContent = data.run.shadow;
  byId('shadow').hidden = !data.run.shadow;
  fillChoices(run);
  const groups = [['robot', 'By robot', (name) => name || '(no name)'], ['source', 'By source', (name) => name || '(no name)'],
    ['config', 'By task, with its config digest', (digest) => taskLabel(run, digest)],
    ['obstacle', 'By the obstacle that decided', (name) => name.replace(/^(?=\d)/, 'obstacle ') || 'none']];
  const choosePassing = () => {
    const filters = readFilters();
    select(run, filters);
    if (before) select(before, filters, {withTime: false});
    byId('shown').textContent = `${counted(run.size)} of ${counted(run.count)} decisions`;
  };
  const showSummary = () => {
    if (!drawPart('what passes the filters', ['main'], choosePassing)) return;
    drawPart('the figures', ['figures'], () => showFigures(run, before));
    drawPart('the trend', ['trend'], () => showTrend(run));
    drawPart('the causes', ['causes'], () => showCauses(run, before));
    drawPart('the steps', ['steps'], () => showSteps(run));
    drawPart('the times', ['tail', 'times'], () => showTimes(run));
    for (const [name, caption, label] of groups)
      drawPart(`the decisions by ${name}`, [`by-${name}`], () => showGroups(run, before, `by-${name}`, caption, name, label));
    drawPart('the other records', OTHERS, () => showOthers(run));
  };
  const showDecisions = () => {
    sortRows(run);
    byId('grid').scrollTop = 0;
    if (run.size === 0) grid.chosen = -1;
    showRows(run);
    byId('detail').hidden = run.size === 0;
    if (run.size > 0) choose(run, Math.max(0, placeOfChosen()), {scroll: placeOfChosen() >= 0});
  };
  show = () => {
    showSummary();
    showDecisions();
  };
  showSummary();
  await new Promise((done) => setTimeout(done, 0));  // on the screen
  await loadRest(run);
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
    `${counted(run.drawings.adviceOf.size)} have what would have helped them: the last that were not certified.`,
    'Outlines are drawn to within half a percent of their size; the certificate is about the exact sets.',
    ...(before ? ['The figures before pass the same filters, except the time.'] : []),
    ...[data.run, data.before].filter((side) => side?.damaged_places).map((side) => `${side.name}: the logs are damaged in ${counted(side.damaged_places)} places.`),
    ...data.run.notes, ...(data.before?.notes ?? [])].map((note) => make('li', note)));
  showDecisions();
  byId('main').inert = false;
  document.body.dataset.ready = 'yes';
};

start().catch((error) => {
  byId('problem').textContent = `This page cannot be shown: ${error.message}`;
  byId('problem').hidden = false;
  throw error;
});

})();
