// As replayed.c, in Node: replayed.mjs LOADER WASM ARM < stream > commands
import fs from 'node:fs';
const [, , loader, wasm, arm] = process.argv;
const { Planner } = await import(loader);
const planner = await Planner.open(fs.readFileSync(wasm), fs.readFileSync(arm));
const bytes = new Uint8Array(fs.readFileSync(0)), stream = new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
const n = planner.n, out = [];
let at = 0;
const get = (count) => stream.subarray(at, (at += count));
const keys = ['deceleration', 'damping', 'friction', 'velocity', 'acceleration', 'torque', 'qMin', 'qMax'];
const told = (call) => { try { const code = call(); return typeof code === 'boolean' ? +code : code ?? 0; } catch (mistake) { return mistake.code; } };
while (at < stream.length) {
  const op = stream[at++];
  if (op === 0) break;
  if (op === 1) { const q = get(n), v = get(n); out.push(told(() => { planner.reset(q, v); })); }
  if (op === 2) {
    const q = get(n), t = get(30);
    out.push(told(() => planner.step(q, t[28] > 0 ? t.subarray(0, 16) : [t[3], t[7], t[11]], { twist: t.subarray(16, 22), acceleration: t.subarray(22, 28), ticks: t[29] })));
    out.push(...planner.q, ...planner.v, ...planner.a, ...planner.tau, planner.error);
  }
  if (op === 3) {
    const [joint, kind, mode, reset, ...left] = get(12);
    out.push(told(() => planner.report({ joint, kind, mode, reset, ...Object.fromEntries(keys.map((key, k) => [key, left[k]])) })));
  }
  if (op === 4) { const [joint] = get(1); out.push(told(() => planner.withdraw(joint))); }
  if (op === 5) out.push(told(() => planner.stop()));
  if (op === 6) out.push(told(() => planner.resume()));
  if (op === 7) { const load = get(13); out.push(told(() => planner.carry(load[0] > 0 ? { mass: load[0], com: load.subarray(1, 4), inertia: load.subarray(4) } : null))); }
  if (op === 8) { const T = get(16); out.push(told(() => planner.tool(T))); }
  if (op === 9) { const [thing, ...rest] = get(23); out.push(told(() => planner.move(thing, rest.slice(0, 16), rest.slice(16)))); }
}
fs.writeSync(1, new Uint8Array(new Float64Array(out).buffer));
