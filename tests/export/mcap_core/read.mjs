// Reads an MCAP file by the format's own library in both of its ways: as a stream, with every checksum, and by its
// indexes. Prints one JSON object, or fails.
import {open} from 'node:fs/promises';
import {McapIndexedReader, McapStreamReader} from '@mcap/core';

const path = process.argv[2];
const file = await open(path);
const size = (await file.stat()).size;
const read = async (offset, length) => {
  const buffer = new Uint8Array(Number(length));
  const {bytesRead} = await file.read(buffer, 0, buffer.length, Number(offset));
  if (bytesRead !== buffer.length) throw new Error('the file ends early');
  return buffer;
};

// As a stream.
const stream = new McapStreamReader({validateCrcs: true}), streamed = new Map();
let header = null, footers = 0;
const take = () => {
  for (let record; (record = stream.nextRecord());) {
    if (record.type === 'Header') header = record;
    if (record.type === 'Footer') ++footers;
    if (record.type === 'Message') streamed.set(record.channelId, (streamed.get(record.channelId) ?? 0) + 1);
  }
};
for (let at = 0; at < size; at += 65536) {
  stream.append(await read(at, Math.min(65536, size - at)));
  take();
}
if (!stream.done() || footers !== 1) throw new Error('the stream does not end');

// By its indexes.
const reader = await McapIndexedReader.Initialize({readable: {size: async () => BigInt(size), read}});
const channels = {}, first = {};
for (const channel of reader.channelsById.values()) {
  const schema = reader.schemasById.get(channel.schemaId);
  if (channel.messageEncoding !== 'json' || schema.encoding !== 'jsonschema') throw new Error(`${channel.topic}: no JSON`);
  if (JSON.parse(new TextDecoder().decode(schema.data)).type !== 'object') throw new Error(`${schema.name}: no object`);
  channels[channel.topic] = {type: schema.name, count: 0, robot: channel.metadata.get('robot') ?? ''};
}
let messages = 0, last = 0n;
for await (const message of reader.readMessages()) {
  const {topic} = reader.channelsById.get(message.channelId);
  if (message.logTime < last) throw new Error('not in the order of their times');
  last = message.logTime;
  ++messages;
  ++channels[topic].count;
  first[topic] ??= {log: String(message.logTime), publish: String(message.publishTime), sequence: message.sequence,
    json: JSON.parse(new TextDecoder().decode(message.data))};
}
for (const [id, count] of streamed)
  if (channels[reader.channelsById.get(id).topic].count !== count) throw new Error('the indexes have other messages');
if (BigInt(messages) !== reader.statistics.messageCount) throw new Error('the statistics count other messages');
console.log(JSON.stringify({library: header.library, chunks: reader.chunkIndexes.length, messages, channels, first}));
