// ftqp.mjs - the planner in a browser or in Node: the same kernel, in WebAssembly.
//
//   import { Planner } from './ftqp.mjs';
//   const planner = await Planner.open(wasmBytes, armBytes);   // ArrayBuffer or Uint8Array, or a Response of fetch
//   planner.reset(q);
//   const status = planner.step(q, pose, { twist });            // pose: 16 numbers by rows, or 3: a position
//   planner.report(planner.locked(2)); planner.q                // Float64Array, valid until the next step

const LINE = 64, NUMBERS = 29, FAULT = 80, LOAD = 104, FINDING = 40, MOST = 64;
const wasi = { // what the C library of the build may ask for; a planner needs none of it
  proc_exit(code) { throw new Error(`the planner ended with ${code}`); },
  fd_write: () => 8, fd_close: () => 8, fd_seek: () => 8,
};

export class Mistake extends Error {
  constructor(code, text) { super(text); this.code = code; }
}

export class Planner {
  static async open(wasm, arm) {
    const bytes = wasm instanceof Response ? await wasm.arrayBuffer() : wasm;
    const { instance } = await WebAssembly.instantiate(bytes, { wasi_snapshot_preview1: wasi });
    return new Planner(instance.exports, new Uint8Array(arm));
  }

  constructor(exports, arm) {
    this.c = exports;
    const base = Math.ceil(exports.__heap_base.value / LINE) * LINE;
    const need = base, file = base + LINE;
    this.#grow(file + arm.length);
    new Uint8Array(exports.memory.buffer).set(arm, file);
    this.#check(exports.ftqp_size(file, arm.length, need));
    const size = this.size = new DataView(exports.memory.buffer).getUint32(need, true);
    this.p = Math.ceil((file + arm.length) / LINE) * LINE;
    this.work = Math.ceil((this.p + size) / LINE) * LINE;
    this.#grow(this.work + 8 * (4 * MOST + NUMBERS) + FAULT + LOAD + MOST * FINDING);
    new Uint8Array(exports.memory.buffer).set(arm, file);
    this.#check(exports.ftqp_open(this.p, file, arm.length));
    this.n = exports.ftqp_joints(this.p);
    this.qAt = this.work; this.vAt = this.qAt + 8 * 64; this.targetAt = this.vAt + 8 * 64;
    this.faultAt = this.targetAt + 8 * NUMBERS; this.loadAt = this.faultAt + FAULT;
    this.foundAt = this.loadAt + LOAD;
  }

  // False warns of a start beyond the arm's limits.
  reset(q, v = null) { return this.#check(this.c.ftqp_reset(this.p, this.#numbers(this.qAt, q), v ? this.#numbers(this.vAt, v) : 0)) === 0; }

  // The command for the next period: a status from 0 on. Throws Mistake for a mistake of the program.
  step(q, pose, { twist = null, acceleration = null, ticks = 1, v = null } = {}) {
    const target = this.#view(this.targetAt, NUMBERS);
    target.fill(0);
    if (pose.length === 16) { target.set(pose); target[28] = 1; } else {
      target[0] = target[5] = target[10] = target[15] = 1;
      for (let k = 0; k < 3; k++) target[4 * k + 3] = pose[k];
    }
    if (twist) target.set(twist, 16);
    if (acceleration) target.set(acceleration, 22);
    return this.#check(this.c.ftqp_step(this.p, this.#numbers(this.qAt, q), v ? this.#numbers(this.vAt, v) : 0, this.targetAt, ticks));
  }

  locked(joint, { instant = false, reset = 0, deceleration = NaN } = {}) { return { joint, kind: 1, mode: +instant, reset, deceleration }; }
  freeSwinging(joint, { damping = 0, friction = 0 } = {}) { return { joint, kind: 2, damping, friction }; }
  degraded(joint, left = {}) { return { joint, kind: 3, ...left }; }

  report(fault) {
    const { joint, kind, mode = 0, reset = 0, deceleration = NaN, damping = 0, friction = 0 } = fault;
    const { velocity = 1, acceleration = 1, torque = 1, qMin = NaN, qMax = NaN } = fault;
    new Int32Array(this.c.memory.buffer, this.faultAt, 4).set([joint, kind, mode, reset]);
    this.#view(this.faultAt + 16, 8).set([deceleration, damping, friction, velocity, acceleration, torque, qMin, qMax]);
    this.#check(this.c.ftqp_report(this.p, this.faultAt));
  }

  believed(joint) { return this.#check(this.c.ftqp_believed(this.p, joint)); }
  withdraw(joint) { this.#check(this.c.ftqp_withdraw(this.p, joint)); }
  stop() { this.#check(this.c.ftqp_stop(this.p)); }
  resume() { return this.#check(this.c.ftqp_resume(this.p)) === 1; }
  speed(share) { this.#check(this.c.ftqp_speed(this.p, share)); }

  carry(load) {
    if (!load) { this.#check(this.c.ftqp_carry(this.p, 0)); return; }
    const { mass, com = [0, 0, 0], inertia = new Array(9).fill(0) } = load;
    this.#view(this.loadAt, 13).set([mass, ...com, ...inertia]);
    this.#check(this.c.ftqp_carry(this.p, this.loadAt));
  }

  // The controlled point in the frame of the arm's own tip, 16 numbers by rows; null is that tip.
  tool(T) { this.#check(this.c.ftqp_tool(this.p, T ? this.#written(T) : 0)); }
  brake(joint) { this.#check(this.c.ftqp_brake(this.p, joint)); }

  // Where a thing of the scene is now, and how it goes on, by its number in arm.h.
  move(thing, pose, twist = [0, 0, 0, 0, 0, 0]) {
    this.#check(this.c.ftqp_move(this.p, thing, this.#written(pose, twist), this.targetAt + 8 * 16));
  }

  // The goal of a further task, a pose or a place, and how it goes on; how much it counts.
  aim(task, pose, twist = [0, 0, 0, 0, 0, 0]) {
    const whole = pose.length === 16 ? pose : [1, 0, 0, pose[0], 0, 1, 0, pose[1], 0, 0, 1, pose[2], 0, 0, 0, 1];
    this.#check(this.c.ftqp_aim(this.p, task, this.#written(whole, twist)));
  }
  aimJoints(task, q) { this.#check(this.c.ftqp_aim_joints(this.p, task, this.#numbers(this.qAt, q))); }
  weight(task, weight) { this.#check(this.c.ftqp_weight(this.p, task, weight)); }
  has(what) { return this.#check(this.c.ftqp_has(this.p, what)) === 1; }

  // Go on from the state of another planner of the same file.
  take(other) { this.#bytes().set(other.#bytes()); }

  // The command for the next period along the path of the file, in a build with one.
  follow(q, { ticks = 1, v = null } = {}) { return this.#check(this.c.ftqp_follow(this.p, this.#numbers(this.qAt, q), v ? this.#numbers(this.vAt, v) : 0, ticks)); }
  begin() { this.#check(this.c.ftqp_begin(this.p)); }
  get progress() { return this.c.ftqp_progress(this.p); }

  // After each step: 0 quiet, 1 a suspicion, 2 something was found, or withdrawn.
  watch(tau = null) { return this.#check(this.c.ftqp_watch(this.p, tau ? this.#numbers(this.vAt, tau) : 0)); }

  findings() {
    const count = this.#check(this.c.ftqp_detect(this.p, this.foundAt, MOST));
    return Array.from({ length: count }, (_, k) => {
      const at = new DataView(this.c.memory.buffer, this.foundAt + k * FINDING, FINDING), number = (byte) => at.getFloat64(byte, true);
      const [joint, kinds] = [at.getInt32(0, true), at.getInt32(4, true)];
      return { joint, kinds, probability: number(8), onset: number(16), detectedAt: number(24), share: number(32) };
    });
  }

  get q() { return this.#view(this.c.ftqp_q(this.p), this.n); }
  get v() { return this.#view(this.c.ftqp_v(this.p), this.n); }
  get a() { return this.#view(this.c.ftqp_a(this.p), this.n); }
  get tau() { return this.#view(this.c.ftqp_tau(this.p), this.n); }
  get status() { return this.c.ftqp_status(this.p); }
  get error() { return this.c.ftqp_error(this.p); }
  // Which joints ask for their brakes; close those.
  get brakes() { this.#check(this.c.ftqp_brakes(this.p, this.targetAt)); return Array.from(new Int32Array(this.c.memory.buffer, this.targetAt, this.n), Boolean); }

  // Why a stop is latched, 0 while none is; and its sentence.
  get stopReason() { return this.c.ftqp_stop_reason(this.p); }
  get stoppedBecause() { return this.#text(this.c.ftqp_stop_reason_name(this.stopReason)); }
  get dt() { return this.c.ftqp_dt(this.p); }
  get tip() { this.#check(this.c.ftqp_tip(this.p, this.targetAt)); return this.#view(this.targetAt, 16).slice(); }

  // A sentence for a status or a mistake.
  name(status) { return this.#text(this.c.ftqp_status_name(status)); }

  #text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer);
    return new TextDecoder().decode(bytes.slice(at, bytes.indexOf(0, at))).replaceAll('ftqp_', '');
  }

  #bytes() { return new Uint8Array(this.c.memory.buffer, this.p, this.size); }
  #written(pose, twist = []) {
    const target = this.#view(this.targetAt, NUMBERS);
    target.fill(0);
    target.set(pose);
    target.set(twist, 16);
    target[28] = 1;
    return this.targetAt;
  }
  #view(at, count) { return new Float64Array(this.c.memory.buffer, at, count); }
  #numbers(at, values) {
    if (values.length !== this.n) throw new Mistake(-37, `got ${values.length} numbers, expected ${this.n}, one a joint`);
    this.#view(at, this.n).set(values);
    return at;
  }
  #check(code) { if (code < 0) throw new Mistake(code, this.name(code)); return code; }
  #grow(bytes) {
    const missing = bytes - this.c.memory.buffer.byteLength;
    if (missing > 0) this.c.memory.grow(Math.ceil(missing / 65536));
  }
}
