// Reads a file of `crepesctl convert --to mcap` with the reader of MCAP's own authors, by its index and from front to back, checksums
// included, and each message against its JSON Schema's required keys. By hand: no test needs npm.
//     npm install --prefix DIR @mcap/core && node tests/clients/mcap_check.mjs DIR FILE.mcap
import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const [folder, file] = process.argv.slice(2);
const require = createRequire(resolve(folder, "node_modules/"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");

const handle = await open(file);
const { size } = await handle.stat();
const readable = {
  size: async () => BigInt(size),
  read: async (offset, length) => {
    const bytes = new Uint8Array(Number(length));
    await handle.read(bytes, 0, bytes.length, Number(offset));
    return bytes;
  },
};

/** Messages by topic, in order of time; a message that is not what its schema says is an error. */
function count(messages, schemas, channels) {
  const counts = new Map();
  let last = 0n;
  for (const { channelId, logTime, data } of messages) {
    const { topic, schemaId, messageEncoding } = channels.get(channelId);
    const { encoding, data: text } = schemas.get(schemaId);
    if (encoding !== "jsonschema" || messageEncoding !== "json") throw new Error(`${topic}: ${encoding}, ${messageEncoding}`);
    const message = JSON.parse(new TextDecoder().decode(data));
    const { properties, required = [] } = JSON.parse(new TextDecoder().decode(text));
    for (const key of [...required, ...Object.keys(message)]) if (!(key in message) || !(key in properties)) throw new Error(`${topic}: ${key}`);
    if (logTime < last) throw new Error(`${topic}: not in order of time`);
    last = logTime;
    counts.set(topic, (counts.get(topic) || 0) + 1);
  }
  return counts;
}

const reader = await McapIndexedReader.Initialize({ readable });
const indexed = [];
for await (const message of reader.readMessages()) indexed.push(message);
const byIndex = count(indexed, reader.schemasById, reader.channelsById);

const stream = new McapStreamReader({ validateCrcs: true });
stream.append(await (await import("node:fs/promises")).readFile(file));
const found = { Schema: new Map(), Channel: new Map(), Message: [] };
for (let record = stream.nextRecord(); record; record = stream.nextRecord()) {
  if (record.type === "Message") found.Message.push(record);
  if (record.type in found && record.type !== "Message") found[record.type].set(record.id, record);
}
if (!stream.done()) throw new Error("the file ends too early");
const byStream = count(found.Message, found.Schema, found.Channel);

const rows = (counts) => JSON.stringify([...counts].sort());
if (rows(byIndex) !== rows(byStream)) throw new Error("index and stream differ");
if (BigInt(indexed.length) !== reader.statistics.messageCount) throw new Error("the statistics differ");
for (const [topic, messages] of byIndex) console.log(`${topic}: ${messages}`);
