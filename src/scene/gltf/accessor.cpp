// Accessors: every component type, normalized integers, strides, sparse values, absent buffer
// views; all offsets in 64-bit overflow-checked arithmetic before a byte is read.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "scene/gltf/check.h"
#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {
namespace {

/// Embree aborts the process from about 1e19; nothing real is that large.
constexpr float kMaxMagnitude = 1e18f;

std::size_t componentSize(int componentType) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return 1;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return 2;
    default:
      return 4;
  }
}

unsigned componentBit(int componentType, bool normalized) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return normalized ? kByteNormalized : kByte;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return normalized ? kUnsignedByteNormalized : kUnsignedByte;
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return normalized ? kShortNormalized : kShort;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return normalized ? kUnsignedShortNormalized : kUnsignedShort;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return normalized ? 0u : static_cast<unsigned>(kUnsignedInt);
    default:
      return normalized ? 0u : static_cast<unsigned>(kFloat);
  }
}

std::string allowedNames(unsigned allowed) {
  static constexpr std::pair<unsigned, const char*> kNames[] = {
      {kFloat, "float"},
      {kByte, "byte"},
      {kByteNormalized, "normalized byte"},
      {kUnsignedByte, "unsigned byte"},
      {kUnsignedByteNormalized, "normalized unsigned byte"},
      {kShort, "short"},
      {kShortNormalized, "normalized short"},
      {kUnsignedShort, "unsigned short"},
      {kUnsignedShortNormalized, "normalized unsigned short"},
      {kUnsignedInt, "unsigned int"}};
  std::string names;
  for (const auto& [bit, name] : kNames) {
    if ((allowed & bit) != 0) names += (names.empty() ? "" : ", ") + std::string(name);
  }
  return names;
}

const char* typeName(int components) {
  switch (components) {
    case 1:
      return "SCALAR";
    case 2:
      return "VEC2";
    case 3:
      return "VEC3";
    case 4:
      return "VEC4";
    default:
      return "MAT4";
  }
}

/// One component as a float; normalized as glTF 2.0, section 3.6.2.2 has it.
template <class T>
float asFloat(const std::uint8_t* p, bool normalized) {
  T value;
  std::memcpy(&value, p, sizeof value);
  if constexpr (std::is_floating_point_v<T>) {
    return value;
  } else {
    const auto f = static_cast<float>(value);
    if (!normalized) return f;
    return std::max(f / static_cast<float>(std::numeric_limits<T>::max()), -1.0f);
  }
}

template <class T>
void convert(const std::uint8_t* in, std::size_t stride, std::size_t count, int components,
             bool normalized, float* out) {
  for (std::size_t i = 0; i < count; ++i, in += stride) {
    for (int c = 0; c < components; ++c) {
      *out++ = asFloat<T>(in + static_cast<std::size_t>(c) * sizeof(T), normalized);
    }
  }
}

void convertElements(int componentType, const std::uint8_t* in, std::size_t stride,
                     std::size_t count, int components, bool normalized, float* out) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return convert<std::int8_t>(in, stride, count, components, normalized, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return convert<std::uint8_t>(in, stride, count, components, normalized, out);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return convert<std::int16_t>(in, stride, count, components, normalized, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return convert<std::uint16_t>(in, stride, count, components, normalized, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return convert<std::uint32_t>(in, stride, count, components, normalized, out);
    default:
      break;
  }
  const std::size_t element = static_cast<std::size_t>(components) * sizeof(float);
  if (stride == element) {
    std::memcpy(out, in, count * element);
  } else {
    convert<float>(in, stride, count, components, normalized, out);
  }
}

std::uint32_t unsignedAt(int componentType, const std::uint8_t* p) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return *p;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: {
      std::uint16_t value;
      std::memcpy(&value, p, sizeof value);
      return value;
    }
    default: {
      std::uint32_t value;
      std::memcpy(&value, p, sizeof value);
      return value;
    }
  }
}

}  // namespace

/// Where an accessor's elements lie.
struct Reader::Layout {
  const std::uint8_t* data = nullptr;  ///< null: all zero
  std::size_t stride = 0;
  const std::uint8_t* sparseIndices = nullptr;
  const std::uint8_t* sparseValues = nullptr;
  int sparseIndexType = 0;
  std::size_t sparseCount = 0;
};

void Reader::fail(const std::string& place, const std::string& message) const {
  gltf::fail(file, place, message);
}

void Reader::reserveBytes(std::size_t bytes, const std::string& place) {
  if (bytes > limits.maxBytes || bytes_.fetch_add(bytes) + bytes > limits.maxBytes) {
    fail(place, "the scene takes more than " + std::to_string(limits.maxBytes) +
                    " bytes of memory; CATOPTRIC_SCENE_MIB raises this limit");
  }
}

int Reader::componentsOf(int accessor) const {
  switch (model.accessors[static_cast<std::size_t>(accessor)].type) {
    case TINYGLTF_TYPE_SCALAR:
      return 1;
    case TINYGLTF_TYPE_VEC2:
      return 2;
    case TINYGLTF_TYPE_VEC3:
      return 3;
    case TINYGLTF_TYPE_VEC4:
      return 4;
    case TINYGLTF_TYPE_MAT4:
      return 16;
    default:
      return 0;  // MAT2 and MAT3 have no use in glTF 2.0
  }
}

std::span<const std::uint8_t> Reader::bytesOf(int bufferView, const std::string& place) const {
  const tinygltf::BufferView& view = model.bufferViews[static_cast<std::size_t>(bufferView)];
  return bytesOf(view.buffer, view.byteOffset, view.byteLength,
                 elementPlace("bufferViews", static_cast<std::size_t>(bufferView)), place);
}

std::span<const std::uint8_t> Reader::bytesOf(int buffer, std::size_t offset, std::size_t length,
                                              const std::string& what,
                                              const std::string& place) const {
  const std::vector<unsigned char>& data = model.buffers[static_cast<std::size_t>(buffer)].data;
  if (offset > data.size() || length > data.size() - offset) {
    fail(place, what + " (" + std::to_string(length) + " bytes at " + std::to_string(offset) +
                    ") reaches past the end of its buffer (" + std::to_string(data.size()) +
                    " bytes)");
  }
  return {data.data() + offset, length};
}

Reader::Layout Reader::layoutOf(int index, const std::string& place) const {
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(index)];
  const std::string self = elementPlace("accessors", static_cast<std::size_t>(index));
  const std::size_t size = componentSize(a.componentType);
  const std::size_t element = size * static_cast<std::size_t>(componentsOf(index));

  // Checks that `count` elements at `offset` lie inside a buffer view, and their alignment.
  const auto locate = [&](int bufferView, std::size_t offset, std::size_t stride,
                          std::size_t elementSize, std::size_t count, std::size_t alignment,
                          const std::string& what) {
    const std::span<const std::uint8_t> bytes = bytesOf(bufferView, place);
    const std::size_t viewOffset =
        model.bufferViews[static_cast<std::size_t>(bufferView)].byteOffset;
    if (offset % alignment != 0 || (viewOffset + offset) % alignment != 0 ||
        stride % alignment != 0) {
      fail(place, what + ": byteOffset " + std::to_string(viewOffset) + " + " +
                      std::to_string(offset) + " or stride " + std::to_string(stride) +
                      " is not aligned to " + std::to_string(alignment) + " bytes");
    }
    std::size_t span = 0;
    if (__builtin_mul_overflow(count - 1, stride, &span) ||
        __builtin_add_overflow(span, elementSize, &span) ||
        __builtin_add_overflow(span, offset, &span) || span > bytes.size()) {
      fail(place, what + ": " + std::to_string(count) + " elements at " + std::to_string(offset) +
                      " reach past the end of /bufferViews/" + std::to_string(bufferView) + " (" +
                      std::to_string(bytes.size()) + " bytes)");
    }
    return bytes.data() + offset;
  };

  Layout layout;
  layout.stride = element;
  if (a.bufferView >= 0) {
    const std::size_t stride = model.bufferViews[static_cast<std::size_t>(a.bufferView)].byteStride;
    if (stride != 0) {
      if (stride < element) {
        fail(place, self + ": byteStride " + std::to_string(stride) +
                        " is smaller than its elements (" + std::to_string(element) + " bytes)");
      }
      layout.stride = stride;
    }
    layout.data = locate(a.bufferView, a.byteOffset, layout.stride, element, a.count, size, self);
  } else if (a.byteOffset != 0) {
    fail(place, self + ": has a byteOffset but no bufferView");
  }
  if (a.sparse.isSparse) {
    layout.sparseCount = static_cast<std::size_t>(a.sparse.count);
    if (layout.sparseCount > a.count) {
      fail(place, self + "/sparse/count: " + std::to_string(layout.sparseCount) +
                      " is more than the accessor's count " + std::to_string(a.count));
    }
    layout.sparseIndexType = a.sparse.indices.componentType;
    const std::size_t indexSize = componentSize(layout.sparseIndexType);
    layout.sparseIndices =
        locate(a.sparse.indices.bufferView, static_cast<std::size_t>(a.sparse.indices.byteOffset),
               indexSize, indexSize, layout.sparseCount, indexSize, self + "/sparse/indices");
    layout.sparseValues =
        locate(a.sparse.values.bufferView, static_cast<std::size_t>(a.sparse.values.byteOffset),
               element, element, layout.sparseCount, size, self + "/sparse/values");
    std::size_t next = 0;
    for (std::size_t i = 0; i < layout.sparseCount; ++i) {
      const std::size_t at =
          unsignedAt(layout.sparseIndexType, layout.sparseIndices + i * indexSize);
      if (at >= a.count || at < next) {
        fail(place, self + "/sparse/indices: index " + std::to_string(at) + " at " +
                        std::to_string(i) + " is out of range or not increasing");
      }
      next = at + 1;
    }
  }
  return layout;
}

std::size_t Reader::prepare(int accessor, int components, unsigned allowed,
                            const std::string& place) const {
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor)];
  const std::string self = elementPlace("accessors", static_cast<std::size_t>(accessor));
  if (componentsOf(accessor) != components) {
    const int have = componentsOf(accessor);
    fail(place, self + ": type is " + (have == 0 ? "MAT2 or MAT3" : typeName(have)) + ", must be " +
                    typeName(components));
  }
  if ((componentBit(a.componentType, a.normalized) & allowed) == 0) {
    fail(place, self + ": component type " + std::to_string(a.componentType) +
                    (a.normalized ? " (normalized)" : "") +
                    " is not allowed here: " + allowedNames(allowed));
  }
  if (a.count > limits.maxBytes) {
    fail(place, self + ": count " + std::to_string(a.count) + " takes more than " +
                    std::to_string(limits.maxBytes) +
                    " bytes of memory; CATOPTRIC_SCENE_MIB raises this limit");
  }
  return a.count;
}

void Reader::readFloats(int accessor, float* out, const std::string& place) const {
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor)];
  const Layout layout = layoutOf(accessor, place);
  const int components = componentsOf(accessor);
  const std::size_t total = a.count * static_cast<std::size_t>(components);
  if (layout.data != nullptr) {
    convertElements(a.componentType, layout.data, layout.stride, a.count, components, a.normalized,
                    out);
  } else {
    std::fill_n(out, total, 0.0f);
  }
  const std::size_t indexSize = componentSize(layout.sparseIndexType);
  const std::size_t element = componentSize(a.componentType) * static_cast<std::size_t>(components);
  for (std::size_t i = 0; i < layout.sparseCount; ++i) {
    const std::size_t at = unsignedAt(layout.sparseIndexType, layout.sparseIndices + i * indexSize);
    convertElements(a.componentType, layout.sparseValues + i * element, element, 1, components,
                    a.normalized, out + at * static_cast<std::size_t>(components));
  }

  // NaN fails the comparison too.
  bool good = true;
  for (std::size_t i = 0; i < total; ++i) good &= std::abs(out[i]) < kMaxMagnitude;
  if (!good) {
    const float* bad =
        std::find_if(out, out + total, [](float x) { return !(std::abs(x) < kMaxMagnitude); });
    const std::size_t at = static_cast<std::size_t>(bad - out);
    fail(place, elementPlace("accessors", static_cast<std::size_t>(accessor)) + ": element " +
                    std::to_string(at / static_cast<std::size_t>(components)) + " has the value " +
                    std::to_string(*bad) + "; finite values below 1e18 are allowed");
  }
}

std::vector<float> Reader::floats(int accessor, int components, unsigned allowed,
                                  const std::string& place) {
  const std::size_t count = prepare(accessor, components, allowed, place);
  const std::size_t total = count * static_cast<std::size_t>(components);
  reserveBytes(total * sizeof(float), place);
  std::vector<float> result(total);
  readFloats(accessor, result.data(), place);
  return result;
}

std::vector<std::uint32_t> Reader::integers(int accessor, int components, unsigned allowed,
                                            const std::string& place) {
  const std::size_t count = prepare(accessor, components, allowed, place);
  const tinygltf::Accessor& a = model.accessors[static_cast<std::size_t>(accessor)];
  const Layout layout = layoutOf(accessor, place);
  const std::size_t size = componentSize(a.componentType);
  const std::size_t perElement = static_cast<std::size_t>(components);
  reserveBytes(count * perElement * sizeof(std::uint32_t), place);
  std::vector<std::uint32_t> result(count * perElement, 0);
  if (layout.data != nullptr) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint8_t* in = layout.data + i * layout.stride;
      for (std::size_t c = 0; c < perElement; ++c) {
        result[i * perElement + c] = unsignedAt(a.componentType, in + c * size);
      }
    }
  }
  const std::size_t indexSize = componentSize(layout.sparseIndexType);
  for (std::size_t i = 0; i < layout.sparseCount; ++i) {
    const std::size_t at = unsignedAt(layout.sparseIndexType, layout.sparseIndices + i * indexSize);
    for (std::size_t c = 0; c < perElement; ++c) {
      result[at * perElement + c] =
          unsignedAt(a.componentType, layout.sparseValues + (i * perElement + c) * size);
    }
  }
  return result;
}

// ---- Extension values ----

const tinygltf::Value& member(const tinygltf::Value& object, const std::string& key) {
  static const tinygltf::Value null;
  return object.IsObject() && object.Has(key) ? object.Get(key) : null;
}

const tinygltf::Value& extension(const tinygltf::ExtensionMap& extensions,
                                 const std::string& name) {
  static const tinygltf::Value null;
  const auto found = extensions.find(name);
  return found == extensions.end() ? null : found->second;
}

double numberOr(const tinygltf::Value& object, const std::string& key, double otherwise) {
  const tinygltf::Value& value = member(object, key);
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

Vec3 vec3Or(const tinygltf::Value& object, const std::string& key, const Vec3& otherwise) {
  const tinygltf::Value& value = member(object, key);
  if (!value.IsArray() || value.ArrayLen() != 3) return otherwise;
  return {static_cast<float>(value.Get(0).GetNumberAsDouble()),
          static_cast<float>(value.Get(1).GetNumberAsDouble()),
          static_cast<float>(value.Get(2).GetNumberAsDouble())};
}

std::string elementPlace(const char* array, std::size_t index) {
  return "/" + std::string(array) + "/" + std::to_string(index);
}

}  // namespace catoptric::scene::gltf
