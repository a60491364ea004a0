// The live page: what `forereach live` sends on /events, as it is now.
'use strict';
(() => {
const {OUTCOMES, EXECUTED, INK, SOFT, outcomeLabel, outcomeColor, byId, make, counted, number, percent, duration, clockText,
  listed, tell, drawPart, drawChart, axis, legend, fillTable, fillList, fillCards, view, wholeOf, showView, startView, drawTube, fillLegend, showLegend} = ForeReach;

const MOST = {decisions: 120, faults: 60, withdrawals: 60, events: 60, gaps: 60, places: 600};
const REFUSED_US = 3e6;  // as long is an abstention drawn
const SILENT_US = 2e6;  // the certifier's heartbeat comes twice a second
const state = {beginning: null, now: null, obstacles: '', chosen: null, heard: 0};
for (const name of Object.keys(MOST)) state[name] = [];

const followed = () => state.chosen === null;
const age = (heard) => state.now.utime - heard;

// ---- The state of the processes.
const showState = () => {
  const {now} = state, {certifier} = now, isSilent = !certifier || age(certifier.heard) > SILENT_US;
  byId('state').dataset.level = isSilent ? 'silent' : certifier.level;
  byId('level').textContent = isSilent ? 'No heartbeat' : certifier.level;
  const words = [];
  if (!certifier) words.push('no certifier has been heard');
  else {
    if (isSilent) words.push(`for ${(age(certifier.heard) / 1e6).toFixed(0)} s; the last was ${certifier.level}`);
    words.push(certifier.state);
    if (certifier.fault) words.push(`fault ${certifier.fault.replaceAll('_', ' ')}`, `on disk: ${certifier.latch}`);
    if (certifier.shadow) words.push('shadow mode: it certifies nothing');
    words.push(`${counted(certifier.obstacles.in_force)} obstacles in force${certifier.obstacles.known ? '' : ', not all are known'}`);
    words.push(`${counted(certifier.observations)} observations, version ${certifier.version}`);
  }
  byId('certifier').textContent = words.join('; ');
  byId('certifier-message').textContent = certifier?.message ?? '';
  byId('advice').textContent = certifier?.advice ? `What to do: ${certifier.advice}` : '';
  const refused = Object.entries(now.refused).filter(([, n]) => n > 0);
  const trust = [];
  if (!now.signed) trust.push('UNSIGNED: anyone on this network can move this robot, and can make this page show what he likes.');
  if (refused.length) trust.push(`Not authentic and not shown: ${refused.map(([name, n]) => `${counted(n)} ${name.replaceAll('_', ' ')}`).join(', ')}.`);
  if (now.note) trust.push(`${now.note}.`);
  byId('trust').textContent = trust.join(' ');
  byId('trust').hidden = trust.length === 0;
};

const showFigures = () => {
  const {counts, certifier, logger} = state.now, outcomes = counts.by_outcome ?? {};
  const of = (wanted) => Object.entries(outcomes).filter(([name]) => wanted(name)).reduce((sum, [, n]) => sum + n, 0);
  const abstained = of((name) => name.startsWith('abstain')), certified = outcomes.certified ?? 0;
  fillCards([
    ['Decisions', counted(counts.decisions), counts.not_shown > 0 ? `${counted(counts.not_shown)} too fast to be listed` : ''],
    ['Certified', percent(certified, counts.decisions), `${counted(certified)}, if the declaration is true`],
    ['Abstained', counted(abstained), listed(new Map(Object.entries(counts.by_cause ?? {}).map(([name, n]) => [name.replaceAll('_', ' '), n])))],
    ['Rejected', counted(outcomes.rejected ?? 0), ''],
    ['Gate', certifier ? duration(certifier.elapsed_us.p50) : '\u2013', certifier ? `median; p99 ${duration(certifier.elapsed_us.p99)}` : ''],
    ['Messages lost', counted(counts.lost), `${counted(counts.gaps)} gaps; here ${counted(counts.dropped)} dropped`],
    ['Unreadable', counted(counts.undecodable), `messages; ${counted(counts.datagrams_refused)} datagrams`],
    ['Logger', !logger ? '\u2013' : age(logger.heard) > SILENT_US ? 'silent' : logger.level, logger ? `${counted(logger.lost)} events lost` : 'not heard'],
  ]);
  const {robot} = state.now;
  fillList('facts', robot ? [
    ['Mode', robot.mode],
    ['Plan', robot.plan === '-1' ? 'none' : `${robot.plan}, step ${robot.step}`],
    ['State', robot.state.map((x, k) => `${state.beginning.states[k] ?? k} ${number(x, 4)}`).join(', ')],
    ['Measured', `${clockText(robot.utime)} UTC${age(robot.heard) > 1e6 ? `, ${(age(robot.heard) / 1e6).toFixed(0)} s ago` : ''}`],
  ] : [['State', 'not heard']]);
};

const BIN_US = 4e6, BINS = 30;
const showTrend = () => {
  const end = Math.ceil(state.now.utime / BIN_US), counts = new Map();
  for (const {utime, outcome} of state.trend) {
    const bin = BINS - 1 - (end - 1 - Math.floor(utime / BIN_US));
    if (bin < 0 || bin >= BINS) continue;
    if (!counts.has(outcome)) counts.set(outcome, new Array(BINS).fill(0));
    ++counts.get(outcome)[bin];
  }
  const names = Object.keys(OUTCOMES).filter((name) => counts.has(name));
  drawChart('trend', `Decisions of the last two minutes: ${names.map((name) => `${outcomeLabel(name)} ${counts.get(name).reduce((a, b) => a + b, 0)}`).join(', ') || 'none'}`, {
    type: 'bar',
    data: {labels: Array.from({length: BINS}, (_, k) => `${(k - BINS) * BIN_US / 1e6} s`),
      datasets: names.map((name) => ({label: outcomeLabel(name), data: counts.get(name), backgroundColor: outcomeColor(name), stack: 'all', barPercentage: 1, categoryPercentage: .94}))},
    options: {plugins: {legend: legend(true)},
      scales: {x: axis('', {stacked: true, title: {display: false}, ticks: {color: SOFT, maxRotation: 0, autoSkipPadding: 30}, grid: {display: false}}),
        y: axis('decisions', {stacked: true, beginAtZero: true, ticks: {color: SOFT, precision: 0}})}},
  });
};

// ---- Tables.
const showDecisions = () => {
  const rows = state.decisions.slice(-60).reverse();
  fillTable(byId('decisions'), '', ['Time (UTC)', 'Outcome', 'Cause', 'Step', 'Plan', 'Took', 'Sentence'], rows.map((decision) => {
    const button = make('button', clockText(decision.utime)), outcome = make('span'), chip = make('i', undefined, 'chip');
    button.type = 'button';
    button.dataset.key = decision.key;
    chip.style.background = outcomeColor(decision.outcome);
    outcome.append(chip, outcomeLabel(decision.outcome));
    return [button, outcome, decision.cause === 'none' ? '' : decision.cause.replaceAll('_', ' '), decision.step < 0 ? '' : String(decision.step),
      `${decision.plan.slice(-7)} ${decision.source}`, duration(decision.elapsed), decision.message];
  }));
  markChosen();
};
const markChosen = () => {
  for (const button of byId('decisions').querySelectorAll('button'))
    button.closest('tr').classList.toggle('chosen', Number(button.dataset.key) === state.chosen?.key);
};
const showOthers = () => {
  const table = (id, caption, heads, line) =>
    fillTable(byId(id), `${caption}: ${counted(state[id].length)}${state[id].length >= MOST[id] ? ' or more' : ''}`, heads, state[id].slice(-20).reverse().map(line));
  table('faults', 'Faults', ['Time', 'Fault', 'Sentence'], (row) => [clockText(row.utime), row.kind, row.message]);
  table('withdrawals', 'Withdrawals', ['Time', 'Plan', 'Cause', 'Sentence'], (row) => [clockText(row.utime), row.plan, row.kind, row.message]);
  table('gaps', 'Gaps', ['Time', 'Channel', 'Reason', 'Lost'], (row) => [clockText(row.utime), `${row.channel} ${row.source}`, row.reason, row.lost]);
  table('events', 'What the robot did', ['Time', 'Event', 'Plan', 'Sentence'], (row) => [clockText(row.utime), row.kind.replaceAll('_', ' '), row.plan, row.message]);
};

// ---- The drawing: around the robot now, or a decision that was chosen.
const hasTube = (decision) => Boolean(decision?.detail.frame);
const newest = (passes) => state.decisions.findLast((decision) => hasTube(decision) && passes(decision));

const choose = (decision) => {
  state.chosen = decision;
  byId('follow').setAttribute('aria-pressed', String(followed()));
  byId('step').closest('.slider').hidden = followed();
  byId('missing').textContent = '';
  view.detail = view.whole = null;
  byId('svg').replaceChildren();
  markChosen();
  draw('the drawing');
};
const showDrawing = () => {
  const decision = state.chosen;
  if (followed()) {
    showNow();
    return;
  }
  byId('shows').textContent = `Decision of ${clockText(decision.utime)}: ${decision.message}`;
  if (decision.detail.missing) byId('missing').textContent = `${hasTube(decision) ? 'Drawn are' : 'No drawing'}: ${decision.detail.missing}.`;
  if (!hasTube(decision)) return;
  drawTube(decision.detail, decision.detail.svg, outcomeColor(decision.outcome));
  showLegend(outcomeColor(decision.outcome), decision.detail);
};

const follow = {size: 0};
const moveView = ([x, y], size) => {
  if (!(size <= follow.size && follow.size <= 3 * size)) follow.size = 2 * Math.max(size, .5);
  const whole = {x: x - follow.size, y: -y - .6 * follow.size, width: 2 * follow.size, height: 1.2 * follow.size};
  if (view.whole && view.whole.width === whole.width) {  // as far as the robot has moved, so that panning and zooming stay
    view.x += whole.x - view.whole.x;
    view.y += whole.y - view.whole.y;
  } else {
    Object.assign(view, whole);
  }
  view.whole = whole;
};

const showNow = () => {
  const {robot, utime} = state.now;
  const running = robot && newest((decision) => decision.outcome === 'certified' && decision.plan === robot.plan);
  const last = newest(() => true);
  // The planner answers an abstention at once: the newest plan is mostly another one.
  const refused = newest((decision) => decision.outcome.startsWith('abstain') && utime - decision.utime < REFUSED_US);
  const tubes = [...new Set([refused, last, running].filter(Boolean))];  // the last is on top
  const frame = last && wholeOf(last.detail);
  const center = robot?.at ?? (frame && [frame.x + frame.width / 2, -frame.y - frame.height / 2]);
  if (!center) {
    byId('shows').textContent = state.beginning.planar ? 'Neither a robot nor a tube has been heard of yet.' : 'The safety coordinates of this task are not planar: no drawing.';
    return;
  }
  const svg = byId('svg'), colorOf = (tube) => (tube === running ? EXECUTED : outcomeColor(tube.outcome));
  moveView(center, Math.max(...tubes.map(({detail: {frame: [, , width, height]}}) => Math.max(width, height) / 1.3), 1));
  svg.innerHTML = state.obstacles + tubes.map(({detail}) => `<g class="glance">${detail.svg}</g>`).join('') +
    `<polyline class="driven" points="${state.places.map(([x, y]) => `${Number(x)},${-y}`).join(' ')}"/>` + (robot?.svg ?? '');
  [...svg.querySelectorAll('.glance')].forEach((group, k) => group.style.setProperty('--tube', colorOf(tubes[k])));
  svg.querySelectorAll(':scope > .scene .obstacle')[refused?.obstacle ?? -1]?.classList.add('binding');
  byId('shows').textContent = last ? `The newest decision: ${last.message}` : '';
  showView();
  fillLegend([['#6b7280', 'obstacles now, and where they will be'], [INK, 'the robot and its path'], ...tubes.reverse().map((tube) =>
    [colorOf(tube), tube === running ? 'the certified plan that it executes' : tube === last ? `the newest plan: ${outcomeLabel(tube.outcome)}` : `the newest plan that is not certified: ${outcomeLabel(tube.outcome)}`])]);
};

// ---- News.
const PARTS = {
  'the state': [['state', 'trust'], showState],
  'the figures': [['figures', 'facts'], showFigures],
  'the trend': [['trend'], showTrend],
  'the decisions': [['decisions'], showDecisions],
  'the other records': [['faults', 'withdrawals', 'gaps', 'events'], showOthers],
  'the drawing': [['drawing'], showDrawing],
};
const due = new Set();  // those that could not be drawn: with the next news again
const draw = (...names) => {
  for (const name of names)
    if (drawPart(name, ...PARTS[name])) due.delete(name); else due.add(name);
};

let key = 0;
const take = (news) => {
  state.now = news.now;
  if (news.obstacles) state.obstacles = news.obstacles;
  for (const decision of news.decisions ?? []) {
    decision.key = ++key;
    state.trend.push({utime: decision.utime, outcome: decision.outcome});
  }
  state.trend = state.trend.slice(-5000);
  for (const [name, most] of Object.entries(MOST)) if (news[name]) state[name] = state[name].concat(news[name]).slice(-most);
  state.heard = performance.now();
  const names = new Set(['the state', 'the figures', 'the trend', ...due]);
  if (news.decisions) names.add('the decisions');
  if (news.faults || news.withdrawals || news.events || news.gaps) names.add('the other records');
  if (followed()) names.add('the drawing');
  draw(...names);
  document.body.dataset.ready = 'yes';
};

const problem = (text) => {
  tell('the connection', text);
  document.body.classList.toggle('lost', Boolean(text));
};

const start = () => {
  state.beginning = JSON.parse(byId('data').textContent);
  state.trend = [];
  byId('what').textContent = `${state.beginning.robot ? `${state.beginning.robot}: ` : ''}${state.beginning.model}, ${state.beginning.task} on ${state.beginning.url}; certificates hold ${state.beginning.holds === 'all_times' ? 'at all times' : 'at the samples'}`;
  startView();
  byId('step').closest('.slider').hidden = true;
  byId('follow').addEventListener('click', () => { if (state.now) choose(null); });
  byId('decisions').addEventListener('click', (event) => {
    const button = event.target.closest('button');
    const decision = button && state.decisions.find((each) => each.key === Number(button.dataset.key));
    if (decision) choose(decision);
  });
  showOthers();
  const source = new EventSource('/events');
  source.addEventListener('open', () => {  // everything is sent again
    for (const name of Object.keys(MOST)) state[name] = [];
    state.trend = [];
    problem('');
  });
  source.addEventListener('message', (event) => drawPart('anything', ['main'], () => take(JSON.parse(event.data))));
  // What is not fresh is not shown as if it were.
  const check = () => {
    const seconds = (performance.now() - state.heard) / 1000;
    if (seconds > 2) problem(`The connection to forereach live is lost: what you see is ${state.heard ? `${seconds.toFixed(0)} s old` : 'nothing yet'}.`);
    else problem('');
  };
  setInterval(check, 500);
};

start();

})();
