// EXR files in memory, by OpenEXR; exr_zip.h compresses.
#include "image/exr.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfChromaticitiesAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <tuple>

#include "core/parallel.h"
#include "image/exr_zip.h"

namespace catoptric::image {
namespace {

/// Rec.709 primaries and D65. [ITU-R BT.709-6] item 1.3-4
const Imf::Chromaticities kRec709({0.64f, 0.33f}, {0.30f, 0.60f}, {0.15f, 0.06f},
                                  {0.3127f, 0.3290f});
/// Files must be the same twice, so the date is ours.
constexpr const char* kDate = "2000:01:01 00:00:00";
/// Files larger than this are faults: OpenEXR's own checks come after its first allocations.
constexpr int kMaxSide = 1 << 16;

void prepareOpenExr() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::Header::setMaxImageSize(kMaxSide, kMaxSide);
    Imf::setGlobalThreadCount(threadCount());
  });
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

class MemoryOutput : public Imf::OStream {
 public:
  explicit MemoryOutput(std::vector<std::byte>& bytes) : OStream("memory"), bytes_(bytes) {}

  void write(const char from[], int count) override {
    const std::size_t end = position_ + static_cast<std::size_t>(count);
    if (end > bytes_.size()) bytes_.resize(end);
    std::memcpy(bytes_.data() + position_, from, static_cast<std::size_t>(count));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

 private:
  std::vector<std::byte>& bytes_;
  std::size_t position_ = 0;
};

Imf::Compression compressionOf(Compression compression) {
  switch (compression) {
    case Compression::None:
      return Imf::NO_COMPRESSION;
    case Compression::Zip:
      return Imf::ZIP_COMPRESSION;
    case Compression::Piz:
      break;
  }
  return Imf::PIZ_COMPRESSION;
}

Imf::Header headerOf(const Image& image, const ExrOptions& options) {
  Imf::Header header(image.width, image.height);
  header.compression() = compressionOf(options.compression);
  Imf::addCapDate(header, kDate);
  Imf::addChromaticities(header, kRec709);
  for (const auto& [name, value] : options.text) header.insert(name, Imf::StringAttribute(value));
  for (const auto& [name, value] : options.numbers) header.insert(name, Imf::FloatAttribute(value));
  for (const auto& [name, value] : options.matrices) {
    Imath::M44f matrix;
    std::copy_n(value.begin(), 16, matrix.getValue());
    header.insert(name, Imf::M44fAttribute(matrix));
  }
  return header;
}

class MemoryInput : public Imf::IStream {
 public:
  explicit MemoryInput(std::span<const std::byte> bytes) : IStream("memory"), bytes_(bytes) {}

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

}  // namespace

std::vector<std::byte> writeExr(const Image& image, const ExrOptions& options) {
  prepareOpenExr();
  Imf::Header header = headerOf(image, options);
  Imf::FrameBuffer source;
  const std::size_t count = image.channels.size();
  std::vector<std::uint16_t> halves;  // of all beauty channels, interleaved as in the image
  if (options.halfBeauty) {
    halves.resize(image.data.size());
    for (std::size_t c = 0; c < count; ++c) {
      if (!isBeauty(image.channels[c])) continue;
      for (std::size_t i = c; i < halves.size(); i += count)
        halves[i] = imath_float_to_half(image.data[i]);
    }
  }
  const Imath::Box2i window = header.dataWindow();
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < count; ++c) {
    const std::string name = nameInFile(image.channels[c]);
    const bool half = options.halfBeauty && isBeauty(image.channels[c]);
    const std::size_t size = half ? sizeof(std::uint16_t) : sizeof(float);
    const void* values = half ? static_cast<const void*>(halves.data() + c) : image.data.data() + c;
    header.channels().insert(name, Imf::Channel(half ? Imf::HALF : Imf::FLOAT));
    source.insert(name,
                  Imf::Slice::Make(half ? Imf::HALF : Imf::FLOAT, values, window, count * size, 0));
    channels.push_back({name, static_cast<const std::byte*>(values), count * size, size});
  }
  std::vector<std::byte> bytes;
  {
    MemoryOutput stream(bytes);
    Imf::OutputFile file(stream, header);  // writes the header and an empty table of offsets
    if (options.compression != Compression::Zip) {
      file.setFrameBuffer(source);
      file.writePixels(image.height);
    }
  }
  if (options.compression == Compression::Zip)
    appendZipBlocks(bytes, image.width, image.height, std::move(channels), options.zipLevel);
  return bytes;
}

Image readExr(std::span<const std::byte> bytes, std::size_t maxValues) {
  prepareOpenExr();
  if (!attributesFit(bytes))
    throw std::runtime_error("the file is truncated, or its header is damaged");
  MemoryInput stream(bytes);
  Imf::InputFile file(stream);
  const Imf::Header& header = file.header();
  if (header.hasType() && !Imf::isImage(header.type()))
    throw std::runtime_error("deep images are not supported");

  // Check everything that decides a size before anything is allocated
  const Imath::Box2i window = header.dataWindow();
  const auto width = std::int64_t{window.max.x} - window.min.x + 1;
  const auto height = std::int64_t{window.max.y} - window.min.y + 1;
  std::vector<std::string> channels;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
    if (c.channel().xSampling != 1 || c.channel().ySampling != 1)
      throw std::runtime_error(std::string("channel ") + c.name() +
                               " is subsampled, which is not supported");
    channels.emplace_back(c.name());
  }
  if (channels.empty()) throw std::runtime_error("the file has no channels");
  if (width > static_cast<std::int64_t>(maxValues / channels.size()) / height)
    throw std::runtime_error(std::to_string(width) + " x " + std::to_string(height) +
                             " pixels of " + std::to_string(channels.size()) +
                             " channels, more than the " + std::to_string(maxValues) +
                             " values allowed");
  std::sort(channels.begin(), channels.end(), [](const std::string& a, const std::string& b) {
    return channelRank(a) < channelRank(b);
  });

  Image image;
  image.width = static_cast<int>(width);
  image.height = static_cast<int>(height);
  for (const std::string& name : channels) image.channels.push_back(nameFromFile(name));
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
  return image;
}

}  // namespace catoptric::image
