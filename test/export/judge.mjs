// SPDX-License-Identifier: Apache-2.0
// An MCAP file by libraries of other hands: node judge.mjs FILE.mcap LOG, with @mcap/core, @foxglove/rosmsg, rosmsg2-serialization and
// rosmsg-msgs-common beside it. Every CRC, every index, every schema against the definitions of ROS 2 Humble, and every message decoded and encoded
// again to the same bytes; the attached log beside the file, LOG. Prints, as JSON, the number of messages of each topic, their first and last times, and the first and last message.
import { McapIndexedReader, McapStreamReader } from '@mcap/core';
import { parse } from '@foxglove/rosmsg';
import { ros2humble } from '@foxglove/rosmsg-msgs-common';
import { MessageReader, MessageWriter } from '@foxglove/rosmsg2-serialization';
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { gunzipSync } from 'node:zlib';

const bytes = readFileSync(process.argv[2]);
const readable = { size: async () => BigInt(bytes.length), read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)) };

// Fields of a definition by name, type and form: constants and defaults are no part of a message.
const fields = (definition) => definition.definitions.filter((f) => !f.isConstant)
  .map((f) => [f.name, f.type, f.isComplex ?? false, f.isArray ?? false, f.arrayLength ?? null]);
const known = (name) => ros2humble[name.replace('/msg/', '/')];

function codec(schema) {
  assert.equal(schema.encoding, 'ros2msg');
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  for (const one of definitions) {
    const name = one.name ?? schema.name;
    assert.ok(known(name), `${name} is a type of ROS 2`);
    assert.deepEqual(fields(one), fields(known(name)), `${name} has the fields of ROS 2`);
  }
  return { reader: new MessageReader(definitions), writer: new MessageWriter(definitions) };
}

const plain = (_, value) => typeof value === 'bigint' ? Number(value) : ArrayBuffer.isView(value) ? Array.from(value)
  : typeof value === 'number' && !Number.isFinite(value) ? String(value) : value;

const indexed = await McapIndexedReader.Initialize({ readable });
assert.equal(indexed.header.profile, 'ros2');
const codecs = new Map([...indexed.schemasById].map(([id, schema]) => [id, codec(schema)]));
const topics = {};
let before = 0n, count = 0;
for await (const message of indexed.readMessages({ validateCrcs: true })) {
  const channel = indexed.channelsById.get(message.channelId);
  assert.equal(channel.messageEncoding, 'cdr');
  assert.ok(message.logTime >= before, 'messages are in order of time');
  before = message.logTime;
  const { reader, writer } = codecs.get(channel.schemaId);
  const decoded = reader.readMessage(message.data);
  assert.ok(Buffer.from(writer.writeMessage(decoded)).equals(Buffer.from(message.data)), `${channel.topic} at ${message.logTime}: encoded again to other bytes`);
  const topic = topics[channel.topic] ??= { type: indexed.schemasById.get(channel.schemaId).name, count: 0, first_ns: message.logTime, first: decoded };
  assert.equal(message.sequence, topic.count++, `${channel.topic}: sequence`);
  Object.assign(topic, { last_ns: message.logTime, last: decoded });
  ++count;
}
assert.equal(BigInt(count), indexed.statistics.messageCount);
assert.equal(indexed.statistics.chunkCount, indexed.chunkIndexes.length);

// The log, as it was recorded.
const attached = [];
for await (const one of indexed.readAttachments({ validateCrcs: true })) attached.push(one);
assert.deepEqual(attached.map(({ name, mediaType }) => [name, mediaType]), [['raw.log.gz', 'application/gzip']]);
assert.ok(gunzipSync(attached[0].data).equals(readFileSync(process.argv[3])), 'the attached log is the log');

// The same without an index, from the first byte to the last.
const stream = new McapStreamReader({ validateCrcs: true });
let streamed = 0;
stream.append(bytes);
for (let record; (record = stream.nextRecord());) streamed += record.type === 'Message' ? 1 : 0;
assert.ok(stream.done(), 'the file ends with its footer');
assert.equal(streamed, count);
process.stdout.write(JSON.stringify(topics, plain) + '\n');
