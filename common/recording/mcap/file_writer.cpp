#include "common/recording/mcap/file_writer.h"

#include "common/recording/mcap/format/chunk_records.h"
#include "common/recording/mcap/format/compression.h"
#include "common/recording/mcap/format/summary_section.h"

namespace fivepipe::mcap {

FileWriter::FileWriter(const std::filesystem::path& path, Compression compression,
                       std::string_view library, std::string_view profile)
    : file_(AppendFile::create(path)), compression_(compression), chunks_(name_of(compression)) {
  append_magic(record_);
  append_header(record_, profile, library);
  file_.append(record_);
}

bool FileWriter::write(const Chunk& chunk, const StopCondition& stop) {
  if (chunk.index.empty()) return true;
  record_.clear();
  ChunkIndex index = append_chunk(record_, chunk, compression_, file_.size_bytes());
  append_message_indexes(record_, chunk.index, file_.size_bytes() + record_.size(), index);
  if (!file_.append(record_, stop)) return false;

  summary_.schemas.insert(chunk.schemas.begin(), chunk.schemas.end());
  summary_.channels.insert(chunk.channels.begin(), chunk.channels.end());
  for (const auto& [channel, entries] : chunk.index)
    add_messages(summary_.statistics, channel, entries.size(), chunk.start_ns, chunk.end_ns);
  chunks_.add(index);
  return true;
}

void FileWriter::attach(const Attachment& attachment) {
  record_.clear();
  append_attachment(record_, attachment);
  const AttachmentIndex index{file_.size_bytes(),        record_.size(),
                              attachment.log_stamp_ns,   attachment.create_stamp_ns,
                              attachment.content.size(), attachment.name,
                              attachment.media_type};
  file_.append(record_);
  summary_.attachments.push_back(index);
}

void FileWriter::add(const Metadata& metadata) {
  record_.clear();
  append_metadata(record_, metadata);
  const MetadataIndex index{file_.size_bytes(), record_.size(), metadata.name};
  file_.append(record_);
  summary_.metadata.push_back(index);
}

bool FileWriter::finish(const StopCondition& stop) {
  summary_.chunks = chunks_.unpacked();
  count_records(summary_);
  return file_.append(end_of_file(summary_, file_.size_bytes(), file_.crc()), stop);
}

}  // namespace fivepipe::mcap
