// 8-bit images by libpng and libjpeg-turbo. Both libraries report errors by longjmp, so every
// function that calls setjmp here keeps its state in a plain struct outside and has no locals with
// destructors.
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <new>
#include <string_view>

#include <jpeglib.h>
#include <png.h>

#include <jerror.h>  // after jpeglib.h, whose settings choose its codes

#include "core/error.h"
#include "core/log.h"
#include "image/image.h"

namespace catoptric::image {
namespace {

constexpr std::size_t kMessageSize = 256;
constexpr const char* kNoMemory = "not enough memory";
/// Scans of a progressive JPEG: real encoders make about 10; a bomb repeats them by the thousand.
constexpr int kMaxJpegScans = 200;
/// What one ancillary PNG chunk may take when unpacked (text, profiles): nothing of it is used.
constexpr png_alloc_size_t kMaxPngChunkBytes = 8u << 20;

void copyMessage(char (&to)[kMessageSize], const char* text) {
  std::snprintf(to, kMessageSize, "%s", text);
}

bool tooLarge(std::uint64_t width, std::uint64_t height, std::size_t maxPixels,
              char (&message)[kMessageSize]) {
  if (width > 0 && height <= maxPixels / width) return false;
  std::snprintf(message, kMessageSize, "%llu x %llu pixels, more than the %zu allowed",
                static_cast<unsigned long long>(width), static_cast<unsigned long long>(height),
                maxPixels);
  return true;
}

/// What one decoding shares with the callbacks of its library.
struct Decoding {
  const unsigned char* data = nullptr;
  std::size_t size = 0;
  std::size_t position = 0;
  std::size_t maxPixels = 0;
  Image8* image = nullptr;
  char message[kMessageSize] = {};
  char warning[kMessageSize] = {};
};

/// Sizes the output; false when memory is short. The only allocation of ours between setjmp and
/// longjmp; it lives in the caller's image.
bool allocate(Decoding& d, std::uint64_t width, std::uint64_t height) {
  try {
    d.image->rgba.resize(static_cast<std::size_t>(width * height * 4));
  } catch (const std::exception&) {
    copyMessage(d.message, kNoMemory);
    return false;
  }
  d.image->width = static_cast<int>(width);
  d.image->height = static_cast<int>(height);
  return true;
}

// ---- PNG ----

[[noreturn]] void onPngError(png_structp png, png_const_charp text) {
  copyMessage(static_cast<Decoding*>(png_get_error_ptr(png))->message, text);
  png_longjmp(png, 1);
}

void onPngWarning(png_structp png, png_const_charp text) {
  copyMessage(static_cast<Decoding*>(png_get_error_ptr(png))->warning, text);
}

void readPngBytes(png_structp png, png_bytep to, std::size_t count) {
  auto& d = *static_cast<Decoding*>(png_get_io_ptr(png));
  if (count > d.size - d.position) png_error(png, "the file is truncated");
  std::memcpy(to, d.data + d.position, count);
  d.position += count;
}

/// The part that may be left by longjmp.
bool readPng(Decoding& d, png_structp png, png_infop info) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_user_limits(png, 0x7FFFFFFF, 0x7FFFFFFF);  // we check the product ourselves
  png_set_chunk_malloc_max(png, kMaxPngChunkBytes);
  png_set_chunk_cache_max(png, 64);
  // Neither profiles nor their faults matter: textures are sRGB or data, as glTF says
  png_set_option(png, PNG_SKIP_sRGB_CHECK_PROFILE, PNG_OPTION_ON);
  png_set_read_fn(png, &d, readPngBytes);
  png_read_info(png, info);

  const png_uint_32 width = png_get_image_width(png, info);
  const png_uint_32 height = png_get_image_height(png, info);
  if (tooLarge(width, height, d.maxPixels, d.message)) return false;

  // Bring every kind to 8-bit RGBA
  const int type = png_get_color_type(png, info);
  const bool hasTransparency = png_get_valid(png, info, PNG_INFO_tRNS) != 0;
  png_set_scale_16(png);
  png_set_expand(png);  // palette, 1-2-4 bits, tRNS
  if (type == PNG_COLOR_TYPE_GRAY || type == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(png);
  if ((type & PNG_COLOR_MASK_ALPHA) == 0 && !hasTransparency)
    png_set_add_alpha(png, 0xFF, PNG_FILLER_AFTER);
  const int passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  const std::size_t rowBytes = std::size_t{width} * 4;
  if (png_get_rowbytes(png, info) != rowBytes) {
    copyMessage(d.message, "a pixel layout that libpng cannot convert to 8-bit RGBA");
    return false;
  }
  if (!allocate(d, width, height)) return false;

  for (int pass = 0; pass < passes; ++pass)
    for (png_uint_32 y = 0; y < height; ++y)
      png_read_row(png, d.image->rgba.data() + y * rowBytes, nullptr);
  png_read_end(png, nullptr);
  return true;
}

bool decodePng(Decoding& d) {
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &d, onPngError, onPngWarning);
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  bool done = false;
  if (info != nullptr)
    done = readPng(d, png, info);
  else
    copyMessage(d.message, kNoMemory);
  png_destroy_read_struct(&png, &info, nullptr);
  return done;
}

// ---- JPEG ----

struct JpegErrors {
  jpeg_error_mgr base;  // first: libjpeg hands back a pointer to it
  Decoding* decoding = nullptr;
  std::jmp_buf back;
};

[[noreturn]] void onJpegError(j_common_ptr c) {
  auto* errors = reinterpret_cast<JpegErrors*>(c->err);
  char text[JMSG_LENGTH_MAX];
  c->err->format_message(c, text);
  copyMessage(errors->decoding->message, text);
  std::longjmp(errors->back, 1);
}

/// libjpeg goes on after damage and fills in grey; we refuse what has lost pixels and only keep a
/// note of the rest (stray bytes between markers).
void onJpegMessage(j_common_ptr c, int level) {
  if (level >= 0) return;
  switch (c->err->msg_code) {
    case JWRN_JPEG_EOF:
    case JWRN_HIT_MARKER:
    case JWRN_HUFF_BAD_CODE:
    case JWRN_MUST_RESYNC:
    case JWRN_BOGUS_PROGRESSION:
    case JWRN_ARITH_BAD_CODE:
      onJpegError(c);
    default:
      break;
  }
  char text[JMSG_LENGTH_MAX];
  c->err->format_message(c, text);
  copyMessage(reinterpret_cast<JpegErrors*>(c->err)->decoding->warning, text);
}

void onJpegProgress(j_common_ptr c) {
  if (!c->is_decompressor) return;
  if (reinterpret_cast<j_decompress_ptr>(c)->input_scan_number <= kMaxJpegScans) return;
  auto* errors = reinterpret_cast<JpegErrors*>(c->err);
  copyMessage(errors->decoding->message, "more than 200 scans");
  std::longjmp(errors->back, 1);
}

/// CMYK without a profile to RGB. Adobe stores the four inks inverted.
void rgbaFromCmyk(std::uint8_t* row, std::size_t width, bool inverted) {
  for (std::size_t x = 0; x < width; ++x) {
    std::uint8_t* p = row + 4 * x;
    const unsigned flip = inverted ? 0u : 255u;
    const unsigned k = p[3] ^ flip;
    for (int c = 0; c < 3; ++c) p[c] = static_cast<std::uint8_t>(((p[c] ^ flip) * k + 127u) / 255u);
    p[3] = 255;
  }
}

bool readJpeg(Decoding& d, jpeg_decompress_struct& jpeg, JpegErrors& errors,
              jpeg_progress_mgr& progress) {
  if (setjmp(errors.back) != 0) return false;
  jpeg_create_decompress(&jpeg);
  jpeg.progress = &progress;
  jpeg_mem_src(&jpeg, d.data, d.size);
  jpeg_read_header(&jpeg, TRUE);
  if (tooLarge(jpeg.image_width, jpeg.image_height, d.maxPixels, d.message)) return false;

  const bool inks = jpeg.jpeg_color_space == JCS_CMYK || jpeg.jpeg_color_space == JCS_YCCK;
  jpeg.out_color_space = inks ? JCS_CMYK : JCS_EXT_RGBA;
  jpeg.dct_method = JDCT_ISLOW;
  jpeg_start_decompress(&jpeg);
  if (!allocate(d, jpeg.output_width, jpeg.output_height)) return false;
  const std::size_t rowBytes = std::size_t{jpeg.output_width} * 4;
  while (jpeg.output_scanline < jpeg.output_height) {
    JSAMPROW row = d.image->rgba.data() + jpeg.output_scanline * rowBytes;
    jpeg_read_scanlines(&jpeg, &row, 1);
    if (inks) rgbaFromCmyk(row, jpeg.output_width, jpeg.saw_Adobe_marker != 0);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

bool decodeJpeg(Decoding& d) {
  jpeg_decompress_struct jpeg{};
  JpegErrors errors{};
  jpeg_progress_mgr progress{};
  jpeg.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = onJpegError;
  errors.base.emit_message = onJpegMessage;
  errors.decoding = &d;
  progress.progress_monitor = onJpegProgress;
  const bool done = readJpeg(d, jpeg, errors, progress);
  jpeg_destroy_decompress(&jpeg);
  return done;
}

}  // namespace

Image8 decodeImage8(std::span<const std::byte> bytes, const std::string& name,
                    std::size_t maxPixels) {
  Image8 image;
  Decoding d;
  d.data = reinterpret_cast<const unsigned char*>(bytes.data());
  d.size = bytes.size();
  d.maxPixels = maxPixels;
  d.image = &image;

  // Recognise the format by its first bytes, whatever the name says
  const char* format = nullptr;
  bool done = false;
  if (d.size >= 8 && png_sig_cmp(d.data, 0, 8) == 0) {
    format = "PNG";
    done = decodePng(d);
  } else if (d.size >= 3 && d.data[0] == 0xFF && d.data[1] == 0xD8 && d.data[2] == 0xFF) {
    format = "JPEG";
    done = decodeJpeg(d);
  } else {
    throw SceneError(name + ": neither PNG nor JPEG (" + std::to_string(d.size) +
                     " bytes; textures must be one of the two)");
  }
  if (!done && d.message == std::string_view(kNoMemory)) throw std::bad_alloc();
  if (!done) throw SceneError(name + ": bad " + format + " image: " + d.message);
  if (d.warning[0] != '\0')
    log::debug(name + ": " + format + " image decoded with a warning: " + d.warning);
  return image;
}

}  // namespace catoptric::image
