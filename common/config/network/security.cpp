#include "common/config/network/security.h"

namespace fivepipe::config {

std::optional<Security> read_security(YamlMap& map) {
  if (!map.has("security")) return std::nullopt;
  YamlMap keys = map.map("security");
  Security security{keys.path("keys"), map.location_of("security").line};
  keys.finish();
  return security;
}

}  // namespace fivepipe::config
