#include "common/config/mesh/material_bytes.h"

#include <cmath>
#include <cstring>
#include <type_traits>

namespace fivepipe::config {

namespace {

template <typename T>
void append_value(std::string& bytes, const T& value) {
  static_assert(std::is_trivially_copyable_v<T>);
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
template <typename T>
void append_values(std::string& bytes, const std::vector<T>& values) {
  append_value(bytes, std::uint64_t(values.size()));
  bytes.append(reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size());
}
void append_text(std::string& bytes, const std::string& text) {
  append_value(bytes, std::uint64_t(text.size()));
  bytes += text;
}

// Takes values from the front. If the bytes end before a value, it and all later ones are 0 or
// empty.
class Taker {
 public:
  explicit Taker(std::string_view bytes) : rest_(bytes) {}
  bool is_at_end() const { return is_good_ && rest_.empty(); }
  bool is_good() const { return is_good_; }

  template <typename T>
  T value() {
    T result{};
    if (const std::string_view from = take(sizeof result); !from.empty())
      std::memcpy(&result, from.data(), sizeof result);
    return result;
  }
  // Returns the number of elements that follow, each of at least min_bytes.
  std::size_t count(std::size_t min_bytes) {
    const auto result = value<std::uint64_t>();
    if (result > rest_.size() / min_bytes) is_good_ = false;
    return is_good_ ? result : 0;
  }
  template <typename T>
  std::vector<T> values() {
    std::vector<T> result(count(sizeof(T)));
    if (!result.empty())
      std::memcpy(result.data(), take(sizeof(T) * result.size()).data(), sizeof(T) * result.size());
    return result;
  }
  std::string text() { return std::string(take(count(1))); }

 private:
  std::string_view take(std::size_t bytes) {
    if (bytes > rest_.size()) is_good_ = false;
    if (!is_good_) return {};
    const std::string_view taken = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return taken;
  }

  std::string_view rest_;
  bool is_good_ = true;
};

std::optional<Wrap> wrap_from(std::uint8_t number) {
  if (number > std::uint8_t(Wrap::clamp)) return std::nullopt;
  return Wrap(number);
}

std::optional<Material> material_from(Taker& taker) {
  Material material{taker.text(), taker.value<std::array<float, 3>>()};
  for (const float c : material.base_rgb)
    if (!(c >= 0 && c <= 1)) return std::nullopt;
  if (taker.value<std::uint8_t>() == 0) return material;
  const std::string file = taker.text();
  const int embedded = taker.value<int>();
  const auto wrap_u = wrap_from(taker.value<std::uint8_t>()),
             wrap_v = wrap_from(taker.value<std::uint8_t>());
  if (!wrap_u || !wrap_v || embedded < -1 || file.empty()) return std::nullopt;
  material.texture = MaterialTexture{file, embedded, *wrap_u, *wrap_v};
  return material;
}

bool are_consistent(const MeshMaterials& materials, std::size_t triangles) {
  std::size_t in_runs = 0;
  for (const MaterialRun& run : materials.runs) {
    in_runs += run.triangles;
    if (run.material == kNoMaterial) continue;
    if (run.material >= materials.materials.size()) return false;
    if (materials.materials[run.material].texture && materials.corners_uv.empty()) return false;
  }
  if (!materials.runs.empty() && in_runs != triangles) return false;
  for (const auto& uv : materials.corners_uv)
    for (const float c : uv)
      if (!(std::abs(c) <= kMaxTextureCoordinate)) return false;
  return materials.corners_uv.empty() || materials.corners_uv.size() == 3 * triangles;
}

}  // namespace

std::string bytes_of(const MeshMaterials& materials) {
  std::string bytes;
  append_value(bytes, std::uint64_t(materials.materials.size()));
  for (const Material& material : materials.materials) {
    append_text(bytes, material.name);
    append_value(bytes, material.base_rgb);
    append_value(bytes, std::uint8_t(material.texture.has_value()));
    if (!material.texture) continue;
    append_text(bytes, material.texture->file.string());
    append_value(bytes, material.texture->embedded);
    append_value(bytes, std::uint8_t(material.texture->wrap_u));
    append_value(bytes, std::uint8_t(material.texture->wrap_v));
  }
  append_values(bytes, materials.runs);
  append_values(bytes, materials.corners_uv);
  append_value(bytes, std::uint64_t(materials.notes.size()));
  for (const std::string& note : materials.notes) append_text(bytes, note);
  return bytes;
}

std::optional<MeshMaterials> materials_from(std::string_view bytes, std::size_t triangles) {
  // Bytes of a material without a name and a texture, and of an empty note.
  constexpr std::size_t kMinMaterialBytes = 21, kMinNoteBytes = 8;
  Taker taker(bytes);
  MeshMaterials materials;
  for (std::size_t left = taker.count(kMinMaterialBytes); left > 0; --left) {
    auto material = material_from(taker);
    if (!material || !taker.is_good()) return std::nullopt;
    materials.materials.push_back(std::move(*material));
  }
  materials.runs = taker.values<MaterialRun>();
  materials.corners_uv = taker.values<std::array<float, 2>>();
  for (std::size_t left = taker.count(kMinNoteBytes); left > 0 && taker.is_good(); --left)
    materials.notes.push_back(taker.text());
  if (!taker.is_at_end() || !are_consistent(materials, triangles)) return std::nullopt;
  return materials;
}

}  // namespace fivepipe::config
