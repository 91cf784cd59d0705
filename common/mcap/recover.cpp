#include "common/mcap/recover.h"

#include <algorithm>

#include "common/mcap/append_file.h"
#include "common/mcap/chunk_records.h"
#include "common/mcap/summary_section.h"

namespace fivepipe::mcap {

Recovery recover(const std::filesystem::path& path) {
  Recovery recovery;
  Scan found;
  {
    const File file(path);
    check_magic(file);
    try {
      recovery.statistics = read_summary(file).statistics;
      recovery.was_finished = true;
      return recovery;
    } catch (const McapError& error) {
      found = scan(file);
      found.damage.summary = error.what();
    }
    Summary& summary = found.summary;
    if (std::any_of(summary.chunks.begin(), summary.chunks.end(), [](const ChunkIndex& chunk) { return chunk.loose; }))
      Place{file.name(), 0}.fail("has messages outside of chunks, which no summary finds");
  }
  AppendFile file = AppendFile::reopen(path, found.damage.whole_bytes);
  for (const std::uint64_t byte : found.damaged_bytes)
    if (byte < found.damage.whole_bytes) file.overwrite(byte, std::byte(Op::set_aside));
  Bytes rest;
  if (!found.has_header) append_header(rest, "", "");
  if (!found.index_missing.empty()) append_message_indexes(rest, found.index_missing, file.size_bytes() + rest.size(), found.summary.chunks.back());
  file.append(rest);
  file.append(end_of_file(found.summary, file.size_bytes(), file.crc_of_whole_file()));
  recovery.statistics = found.summary.statistics;
  recovery.damage = std::move(found.damage);
  return recovery;
}

Recovery recover(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  return recover(to);
}

}  // namespace fivepipe::mcap
