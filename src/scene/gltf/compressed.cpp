#include "scene/gltf/compressed.h"

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "core/parallel.h"
#include "scene/gltf/reader.h"

namespace catoptric::scene::gltf {
namespace {

using config::Value;

constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kDraco = "KHR_draco_mesh_compression";
/// What Draco takes for each corner of a triangle: its table of corners, and ours.
constexpr std::size_t kDracoBytes = 16;
/// What stands in for a fallback buffer: tinygltf needs one byte.
constexpr const char* kOneByte = R"(1,"uri":"data:application/octet-stream;base64,AA==")";

Value extensionOf(const Value& owner, const char* name) {
  const Value extensions = owner.get("extensions");
  return extensions.isNull() ? extensions : extensions.get(name);
}

std::size_t sizeOr(const Value& object, const char* key, std::size_t otherwise) {
  return object.has(key) ? static_cast<std::size_t>(object.get(key).asNumber()) : otherwise;
}

/// Replaces the text of a number, also if there is a rewrite of it already.
void replaceNumber(const Value& number, std::string text, std::vector<Rewrite>& rewrites) {
  const std::pair<std::size_t, std::size_t> range = number.textRange();
  std::erase_if(rewrites, [&](const Rewrite& r) { return r.begin == range.first; });
  rewrites.push_back({range.first, range.second, std::move(text)});
}

/// meshoptimizer asserts what is checked here.
void checkMeshoptView(const Checker& check, const Value& view, const Value& packed,
                      const std::string& place) {
  const std::string mode = packed.get("mode").asString();
  const std::string filter = packed.has("filter") ? packed.get("filter").asString() : "NONE";
  const std::size_t stride = sizeOr(packed, "byteStride", 0);
  const std::size_t count = sizeOr(packed, "count", 0);
  const auto refuseStride = [&](const std::string& allowed) {
    check.failAt(place + "/byteStride",
                 std::to_string(stride) + " is not allowed with mode " + mode +
                     (filter == "NONE" ? "" : " and filter " + filter) + ": " + allowed);
  };
  if (mode != "ATTRIBUTES") {
    if (stride != 2 && stride != 4) refuseStride("2 or 4");
    if (filter != "NONE") check.failAt(place + "/filter", filter + " needs the mode ATTRIBUTES");
    if (mode == "TRIANGLES" && count % 3 != 0)
      check.failAt(place + "/count", std::to_string(count) + " is not a multiple of 3");
  } else if (stride % 4 != 0) {
    refuseStride("a multiple of 4, up to 256");
  } else if (filter == "OCTAHEDRAL" && stride != 4 && stride != 8) {
    refuseStride("4 or 8");
  } else if (filter == "QUATERNION" && stride != 8) {
    refuseStride("8");
  }
  const std::size_t length = sizeOr(view, "byteLength", 0);
  std::size_t bytes = 0;
  if (__builtin_mul_overflow(count, stride, &bytes) || bytes != length)
    check.failAt(place, "count " + std::to_string(count) + " and byteStride " +
                            std::to_string(stride) + " do not make the view's byteLength " +
                            std::to_string(length));
}

void checkBufferViews(const Checker& check, const Value& root, std::vector<Rewrite>& rewrites) {
  std::vector<Value> buffers;
  if (root.has("buffers")) buffers = root.get("buffers").asArray();
  for (const Value& buffer : buffers)
    if (isEmptyFallback(buffer)) replaceNumber(buffer.get("byteLength"), kOneByte, rewrites);
  const Value views = root.get("bufferViews");
  for (std::size_t i = 0; !views.isNull() && i < views.asArray().size(); ++i) {
    const Value& view = views.asArray()[i];
    const std::string place = elementPlace("bufferViews", i);
    const Value packed = extensionOf(view, kMeshopt);
    const auto requireBytes = [&](const Value& owner, const std::string& at) {
      const std::size_t buffer = sizeOr(owner, "buffer", 0);
      if (isEmptyFallback(buffers[buffer]))
        check.failAt(at + "/buffer", elementPlace("buffers", buffer) +
                                         " has no bytes: it is the fallback of " + kMeshopt);
    };
    if (packed.isNull()) {
      requireBytes(view, place);
    } else {
      const std::string own = place + "/extensions/" + kMeshopt;
      requireBytes(packed, own);
      checkMeshoptView(check, view, packed, own);
    }
  }
}

void checkPrimitives(const Checker& check, const Value& root, std::vector<Rewrite>& rewrites) {
  const Value meshes = root.get("meshes");
  for (std::size_t m = 0; !meshes.isNull() && m < meshes.asArray().size(); ++m) {
    const std::vector<Value>& primitives = meshes.asArray()[m].get("primitives").asArray();
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const Value packed = extensionOf(primitives[p], kDraco);
      if (packed.isNull()) continue;
      const std::string place = elementPlace("meshes", m) + "/primitives/" + std::to_string(p);
      constexpr std::size_t kTriangles = TINYGLTF_MODE_TRIANGLES;
      if (sizeOr(primitives[p], "mode", kTriangles) != kTriangles)
        check.failAt(place + "/mode", std::string("must be 4 (triangles) with ") + kDraco);
      if (!primitives[p].has("indices"))
        check.failAt(place, std::string("\"indices\" is missing, which ") + kDraco + " needs");
      for (const std::string& name : packed.get("attributes").keys())
        if (!primitives[p].get("attributes").has(name))
          check.failAt(place + "/extensions/" + kDraco + "/attributes/" + name,
                       "is not among the primitive's attributes");
      const Value accessor = root.get("accessors").asArray()[sizeOr(primitives[p], "indices", 0)];
      if (!accessor.has("bufferView"))
        replaceNumber(accessor.get("count"),
                      std::to_string(sizeOr(accessor, "count", 0)) +
                          ",\"bufferView\":" + std::to_string(sizeOr(packed, "bufferView", 0)),
                      rewrites);
    }
  }
}

std::size_t sizeOr(const tinygltf::Value& object, const char* key) {
  return static_cast<std::size_t>(numberOr(object, key, 0.0));
}

/// Makes `bytes` a buffer view of their own: returns its buffer.
int addBuffer(tinygltf::Model& model, std::vector<unsigned char> bytes) {
  tinygltf::Buffer buffer;
  buffer.data = std::move(bytes);
  model.buffers.push_back(std::move(buffer));
  return static_cast<int>(model.buffers.size()) - 1;
}

/// Runs `job(i)` for each i in parallel. Throws the first error in their order.
void forEach(std::size_t count, const std::function<void(std::size_t)>& job) {
  std::vector<std::exception_ptr> errors(count);
  parallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      try {
        job(i);
      } catch (...) {
        errors[i] = std::current_exception();
      }
    }
  });
  for (const std::exception_ptr& error : errors)
    if (error) std::rethrow_exception(error);
}

std::vector<unsigned char> unpackedView(Reader& reader, std::size_t index) {
  const tinygltf::BufferView& view = reader.model.bufferViews[index];
  const tinygltf::Value& packed = extension(view.extensions, kMeshopt);
  const std::string place =
      elementPlace("bufferViews", index) + "/extensions/" + std::string(kMeshopt);
  const std::span<const std::uint8_t> in =
      reader.bytesOf(static_cast<int>(sizeOr(packed, "buffer")), sizeOr(packed, "byteOffset"),
                     sizeOr(packed, "byteLength"), "its data", place);
  const std::size_t count = sizeOr(packed, "count");
  const std::size_t stride = sizeOr(packed, "byteStride");
  reader.reserveBytes(view.byteLength, place);
  std::vector<unsigned char> out(view.byteLength);
  const std::string& mode = member(packed, "mode").Get<std::string>();
  const int failed =
      mode == "ATTRIBUTES"
          ? meshopt_decodeVertexBuffer(out.data(), count, stride, in.data(), in.size())
      : mode == "TRIANGLES"
          ? meshopt_decodeIndexBuffer(out.data(), count, stride, in.data(), in.size())
          : meshopt_decodeIndexSequence(out.data(), count, stride, in.data(), in.size());
  if (failed != 0)
    reader.fail(place, "the " + std::to_string(in.size()) + " bytes do not hold " +
                           std::to_string(count) + " elements of the mode " + mode);
  if (member(packed, "filter").IsString()) {
    const std::string& filter = member(packed, "filter").Get<std::string>();
    if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(out.data(), count, stride);
    if (filter == "QUATERNION") meshopt_decodeFilterQuat(out.data(), count, stride);
    if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(out.data(), count, stride);
  }
  return out;
}

void unpackViews(Reader& reader) {
  std::vector<std::size_t> packed;
  for (std::size_t i = 0; i < reader.model.bufferViews.size(); ++i)
    if (extension(reader.model.bufferViews[i].extensions, kMeshopt).IsObject()) packed.push_back(i);
  std::vector<std::vector<unsigned char>> bytes(packed.size());
  forEach(packed.size(), [&](std::size_t i) { bytes[i] = unpackedView(reader, packed[i]); });
  for (std::size_t i = 0; i < packed.size(); ++i) {
    tinygltf::BufferView& view = reader.model.bufferViews[packed[i]];
    view.buffer = addBuffer(reader.model, std::move(bytes[i]));
    view.byteOffset = 0;
  }
}

/// A primitive that Draco compressed. Primitives of one buffer view share its mesh.
struct DracoJob {
  const tinygltf::Primitive* primitive = nullptr;
  std::string place;
  std::size_t view = 0;
  std::shared_ptr<const draco::Mesh> mesh;
};

/// The numbers of faces that a Draco mesh has by its header: Draco takes memory for so many before
/// it finds out that the data end. Nothing: the header is damaged.
std::optional<std::uint64_t> facesOf(const Reader& reader, std::span<const std::uint8_t> bytes,
                                     const std::string& place) {
  draco::DecoderBuffer in;
  in.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::DracoHeader header{};
  if (!in.Decode(header.draco_string, sizeof header.draco_string) ||
      !in.Decode(&header.version_major) || !in.Decode(&header.version_minor) ||
      !in.Decode(&header.encoder_type) || !in.Decode(&header.encoder_method) ||
      !in.Decode(&header.flags) ||
      !std::ranges::equal(header.draco_string, std::string_view("DRACO")))
    return {};
  // The extension allows this version alone.
  const int version = DRACO_BITSTREAM_VERSION(header.version_major, header.version_minor);
  if (version != draco::kDracoMeshBitstreamVersion)
    reader.fail(place, "Draco's bitstream version " + std::to_string(header.version_major) + "." +
                           std::to_string(header.version_minor) + " is not supported; 2.2 is");
  if (header.encoder_type != draco::TRIANGULAR_MESH)
    reader.fail(place, "holds no triangles but a point cloud");
  in.set_bitstream_version(static_cast<std::uint16_t>(version));
  if ((header.flags & METADATA_FLAG_MASK) != 0) {
    draco::GeometryMetadata metadata;
    if (!draco::MetadataDecoder().DecodeGeometryMetadata(&in, &metadata)) return {};
  }
  std::uint32_t faces = 0;
  if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING) {
    std::uint8_t traversal = 0;
    std::uint32_t vertices = 0;
    if (!in.Decode(&traversal) || !draco::DecodeVarint(&vertices, &in)) return {};
  }
  if (!draco::DecodeVarint(&faces, &in)) return {};
  return faces;
}

/// The primitive's accessor of indices must have those of as many faces.
void checkIndices(const Reader& reader, const DracoJob& job, std::uint64_t faces) {
  const std::size_t indices = reader.countOf(job.primitive->indices);
  if (faces * 3 != indices)
    reader.fail(job.place + "/indices",
                elementPlace("accessors", static_cast<std::size_t>(job.primitive->indices)) +
                    " has " + std::to_string(indices) + " elements, the Draco mesh " +
                    std::to_string(faces * 3));
}

void decode(Reader& reader, DracoJob& job) {
  const std::string place = job.place + "/extensions/" + kDraco;
  const std::span<const std::uint8_t> bytes = reader.bytesOf(static_cast<int>(job.view), place);
  const auto refuse = [&](const std::string& why) {
    reader.fail(place, "the " + std::to_string(bytes.size()) + " bytes are no Draco mesh" + why);
  };
  const std::optional<std::uint64_t> faces = facesOf(reader, bytes, place);
  if (!faces) refuse(": their header is damaged");
  checkIndices(reader, job, *faces);
  reader.reserveBytes(3 * *faces * kDracoBytes, place);
  draco::DecoderBuffer in;
  in.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  auto decoded = draco::Decoder().DecodeMeshFromBuffer(&in);
  if (!decoded.ok()) refuse(": " + decoded.status().error_msg_string());
  std::unique_ptr<draco::Mesh> mesh = std::move(decoded).value();
  // Damaged data may have made fewer faces, or such of points that it lacks.
  bool good = mesh->num_faces() == *faces;
  for (draco::FaceIndex f(0); good && f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& point : mesh->face(f)) good &= point.value() < mesh->num_points();
  if (!good) refuse(": its faces are damaged");
  job.mesh = std::move(mesh);
}

/// The values of an attribute at all points, of the accessor's type.
template <class T>
bool gather(const draco::PointAttribute& attribute, std::size_t points, int components,
            std::vector<unsigned char>& out) {
  if (!attribute.is_mapping_identity() && attribute.indices_map_size() < points) return false;
  out.resize(points * static_cast<std::size_t>(components) * sizeof(T));
  T* to = reinterpret_cast<T*>(out.data());
  for (std::size_t i = 0; i < points; ++i, to += components) {
    const draco::AttributeValueIndex value =
        attribute.mapped_index(draco::PointIndex(static_cast<std::uint32_t>(i)));
    if (value.value() >= attribute.size() ||
        !attribute.ConvertValue<T>(value, static_cast<std::int8_t>(components), to))
      return false;
  }
  return true;
}

bool gatherAs(int componentType, const draco::PointAttribute& attribute, std::size_t points,
              int components, std::vector<unsigned char>& out) {
  switch (componentType) {
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return gather<std::int8_t>(attribute, points, components, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return gather<std::uint8_t>(attribute, points, components, out);
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return gather<std::int16_t>(attribute, points, components, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return gather<std::uint16_t>(attribute, points, components, out);
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      return gather<std::uint32_t>(attribute, points, components, out);
    default:
      return gather<float>(attribute, points, components, out);
  }
}

/// Lets an accessor read these bytes.
void setBytes(Reader& reader, int accessor, std::vector<unsigned char> bytes) {
  tinygltf::BufferView view;
  view.byteLength = bytes.size();
  view.buffer = addBuffer(reader.model, std::move(bytes));
  reader.model.bufferViews.push_back(view);
  tinygltf::Accessor& a = reader.model.accessors[static_cast<std::size_t>(accessor)];
  a.bufferView = static_cast<int>(reader.model.bufferViews.size()) - 1;
  a.byteOffset = 0;
}

/// Where the values of an accessor come from.
struct DracoSource {
  std::size_t view;
  std::int64_t attribute;  ///< -1: the corners of faces
  bool operator==(const DracoSource&) const = default;
};
/// The accessors that Draco's meshes have filled.
using Filled = std::map<int, DracoSource>;

/// Whether an accessor is still to be filled. Throws if it has been filled from elsewhere.
bool claim(Reader& reader, int accessor, const DracoSource& source, const std::string& place,
           Filled& filled) {
  const auto [found, isNew] = filled.try_emplace(accessor, source);
  if (!isNew && found->second != source)
    reader.fail(place, elementPlace("accessors", static_cast<std::size_t>(accessor)) +
                           " would have the values of two attributes, of " +
                           elementPlace("bufferViews", found->second.view) + " and " +
                           elementPlace("bufferViews", source.view));
  return isNew;
}

void install(Reader& reader, const DracoJob& job, Filled& filled) {
  const tinygltf::Value& ids = member(extension(job.primitive->extensions, kDraco), "attributes");
  for (const std::string& name : ids.Keys()) {
    const std::string place = job.place + "/extensions/" + kDraco + "/attributes/" + name;
    const auto id = static_cast<std::uint32_t>(numberOr(ids, name, 0.0));
    const draco::PointAttribute* attribute = job.mesh->GetAttributeByUniqueId(id);
    if (attribute == nullptr)
      reader.fail(place, "the Draco mesh has no attribute " + std::to_string(id));
    const int index = job.primitive->attributes.at(name);
    if (!claim(reader, index, {job.view, id}, place, filled)) continue;
    const std::string self = elementPlace("accessors", static_cast<std::size_t>(index));
    const std::size_t points = job.mesh->num_points();
    if (reader.countOf(index) != points)
      reader.fail(place, self + " has " + std::to_string(reader.countOf(index)) +
                             " elements, the Draco mesh " + std::to_string(points) + " points");
    const int components = reader.componentsOf(index);
    if (attribute->num_components() != components)
      reader.fail(place, self + " has " + std::to_string(components) +
                             " components, the Draco mesh " +
                             std::to_string(attribute->num_components()));
    reader.reserveBytes(points * static_cast<std::size_t>(components) * sizeof(float), place);
    std::vector<unsigned char> bytes;
    const int type = reader.model.accessors[static_cast<std::size_t>(index)].componentType;
    if (!gatherAs(type, *attribute, points, components, bytes))
      reader.fail(place, "the Draco mesh has values that " + self + " cannot hold");
    setBytes(reader, index, std::move(bytes));
  }
  const int indices = job.primitive->indices;
  if (!claim(reader, indices, {job.view, -1}, job.place + "/indices", filled)) return;
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * static_cast<std::size_t>(job.mesh->num_faces()));
  for (draco::FaceIndex f(0); f < job.mesh->num_faces(); ++f)
    for (const draco::PointIndex& point : job.mesh->face(f)) corners.push_back(point.value());
  const auto raw = std::as_bytes(std::span(corners));
  const auto* first = reinterpret_cast<const unsigned char*>(raw.data());
  setBytes(reader, indices, {first, first + raw.size()});
  reader.model.accessors[static_cast<std::size_t>(indices)].componentType =
      TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
}

void unpackPrimitives(Reader& reader) {
  std::vector<DracoJob> jobs;
  std::map<std::size_t, std::size_t> firstOf;  // job of each buffer view
  std::vector<std::size_t> first;
  for (std::size_t m = 0; m < reader.model.meshes.size(); ++m) {
    const std::vector<tinygltf::Primitive>& primitives = reader.model.meshes[m].primitives;
    for (std::size_t p = 0; p < primitives.size(); ++p) {
      const tinygltf::Value& packed = extension(primitives[p].extensions, kDraco);
      if (!packed.IsObject()) continue;
      const std::size_t view = sizeOr(packed, "bufferView");
      if (firstOf.try_emplace(view, jobs.size()).second) first.push_back(jobs.size());
      jobs.push_back({&primitives[p],
                      elementPlace("meshes", m) + "/primitives/" + std::to_string(p), view,
                      nullptr});
    }
  }
  forEach(first.size(), [&](std::size_t i) { decode(reader, jobs[first[i]]); });
  Filled filled;
  for (DracoJob& job : jobs) {
    if (!job.mesh) {
      job.mesh = jobs[firstOf.at(job.view)].mesh;
      checkIndices(reader, job, job.mesh->num_faces());
    }
    install(reader, job, filled);
  }
}

}  // namespace

bool isEmptyFallback(const Value& buffer) {
  const Value packed = extensionOf(buffer, kMeshopt);
  return !buffer.has("uri") && !packed.isNull() && packed.has("fallback") &&
         packed.get("fallback").asBool();
}

void checkCompressed(const Checker& check, const Value& root, std::vector<Rewrite>& rewrites) {
  checkBufferViews(check, root, rewrites);
  checkPrimitives(check, root, rewrites);
}

void decompress(Reader& reader) {
  unpackViews(reader);
  unpackPrimitives(reader);
}

}  // namespace catoptric::scene::gltf
