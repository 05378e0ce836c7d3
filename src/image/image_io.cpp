// Checks what goes in and out of the module catoptric_imageio, and loads it at first use.
#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <mutex>
#include <set>

#include "core/error.h"
#include "core/file.h"
#include "core/log.h"
#include "core/parallel.h"
#include "image/hdr.h"
#include "image/module_api.h"

namespace catoptric::image {
namespace {

/// The largest finite half.
constexpr float kMaxHalf = 65504.0f;
/// What readImage allocates at most: 2 GiB of floats, an environment of 16384 x 8192 RGBA.
constexpr std::size_t kMaxValues = std::size_t{1} << 29;

// ---- Loading ----

constexpr const char* kModuleFile = "catoptric_imageio.so";

/// Places of the module, from the file that holds this code: the build tree has bin/ beside lib/,
/// the install tree bin/ beside lib/catoptric/.
std::vector<std::filesystem::path> modulePlaces() {
  std::vector<std::filesystem::path> places;
  std::error_code ignored;
  std::vector<std::filesystem::path> homes;
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&modulePlaces), &info) != 0 &&
      info.dli_fname != nullptr && info.dli_fname[0] == '/')
    homes.push_back(std::filesystem::weakly_canonical(info.dli_fname, ignored).parent_path());
  homes.push_back(std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path());
  for (const auto& home : homes)
    for (const char* folder : {"../lib/catoptric", "../lib", "."}) {
      const auto place = (home / folder / kModuleFile).lexically_normal();
      if (std::find(places.begin(), places.end(), place) == places.end()) places.push_back(place);
    }
  return places;
}

/// Loads the module; throws OutputError that says where it was looked for.
const ImageIoApi* loadModule() {
  const auto places = modulePlaces();
  std::string tried;
  for (const auto& place : places) {
    std::error_code ignored;
    tried += "\n  " + place.string();
    if (!std::filesystem::exists(place, ignored)) continue;
    // Local, so that the OpenGL that OpenImageIO drags in is never found by another loader; lazy,
    // since binding every function of 258 libraries takes a fifth of the time
    void* module = dlopen(place.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (module == nullptr) {
      const char* reason = dlerror();
      throw OutputError("the image module cannot be loaded: " +
                        std::string(reason != nullptr ? reason : place.string()) +
                        "; install OpenImageIO 2.4, OpenColorIO 2.1 and OpenEXR 3.1 (Debian: "
                        "libopenimageio2.4 libopencolorio2.1 libopenexr-3-1-30)");
    }
    using Entry = const ImageIoApi* (*)();
    const auto entry = reinterpret_cast<Entry>(dlsym(module, kImageIoSymbol));
    const ImageIoApi* api = entry != nullptr ? entry() : nullptr;
    if (api == nullptr || api->version != kImageIoVersion)
      throw OutputError(place.string() +
                        ": not the image module of this catoptric; build or "
                        "install program and module together");
    const std::string error = api->prepare(threadCount());
    if (!error.empty()) throw OutputError(place.string() + ": " + error);
    log::debug("image module loaded from " + place.string());
    return api;
  }
  throw OutputError("the image module " + std::string(kModuleFile) +
                    " is missing, so EXR files and previews cannot be made; looked for:" + tried);
}

/// The module, loaded by the first caller; a failure is thrown to every caller.
const ImageIoApi& api() {
  static std::mutex mutex;
  static const ImageIoApi* loaded = nullptr;
  const std::lock_guard lock(mutex);
  if (loaded == nullptr) loaded = loadModule();
  return *loaded;
}

// ---- Checks ----

bool isBeauty(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A";
}

std::string describe(const Image& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels of " +
         std::to_string(image.channels.size()) + " channels";
}

void requireWellFormed(const Image& image) {
  if (image.width < 1 || image.height < 1 || image.channels.empty())
    throw OutputError("image of " + describe(image) + ": nothing to write");
  if (image.data.size() != image.pixelCount() * image.channels.size())
    throw OutputError("image of " + describe(image) + " has " + std::to_string(image.data.size()) +
                      " values");
  std::set<std::string> seen;
  for (const std::string& name : image.channels) {
    if (name.empty() || name.size() > 255)
      throw OutputError("image channel \"" + name + "\": names have 1 to 255 characters");
    if (!seen.insert(name).second) throw OutputError("image channel " + name + " is there twice");
  }
}

/// Throws FrameError for the first NaN or infinity.
void requireFinite(const Image& image) {
  const std::size_t count = image.channels.size();
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    if (std::isfinite(image.data[i])) continue;
    const std::size_t pixel = i / count;
    throw FrameError("channel " + image.channels[i % count] + " has " +
                     (std::isnan(image.data[i]) ? "NaN" : "an infinity") + " at pixel (" +
                     std::to_string(pixel % image.width) + ", " +
                     std::to_string(pixel / image.width) + "); frames must be finite");
  }
}

}  // namespace

std::vector<std::byte> encodeExr(const Image& image, const ExrOptions& options,
                                 ExrStatistics* statistics) {
  requireWellFormed(image);
  requireFinite(image);
  if (options.zipLevel < 1 || options.zipLevel > 9)
    throw OutputError("EXR zip level " + std::to_string(options.zipLevel) + ": 1 to 9 are allowed");
  for (const auto& [name, values] : options.matrices)
    if (values.size() != 16)
      throw OutputError("EXR attribute " + name + ": a matrix has 16 numbers, not " +
                        std::to_string(values.size()));

  // Clamp what half cannot hold, and count it: no infinity may come out of the conversion
  ExrStatistics counted;
  Image clamped;
  const Image* source = &image;
  if (options.halfBeauty) {
    const std::size_t count = image.channels.size();
    for (std::size_t c = 0; c < count; ++c) {
      if (!isBeauty(image.channels[c])) continue;
      for (std::size_t i = c; i < image.data.size(); i += count) {
        if (std::fabs(image.data[i]) <= kMaxHalf) continue;
        if (counted.clampedHalf++ == 0) {
          clamped = image;
          source = &clamped;
        }
        clamped.data[i] = std::copysign(kMaxHalf, image.data[i]);
      }
    }
  }

  std::vector<std::byte> bytes;
  const std::string error = api().encodeExr(*source, options, bytes);
  if (!error.empty()) throw OutputError("EXR of " + describe(image) + ": " + error);
  if (statistics != nullptr) *statistics = counted;
  return bytes;
}

Image readImage(const std::filesystem::path& file) {
  const std::vector<std::byte> bytes = readFile(file);
  if (isHdr(bytes)) return decodeHdr(bytes, file.string(), kMaxValues);
  constexpr std::byte kExrMagic[] = {std::byte{0x76}, std::byte{0x2F}, std::byte{0x31},
                                     std::byte{0x01}};
  if (bytes.size() < 4 || !std::equal(std::begin(kExrMagic), std::end(kExrMagic), bytes.begin()))
    throw SceneError(file.string() + ": neither an EXR nor a Radiance HDR image (" +
                     std::to_string(bytes.size()) + " bytes)");
  Image image;
  const std::string error = api().decodeExr(bytes, kMaxValues, image);
  if (!error.empty()) throw SceneError(file.string() + ": bad EXR image: " + error);
  return image;
}

std::vector<std::uint8_t> displayRgb8(const Image& image, float exposureStops) {
  requireWellFormed(image);
  const int red = image.channel("R");
  const int green = image.channel("G");
  const int blue = image.channel("B");
  if (red < 0 || green < 0 || blue < 0)
    throw OutputError("image of " + describe(image) + ": no R G B to show");

  // Pack the colour; what OpenColorIO need not see is bounded here and marked afterwards
  constexpr float kBound = 1e9f;
  const std::size_t pixels = image.pixelCount();
  const std::size_t count = image.channels.size();
  std::vector<float> rgb(pixels * 3);
  std::vector<std::size_t> notNumbers;
  const int indices[3] = {red, green, blue};
  for (std::size_t p = 0; p < pixels; ++p) {
    bool bad = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const float value = image.data[p * count + static_cast<std::size_t>(indices[c])];
      bad = bad || std::isnan(value);
      rgb[3 * p + c] = std::isnan(value) ? 0.0f : std::clamp(value, -kBound, kBound);
    }
    if (bad) notNumbers.push_back(p);
  }
  std::vector<std::uint8_t> out(pixels * 3);
  const std::string error = api().display(rgb, exposureStops, out);
  if (!error.empty()) throw OutputError("preview of " + describe(image) + ": " + error);
  for (const std::size_t p : notNumbers) {
    out[3 * p] = 255;
    out[3 * p + 1] = 0;
    out[3 * p + 2] = 255;
  }
  return out;
}

void loadImageIo() {
  try {
    api();
  } catch (const std::exception&) {
    // The first write or read reports it
  }
}

void preloadImageIo() {
  // Joined when the program ends: the loader must not run while it is torn down
  static std::mutex mutex;
  static std::future<void> loading;
  const std::lock_guard lock(mutex);
  if (loading.valid()) return;
  loading = std::async(std::launch::async, loadImageIo);
}

}  // namespace catoptric::image
