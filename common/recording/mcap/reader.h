// Reads MCAP files (https://mcap.dev/spec): finished files by their summary, unfinished ones
// (process killed, power cut, disk full) by a scan from the start.
#pragma once
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <set>

#include "common/recording/mcap/cursor.h"
#include "common/recording/mcap/format/summary.h"
#include "common/recording/mcap/scan.h"

namespace fivepipe::mcap {

struct Header {
  std::string profile, library;  // profile of the file's content; program that wrote it
};

// Loads the summary and the requested parts only. Opening an unfinished file reads it once, one
// chunk at a time.
class Reader {
 public:
  // Throws std::system_error if the file cannot be read, McapError if it is not an MCAP file.
  explicit Reader(const std::filesystem::path& path);

  // True if the file has a valid summary.
  bool is_finished() const { return damage_.summary.empty(); }
  const Damage& damage() const { return damage_; }  // empty if the file is finished

  const Header& header() const { return header_; }  // empty if it is damaged
  const std::map<Id, Schema>& schemas() const { return summary_.schemas; }
  const std::map<Id, Channel>& channels() const { return summary_.channels; }
  const Statistics& statistics() const { return summary_.statistics; }
  const std::vector<ChunkIndex>& chunks() const { return summary_.chunks; }
  const std::vector<AttachmentIndex>& attachments() const { return summary_.attachments; }
  const std::vector<MetadataIndex>& metadata() const { return summary_.metadata; }
  // Take an entry of attachments() or metadata(). Throw McapError if the record is damaged.
  Attachment read(const AttachmentIndex& attachment) const;
  Metadata read(const MetadataIndex& metadata) const;

  // Messages with a log stamp in [start_ns, end_ns], of the channels `only` or of all channels.
  Cursor messages(std::uint64_t start_ns = 0,
                  std::uint64_t end_ns = std::numeric_limits<std::uint64_t>::max(),
                  const std::optional<std::set<Id>>& only = std::nullopt) const;

 private:
  Buffer content_of_record(std::uint64_t byte, std::uint64_t length_bytes, Op op) const;

  std::shared_ptr<const File> file_;
  Header header_;
  Summary summary_;
  Damage damage_;
};

}  // namespace fivepipe::mcap
