// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Vendor/EXT_meshopt_compression
#include "codecs/mesh/meshopt_view.h"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include "codecs/mesh/glb.h"

namespace farfeel::codecs {
namespace {

constexpr std::uint64_t kMost = 1U << 28;  // of elements, as of everything in a document
/// In the tightest packing sixteen bytes of sixteen elements take two bits.
constexpr std::uint64_t kMostTimes = 64, kSmall = 1U << 14;

template <typename Choice, std::size_t kCount>
bool choose(const nlohmann::json& in, const char* key, const std::array<std::pair<const char*, Choice>, kCount>& names,
            Choice& to) {
  const auto found = in.find(key);
  if (found == in.end()) return key == std::string_view("filter");
  for (const auto& [name, choice] : names) {
    if (*found == name) return to = choice, true;
  }
  return false;
}

}  // namespace

tl::expected<MeshoptView, std::string> meshopt_view(const nlohmann::json& extension,
                                                    std::span<const std::uint64_t> buffer_bytes) {
  using Mode = MeshoptView::Mode;
  using Filter = MeshoptView::Filter;
  constexpr std::array<std::pair<const char*, Mode>, 3> kModes{
      {{"ATTRIBUTES", Mode::kAttributes}, {"TRIANGLES", Mode::kTriangles}, {"INDICES", Mode::kIndices}}};
  constexpr std::array<std::pair<const char*, Filter>, 4> kFilters{{{"NONE", Filter::kNone},
                                                                    {"OCTAHEDRAL", Filter::kOctahedral},
                                                                    {"QUATERNION", Filter::kQuaternion},
                                                                    {"EXPONENTIAL", Filter::kExponential}}};
  const auto wrong = [](std::string why) {
    return tl::unexpected("a view under meshopt compression " + std::move(why));
  };
  MeshoptView view;
  if (!extension.is_object() || !choose(extension, "mode", kModes, view.mode) ||
      !choose(extension, "filter", kFilters, view.filter))
    return wrong("has a mode or filter that is none");
  std::string fault;
  const auto integer = [&](const char* key, std::uint64_t most, bool is_needed = true) -> std::size_t {
    if (!is_needed && !extension.contains(key)) return 0;
    const auto value = bounded_integer(extension, key, most);
    if (!value) fault = value.error();
    return value.value_or(0);
  };
  view.buffer = integer("buffer", kMost);
  const std::uint64_t in_buffer = view.buffer < buffer_bytes.size() ? buffer_bytes[view.buffer] : 0;
  view.first = integer("byteOffset", in_buffer, false);
  view.bytes = integer("byteLength", in_buffer);
  view.count = integer("count", kMost);
  view.stride = integer("byteStride", 256);
  if (view.buffer >= buffer_bytes.size()) return wrong("names a buffer that is not there");
  if (!fault.empty()) return wrong("is not as it should be: " + fault);
  if (view.bytes > in_buffer - view.first) return wrong("ends beyond its buffer");
  const bool is_good_stride =
      view.mode == Mode::kAttributes ? view.stride > 0 && view.stride % 4 == 0 : view.stride == 2 || view.stride == 4;
  const bool is_good_filter =
      view.filter == Filter::kNone ||
      (view.mode == Mode::kAttributes && (view.filter == Filter::kExponential || view.stride == 8 ||
                                          (view.filter == Filter::kOctahedral && view.stride == 4)));
  if (!is_good_stride || !is_good_filter || (view.mode == Mode::kTriangles && view.count % 3 != 0))
    return wrong("has a stride, count or filter that its mode does not have");
  if (view.unpacked_bytes() > kMostTimes * view.bytes + kSmall)
    return wrong(fmt::format("claims {} bytes in {}: no packing is so tight", view.unpacked_bytes(), view.bytes));
  return view;
}

tl::expected<std::vector<unsigned char>, std::string> unpacked(const MeshoptView& view,
                                                               std::span<const unsigned char> packed) {
  std::vector<unsigned char> out(view.unpacked_bytes());
  if (view.count == 0) return out;
  int error = 0;
  switch (view.mode) {
    case MeshoptView::Mode::kAttributes:
      error = meshopt_decodeVertexBuffer(out.data(), view.count, view.stride, packed.data(), packed.size());
      break;
    case MeshoptView::Mode::kTriangles:
      error = meshopt_decodeIndexBuffer(out.data(), view.count, view.stride, packed.data(), packed.size());
      break;
    case MeshoptView::Mode::kIndices:
      error = meshopt_decodeIndexSequence(out.data(), view.count, view.stride, packed.data(), packed.size());
      break;
  }
  if (error != 0) {
    return tl::unexpected(
        fmt::format("bytes under meshopt compression cannot be unpacked (error {}): the file is damaged, or packed by "
                    "a newer version of it; export without it",
                    error));
  }
  switch (view.filter) {
    case MeshoptView::Filter::kNone:
      break;
    case MeshoptView::Filter::kOctahedral:
      meshopt_decodeFilterOct(out.data(), view.count, view.stride);
      break;
    case MeshoptView::Filter::kQuaternion:
      meshopt_decodeFilterQuat(out.data(), view.count, view.stride);
      break;
    case MeshoptView::Filter::kExponential:
      meshopt_decodeFilterExp(out.data(), view.count, view.stride);
      break;
  }
  return out;
}

}  // namespace farfeel::codecs
