// Reads an MCAP file with the readers of @mcap/core, by its index and as a stream, and checks that
// both return the same messages and that the statistics count them. Prints one JSON line per
// message in the order of the log stamps, or with --summary one line with the counts.
import {createHash} from "node:crypto";
import {once} from "node:events";
import {open} from "node:fs/promises";
import {createRequire} from "node:module";

// Installed beside this file: tests/npm/install.
const require = createRequire(import.meta.url);
const {McapIndexedReader, McapStreamReader} = require("@mcap/core");
const {parseIDL} = require("@foxglove/omgidl-parser");
const {MessageReader} = require("@foxglove/omgidl-serialization");
const {crc32, crc32Init, crc32Update, crc32Final} = require("@foxglove/crc");
const lz4 = require("@foxglove/wasm-lz4");
const zstd = require("@foxglove/wasm-zstd");

const kPieceBytes = 1 << 20;
const kMaxHexBytes = 64;  // longer octet sequences are printed as "crc32:12345678/LENGTH"

const usage = `Usage: read_mcap.mjs [--summary] FILE

Reads an MCAP file with @mcap/core, checks it and prints its messages as JSON lines: topic,
sequence, log, publish, value. 64-bit numbers are strings. Octets are hexadecimal up to
${kMaxHexBytes} bytes, longer sequences are "crc32:CRC/LENGTH".

  --summary   print one JSON line instead: the counts by topic, attachments, metadata`;

function check(holds, what) {
  if (!holds) throw new Error(what);
}
const json = (value) => JSON.stringify(value, (_, v) => (typeof v === "bigint" ? v.toString() : v));
const crcText = (bytes) => `crc32:${crc32(bytes).toString(16).padStart(8, "0")}/${bytes.length}`;

// Converts values that JSON cannot represent: 64-bit numbers, octets, infinities.
function printable(value) {
  if (typeof value === "bigint") return value.toString();
  if (typeof value === "number") return Number.isFinite(value) ? value : String(value);
  if (value instanceof Uint8Array)
    return value.length > kMaxHexBytes ? crcText(value) : Buffer.from(value).toString("hex");
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return Array.from(value, printable);
  if (value !== null && typeof value === "object")
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, printable(v)]));
  return value;
}

// Counts messages and sums their hashes by channel, independent of the order of the messages.
class Tally {
  channels = new Map();
  add(message) {
    const hash = createHash("sha1")
                     .update(`${message.sequence} ${message.logTime} ${message.publishTime} `)
                     .update(message.data)
                     .digest()
                     .readBigUInt64LE();
    const channel = this.channels.get(message.channelId) ?? {count: 0n, sum: 0n};
    this.channels.set(
        message.channelId,
        {count: channel.count + 1n, sum: BigInt.asUintN(64, channel.sum + hash)});
  }
  text() {
    return json([...this.channels.entries()].sort(([a], [b]) => a - b));
  }
}

async function* pieces(file, sizeBytes) {
  for (let at = 0; at < sizeBytes;) {
    const piece = new Uint8Array(Math.min(kPieceBytes, sizeBytes - at));
    const {bytesRead} = await file.read(piece, 0, piece.length, at);
    check(bytesRead > 0, "the file was truncated while it was read");
    at += bytesRead;
    yield piece.subarray(0, bytesRead);
  }
}

async function readStream(file, decompressHandlers) {
  const reader =
      new McapStreamReader({includeChunks: true, validateCrcs: true, decompressHandlers});
  const found =
      {tally: new Tally(), attachments: [], metadata: [], chunks: 0, statistics: undefined};
  let isData = true;
  for await (const piece of pieces(file, (await file.stat()).size)) {
    reader.append(piece);
    for (let record; (record = reader.nextRecord());) {
      if (record.type === "Message") found.tally.add(record);
      if (record.type === "Chunk") found.chunks += 1;
      if (record.type === "Attachment") found.attachments.push(attachmentLine(record));
      if (record.type === "Metadata") found.metadata.push(metadataLine(record));
      if (record.type === "DataEnd") isData = false;
      if (record.type === "Unknown")
        check(record.opcode >= 0x80, `unknown record ${record.opcode}`);
    }
  }
  check(!isData && reader.done(), "the stream reader did not reach the file's end");
  return found;
}

const attachmentLine = (a) => json({
  name: a.name,
  media_type: a.mediaType,
  log: a.logTime,
  create: a.createTime,
  content: crcText(a.data)
});
const metadataLine = (m) => json({name: m.name, values: Object.fromEntries(m.metadata)});

async function checkDataCrc(file, indexed) {
  if (!indexed.dataSectionCrc) return;
  let crc = crc32Init();
  for await (const piece of pieces(file, Number(indexed.dataEndOffset)))
    crc = crc32Update(crc, piece);
  check(crc32Final(crc) === indexed.dataSectionCrc, "the data section's CRC is wrong");
}

function decoders(indexed) {
  const byChannel = new Map();
  for (const channel of indexed.channelsById.values()) {
    const schema = indexed.schemasById.get(channel.schemaId);
    if (schema?.encoding !== "omgidl" || channel.messageEncoding !== "cdr") continue;
    byChannel.set(
        channel.id,
        new MessageReader(schema.name, parseIDL(new TextDecoder().decode(schema.data))));
  }
  return byChannel;
}

async function readIndexed(file, decompressHandlers, print) {
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, size) => {
      const bytes = new Uint8Array(Number(size));
      let at = 0;
      while (at < bytes.length) {
        const {bytesRead} = await file.read(bytes, at, bytes.length - at, Number(offset) + at);
        check(bytesRead > 0, "an index points beyond the file's end");
        at += bytesRead;
      }
      return bytes;
    },
  };
  const indexed = await McapIndexedReader.Initialize({readable, decompressHandlers});
  const found = {indexed, tally: new Tally(), attachments: [], metadata: []};
  const readers = decoders(indexed);
  let last = -1n;
  for await (const message of indexed.readMessages({validateCrcs: true})) {
    check(message.logTime >= last, "messages out of order");
    last = message.logTime;
    found.tally.add(message);
    const reader = readers.get(message.channelId);
    const value = reader ? printable(reader.readMessage(message.data)) : null;
    await print({
      topic: indexed.channelsById.get(message.channelId).topic,
      sequence: message.sequence,
      log: message.logTime,
      publish: message.publishTime,
      value
    });
  }
  for await (const attachment of indexed.readAttachments({validateCrcs: true}))
    found.attachments.push(attachmentLine(attachment));
  for await (const metadata of indexed.readMetadata()) found.metadata.push(metadataLine(metadata));
  return found;
}

function checkStatistics(indexed, stream) {
  const statistics = indexed.statistics;
  check(statistics, "no statistics");
  const counts =
      [...stream.tally.channels.entries()].map(([id, {count}]) => [id, count]).sort(([a], [
                                                                                      b
                                                                                    ]) => a - b);
  check(
      json([...statistics.channelMessageCounts.entries()].sort(([a], [b]) => a - b)) ===
          json(counts),
      "statistics: messages by channel");
  check(
      statistics.messageCount === counts.reduce((sum, [, count]) => sum + count, 0n),
      "statistics: messages");
  check(
      statistics.chunkCount === stream.chunks && indexed.chunkIndexes.length === stream.chunks,
      "statistics: chunks");
  check(statistics.attachmentCount === stream.attachments.length, "statistics: attachments");
  check(statistics.metadataCount === stream.metadata.length, "statistics: metadata");
  check(statistics.schemaCount === indexed.schemasById.size, "statistics: schemas");
  check(statistics.channelCount === indexed.channelsById.size, "statistics: channels");
}

async function main(args) {
  const summary = args.includes("--summary");
  const paths = args.filter((arg) => !arg.startsWith("--"));
  if (paths.length !== 1 || args.length !== paths.length + Number(summary)) {
    console.error(usage);
    return 2;
  }
  await lz4.isLoaded;
  await zstd.isLoaded;
  const decompressHandlers = {
    lz4: (bytes, size) => lz4(bytes, Number(size)),
    zstd: (bytes, size) => zstd.decompress(bytes, Number(size)),
  };
  const print = async (line) => {
    if (!summary && !process.stdout.write(json(line) + "\n")) await once(process.stdout, "drain");
  };
  const file = await open(paths[0]);
  try {
    const byIndex = await readIndexed(file, decompressHandlers, print);
    const asStream = await readStream(file, decompressHandlers);
    const {indexed} = byIndex;
    check(
        byIndex.tally.text() === asStream.tally.text(),
        "index and stream return different messages");
    check(
        json(byIndex.attachments) === json(asStream.attachments),
        "index and stream return different attachments");
    check(
        json(byIndex.metadata) === json(asStream.metadata),
        "index and stream return different metadata");
    checkStatistics(indexed, asStream);
    await checkDataCrc(file, indexed);
    if (summary) {
      const topics = {};  // a topic may have several channels
      for (const [id, {count}] of asStream.tally.channels)
        topics[indexed.channelsById.get(id).topic] =
            (topics[indexed.channelsById.get(id).topic] ?? 0) + Number(count);
      const compressions = [...new Set(indexed.chunkIndexes.map((chunk) => chunk.compression))];
      console.log(json({
        library: indexed.header.library,
        chunks: asStream.chunks,
        compressions,
        topics,
        attachments: asStream.attachments.map(JSON.parse),
        metadata: asStream.metadata.map(JSON.parse)
      }));
    }
  } finally {
    await file.close();
  }
  return 0;
}

try {
  process.exitCode = await main(process.argv.slice(2));
} catch (error) {
  console.error(`read_mcap: ${error.message}`);
  process.exitCode = 1;
}
