// Reads MCAP files (https://mcap.dev/spec): finished ones by their summary, others (process killed,
// power cut, disk full) by a scan from the start.
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
  std::string profile, library;  // what the whole file complies with; what wrote it
};

// Never loads more of a file than its summary and what is asked for. Of an unfinished file, opening
// it reads everything once, a chunk at a time.
class Reader {
 public:
  // std::system_error: the file can't be read. McapError: it does not begin as an MCAP file.
  explicit Reader(const std::filesystem::path& path);
  // The same, but scans finished files too, and so finds out what of them is damaged.
  static Reader scanning(const std::filesystem::path& path);

  // There is a good summary.
  bool is_finished() const { return damage_.summary.empty(); }
  const Damage& damage() const { return damage_; }  // beyond `summary`: what a scan found

  const Header& header() const { return header_; }  // empty where it is damaged
  const std::map<Id, Schema>& schemas() const { return summary_.schemas; }
  const std::map<Id, Channel>& channels() const { return summary_.channels; }
  const Statistics& statistics() const { return summary_.statistics; }
  const std::vector<ChunkIndex>& chunks() const { return summary_.chunks; }
  const std::vector<AttachmentIndex>& attachments() const { return summary_.attachments; }
  const std::vector<MetadataIndex>& metadata() const { return summary_.metadata; }
  // By what attachments() and metadata() give. McapError: damaged.
  Attachment read(const AttachmentIndex& attachment) const;
  Metadata read(const MetadataIndex& metadata) const;

  // Messages whose log stamp is in [start_ns, end_ns], of these channels; without `only`, of all.
  Cursor messages(std::uint64_t start_ns = 0,
                  std::uint64_t end_ns = std::numeric_limits<std::uint64_t>::max(),
                  const std::optional<std::set<Id>>& only = std::nullopt) const;

 private:
  Reader(const std::filesystem::path& path, bool scans);
  Buffer content_of_record(std::uint64_t byte, std::uint64_t length_bytes, Op op) const;

  std::shared_ptr<const File> file_;
  Header header_;
  Summary summary_;
  Damage damage_;
};

}  // namespace fivepipe::mcap
