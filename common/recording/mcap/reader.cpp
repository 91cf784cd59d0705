#include "common/recording/mcap/reader.h"

#include "common/recording/mcap/format/records.h"
#include "common/recording/mcap/format/summary_section.h"

namespace fivepipe::mcap {

namespace {

// A header holds a profile and the name and version of a library, which are far shorter.
constexpr std::uint64_t kMaxHeaderBytes = 1 << 20;

Header header_of(const File& file) {
  const FileOffset location{file.name(), kMagic.size()};
  if (file.size_bytes() < kMagic.size() + kRecordHeaderBytes) return {};
  const Buffer head = file.read(location.byte, kRecordHeaderBytes);
  ByteReader fields(head.view(), location);
  if (Op(fields.take<std::uint8_t>()) != Op::header) return {};
  const std::uint64_t content_bytes = fields.take<std::uint64_t>();
  if (content_bytes > kMaxHeaderBytes ||
      content_bytes > file.size_bytes() - location.byte - kRecordHeaderBytes)
    return {};
  const Buffer content = file.read(location.byte + kRecordHeaderBytes, content_bytes);
  try {
    ByteReader texts(content.view(), location);
    std::string profile = texts.text();
    return {std::move(profile), texts.text()};
  } catch (const McapError&) {
    return {};  // the header is not needed to read messages
  }
}

}  // namespace

Reader::Reader(const std::filesystem::path& path) : file_(std::make_shared<const File>(path)) {
  check_magic(*file_);
  header_ = header_of(*file_);
  try {
    summary_ = read_summary(*file_);
  } catch (const McapError& error) {
    Scan found = scan(*file_);
    summary_ = std::move(found.summary);
    damage_ = std::move(found.damage);
    damage_.summary = error.what();
  }
}

Buffer Reader::content_of_record(std::uint64_t byte, std::uint64_t length_bytes, Op op) const {
  const Buffer head = file_->read(byte, kRecordHeaderBytes);
  const FileOffset location{file_->name(), byte};
  ByteReader fields(head.view(), location);
  if (Op(fields.take<std::uint8_t>()) != op ||
      fields.take<std::uint64_t>() != length_bytes - kRecordHeaderBytes)
    location.fail("not a record of the indexed type and length");
  return file_->read(byte + kRecordHeaderBytes, length_bytes - kRecordHeaderBytes);
}

Attachment Reader::read(const AttachmentIndex& attachment) const {
  const Buffer content =
      content_of_record(attachment.offset, attachment.length_bytes, Op::attachment);
  return read_attachment({content.view(), {file_->name(), attachment.offset}});
}

Metadata Reader::read(const MetadataIndex& metadata) const {
  const Buffer content = content_of_record(metadata.offset, metadata.length_bytes, Op::metadata);
  return read_metadata({content.view(), {file_->name(), metadata.offset}});
}

Cursor Reader::messages(std::uint64_t start_ns, std::uint64_t end_ns,
                        const std::optional<std::set<Id>>& only) const {
  std::vector<bool> wanted(std::numeric_limits<Id>::max() + std::size_t(1), false);
  for (const auto& [id, channel] : summary_.channels) wanted[id] = !only || only->contains(id);
  return {file_, summary_.chunks, start_ns, end_ns, std::move(wanted)};
}

}  // namespace fivepipe::mcap
