// SPDX-License-Identifier: Apache-2.0
// node judge.mjs NODE EDS LOG: npm's canopen (MIT) as client of a node, with the node's electronic data sheet as it reads that. Every object
// is read, every staged row written, refused beyond its limits and applied. LOG gets the frames. Prints counts as JSON.
import { createRequire } from 'node:module';
import { spawn } from 'node:child_process';
import fs from 'node:fs';
import readline from 'node:readline';

const { Device, Eds, DataType } = createRequire(process.cwd() + '/')('canopen');
const [, , program, sheet, log] = process.argv;
const ID = 10;
const node = spawn(program, { stdio: ['pipe', 'pipe', 'inherit'] });
const device = new Device({ id: 0x70 });
device.eds.addSdoClientParameter(ID, 0x600 | ID, 0x580 | ID);
const out = fs.createWriteStream(log);
device.addListener('message', (m) => node.stdin.write(`${m.id.toString(16)}#${Buffer.from(m.data).toString('hex')}\n`));
readline.createInterface({ input: node.stdout }).on('line', (line) => {
  if (line === '.') return;
  out.write(line + '\n');
  const [id, data] = line.split(' ')[2].split('#');
  if (parseInt(id, 16) !== (0x600 | ID)) device.receive({ id: parseInt(id, 16), data: Buffer.from(data, 'hex') });
});
device.start();

const fail = (what) => { console.error(`canopen: ${what}`); process.exit(1); };
const same = (a, b, type) => type === DataType.REAL32 ? Math.fround(Number(a)) === Math.fround(Number(b)) : String(a) === String(b);
const object = (e) => ({ serverId: ID, index: e.index, subIndex: e.subIndex ?? 0, dataType: e.dataType, timeout: 5000 });
const read = (e) => device.sdo.upload(object(e));
const write = (e, data) => device.sdo.download({ ...object(e), data });
const code = async (transfer) => { try { await transfer; return 0; } catch (error) { return error.code ?? fail(error.message); } };

const eds = Eds.fromFile(sheet);
const counts = { objects: 0, read: 0, defaults: 0, written: 0, refused: 0 };
const rows = [];
for (const entry of eds.values()) {
  ++counts.objects;
  if (!entry.subNumber) rows.push(entry);
  else for (let i = 0; i < 256; ++i) if (entry.at(i)) rows.push(entry.at(i));
}
for (const e of rows) {
  const value = await read(e);
  ++counts.read;
  const stated = e.defaultValue;
  if (e.index < 0x2000 || stated === undefined || stated === '') continue;
  if (!same(value, stated, e.dataType)) fail(`${e.parameterName} reads ${value}, its sheet says ${stated}`);
  ++counts.defaults;
}
for (const e of rows.filter((e) => e.index >= 0x2000 && e.index < 0x3000)) {
  const number = e.dataType === DataType.INTEGER64 ? BigInt(e.defaultValue) : Number(e.defaultValue);
  if (e.accessType !== 'rw') {
    if (await code(write(e, number)) !== 0x06010002) fail(`${e.parameterName} is written`);
    ++counts.refused;
    continue;
  }
  await write(e, number);
  if (!same(await read(e), e.defaultValue, e.dataType)) fail(`${e.parameterName} is not what was written`);
  ++counts.written;
  const beyond = e.dataType === DataType.REAL32 ? 3e38 : e.dataType === DataType.INTEGER64 ? null : 0x7FFFFFFF;
  if (beyond === null || (e.highLimit ?? 0) >= beyond) continue;
  if (await code(write(e, beyond)) !== 0x06090031) fail(`${e.parameterName} takes ${beyond}`);
  ++counts.refused;
}
const named = (name, index) => rows.find((e) => e.parameterName === name && e.index >= index);
await write(named('landmark.gate_scale', 0x2000), 2.5);
const apply = { serverId: ID, index: 0x5F00, subIndex: 1, dataType: DataType.UNSIGNED32, timeout: 5000 };
const staged = await device.sdo.upload(apply);
if (await code(device.sdo.download({ ...apply, data: (staged ^ 1) >>> 0 })) !== 0x08000022) fail('a foreign set is applied');
await device.sdo.download({ ...apply, data: staged });
if (await read(named('landmark.gate_scale (active)', 0x3000)) !== 2.5) fail('nothing was applied');
console.log(JSON.stringify(counts));
out.end(() => process.exit(0));
