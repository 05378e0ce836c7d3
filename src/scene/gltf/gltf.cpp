// glTF 2.0, from bytes to Scene: gates, tinygltf, then the parts of gltf_reader.h.
#include <algorithm>
#include <cstring>
#include <exception>

#include "core/error.h"
#include "core/file.h"
#include "scene/gltf/check.h"
#include "scene/gltf/reader.h"

namespace catoptric::scene {
namespace {

using namespace gltf;

/// What tinygltf's callbacks need. Their errors are kept and thrown afterwards.
struct ParserFiles {
  const Reader& reader;
  const External& external;
  std::exception_ptr error;
};

bool fileExists(const std::string& name, void* user) {
  const auto& files = *static_cast<const ParserFiles*>(user);
  return files.external.byParserName.count(name) > 0;
}

std::string samePath(const std::string& name, void*) {
  return name;
}

/// Buffers are read here; images later, in parallel, so they get a stand-in byte.
bool readWholeFile(std::vector<unsigned char>* out, std::string*, const std::string& name,
                   void* user) {
  auto& files = *static_cast<ParserFiles*>(user);
  try {
    const External::Entry& entry = files.external.byParserName.at(name);
    if (!entry.buffer) {
      out->assign(1, 0);
      return true;
    }
    const Reader& reader = files.reader;
    if (entry.uri.rfind("data:", 0) == 0) {
      const std::string bytes = decodeDataUri(entry.uri, reader.file, entry.place);
      out->assign(bytes.begin(), bytes.end());
      return true;
    }
    const std::filesystem::path path =
        fileOfUri(entry.uri, reader.file, reader.limits, entry.place);
    std::vector<std::byte> bytes;
    try {
      bytes = readFile(path, reader.limits.maxFileBytes);
    } catch (const Error& e) {
      reader.fail(entry.place, std::string(e.what()) + kAssetHint);
    }
    if (bytes.size() < entry.byteLength) {
      reader.fail(entry.place, path.string() + " has " + std::to_string(bytes.size()) +
                                   " bytes, byteLength says " + std::to_string(entry.byteLength));
    }
    // The file may be longer than the buffer; tinygltf wants it exact.
    out->resize(entry.byteLength);
    std::memcpy(out->data(), bytes.data(), entry.byteLength);
    return true;
  } catch (...) {
    files.error = std::current_exception();
    return false;
  }
}

bool writeNothing(std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
  return false;
}

/// Keeps the bytes of images in data URIs. Others are found again by bufferView or uri; the
/// pointer given for a bufferView is not even checked by tinygltf.
bool keepImageBytes(tinygltf::Image* image, const int, std::string*, std::string*, int, int,
                    const unsigned char* bytes, int size, void*) {
  image->as_is = true;
  if (image->bufferView < 0 && image->uri.empty() && size > 0) {
    image->image.assign(bytes, bytes + size);
  }
  return true;
}

void parse(Reader& reader, std::span<const std::byte> bytes, const Container& container,
           const External& external) {
  ParserFiles files{reader, external, nullptr};
  tinygltf::TinyGLTF parser;
  parser.SetFsCallbacks({&fileExists, &samePath, &readWholeFile, &writeNothing, &files});
  parser.SetImageLoader(&keepImageBytes, nullptr);
  std::string error;
  std::string warning;
  // Its sizes are unsigned int; readFile() and the limits keep files below 4 GiB.
  const bool good =
      container.binary
          ? parser.LoadBinaryFromMemory(&reader.model, &error, &warning,
                                        reinterpret_cast<const unsigned char*>(bytes.data()),
                                        static_cast<unsigned int>(bytes.size()), "")
          : parser.LoadASCIIFromString(&reader.model, &error, &warning, container.json.data(),
                                       static_cast<unsigned int>(container.json.size()), "");
  if (files.error) std::rethrow_exception(files.error);
  if (!good) {
    constexpr std::size_t kShown = 300;  // it quotes whole data URIs
    while (!error.empty() && error.back() == '\n') error.pop_back();
    reader.fail("", "tinygltf: " + error.substr(0, kShown));
  }
}

}  // namespace

Scene loadGltf(const std::filesystem::path& file, const LoadLimits& limits) {
  constexpr std::size_t kParserMax = 0xFFFFFFFFu;
  std::vector<std::byte> bytes = readFile(file, std::min(limits.maxFileBytes, kParserMax));
  Reader reader(file, limits);
  Container container = splitContainer(bytes, reader.file);
  const Checked checked = checkJson(container, reader.file, limits);
  if (!checked.rewrites.empty()) {
    bytes = rewritten(container, checked.rewrites);
    container = splitContainer(bytes, reader.file);
  }
  parse(reader, bytes, container, checked.external);

  decompress(reader);

  const auto uses = [&](const char* name) {
    const std::vector<std::string>& used = reader.model.extensionsUsed;
    return std::find(used.begin(), used.end(), name) != used.end();
  };
  reader.quantization = uses("KHR_mesh_quantization");
  Scene& scene = reader.scene;
  scene.name = file.stem().string();
  scene.source = file;
  for (const std::string& name : reader.model.extensionsUsed) {
    if (!isKnownExtension(name)) {
      scene.notes.push_back("extension " + name.substr(0, 80) + " is ignored");
    }
  }

  // Geometry before textures: an index out of range is found without decoding an image.
  const NodeOrder order = readNodes(reader);
  readSkins(reader, order);
  std::vector<std::vector<Primitive>> primitives = readPrimitives(reader);
  bool needDefault = false;
  for (const std::vector<Primitive>& mesh : primitives) {
    for (const Primitive& p : mesh) needDefault |= p.drawn && p.material == kNone;
  }
  readMaterials(reader, needDefault);
  readObjects(reader, order, std::move(primitives));
  readLightsAndCameras(reader, order);
  readAnimations(reader, order);
  if (scene.objects.empty()) scene.notes.push_back("there is nothing to draw");
  return std::move(reader.scene);
}

}  // namespace catoptric::scene
