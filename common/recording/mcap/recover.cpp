#include "common/recording/mcap/recover.h"

#include <algorithm>

#include "common/recording/mcap/append_file.h"
#include "common/recording/mcap/format/chunk_records.h"
#include "common/recording/mcap/format/summary_section.h"

namespace fivepipe::mcap {

namespace {

// Throws McapError if the file cannot be repaired.
Scan scan_recoverable(const File& file) {
  Scan found = scan(file);
  const auto& chunks = found.summary.chunks;
  if (std::any_of(chunks.begin(), chunks.end(),
                  [](const ChunkIndex& chunk) { return chunk.unchunked; }))
    FileOffset{file.name(), 0}.fail(
        "cannot be repaired: it has messages outside of chunks, which a summary cannot index");
  return found;
}

// A message index must follow its chunk directly, so every chunk but the last is moved to the end.
void add_message_indexes(AppendFile& to, const File& from, std::vector<ChunkIndex>& chunks) {
  for (ChunkIndex& chunk : chunks) {
    if (!chunk.message_index_offsets.empty()) continue;
    const std::uint64_t was_at = chunk.offset;
    const MessageIndex messages =
        content_of(read_chunk(from, chunk).view(), {from.name(), chunk.offset}).messages;
    if (messages.empty()) continue;
    Bytes moved;
    if (chunk.offset + chunk.length_bytes != to.size_bytes()) {
      append(moved, from.read(chunk.offset, chunk.length_bytes).view());
      chunk.offset = to.size_bytes();
    }
    append_message_indexes(moved, messages, to.size_bytes() + moved.size(), chunk);
    to.append(moved);
    if (chunk.offset != was_at) to.overwrite(was_at, std::byte(Op::quarantined));
  }
  std::sort(chunks.begin(), chunks.end(),
            [](const ChunkIndex& a, const ChunkIndex& b) { return a.offset < b.offset; });
}

}  // namespace

Recovery recover(const std::filesystem::path& path) {
  Recovery recovery;
  const File from(path);
  check_magic(from);
  try {
    recovery.statistics = read_summary(from).statistics;
    recovery.was_finished = true;
    return recovery;
  } catch (const McapError& error) {
    recovery.damage.summary = error.what();
  }
  Scan found = scan_recoverable(from);
  AppendFile to = AppendFile::reopen(path, found.damage.intact_bytes);
  for (const std::uint64_t byte : found.damaged_bytes)
    if (byte < found.damage.intact_bytes) to.overwrite(byte, std::byte(Op::quarantined));
  Bytes header;
  if (!found.has_header) append_header(header, "", "");
  to.append(header);
  add_message_indexes(to, from, found.summary.chunks);
  to.append(end_of_file(found.summary, to.size_bytes(), to.crc_of_whole_file()));
  found.damage.summary = std::move(recovery.damage.summary);
  recovery.statistics = found.summary.statistics;
  recovery.damage = std::move(found.damage);
  return recovery;
}

Recovery recover(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  return recover(to);
}

}  // namespace fivepipe::mcap
