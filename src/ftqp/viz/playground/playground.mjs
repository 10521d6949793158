// playground.mjs - a planner leads an arm in a page; the page is viser's client, to which this script sends what to draw.
import { Planner } from './ftqp.mjs'; // in the page, the text of that file stands before what follows
// ---
const page = JSON.parse(document.getElementById('ftqp-playground').textContent);
const { joints, nodes, looks, dt } = page, n = joints.length;
const HEALTHY = 0, LOCKED = 1, RAMP = 0.25; // a brake closes with a quarter of the acceleration limit, as planners assume
const LONGEST = 0.05; // seconds that one picture makes up for, at most
const SHARP = 5; // 1/s: how a dragged target comes to rest
const THERE = 1e-6; // a target so near to where its path begins is there
const HISTORY = 200, FLOOR = -6, CEILING = 0; // of the curve of errors: tenths of a second, powers of ten of a metre

// ---- vectors and quaternions w, x, y, z
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const norm = (a) => Math.hypot(...a);
const sum = (a, b, s = 1) => a.map((x, k) => x + s * b[k]);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const times = ([w, ...u], [s, ...v]) =>
  [w * s - u[0] * v[0] - u[1] * v[1] - u[2] * v[2], ...cross(u, v).map((x, k) => x + w * v[k] + s * u[k])];
const turned = ([w, ...u], v) => { const c = cross(u, v); return sum(sum(v, c, 2 * w), cross(u, c), 2); };
const inverse = ([w, ...u]) => [w, ...u.map((x) => -x)];
const unit = (a) => { const length = norm(a); return a.map((x) => x / length); };
const turn = (r) => { const a = norm(r), s = a > 1e-9 ? Math.sin(a / 2) / a : 0.5; return [Math.cos(a / 2), ...r.map((x) => s * x)]; };
const way = (from, to) => { // the rotation vector from one quaternion to another
  let [w, ...u] = times(to, inverse(from));
  if (w < 0) [w, u] = [-w, u.map((x) => -x)];
  const s = norm(u), f = s > 1e-12 ? 2 * Math.atan2(s, w) / s : 2;
  return u.map((x) => f * x);
};
const matrix = ([w, x, y, z], p) => [
  1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), p[0],
  2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x), p[1],
  2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y), p[2], 0, 0, 0, 1,
];

// ---- the picture of a joint's frame in that of its parent, and where the tip is
function local(i, q) {
  const home = page.home[i].slice(0, 4), place = page.home[i].slice(4);
  return page.prismatic[i] ? [home, sum(place, turned(home, [0, 0, q]))] : [times(home, turn([0, 0, q])), place];
}
function tipOf(q) {
  let place = page.tip.slice(4);
  for (let i = page.tip_joint; i >= 0; i = page.parent[i]) { const [w, p] = local(i, q[i]); place = sum(p, turned(w, place)); }
  return place;
}

// ---- what leads the tip: the path, or a hand, or the way back to the path
const path = page.path && { lap: page.path.lap, rows: new Float64Array(bytes(page.path.rows).buffer) };
const start = { turn: page.pose.slice(0, 4), place: page.pose.slice(4) };
const still = [0, 0, 0];

function quintic(p0, v0, a0, p1, v1, a1, h, t) {
  const s = t / h, place = [], speed = [], acceleration = [];
  for (let k = 0; k < 3; k++) {
    const d = p1[k] - p0[k] - v0[k] * h - a0[k] * h * h / 2, e = (v1[k] - v0[k] - a0[k] * h) * h, f = (a1[k] - a0[k]) * h * h;
    const c = 10 * d - 4 * e + f / 2, b = -15 * d + 7 * e - f, a = 6 * d - 3 * e + f / 2;
    place.push(p0[k] + v0[k] * t + a0[k] * t * t / 2 + s ** 3 * (c + s * (b + s * a)));
    speed.push(v0[k] + a0[k] * t + s * s * (3 * c + s * (4 * b + s * 5 * a)) / h);
    acceleration.push(a0[k] + s * (6 * c + s * (12 * b + s * 20 * a)) / (h * h));
  }
  return [place, speed, acceleration];
}

function along(t) { // the target on the path at a time of its lap
  if (!path) return { ...start, speed: still, spin: still, acceleration: still, spinUp: still };
  const last = path.rows.length / 19 - 1, h = path.lap / last, k = Math.min(Math.floor(t / h), last - 1);
  const row = (k) => Array.from(path.rows.subarray(19 * k, 19 * k + 19));
  const a = row(k), b = row(k + 1), part = (x, at) => x.slice(at, at + 3), from = a.slice(3, 7);
  const [place, speed, acceleration] = quintic(part(a, 0), part(a, 7), part(a, 13), part(b, 0), part(b, 7), part(b, 13), h, t - k * h);
  const [r, spin, spinUp] = quintic(still, part(a, 10), part(a, 16), way(from, b.slice(3, 7)), part(b, 10), part(b, 16), h, t - k * h);
  return { place, turn: times(turn(r), from), speed, spin, acceleration, spinUp };
}

function toward(gap, speed, [most, gather]) { // the next speed on the way, which ends at rest
  const far = norm(gap), fast = Math.min(most, Math.sqrt(gather * far), SHARP * far);
  const change = sum(far > 0 ? gap.map((x) => x * fast / far) : gap, speed, -1), size = norm(change);
  return size > gather * dt ? sum(speed, change, gather * dt / size) : sum(speed, change);
}

class Lead {
  constructor() { this.reset(); }
  reset() { this.t = 0; this.goal = null; this.back = false; this.target = along(0); }
  drag(goal) { this.goal = goal; this.back = false; }
  toPath() { if (this.goal) { this.goal = along(0); this.back = true; } }
  next() {
    if (!this.goal) {
      this.t += dt;
      if (path && this.t >= path.lap) this.t -= path.lap;
      this.target = along(this.t);
      return;
    }
    const now = this.target, gap = sum(this.goal.place, now.place, -1), round = way(now.turn, this.goal.turn);
    const speed = toward(gap, now.speed, page.hurry[0]), spin = toward(round, now.spin, page.hurry[1]);
    this.target = {
      place: sum(now.place, speed, dt), turn: unit(times(turn(spin.map((x) => x * dt)), now.turn)), speed, spin,
      acceleration: sum(speed, now.speed, -1).map((x) => x / dt), spinUp: sum(spin, now.spin, -1).map((x) => x / dt),
    };
    if (this.back && norm(gap) < THERE * page.size && norm(round) < THERE) { this.goal = null; this.back = false; this.t = 0; }
  }
}

// ---- the arms: one gets reports of what fails, one does not
class Arm {
  constructor(planner, reported) { this.planner = planner; this.reported = reported; this.reset(); }
  reset() {
    for (let i = 0; i < n; i++) this.planner.withdraw(i);
    this.q = page.q.slice();
    this.v = this.q.map(() => 0);
    this.planner.reset(this.q);
    this.status = 0;
  }
  take(other) { this.planner.take(other.planner); this.q = other.q.slice(); this.v = other.v.slice(); }
  step(pose, twist, acceleration) {
    this.status = this.planner.step(this.q, pose, { twist, acceleration });
    const command = this.planner.q;
    for (let i = 0; i < n; i++) this.v[i] = (this.obeys(i, command[i]) - this.q[i]) / dt;
    for (let i = 0; i < n; i++) this.q[i] += this.v[i] * dt;
    if (this.reported) this.q = Array.from(command);
  }
  obeys(i, command) { // where a joint is a tick later
    if (truth[i] === LOCKED) { const v = this.v[i]; return this.q[i] + dt * Math.sign(v) * Math.max(Math.abs(v) - RAMP * page.a_max[i] * dt, 0); }
    const most = truth[i] === HEALTHY || page.v_max[i] === null ? Infinity : page.weak.velocity * page.v_max[i] * dt;
    return this.q[i] + Math.min(Math.max(command - this.q[i], -most), most);
  }
}

const truth = new Array(n).fill(HEALTHY);
const broken = () => truth.some((code) => code !== HEALTHY);
const lead = new Lead();
const wasm = bytes(page.wasm), arm = bytes(page.arm);
const [reported, ghost] = [new Arm(await Planner.open(wasm, arm), true), new Arm(await Planner.open(wasm, arm), false)];
let ticks = 0, paused = false, speed = page.speed, owed = 0, spent = 0, steps = 0, held = -Infinity, chosen = 0, refusal = '';

function tick() {
  lead.next();
  const { place, turn, speed: v, spin, acceleration, spinUp } = lead.target;
  const pose = matrix(turn, place);
  for (const one of broken() ? [reported, ghost] : [reported]) one.step(pose, [...v, ...spin], [...acceleration, ...spinUp]);
  ticks++;
  steps++;
}

function fail(i, word) {
  refusal = '';
  if (!broken()) { ghost.take(reported); trails[1].rest(); }
  const code = looks.buttons[word] ?? HEALTHY;
  try {
    if (code === HEALTHY) reported.planner.withdraw(i);
    else reported.planner.report(code === LOCKED ? reported.planner.locked(i) : reported.planner.degraded(i, page.weak));
    truth[i] = code;
    reported.planner.resume();
  } catch (mistake) { refusal = mistake.message; }
}

function begin() {
  truth.fill(HEALTHY); lead.reset(); reported.reset(); ghost.reset(); trails.forEach((one) => one.rest()); history.length = 0; ticks = 0; refusal = '';
}

// ---- what the page says
const acts = {
  time(word) { if (word === 'reset') begin(); else if (word === 'to path') lead.toPath(); else paused = word === 'pause'; },
  speed(value) { speed = value; },
  chosen(name) { chosen = joints.indexOf(name); },
  joint(word, i) { fail(i ?? chosen, word); },
  drag(on) { visible(nodes.handle, on); if (!on) lead.toPath(); },
  overlay(on, name) { shown[name] = on; },
};
function heard({ type, message }) {
  if (type === 'set_server') { connect(); return; }
  if (type !== 'send') return;
  if (message.type === 'GuiUpdateMessage' && page.acts[message.uuid]) {
    const [act, what] = page.acts[message.uuid];
    acts[act](message.updates.value, what);
  } else if (message.name === nodes.handle) {
    if (message.type === 'TransformControlsDragStartMessage') held = Infinity;
    if (message.type === 'TransformControlsDragEndMessage') held = -Infinity;
    if (message.type === 'TransformControlsUpdateMessage')
      lead.drag({ turn: page.turns ? unit(message.wxyz) : lead.target.turn, place: message.position });
  }
}

// ---- what the page is sent
let worker = null, outgoing = [];
const queue = (message) => outgoing.push(message);
const text = (name, content) => queue({ type: 'GuiUpdateMessage', uuid: page.texts[name], updates: { content } });
const change = (name, updates) => queue({ type: 'SceneNodeUpdateMessage', name, updates, owner: '' });
const seen = {};
function visible(name, on) {
  if (seen[name] !== on) queue({ type: 'SetSceneNodeVisibilityMessage', name, visible: seen[name] = on, owner: '' });
}
function put(name, wxyz, position) {
  queue({ type: 'SetOrientationMessage', name, wxyz, owner: '' });
  queue({ type: 'SetPositionMessage', name, position, owner: '' });
}
function arrays(value) { // the arrays of the first messages, where those name them
  if (value === null || typeof value !== 'object') return value;
  if ('__binary_index' in value) {
    const kinds = { '<f2': Uint16Array, '<f4': Float32Array, '<f8': Float64Array, '<u2': Uint16Array, '<u4': Uint32Array, '<i4': Int32Array };
    return new (kinds[value.dtype] ?? Uint8Array)(bytes(page.arrays[value.__binary_index]).buffer);
  }
  for (const key in value) value[key] = arrays(value[key]);
  return value;
}
function send() {
  if (outgoing.length && worker) worker.onmessage({ data: { type: 'message_batch', messages: outgoing } });
  outgoing = [];
}
function connect() {
  worker.onmessage({ data: { type: 'connected' } });
  outgoing = arrays(structuredClone(page.messages));
  change(nodes.named, { text: looks.named });
  send();
  requestAnimationFrame(picture);
}

class Trail {
  constructor(name) { this.name = name; [this.count, this.apart] = page.trail; this.points = new Float32Array(6 * this.count); this.rest(); }
  rest() { this.last = null; } // and begin anew
  follow(tip) {
    if (!this.last) { for (let k = 0; k < this.points.length; k++) this.points[k] = tip[k % 3]; this.next = 0; this.last = tip; }
    else if (norm(sum(tip, this.last, -1)) >= this.apart) { this.points.set([...this.last, ...tip], 6 * this.next); this.next = (this.next + 1) % this.count; this.last = tip; }
    else return;
    change(this.name, { points: this.points.slice() });
  }
}
const trails = [new Trail(nodes.trail), new Trail(nodes.rival_trail)];
const shown = Object.fromEntries(Object.keys(nodes.overlays).map((name) => [name, name !== 'ellipsoid']));
const painted = new Array(n).fill(''), history = [];
let before = null, written = -Infinity, labels = '';

const share = (i, q) => page.low[i] === null || page.high[i] === null
  ? Math.atan2(Math.sin(q), Math.cos(q)) / Math.PI : (2 * q - page.low[i] - page.high[i]) / (page.high[i] - page.low[i]);
const brakes = (i) => truth[i] === LOCKED && Math.abs(reported.v[i]) > 1e-4;
function colour(i) {
  if (brakes(i)) return looks.braking;
  const near = page.low[i] !== null && Math.abs(share(i, reported.q[i])) > page.near;
  return truth[i] === HEALTHY && near ? looks.near : looks.condition[truth[i]];
}

function draw() {
  const apart = broken();
  for (let i = 0; i < n; i++) {
    put(nodes.frames[i], ...local(i, reported.q[i]));
    if (apart && shown[looks.overlay]) put(nodes.rival_frames[i], ...local(i, ghost.q[i]));
    const paint = colour(i);
    if (String(paint) === painted[i]) continue;
    painted[i] = String(paint);
    for (const name of nodes.barrels[i]) change(name, { color: paint });
    for (const name of nodes.bodies[i]) change(name, { color: truth[i] === HEALTHY && !brakes(i) ? looks.link : paint });
  }
  put(nodes.target, lead.target.turn, lead.target.place);
  if (held < 0 && (!lead.goal || lead.back)) put(nodes.handle, lead.target.turn, lead.target.place);
  for (const [name, members] of Object.entries(nodes.overlays)) for (const one of members) if (one !== nodes.named) visible(one, shown[name] && (name !== looks.overlay || apart));
  trails[0].follow(tipOf(reported.q));
  if (apart) { const tip = tipOf(ghost.q); trails[1].follow(tip); put(nodes.named, [1, 0, 0, 0], sum(tip, [0, 0, -0.07 * page.size])); }
  visible(nodes.named, apart && shown.labels && shown[looks.overlay]);
  const words = joints.flatMap((name, i) => truth[i] === HEALTHY ? [] : [`${name} ${page.conditions[truth[i]]}`]).join(', ');
  if (words !== labels) change(nodes.said, { text: labels = words });
}

const length = (error) => error < 1e-5 ? '&lt; 0.01 mm' : error < 1 ? `${(1e3 * error).toPrecision(3)} mm` : `${error.toFixed(2)} m`;
const escaped = (words) => words.replace(/[&<>"]/g, (letter) => `&#${letter.charCodeAt(0)};`);
const FONT = 'font:13px/1.45 system-ui,sans-serif;color:#222';
function write() {
  const [name, sentence] = page.statuses[reported.status], apart = broken();
  const listed = joints.flatMap((joint, i) => truth[i] === HEALTHY ? [] : [`${joint}:${page.conditions[truth[i]]}`]).join(' ');
  const facts = [`${(ticks * dt).toFixed(1)} s, ${paused ? 'paused' : `${speed} × real time`}`, `error of the end effector <b>${length(reported.planner.error)}</b>`];
  if (apart) facts.push(`<span style="color:${looks.rival}">${looks.named}: <b>${length(ghost.planner.error)}</b></span>`);
  if (steps) facts.push(`<span style="color:#888">a tick takes ${(1e3 * spent / steps).toFixed(0)} µs</span>`);
  text('head', `<div id="ftqp-status" data-status="${name}" data-faults="${escaped(listed)}" data-tick="${ticks}" data-paused="${paused}"
    data-error="${reported.planner.error}" data-unreported="${apart ? ghost.planner.error : ''}" style="${FONT};padding:2px 10px">
    <div style="color:#666">${escaped(page.title)}</div><div style="font-size:17px;font-weight:600"><span style="display:inline-block;
    width:12px;height:12px;border-radius:50%;background:${looks.status[name]};margin-right:7px"></span>${name}</div>
    <div style="min-height:37px">${sentence}</div><div>${facts.join('<br>')}</div><div style="color:#8a4b00">${escaped(refusal)}</div></div>`);
  text('table', `<div style="${FONT};padding:0 10px"><table id="ftqp-joints" style="border-collapse:collapse;font-size:12px;width:100%">
    <tr style="color:#666;text-align:left"><th></th><th>place in range</th><th>speed</th></tr>${joints.map(row).join('')}</table></div>`);
  text('curve', curve());
}
const hex = (paint) => `rgb(${paint})`;
function row(name, i) {
  const at = Math.min(Math.max(50 + 50 * share(i, reported.q[i]), 0), 100), most = page.v_max[i], fast = most ? Math.min(100 * Math.abs(reported.v[i]) / most, 100) : 0;
  const bar = (inner) => `<td style="padding:2px 6px 2px 0"><div style="position:relative;height:8px;background:#e6e8ec;border-radius:4px">${inner}</div></td>`;
  const paint = hex(colour(i));
  return `<tr><td style="padding:0 8px 0 0">${escaped(page.short[i])}</td>${bar(`<div style="position:absolute;left:calc(${at.toFixed(1)}% - 4px);width:8px;height:8px;border-radius:4px;background:${paint}"></div>`)}
    ${bar(`<div style="width:${fast.toFixed(1)}%;height:8px;border-radius:4px;background:${paint}"></div>`)}</tr>`;
}
function curve() { // errors of the last twenty seconds, powers of ten
  history.push([reported.planner.error, broken() ? ghost.planner.error : NaN]);
  if (history.length > HISTORY) history.shift();
  const y = (error) => 90 - 80 * (Math.min(Math.max(Math.log10(error), FLOOR), CEILING) - FLOOR) / (CEILING - FLOOR);
  const line = (which, colour) => {
    const points = history.flatMap((errors, k) => Number.isNaN(errors[which]) ? [] : [`${(30 + 165 * (k + HISTORY - history.length) / HISTORY).toFixed(1)},${y(errors[which] + 1e-12).toFixed(1)}`]);
    return `<polyline points="${points.join(' ')}" fill="none" stroke="${colour}" stroke-width="1.5"/>`;
  };
  const marks = [[0, '1 m'], [-3, '1 mm'], [-6, '1 µm']].map(([power, words]) =>
    `<line x1="30" x2="195" y1="${y(10 ** power)}" y2="${y(10 ** power)}" stroke="#ddd"/><text x="27" y="${y(10 ** power) + 3}" font-size="8.5" text-anchor="end" fill="#666">${words}</text>`);
  return `<div style="${FONT};padding:4px 8px">error of the end effector, last 20 s<svg viewBox="0 0 200 98" style="width:100%">${marks.join('')}${line(1, looks.rival)}${line(0, looks.trail)}</svg></div>`;
}

function picture(now) {
  const passed = before === null ? 0 : Math.min((now - before) / 1e3, LONGEST);
  before = now;
  if (!paused) {
    owed += passed * speed;
    const began = performance.now(), count = steps;
    while (owed >= dt) { tick(); owed -= dt; }
    if (steps > count) spent += performance.now() - began;
    if (steps > 5e3) { spent *= 0.5; steps *= 0.5; }
  }
  draw();
  if (now - written >= 100) { written = now; write(); }
  send();
  requestAnimationFrame(picture);
}

PlannerWorker.heard = (said, from) => { worker = from; heard(said); };
for (const [said, from] of PlannerWorker.queue.splice(0)) PlannerWorker.heard(said, from);
