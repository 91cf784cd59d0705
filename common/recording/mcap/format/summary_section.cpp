#include "common/recording/mcap/format/summary_section.h"

#include <algorithm>
#include <cstring>

#include "common/recording/mcap/format/records.h"

namespace fivepipe::mcap {
namespace {

// For comparison: the indexes of 100 000 chunks with 10 channels each take 30 MB.
constexpr std::uint64_t kMaxSummaryBytes = 256 << 20;

// Calls `append_all`, which appends the records of one kind, and adds a summary offset record for
// them if there are any.
template <typename AppendAll>
void append_group(Bytes& to, Bytes& offsets, std::uint64_t to_starts_at, Op op,
                  AppendAll append_all) {
  const std::uint64_t start = to.size();
  append_all();
  if (to.size() == start) return;
  const OpenRecord record(offsets, Op::summary_offset);
  append(offsets, std::uint8_t(op));
  append(offsets, to_starts_at + start);
  append(offsets, std::uint64_t(to.size() - start));
}

void append_groups(Bytes& to, Bytes& offsets, std::uint64_t to_starts_at, const Summary& summary) {
  const auto group = [&](Op op, auto append_all) {
    append_group(to, offsets, to_starts_at, op, append_all);
  };
  group(Op::schema, [&] {
    for (const auto& [id, schema] : summary.schemas) append_schema(to, id, schema);
  });
  group(Op::channel, [&] {
    for (const auto& [id, channel] : summary.channels) append_channel(to, id, channel);
  });
  group(Op::statistics, [&] { append_statistics(to, summary.statistics); });
  group(Op::chunk_index, [&] {
    for (const ChunkIndex& chunk : summary.chunks) append_chunk_index(to, chunk);
  });
  group(Op::attachment_index, [&] {
    for (const AttachmentIndex& attachment : summary.attachments)
      append_attachment_index(to, attachment);
  });
  group(Op::metadata_index, [&] {
    for (const MetadataIndex& metadata : summary.metadata) append_metadata_index(to, metadata);
  });
}

Footer footer_of(const File& file) {
  const FileOffset end{file.name(), file.size_bytes()};
  if (file.size_bytes() < 2 * kMagic.size() + kFooterBytes) end.fail("no footer");
  const std::uint64_t at = file.size_bytes() - kMagic.size() - kFooterBytes;
  const Buffer bytes = file.read(at, kFooterBytes + kMagic.size());
  if (std::memcmp(bytes.view().data() + kFooterBytes, kMagic.data(), kMagic.size()) != 0)
    end.fail("no magic bytes at the end");
  const FileOffset location{file.name(), at};
  const auto record = RecordSequence(bytes.view().first(kFooterBytes), location).next();
  if (!record || record->op != Op::footer ||
      record->content.size() != kFooterBytes - kRecordHeaderBytes)
    location.fail("no footer");
  const Footer footer = read_footer(ByteReader(record->content, location));
  if (footer.summary_start == 0) location.fail("no summary");
  const std::uint64_t summary_end =
      footer.summary_offset_start == 0 ? at : footer.summary_offset_start;
  if (footer.summary_start < kMagic.size() + kDataEndBytes || summary_end > at ||
      footer.summary_start > summary_end || at - footer.summary_start > kMaxSummaryBytes)
    location.fail("the footer's summary offset is invalid");
  const Buffer data_end = file.read(footer.summary_start - kDataEndBytes, kDataEndBytes);
  if (Op(std::uint8_t(data_end.view()[0])) != Op::data_end)
    location.fail("the footer's summary offset is invalid");
  return footer;
}

// Checks that all indexed records are in the data section and do not overlap: otherwise a small
// file could take unlimited time to read.
template <typename Index>
void check_offsets(std::vector<Index>& indexes, std::uint64_t data_end,
                   const FileOffset& location) {
  std::sort(indexes.begin(), indexes.end(),
            [](const Index& a, const Index& b) { return a.offset < b.offset; });
  std::uint64_t free_from = kMagic.size();
  for (const Index& index : indexes) {
    if (index.offset < free_from || index.offset > data_end ||
        index.length_bytes < kRecordHeaderBytes || index.length_bytes > data_end - index.offset)
      location.fail("the summary has an invalid record offset");
    free_from = index.offset + index.length_bytes;
  }
}

void check(Summary& summary, bool has_statistics, std::uint64_t data_end,
           const FileOffset& location) {
  check_offsets(summary.chunks, data_end, location);
  check_offsets(summary.attachments, data_end, location);
  check_offsets(summary.metadata, data_end, location);
  const Statistics& statistics = summary.statistics;
  if (!has_statistics) location.fail("the summary has no statistics");
  if (statistics.chunks != summary.chunks.size() ||
      statistics.attachments != summary.attachments.size() ||
      statistics.metadata != summary.metadata.size() ||
      (statistics.messages > 0 && summary.chunks.empty()))
    location.fail("the summary's statistics contradict its indexes");
}

}  // namespace

Bytes end_of_file(const Summary& summary, std::uint64_t data_bytes, std::uint32_t data_crc) {
  Bytes end;
  {
    const OpenRecord data_end(end, Op::data_end);
    append(end, data_crc);
  }
  Bytes section, offsets;
  const std::uint64_t summary_start = data_bytes + end.size();
  append_groups(section, offsets, summary_start, summary);
  const std::uint64_t summary_offset_start = summary_start + section.size();
  append(section, ByteView(offsets));
  append(section, std::uint8_t(Op::footer));
  append(section, std::uint64_t(kFooterBytes - kRecordHeaderBytes));
  append(section, summary_start);
  append(section, summary_offset_start);
  append(section, crc32_of(section));
  append(end, ByteView(section));
  append_magic(end);
  return end;
}

Summary read_summary(const File& file) {
  const Footer footer = footer_of(file);
  const FileOffset location{file.name(), footer.summary_start};
  const std::uint64_t footer_at = file.size_bytes() - kMagic.size() - kFooterBytes;
  const Buffer bytes =
      file.read(footer.summary_start, footer_at + kFooterBytes - footer.summary_start);
  const ByteView covered = bytes.view().first(bytes.view().size() - sizeof(footer.summary_crc));
  if (footer.summary_crc != 0 && footer.summary_crc != crc32_of(covered))
    location.fail("the summary's CRC is wrong");

  Summary summary;
  bool has_statistics = false;
  const std::uint64_t end =
      footer.summary_offset_start == 0 ? footer_at : footer.summary_offset_start;
  RecordSequence records(bytes.view().first(end - footer.summary_start), location);
  while (const auto record = records.next()) {
    const ByteReader fields(record->content, {file.name(), footer.summary_start + record->offset});
    switch (record->op) {
      case Op::schema: summary.schemas.insert(read_schema(fields)); break;
      case Op::channel: summary.channels.insert(read_channel(fields)); break;
      case Op::statistics:
        summary.statistics = read_statistics(fields);
        has_statistics = true;
        break;
      case Op::chunk_index: summary.chunks.push_back(read_chunk_index(fields)); break;
      case Op::attachment_index:
        summary.attachments.push_back(read_attachment_index(fields));
        break;
      case Op::metadata_index: summary.metadata.push_back(read_metadata_index(fields)); break;
      default: break;
    }
  }
  summary.schemas.erase(0);  // the specification declares id 0 invalid: ignore it
  check(summary, has_statistics, footer.summary_start - kDataEndBytes, location);
  return summary;
}

}  // namespace fivepipe::mcap
