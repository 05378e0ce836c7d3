// The module catoptric_imageio: EXR through OpenImageIO (writing) and OpenEXR (reading), display
// transforms through OpenColorIO. Loaded by image_io.cpp, never linked.
#include <OpenColorIO/OpenColorIO.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <mutex>
#include <sstream>
#include <tuple>

#include "image/module_api.h"
#include "image/ocio_config.h"

namespace catoptric::image {
namespace {

// ---- EXR writing ----

/// Rec.709 primaries and D65, as x y pairs of red, green, blue, white. [ITU-R BT.709-6] item 1.3-4
constexpr float kRec709[8] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
/// Files must be the same twice, so the date is ours. [OpenImageIO sets the present one otherwise]
constexpr const char* kDateTime = "2000:01:01 00:00:00";

bool isBeauty(const std::string& channel) {
  return channel == "R" || channel == "G" || channel == "B" || channel == "A";
}

/// Layers of one channel are called NAME.X in files: of a layer's channels Blender, and others,
/// know single letters alone.
bool isLayerOfOne(const std::string& name) {
  return name == "s" || name.starts_with("id.") || name.starts_with("mask.");
}
std::string nameInFile(const std::string& name) {
  return isLayerOfOne(name) ? name + ".X" : name;
}
/// Earlier files have them without the letter.
std::string nameFromFile(const std::string& name) {
  const std::string layer = name.ends_with(".X") ? name.substr(0, name.size() - 2) : "";
  return isLayerOfOne(layer) ? layer : name;
}

/// Pixels as the file holds them: channel after channel, halves where the spec says so.
/// OpenImageIO's own conversion of mixed formats takes 10 times as long.
std::vector<std::byte> packed(const Image& image, const std::vector<bool>& isHalf) {
  std::size_t pixelBytes = 0;
  for (const bool half : isHalf) pixelBytes += half ? 2 : 4;
  std::vector<std::byte> bytes(image.pixelCount() * pixelBytes);
  const std::size_t channels = isHalf.size();
  std::size_t offset = 0;
  for (std::size_t c = 0; c < channels; ++c) {
    const float* from = image.data.data() + c;
    std::byte* to = bytes.data() + offset;
    const std::size_t pixels = image.pixelCount();
    if (isHalf[c])
      for (std::size_t p = 0; p < pixels; ++p, from += channels, to += pixelBytes) {
        const std::uint16_t bits = imath_float_to_half(*from);
        std::memcpy(to, &bits, sizeof bits);
      }
    else
      for (std::size_t p = 0; p < pixels; ++p, from += channels, to += pixelBytes)
        std::memcpy(to, from, sizeof(float));
    offset += isHalf[c] ? 2 : 4;
  }
  return bytes;
}

std::string writeExr(const Image& image, const ExrOptions& options, std::vector<std::byte>& bytes) {
  OIIO::ImageSpec spec(image.width, image.height, static_cast<int>(image.channels.size()),
                       OIIO::TypeFloat);
  spec.channelnames.clear();
  for (const std::string& name : image.channels) spec.channelnames.push_back(nameInFile(name));
  std::vector<bool> isHalf;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const std::string& name = image.channels[c];
    if (name == "A") spec.alpha_channel = static_cast<int>(c);
    if (name == "Z") spec.z_channel = static_cast<int>(c);
    const bool half = options.halfBeauty && isBeauty(name);
    spec.channelformats.push_back(half ? OIIO::TypeHalf : OIIO::TypeFloat);
    isHalf.push_back(half);
  }
  switch (options.compression) {
    case Compression::None:
      spec.attribute("compression", "none");
      break;
    case Compression::Zip:
      spec.attribute("compression", "zip:" + std::to_string(options.zipLevel));
      break;
    case Compression::Piz:
      spec.attribute("compression", "piz");
      break;
  }
  spec.attribute("DateTime", kDateTime);
  spec.attribute("Software", "catoptric");
  spec.attribute("oiio:ColorSpace", "lin_rec709");
  spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), kRec709);
  for (const auto& [name, value] : options.text) spec.attribute(name, value);
  for (const auto& [name, value] : options.numbers) spec.attribute(name, value);
  for (const auto& [name, value] : options.matrices)
    spec.attribute(name, OIIO::TypeMatrix44, value.data());

  auto output = OIIO::ImageOutput::create("frame.exr");
  if (!output) return OIIO::geterror();
  OIIO::Filesystem::IOVecOutput sink;
  if (!output->supports("ioproxy") || !output->set_ioproxy(&sink))
    return "this OpenImageIO cannot write EXR to memory";
  if (!output->open("frame.exr", spec)) return output->geterror();
  if (!output->write_image(OIIO::TypeUnknown, packed(image, isHalf).data()))
    return output->geterror();
  if (!output->close()) return output->geterror();

  const auto& written = sink.buffer();
  bytes.resize(written.size());
  std::memcpy(bytes.data(), written.data(), written.size());
  return {};
}

// ---- EXR reading ----

class MemoryStream : public Imf::IStream {
 public:
  explicit MemoryStream(std::span<const std::byte> bytes) : IStream("memory"), bytes_(bytes) {}

  bool read(char to[], int count) override {
    if (count < 0 || static_cast<std::size_t>(count) > bytes_.size() - position_)
      throw std::runtime_error("the file is truncated");
    std::memcpy(to, bytes_.data() + position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("the file is truncated");
    position_ = position;
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

/// Files list channels by the alphabet; we want the beauty first and colours as R G B A.
auto channelRank(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  const std::string layer = dot == std::string::npos ? "" : name.substr(0, dot);
  const std::string last = dot == std::string::npos ? name : name.substr(dot + 1);
  const std::size_t colour = std::string("RGBA").find(last);
  return std::tuple(layer, last.size() == 1 && colour != std::string::npos ? colour : 4, last);
}

/// Whether the first header's attributes lie within the file: OpenEXR allocates what an attribute
/// claims, up to 2 GiB, before it reads it. [OpenEXR "File Layout": magic, version, then name,
/// type, size, value of each attribute, then a null byte]
bool attributesFit(std::span<const std::byte> bytes) {
  std::size_t at = 8;
  const auto skipText = [&] {
    while (at < bytes.size() && bytes[at] != std::byte{0}) ++at;
    return ++at < bytes.size();
  };
  while (at < bytes.size() && bytes[at] != std::byte{0}) {
    std::uint32_t size = 0;
    if (!skipText() || !skipText() || bytes.size() - at < sizeof size) return false;
    std::memcpy(&size, bytes.data() + at, sizeof size);
    at += sizeof size;
    if (size > bytes.size() - at) return false;
    at += size;
  }
  return at < bytes.size();
}

std::string readExr(std::span<const std::byte> bytes, std::size_t maxValues, Image& image) {
  if (!attributesFit(bytes)) return "the file is truncated, or its header is damaged";
  MemoryStream stream(bytes);
  Imf::InputFile file(stream);
  const Imf::Header& header = file.header();
  if (header.hasType() && !Imf::isImage(header.type())) return "deep images are not read";

  // Check everything that decides a size before anything is allocated
  const Imath::Box2i window = header.dataWindow();
  const auto width = std::int64_t{window.max.x} - window.min.x + 1;
  const auto height = std::int64_t{window.max.y} - window.min.y + 1;
  std::vector<std::string> channels;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
      return std::string("channel ") + c.name() + " is subsampled, which is not read";
    channels.emplace_back(c.name());
  }
  if (channels.empty()) return "no channels";
  if (width > static_cast<std::int64_t>(maxValues / channels.size()) / height)
    return std::to_string(width) + " x " + std::to_string(height) + " pixels of " +
           std::to_string(channels.size()) + " channels, more than the " +
           std::to_string(maxValues) + " values allowed";
  std::sort(channels.begin(), channels.end(), [](const std::string& a, const std::string& b) {
    return channelRank(a) < channelRank(b);
  });

  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  image.channels.clear();
  for (const std::string& name : channels) image.channels.push_back(nameFromFile(name));
  image.data.clear();
  image.data.reserve(image.pixelCount() * channels.size());  // touches nothing yet

  // In blocks of rows, so that a small file that claims to be large fails before it fills memory
  constexpr int kBlockRows = 128;
  const std::size_t rowValues = channels.size() * static_cast<std::size_t>(width);
  std::vector<float> block;
  for (int first = window.min.y; first <= window.max.y; first += kBlockRows) {
    const int last = std::min(first + kBlockRows - 1, window.max.y);
    const Imath::Box2i rows({window.min.x, first}, {window.max.x, last});
    block.resize(rowValues * static_cast<std::size_t>(last - first + 1));
    Imf::FrameBuffer target;
    for (std::size_t c = 0; c < channels.size(); ++c)
      target.insert(channels[c],
                    Imf::Slice::Make(Imf::FLOAT, block.data() + c, rows,
                                     channels.size() * sizeof(float), rowValues * sizeof(float)));
    file.setFrameBuffer(target);
    file.readPixels(first, last);
    image.data.insert(image.data.end(), block.begin(), block.end());
  }
  return {};
}

// ---- Display ----

namespace ocio = OCIO_NAMESPACE;

/// The processors of our config, one for each exposure asked for.
class Displays {
 public:
  ocio::ConstCPUProcessorRcPtr of(float stops) {
    const std::lock_guard lock(mutex_);
    if (!config_) {
      std::istringstream text(kOcioConfig);
      config_ = ocio::Config::CreateFromStream(text);
      config_->validate();
    }
    auto& processor = processors_[stops];
    if (!processor) {
      const auto exposure = ocio::ExposureContrastTransform::Create();
      exposure->setStyle(ocio::EXPOSURE_CONTRAST_LINEAR);
      exposure->setExposure(stops);
      const auto view = ocio::DisplayViewTransform::Create();
      view->setSrc("scene_linear");
      view->setDisplay("sRGB");
      view->setView("sRGB");
      const auto both = ocio::GroupTransform::Create();
      if (stops != 0.0f) both->appendTransform(exposure);
      both->appendTransform(view);
      processor = config_->getProcessor(both)->getOptimizedCPUProcessor(
          ocio::BIT_DEPTH_F32, ocio::BIT_DEPTH_UINT8, ocio::OPTIMIZATION_LOSSLESS);
    }
    return processor;
  }

 private:
  std::mutex mutex_;
  ocio::ConstConfigRcPtr config_;
  std::map<float, ocio::ConstCPUProcessorRcPtr> processors_;
};

Displays& displays() {
  static Displays instance;
  return instance;
}

std::string display(std::span<float> rgb, float exposureStops, std::span<std::uint8_t> out) {
  const auto processor = displays().of(exposureStops);
  const long pixels = static_cast<long>(rgb.size() / 3);
  const ocio::PackedImageDesc from(rgb.data(), pixels, 1, 3);
  ocio::PackedImageDesc to(out.data(), pixels, 1, 3, ocio::BIT_DEPTH_UINT8, 1, ocio::AutoStride,
                           ocio::AutoStride);
  processor->apply(from, to);
  return {};
}

// ---- The interface ----

std::string prepare(int threads) {
  // Files larger than this are faults: the readers' own checks come after their first allocations
  Imf::Header::setMaxImageSize(1 << 16, 1 << 16);
  OIIO::attribute("threads", threads);
  OIIO::attribute("exr_threads", threads);
  displays().of(0.0f);
  return {};
}

/// Runs `function` with every exception turned into text.
template <auto function>
struct Guarded;
template <class... Arguments, std::string (*function)(Arguments...)>
struct Guarded<function> {
  static std::string call(Arguments... arguments) {
    try {
      return function(arguments...);
    } catch (const std::exception& error) {
      return error.what()[0] != '\0' ? error.what() : "unknown error";
    } catch (...) {
      return "unknown error";
    }
  }
};

}  // namespace

extern "C" __attribute__((visibility("default"))) const ImageIoApi* catoptricImageIo() {
  static const ImageIoApi api{kImageIoVersion, Guarded<prepare>::call, Guarded<writeExr>::call,
                              Guarded<readExr>::call, Guarded<display>::call};
  return &api;
}

}  // namespace catoptric::image
